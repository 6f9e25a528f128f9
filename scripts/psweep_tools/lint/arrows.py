# SPDX-License-Identifier: Apache-2.0
"""Which folder uses which: the arrows between the folders of sw/ and tb/, in the C++ and in CMake.

  scripts/tools.py arrows [--root DIR]    check the tree
  scripts/tools.py arrows --graph         print every arrow and the number of includes behind it
  scripts/tools.py arrows --self-test     plant wrong arrows in a small tree; each has to be found

Folders are listed from the lowest to the highest in the tables of sw/README.md and tb/README.md.
  - sw/ includes nothing of tb/; a folder includes only itself and folders above it in its table, tb/ all of sw/.
  - Every quoted include leads to a file of the tree, except for generated ones (GENERATED).
  - Libraries, one a folder, link what they include: PUBLIC what their headers do, PRIVATE what only sources do.
    Programs and tests link in LIBS what their sources include. Nothing else of psweep:: is linked.
  - Every source belongs to one target of psweep_library(), psweep_program() or psweep_test(); further ones of a
    library may stand in target_sources()."""
import argparse
import pathlib
import re
import tempfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field

ROOT = pathlib.Path(__file__).resolve().parents[3]
TREES = ("sw", "tb")
SOURCE = re.compile(r"\.(cpp|hpp|inc|cpp\.in)$")
HEADER = re.compile(r"\.(hpp|inc)$")
INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]+"([^"]+)"', re.M)
# Verilated classes, tables that are written while building, names that CMake fills in.
GENERATED = re.compile(r"V\w*@?\w*@?\w*\.h|@\w+@|\w+_pins\.hpp|(flips|\w*_upset)(_\w+)?\.inc|\w+_upset\.inc")
ROW = re.compile(r"^\| `([a-z_]+)/`", re.M)
CALL = re.compile(
    r"\b(psweep_library|psweep_program|psweep_test|target_sources|add_library)\(([^()]*(?:\([^()]*\)[^()]*)*)\)")
KEYWORDS = {"SOURCES", "PUBLIC", "PRIVATE", "LIBS", "LABELS", "DEFINITIONS", "AT_TOP", "ON_REQUEST"}
OURS = ("psweep_library", "psweep_program", "psweep_test")


@dataclass(frozen=True)
class Include:
    file: str
    line: int
    text: str
    target: str  # file of the tree; '' if it is generated


@dataclass
class Target:
    kind: str
    name: str
    place: str
    folder: str
    words: dict[str, list[str]] = field(default_factory=dict)

    def linked(self, keyword: str) -> set[str]:
        return {word for word in self.words.get(keyword, []) if word.startswith("psweep::")}


def folder_of(name: str) -> str:
    """'sw/net' of 'sw/net/client.cpp'; '' of a file that lies in no folder."""
    parts = name.split("/")
    return "/".join(parts[:2]) if len(parts) > 2 else ""


def library_of(folder: str) -> str:
    """psweep::net of sw/net, psweep::tb_engine of tb/engine."""
    tree, name = folder.split("/")
    return f"psweep::{name}" if tree == "sw" else f"psweep::tb_{name}"


