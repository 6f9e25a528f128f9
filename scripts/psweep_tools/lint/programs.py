# SPDX-License-Identifier: Apache-2.0
"""The C++, the scripts, and what other programs of this repository check."""
from __future__ import annotations

import re
import shutil
import subprocess
import sys

from .. import setup
from . import arrows
from .tree import Skip, Tree

TOP_LEVEL = re.compile(r"rtl|tb|sw|constraints|scripts|docs|CMakeLists\.txt|CMakePresets\.json|Makefile|"
                       r"README\.md|LICENSE|\..*")
FOLDERS = (".", "rtl", "tb", "sw", "constraints", "scripts", "docs")
MOST_LINES = 40  # of a shell script, which only calls


def _run(tree: Tree, *command: str, always: bool = False) -> list[str]:
    """Output of a command that fails (or always)."""
    done = subprocess.run(command, cwd=tree.root, capture_output=True, text=True, check=False)
    lines = (done.stdout + done.stderr).splitlines()
    if done.returncode:
        return lines or [f"{command[0]} ended with {done.returncode}"]
    return [line for line in lines if line.startswith("note: ")] if always else []


def check_layout(tree: Tree) -> list[str]:
    """What lies at the top level; a README in each folder."""
    extra = sorted({name.split("/")[0] for name in tree.files if not TOP_LEVEL.fullmatch(name.split("/")[0])})
    return [f"at the top level, beyond the agreed layout: {name}" for name in extra] + \
        [f"{folder}/README.md is missing" for folder in FOLDERS if not tree.exists(f"{folder}/README.md")]


def check_pages(tree: Tree) -> list[str]:
    """Tables of the page about the design space are those of its CSV files (scripts/dse/pages.py)."""
    return _run(tree, sys.executable, "-B", "scripts/dse/pages.py", "--check")


def check_evidence(tree: Tree) -> list[str]:
    """Blocks of README and pages are what docs/evidence/*.json makes of them, figures beyond them name their commit;
    what is stale is named, which is no failure (scripts/evidence.py)."""
    return _run(tree, sys.executable, "-B", "scripts/evidence.py", "lint", always=True)


def check_configurations(tree: Tree) -> list[str]:
    """rtl/configs against the schemas, the schemas against VHDL, C++ and pages (configurations.py)."""
    return _run(tree, sys.executable, "-B", "scripts/configurations.py", "check")


def check_arrows(tree: Tree) -> list[str]:
    """Folders of sw/ and tb/ use only those above them, CMake links what they include (scripts/tools.py arrows)."""
    return arrows.self_test() or arrows.Tree(tree.root).check()


def cpp_files(tree: Tree) -> list[str]:
    return tree.select(r"\.(cpp|hpp|inc)$")


def need_clang_format() -> None:
    """Versions differ in the spaces around '::*' and behind 'operator delete', which no option settles; so one
    decides."""
    if shutil.which("clang-format") is None:
        raise Skip("clang-format is not installed")
    version = subprocess.run(["clang-format", "--version"], capture_output=True, text=True, check=True).stdout.strip()
    if "version 14." not in version:
        raise Skip(f"clang-format 14 (Debian 12) decides, this is {version}")


def check_format(tree: Tree) -> list[str]:
    """clang-format 14 leaves the C++ as it is."""
    need_clang_format()
    done = subprocess.run(["clang-format", "--dry-run", "--Werror", *cpp_files(tree)], cwd=tree.root,
                          capture_output=True, text=True, check=False)
    names = sorted(set(re.findall(r"^(\S+?):\d+:\d+: error:", done.stderr, re.M)))
    found = [f"{name}: not laid out by .clang-format; 'make format' does it" for name in names]
    return found or (done.stderr.splitlines() if done.returncode else [])


def shell_scripts(tree: Tree) -> list[str]:
    return [name for name in tree.files if re.match(r"#!.*\b(ba)?sh\n", tree.read(name)[:80])]


def style_of_shell(name: str, text: str) -> list[str]:
    """A script is short and only calls; what it would compute, Python does."""
    found = []
    if text.count("\n") > MOST_LINES:
        found.append(f"{name}: {text.count(chr(10))} lines; a shell script has at most {MOST_LINES} and only calls")
    for number, line in enumerate(text.splitlines(), 1):
        if match := re.search(r"(?:^|[\s|(;@])(awk|perl)\s", line.split(" #")[0] if not line.startswith("#") else ""):
            found.append(f"{name}:{number}: {match[1]}: Python does it")
    return found


def check_shell(tree: Tree) -> list[str]:
    """shellcheck on the scripts, which have at most 40 lines; neither Perl nor awk anywhere."""
    scripts = shell_scripts(tree)
    problems = [line for name in [*scripts, "Makefile"] for line in style_of_shell(name, tree.read(name))
                if name != "Makefile" or "only calls" not in line]
    problems += [f"{name}: Perl or awk" for name in tree.files
                 if name.endswith((".pl", ".pm", ".awk")) or re.match(r"#!.*\b(perl|awk)\b", tree.read(name)[:80])]
    if problems:
        return problems
    if shutil.which("shellcheck") is None:
        raise Skip("shellcheck is not installed")
    return _run(tree, "shellcheck", "--severity=warning", *scripts)


def _python_tool(name: str) -> str:
    """Debian 12 has no ruff and an old mypy: from the environment of group python, or the search path."""
    ours = setup.venv_place("python") / "bin" / name
    found = str(ours) if ours.exists() else shutil.which(name)
    if found is None:
        raise Skip(f"{name} is not installed: scripts/setup.sh python")
    return found


def check_python(tree: Tree) -> list[str]:
    """ruff on the Python (.ruff.toml)."""
    return _run(tree, _python_tool("ruff"), "check", "--quiet", "--no-cache", "--output-format=concise",
                *tree.select(r"\.py$"))


def check_length(tree: Tree) -> list[str]:
    """lizard: no function of C++ or Python of more than 100 lines."""
    sources = tree.select(r"^(sw|tb|scripts)/.*\.(cpp|hpp|py)$")
    return _run(tree, _python_tool("lizard"), "--length", "100", "--CCN", "1000", "--warnings_only", *sources)


def check_types(tree: Tree) -> list[str]:
    """mypy --strict on the package of the tools (.mypy.ini)."""
    return _run(tree, _python_tool("mypy"), "--no-error-summary", "--cache-dir=/dev/null")
