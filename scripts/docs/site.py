#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The pages as a site: build/docs/index.html (make docs).

  scripts/docs/site.py            builds it; a link that leads nowhere, or a page outside of the navigation, is an error
  scripts/docs/site.py --serve    shows it at http://localhost:8000 instead

The pages of the repository are copied to build/docs-src, with the files that they link, and with the complete tables
of the evidence, which the pages show as summaries only. The navigation is what docs/README.md lists. Needs MkDocs in
build/docs-venv (scripts/setup.sh docs), no network.
"""
import argparse
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
STAGE = ROOT / "build" / "docs-src"
SITE = ROOT / "build" / "docs"
MKDOCS = pathlib.Path(os.environ.get("DOCS_VENV", ROOT / "build" / "docs-venv")) / "bin" / "mkdocs"
LINK = re.compile(r"\]\(([^)\s#]+)[^)]*\)|\bsrc=\"([^\"]+)\"")
# Of the folders, beside the pages.
OTHERS = ("rtl/README.md", "sw/README.md", "tb/README.md", "scripts/README.md", "constraints/README.md",
          "constraints/crossings.md")
COMPLETE = {"Complete tables": ("scripts/evidence.py", "full", "docs/evidence/full.md"),
            "Complete tables of cost": ("scripts/cost/report.py", "--full", "docs/evidence/full_cost.md")}


def without_code(text: str) -> str:
    return re.sub(r"(?ms)^```.*?^```|`[^`\n]*`", "", text)


def staged(text: str) -> str:
    """Python-Markdown wants a blank line in front of a list, GitHub's Markdown does not."""
    out: list[str] = []
    code = False
    for line in text.splitlines():
        code ^= line.startswith("```")
        item = re.match(r"(- |\d+\. )", line)
        if item and not code and out and out[-1].strip() and not re.match(r"(- |\d+\. | |#)", out[-1]):
            out.append("")
        out.append(line)
    return "\n".join(out) + "\n"


def copy_page(page: pathlib.Path) -> None:
    text = page.read_text()
    target = STAGE / page.relative_to(ROOT)
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(staged(text))
    for match in LINK.finditer(without_code(text)):
        name = match[1] or match[2]
        linked = (page.parent / name).resolve()
        if not re.match(r"\w+:", name) and linked.is_file() and linked.suffix != ".md":
            other = STAGE / linked.relative_to(ROOT)
            other.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(linked, other)


def navigation() -> list[dict[str, object]]:
    """The sections of docs/README.md and their pages, each where it is listed first."""
    seen: set[str] = set()
    parts: list[dict[str, object]] = [{"Start": ["README.md"]}]
    for section in re.split(r"(?m)^## ", (ROOT / "docs" / "README.md").read_text())[1:]:
        title, _, text = section.partition("\n")
        entries: list[object] = []
        for row in re.findall(r"(?m)^\| ([^|]+) \| (.*\]\(.*) \|$", text):
            pages = [name for name in re.findall(r"\]\(([\w/]+\.md)\)", row[1]) if name not in seen]
            seen.update(pages)
            if pages:
                entries.append({row[0][0].upper() + row[0][1:]: [f"docs/{name}" for name in pages]})
        parts.append({title: entries})
    last = list(parts[-1].values())[0]
    assert isinstance(last, list)
    last.append({"Complete tables": [{title: page} for title, (_, _, page) in COMPLETE.items()]})
    parts.append({"Folders": ["docs/README.md", *OTHERS]})
    return parts


def stage() -> pathlib.Path:
    shutil.rmtree(STAGE, ignore_errors=True)
    for page in (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md")), *(ROOT / name for name in OTHERS)):
        copy_page(page)
    for script, option, page in COMPLETE.values():
        subprocess.run([sys.executable, "-B", script, option, str(STAGE / page)], cwd=ROOT, check=True)
    config = STAGE.with_suffix(".yml")
    # JSON is YAML, too.
    config.write_text(json.dumps({"INHERIT": str(ROOT / "docs" / "mkdocs.yml"), "docs_dir": str(STAGE),
                                  "site_dir": str(SITE), "nav": navigation()}, indent=1))
    return config


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--serve", action="store_true")
    options = parser.parse_args()
    if not MKDOCS.exists():
        print(f"docs: no {MKDOCS}: scripts/setup.sh docs", file=sys.stderr)
        return 1
    config = stage()
    if options.serve:
        return subprocess.run([str(MKDOCS), "serve", "-f", str(config)], check=False).returncode
    # Not --quiet: what is not told is not counted by --strict either.
    done = subprocess.run([str(MKDOCS), "build", "--strict", "-f", str(config)], check=False, text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    if done.returncode:
        print(done.stdout, file=sys.stderr)
    else:
        print(f"docs: {SITE.relative_to(ROOT)}/index.html")
    return done.returncode


if __name__ == "__main__":
    sys.exit(main())