class Tree:
    def __init__(self, root: pathlib.Path) -> None:
        self.root = root
        self.problems: list[str] = []
        names = (p for tree in TREES for p in sorted((root / tree).rglob("*")) if p.is_file())
        self.files = {str(p.relative_to(root)): p for p in names}
        self.order: dict[str, int] = {}
        for tree in TREES:
            for folder in ROW.findall((root / tree / "README.md").read_text(encoding="utf-8")):
                self.order[f"{tree}/{folder}"] = len(self.order)
        self.includes = [i for name in self.files if SOURCE.search(name) for i in self._includes_of(name)]
        self.targets = list(self._targets())

    def complain(self, text: str) -> None:
        self.problems.append(text)

    def _includes_of(self, name: str) -> Iterator[Include]:
        text = self.files[name].read_text(encoding="utf-8")
        for match in INCLUDE.finditer(text):
            line, path = text.count("\n", 0, match.start()) + 1, match[1]
            places = (f"{name.rsplit('/', 1)[0]}/{path}", *(f"{tree}/{path}" for tree in TREES))
            found = [place for place in places if place in self.files]
            if not found and not GENERATED.fullmatch(path):
                self.complain(f'{name}:{line}: "{path}" is no file of the tree')
            yield Include(name, line, path, found[0] if found else "")

    def _targets(self) -> Iterator[Target]:
        for name, path in self.files.items():
            if path.name != "CMakeLists.txt":
                continue
            text = re.sub(r"#[^\n]*", "", path.read_text(encoding="utf-8"))
            for match in CALL.finditer(text):
                first, *rest = match[2].split()
                place = f"{name}:{text.count(chr(10), 0, match.start()) + 1}"
                target = Target(match[1], first, place, folder_of(name))
                keyword = ""
                for word in rest:
                    if word in KEYWORDS:
                        keyword = word
                    else:
                        target.words.setdefault(keyword, []).append(word.strip('"'))
                yield target

    def check_arrows(self) -> None:
        for i in self.includes:
            here, there = folder_of(i.file), folder_of(i.target)
            if not i.target or here == there:
                continue
            for folder in (here, there):
                if folder not in self.order:
                    self.complain(f"{i.file}:{i.line}: folder {folder or '?'} is not in the README of its tree")
                    break
            else:
                if here.startswith("sw/") and there.startswith("tb/"):
                    self.complain(f'{i.file}:{i.line}: "{i.text}": the product must not use tests')
                elif self.order[there] > self.order[here]:
                    self.complain(f'{i.file}:{i.line}: "{i.text}": {there} does not stand above {here} in the README')

    def _with_own_headers(self, files: list[str]) -> list[str]:
        """These files and what they include of their own folder, however indirectly."""
        all_files, todo = set(files), list(files)
        while todo:
            name = todo.pop()
            new = {i.target for i in self.includes if i.file == name and folder_of(i.target) == folder_of(name)}
            todo += new - all_files
            all_files |= new
        return sorted(all_files)

    def _used(self, files: list[str], own: str) -> set[str]:
        """Libraries of the folders, but for `own`, that these files include."""
        folders = {folder_of(i.target) for i in self.includes if i.file in files and i.target}
        return {library_of(f) for f in folders if f and f != own}

    def _sources(self, target: Target) -> list[str]:
        words = target.words.get("SOURCES", []) if target.kind in OURS else sum(target.words.values(), [])
        folder = target.place.rsplit("/", 1)[0]
        return [f"{folder}/{word}" for word in words if word.endswith(".cpp") and "$" not in word]

    def check_targets(self) -> None:
        owner: dict[str, str] = {}
        libraries = {t.folder: t for t in self.targets if t.kind == "psweep_library"}
        for target in self.targets:
            for source in self._sources(target):
                if source not in self.files:
                    self.complain(f"{target.place}: {source} does not exist")
                if source in owner:
                    self.complain(f"{target.place}: {source} belongs to {owner[source]} already")
                owner[source] = target.name.removeprefix("psweep_")
        for target in self.targets:
            if target.kind not in OURS:
                continue
            if target.kind == "psweep_library":
                self._check_library(target, owner)
            else:
                # Headers of a folder without a library belong to the programs that include them.
                own = target.folder if target.folder not in libraries else ""
                sources = self._with_own_headers(self._sources(target)) if own else self._sources(target)
                self._compare(target, "LIBS", self._used(sources, own))
        for name in self.files:
            if name.endswith(".cpp") and name not in owner:
                self.complain(f"{name}: belongs to no psweep_library(), psweep_program() or psweep_test()")

    def _check_library(self, target: Target, owner: dict[str, str]) -> None:
        if library_of(target.folder) != f"psweep::{target.name}":
            self.complain(f"{target.place}: the library of {target.folder} has to be {library_of(target.folder)[8:]}")
        mine = [f for f in self.files if folder_of(f) == target.folder and owner.get(f, target.name) == target.name]
        public = self._used([f for f in mine if HEADER.search(f)], target.folder)
        private = self._used([f for f in mine if SOURCE.search(f) and not HEADER.search(f)], target.folder) - public
        self._compare(target, "PUBLIC", public)
        self._compare(target, "PRIVATE", private)

    def _compare(self, target: Target, keyword: str, used: set[str]) -> None:
        linked = target.linked(keyword)
        for library in sorted(used - linked):
            self.complain(f"{target.place}: {target.name} includes {library}, but does not link it as {keyword}")
        for library in sorted(linked - used):
            self.complain(f"{target.place}: {target.name} links {library} as {keyword}, but does not include it so")

    def check(self) -> list[str]:
        self.check_arrows()
        self.check_targets()
        if not (self.order and self.targets and any(i.target for i in self.includes)):
            self.complain("arrows: nothing was checked")
        return self.problems

    def graph(self) -> list[str]:
        arrows = Counter((folder_of(i.file), folder_of(i.target)) for i in self.includes if i.target)
        return [f"{a} -> {b}: {n}" for (a, b), n in sorted(arrows.items()) if a != b]


