# SPDX-License-Identifier: Apache-2.0
"""Contents of the files that evidence depends on, as hashes; now, or as of a commit. Comments do not count."""
import hashlib
import pathlib
import re
import subprocess
from collections.abc import Callable, Iterable

from .. import vhdl

ROOT = pathlib.Path(__file__).resolve().parents[3]
_CPP = re.compile(r'R"(\w*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])\'|//[^\n]*|/\*.*?\*/', re.S)


def _cpp(match: re.Match[str]) -> str:
    return "" if match[0].startswith(("//", "/*")) else match[0]


def essence(name: str, content: bytes) -> bytes:
    """The text without comments, trailing blanks and blank lines, of VHDL and C++; anything else as it is."""
    if name.endswith(".vhd"):
        return vhdl.essence(content.decode("latin-1")).encode("latin-1")
    if name.endswith((".cpp", ".hpp", ".inc", ".cpp.in")):
        text = _CPP.sub(_cpp, content.decode("latin-1"))
    else:
        return content
    lines = [line.rstrip() for line in text.split("\n")]
    return "\n".join(line for line in lines if line).encode("latin-1")


def known_as(name: str) -> str:
    """A name in a stamp: of VHDL without the folder in rtl/, as a file that is moved is the same."""
    return re.sub(r"^rtl/(?:\w+/)+(\w+\.vhd)$", r"rtl/\1", name)


def digest(name: str, content: bytes) -> str:
    return hashlib.sha256(essence(name, content)).hexdigest()[:12]


def combined(files: dict[str, str]) -> str:
    """One hash of {file: hash}."""
    return hashlib.sha256("\n".join(f"{k} {files[k]}" for k in sorted(files)).encode()).hexdigest()[:16]


def git(*arguments: str, root: pathlib.Path = ROOT) -> bytes | None:
    """What git says; None if there is no git here, or if it says no."""
    try:
        done = subprocess.run(["git", "-c", "safe.directory=*", *arguments], cwd=root, capture_output=True, check=False)
    except OSError:
        return None
    return done.stdout if done.returncode == 0 else None


_PATTERNS: dict[str, re.Pattern[str]] = {}


def matches(pattern: str, name: str) -> bool:
    """'**' stands for any folders, '*' for anything within one."""
    if pattern not in _PATTERNS:
        parts = (".*" if p == "**" else "[^/]*" if p == "*" else re.escape(p) for p in re.split(r"(\*\*|\*)", pattern))
        _PATTERNS[pattern] = re.compile("".join(parts) + r"\Z")
    return bool(_PATTERNS[pattern].match(name))


def entities(files_f: str) -> list[str]:
    """Entities (and packages) of rtl/files.f, in its order."""
    return list(vhdl.listed(files_f))


def expand(globs: Iterable[str], names: Iterable[str], files_f: str) -> list[str]:
    """Files of `names` that the globs name. '@engine': the RTL up to psweep; '@chip': all RTL; '!' in front of a glob
    takes its files out again."""
    files = vhdl.listed(files_f)
    order = list(files)
    rtl = {"@engine": order[:order.index("psweep") + 1] if "psweep" in order else order, "@chip": order}
    all_names = list(names)
    wanted: set[str] = set()
    for glob in globs:
        if glob in rtl:
            wanted |= {f"rtl/{files[entity]}" for entity in rtl[glob]} & set(all_names)
        elif glob.startswith("!"):
            wanted = {name for name in wanted if not matches(glob[1:], name)}
        else:
            wanted |= {name for name in all_names if matches(glob, name)}
    return sorted(wanted)


FOLDERS = ("rtl", "tb", "sw", "scripts", "constraints", "CMakeLists.txt", "CMakePresets.json", "Makefile")


def _listed(root: pathlib.Path) -> list[str]:
    found = git("ls-files", "-co", "--exclude-standard", "--", *FOLDERS, root=root)
    if found is not None:
        return [name for name in found.decode().splitlines() if (root / name).is_file()]
    names = []
    for folder in FOLDERS:
        at = root / folder
        names += [at] if at.is_file() else [p for p in at.rglob("*") if p.is_file() and "__pycache__" not in p.parts]
    return sorted(str(p.relative_to(root)) for p in names)


class Tree:
    """Files now."""

    def __init__(self, root: pathlib.Path = ROOT) -> None:
        self.root = root
        self.names = _listed(root)
        self._hashes: dict[str, str] = {}

    def read(self, name: str) -> bytes:
        return (self.root / name).read_bytes()

    def hashes(self, globs: Iterable[str]) -> dict[str, str]:
        """{file: hash} of what the globs name."""
        files_f = self.read("rtl/files.f").decode() if "rtl/files.f" in self.names else ""
        out = {}
        for name in expand(globs, self.names, files_f):
            if name not in self._hashes:
                self._hashes[name] = digest(name, self.read(name))
            out[known_as(name)] = self._hashes[name]
        return out


class Commit(Tree):
    """Files of a commit."""

    def __init__(self, commit: str, root: pathlib.Path = ROOT) -> None:  # pylint: disable=super-init-not-called
        listed = git("ls-tree", "-r", "--name-only", commit, "--", *FOLDERS, root=root)
        if listed is None:
            raise ValueError(f"git knows no commit {commit}")
        self.root, self.commit, self._hashes = root, commit, {}
        self.names = listed.decode().splitlines()

    def read(self, name: str) -> bytes:
        content = git("show", f"{self.commit}:{name}", root=self.root)
        if content is None:
            raise ValueError(f"git has no {name} of {self.commit}")
        return content


def rtl_closure(top: str, order: list[str], text: Callable[[str], str]) -> list[str]:
    """Entities and packages that `top` is made of, itself included, in the order of rtl/files.f."""
    found, waiting = set(), [top]
    while waiting:
        name = waiting.pop()
        if name in found:
            continue
        found.add(name)
        words = set(re.findall(r"\w+", essence(f"{name}.vhd", text(name).encode("latin-1")).decode("latin-1")))
        waiting += [other for other in order if other in words and other not in found]
    return [name for name in order if name in found]


def include_closure(starts: Iterable[str], exists: Callable[[str], bool], text: Callable[[str], str]) -> list[str]:
    """C++ files and what they include by name in quotes; with a header comes the source of the same name."""
    found: set[str] = set()
    waiting = [name for name in starts if exists(name)]
    while waiting:
        name = waiting.pop()
        if name in found:
            continue
        found.add(name)
        folder = name.rpartition("/")[0]
        for included in re.findall(r'^\s*#\s*include\s+"([^"]+)"', text(name), re.M):
            for at in (f"{folder}/{included}", f"sw/{included}", f"tb/{included}"):
                if exists(at):
                    waiting.append(at)
                    source = re.sub(r"\.hpp$", ".cpp", at)
                    if source != at and exists(source):
                        waiting.append(source)
                    break
    return sorted(found)
