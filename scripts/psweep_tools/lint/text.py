# SPDX-License-Identifier: Apache-2.0
"""Texts line by line, and links between pages."""
from __future__ import annotations

import functools
import posixpath
import re

from .tree import Findings, Tree

# Written in two parts each, or this file would be full of findings.
_WORDS = re.compile(r"\b(" + "|".join(("TO" + "DO", "FIX" + "ME", "X" + "XX", "HA" + "CK")) + r")\b")
_HOMES = re.compile(r"(?:^|[\s\"'=(`])("
                    + "|".join(("/wo" + "rk/", "/ro" + "ot/", "/ho" + "me/", "/Us" + "ers/")) + ")")
_NO_COMMENTS = re.compile(r"\.(md|json|yaml|yml|svg|html|pgm|ppm|csv)$|^LICENSE$")
_RIGID = re.compile(r"^\s*(\||\[[^\]]*\]: )")  # rows of a Markdown table and lone links cannot be wrapped
_TEST_NAME = re.compile(r'TEST_CASE(?:_METHOD)?\("[^"]*[;\[\]][^"]*"')
_LINK = re.compile(r'\]\(([^)\s]+)\)|\bsrc="([^"]+)"')


def check_text(tree: Tree) -> list[str]:
    """ASCII, LF, final newline, tabs, trailing blanks, 120 columns, SPDX, words, paths of one machine."""
    findings = Findings("text", tree.waivers)
    for name in tree.files:
        _check_file(findings, name, tree.read(name))
    return findings.close()


def _check_file(findings: Findings, name: str, text: str) -> None:
    if "\0" in text:  # a picture
        return
    if not text:
        findings.add(name, 1, "empty", "the file is empty")
        return
    if not text.endswith("\n"):
        findings.add(name, 1, "newline", "no newline at the end")
    if text.endswith("\n\n"):
        findings.add(name, 1, "newline", "blank line at the end")
    head = "".join(line + "\n" for line in text.split("\n")[:-1][:3])
    if not _NO_COMMENTS.search(name) and "SPDX-License-Identifier: Apache-2.0" not in head:
        findings.add(name, 1, "spdx", "no SPDX-License-Identifier: Apache-2.0 in the first three lines")
    tab = re.compile(r"[^\t].*\t" if name == "Makefile" else r"\t")
    page, wide = name.endswith(".md"), name.endswith((".svg", ".csv"))
    for number, line in enumerate(text.rstrip("\n").split("\n"), 1):
        if not line.isascii():
            findings.add(name, number, "ascii", "not ASCII", line)
        if "\r" in line:
            findings.add(name, number, "lf", "carriage return", line)
        if tab.search(line):
            findings.add(name, number, "tab", "tab", line)
        if line.endswith((" ", "\t")):
            findings.add(name, number, "blanks", "trailing blanks", line)
        if len(line) > 120 and not wide and not (page and _RIGID.match(line)):
            findings.add(name, number, "columns", f"{len(line)} columns", line)
        if _TEST_NAME.search(line):
            findings.add(name, number, "test_name",
                         "CTest takes a semicolon or bracket in a test's name for a list", line)
        if match := _WORDS.search(line):
            findings.add(name, number, "words", f"promises later work: {match[1]}", line)
        if match := _HOMES.search(line):
            findings.add(name, number, "paths", f"path of one machine: {match[1]}", line)


def check_links(tree: Tree) -> list[str]:
    """Links of the Markdown files lead to files and headings; docs/README.md lists all pages."""
    findings = Findings("links", tree.waivers)

    @functools.lru_cache(maxsize=None)
    def headings(page: str) -> set[str]:
        """As anchors: small letters, blanks to '-', other marks left out."""
        found = re.findall(r"^#+ (.*)$", tree.read(page), re.M)
        return {re.sub(r"[^a-z0-9 _-]", "", name.lower()).replace(" ", "-") for name in found}

    for name in tree.select(r"\.md$"):
        folder, code = posixpath.dirname(name), False
        for number, line in enumerate(tree.read(name).split("\n"), 1):
            code ^= line.startswith("```")
            if code:
                continue
            for match in _LINK.finditer(line):
                target = match[1] or match[2]
                if re.match(r"https?:|mailto:", target):
                    continue
                path, _, anchor = target.partition("#")
                page = posixpath.join(folder, path) if path else name
                if not tree.exists(page):
                    findings.add(name, number, "link", f"{path} does not exist", line)
                elif anchor and page.endswith(".md") and anchor not in headings(posixpath.normpath(page)):
                    findings.add(name, number, "link", f"no heading for #{anchor}", line)
    index = tree.read("docs/README.md")
    for path in sorted((tree.root / "docs").rglob("*.md")):
        page = path.relative_to(tree.root / "docs").as_posix()
        if page != "README.md" and f"]({page})" not in index:
            findings.add("docs/README.md", 1, "index", f"{page} is not listed")
    return findings.close()