GOOD = {
    "sw/README.md": "| `core/` | a |\n| `net/` | b |\n| `app/` | c |\n",
    "tb/README.md": "| `support/` | a |\n| `model/` | b |\n",
    "sw/core/CMakeLists.txt": "psweep_library(core)\n",
    "sw/core/image.hpp": "",
    "sw/net/CMakeLists.txt": "psweep_library(net SOURCES client.cpp\n  PRIVATE psweep::core)  # as it is\n",
    "sw/net/client.hpp": "",
    "sw/net/client.cpp": '#include "net/client.hpp"\n#include "core/image.hpp"\n',
    "sw/app/CMakeLists.txt": "psweep_program(psweep SOURCES main.cpp LIBS psweep::net Threads::Threads)\n",
    "sw/app/main.cpp": '#include "net/client.hpp"\n',
    "tb/support/CMakeLists.txt": "psweep_library(tb_support PUBLIC psweep::core)\n",
    "tb/support/sim.hpp": '#include "core/image.hpp"\n',
    "tb/model/CMakeLists.txt": "psweep_test(test_net SOURCES test_net.cpp LIBS psweep::net psweep::tb_support)\n",
    "tb/model/test_net.cpp": '#include "Vunit.h"\n#include "net/client.hpp"\n#include "support/sim.hpp"\n',
}
# File, its new text, what has to be said about it (nothing of another file is).
PLANTED = (
    ("sw/core/image.hpp", '#include "net/client.hpp"\n', "does not stand above sw/core"),
    ("sw/net/client.hpp", '#include "support/sim.hpp"\n', "must not use tests"),
    ("tb/support/sim.hpp", '#include "core/image.hpp"\n#include "app/none.hpp"\n', "is no file of the tree"),
    ("sw/net/client.hpp", '#include "core/image.hpp"\n', "does not link it as PUBLIC"),
    ("sw/net/CMakeLists.txt", "psweep_library(net SOURCES client.cpp)\n", "does not link it as PRIVATE"),
    ("sw/app/main.cpp", "", "links psweep::net as LIBS, but does not include it"),
    ("tb/model/test_net.cpp", '#include "net/client.hpp"\n#include "support/sim.hpp"\n#include "core/image.hpp"\n',
     "does not link it as LIBS"),
    ("sw/net/other.cpp", "", "belongs to no psweep_library()"),
    ("sw/extra/x.hpp", '#include "core/image.hpp"\n', "is not in the README"),
    ("sw/net/CMakeLists.txt", "psweep_library(link SOURCES client.cpp PRIVATE psweep::core)\n", "has to be net"),
)


def _problems_of(files: dict[str, str]) -> list[str]:
    with tempfile.TemporaryDirectory() as folder:
        for name, text in files.items():
            path = pathlib.Path(folder) / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
        return Tree(pathlib.Path(folder)).check()


def self_test() -> list[str]:
    """What the self-test has to complain about: nothing, if every planted fault is found and the good tree is good."""
    wrong = [f"the good tree: {problem}" for problem in _problems_of(GOOD)]
    for name, text, message in PLANTED:
        found = _problems_of({**GOOD, name: text})
        if not any(message in problem for problem in found):
            wrong.append(f"planted in {name}, but not found: {message}; said: {found}")
    return wrong


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(prog="scripts/tools.py arrows", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", type=pathlib.Path, default=ROOT)
    parser.add_argument("--graph", action="store_true")
    parser.add_argument("--self-test", action="store_true")
    options = parser.parse_args(arguments)
    if options.self_test:
        problems = self_test()
    elif options.graph:
        print("\n".join(Tree(options.root).graph()))
        return 0
    else:
        problems = Tree(options.root).check()
    for problem in problems:
        print(problem)
    return 1 if problems else 0
