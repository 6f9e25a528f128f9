# SPDX-License-Identifier: Apache-2.0
"""The VHDL: constructs that break on the way to Verilog, attributes for the FPGA tools, files that belong together."""
from __future__ import annotations

import pathlib
import re
import shutil
import subprocess
import tempfile

from ..vhdl import VhdlError, parse
from .tree import Findings, Skip, Tree

_RESERVED = "|".join("""
  always assign automatic casex casez cell config deassign defparam design disable edge endcase endconfig
  endfunction endgenerate endmodule endprimitive endspecify endtable endtask event force forever fork highz0
  highz1 ifnone incdir include initial inout input instance integer_vector join large liblist localparam
  macromodule medium module negedge nmos noshowcancelled notif0 notif1 output parameter pmos posedge
  primitive pull0 pull1 pulldown pullup rcmos reg release repeat rnmos rpmos rtran small specify specparam
  strong0 strong1 supply0 supply1 table task tran tri tri0 tri1 triand trior trireg uwire vectored wand
  weak0 weak1 wire wor logic bit byte int static unique priority final do""".split())
# Of the text in small letters, without strings, comments and what is not synthesised.
_RULES = [(name, re.compile(pattern), why) for name, pattern, why in (
    ("others", r"\bwhen\s+others\s*=>(?!\s*null\b)", "GHDL 2.0 loses it: list every choice, or use if/elsif"),
    ("with_select", r"\bwith\b[^;]*\bselect\b", "GHDL 2.0 loses the default: use when/else"),
    ("abs", r"\babs\b", "comes out as VHDL text: compare and subtract"),
    ("rem", r"\brem\b", "comes out as the unsigned operator"),
    ("shift_right", r"\bshift_right\b", "of signed comes out as a logical shift: slice; waive it for unsigned"),
    ("sra", r"\b(sra|sla)\b", "use slices"),
    ("std_match", r"\bstd_match\b", "crashes the converter"),
    ("vhdl2008", r"\?=|\?/=|\?<|\?>|\bprocess\s*\(\s*all\s*\)|\bcase\?|<<\s*signal", "not VHDL-93"),
    ("initial_value", r"\bsignal\b[^;]*:=", "initial values are not resets: reset the signal"),
    ("not_hardware", r"\bafter\b|\bwait\b|\bshared\s+variable\b", "no hardware"),
    ("port_mode", r":\s*(buffer|inout)\b", "only in and out"),
    ("generic_type", r"\bg_\w+\s*:\s*(string|real|time)\b", "garbles netlist names: integer or boolean"),
    ("library", r"\bstd_logic_(arith|signed|unsigned)\b", "not a standard package: numeric_std"),
    ("image", r"'image\b", "XST's parser may not take it: between translate_off and translate_on"),
    ("unknown", r"'x'", "no vendor has it in a template: between translate_off and translate_on"),
    ("reserved", rf"\b(?:signal|variable|constant|entity|type|subtype|function|procedure|component)\s+({_RESERVED})\b",
     "a Verilog keyword"),
    ("reserved", rf"(?:^|[;(])\s*({_RESERVED})\s*:\s*(?:in|out)\b", "a Verilog keyword as port"),
)]
_CAMEL = re.compile(r"\b([a-z]\w*[a-z][A-Z]\w*|[A-Z][a-z]\w*)\b")


def check_files(tree: Tree) -> list[str]:
    """rtl/files.f lists every VHDL file once."""
    there, listed = set(tree.select(r"^rtl/.*\.vhd$")), {f"rtl/{name}" for name in tree.rtl.files.values()}
    return [f"rtl/files.f does not list {name}" for name in sorted(there - listed)] + \
        [f"rtl/files.f: there is no {name}" for name in sorted(listed - there)]


def check_analyse(tree: Tree) -> list[str]:
    """GHDL takes all files of rtl/files.f as VHDL-93, warnings are errors."""
    if shutil.which("ghdl") is None:
        raise Skip("ghdl is not installed")
    with tempfile.TemporaryDirectory() as work:
        done = subprocess.run(["ghdl", "-a", "--std=93", "--warn-error", f"--workdir={work}",
                               *(f"rtl/{name}" for name in tree.rtl.files.values())],
                              cwd=tree.root, capture_output=True, text=True, check=False)
    return (done.stdout + done.stderr).splitlines() if done.returncode else []


def check_vhdl(tree: Tree) -> list[str]:
    """No construct that the conversion to Verilog breaks, or that is not VHDL-93."""
    findings = Findings("vhdl", tree.waivers)
    for name in tree.select(r"^rtl/.*\.vhd$"):
        check_constructs(findings, name, tree.read(name))
    return findings.close()


def check_constructs(findings: Findings, name: str, text: str) -> None:
    stem = pathlib.PurePosixPath(name).stem
    # Strings and comments go, line numbers stay.
    code = re.sub(r'"[^"\n]*"', '""', text)
    code = re.sub(r"(--\s*synthesis\s+translate_off)(.*?)(--\s*synthesis\s+translate_on)",
                  lambda m: "\n" * m[2].count("\n"), code, flags=re.S)
    code = re.sub(r"--[^\n]*", "", code)
    lines = code.split("\n")
    for number, line in enumerate(lines, 1):
        if match := _CAMEL.search(line):
            findings.add(name, number, "camel_case", f"{match[1]}: is lower-cased in the netlist", line)
    lower = code.lower()
    for rule, pattern, why in _RULES:
        for match in pattern.finditer(lower):
            number = 1 + lower.count("\n", 0, match.start()) + (lower[match.start()] == "\n")
            findings.add(name, number, rule, why, lines[number - 1])
    try:
        design = parse(text)
    except VhdlError as error:
        findings.add(name, 1, "reader", f"scripts/psweep_tools/vhdl does not understand it: {error}")
        return
    if stem in [instance.entity.lower() for instance in design.instances]:
        findings.add(name, 1, "recursion", "instantiates itself, which XST takes of components only")
    entities = [entity.name.lower() for entity in design.entities]
    if entities != ([] if stem.endswith("_pkg") else [stem]):
        findings.add(name, 1, "one_entity", f"entities: {' '.join(entities)}, expected {stem}")


def check_units(tree: Tree) -> list[str]:
    """Every entity has a golden model, a test and a page."""
    findings = Findings("units", tree.waivers)
    for unit in tree.rtl.entities:
        places = {"golden": [f"sw/golden/{unit}.hpp"], "page": [tree.page(unit)],
                  "test": [f"tb/{folder}/test_{unit}.cpp" for folder in ("units", "engine", "chip")]}
        for rule in sorted(places):
            if not any(tree.exists(place) for place in places[rule]):
                findings.add(f"rtl/{tree.rtl.name(unit)}", 1, rule, f"{places[rule][0]} is missing")
    return findings.close()


def check_attributes(tree: Tree) -> list[str]:
    """The table 'Attributes' of the page about the flows lists all attributes for the FPGA tools that are in the VHDL,
    and they are all there, with these values: constants of psweep_pkg, or literals in entities that use no package."""
    page = tree.page("flows")
    table = re.search(r"^## Attributes\n(.*?)(?=^## |\Z)", tree.read(page), re.M | re.S)
    if table is None:
        return [f"{page}: no 'Attributes'"]
    listed: set[str] = set()
    for row in re.findall(r"^\|(.*)\|$", table[1], re.M):
        attribute, value, entity, signals = (cell.strip() for cell in row.split("|")[:4])
        if not re.fullmatch(r"attribute|-+", attribute):
            listed |= {f"{entity}.{signal}: {attribute} is {value}" for signal in re.split(r", *", signals)}
    constants = {name for name, (kind, value) in tree.rtl.design("psweep_pkg").constants.items()
                 if kind == "string" and re.fullmatch(r'"\w+"', value)}
    problems, written = [], set()
    for unit in tree.rtl.units:
        design, file = tree.rtl.design(unit), f"rtl/{tree.rtl.name(unit)}"
        for found in design.attributes:
            value = found.value
            if value.startswith('"'):
                value = value.strip('"')
            elif value not in constants:
                problems.append(f"{file}: {value} is no constant of psweep_pkg")
            for signal in found.signals:
                written.add(f"{unit}.{signal}: {found.name} is {value}")
                if signal not in design.signals:
                    problems.append(f"{file}: no signal {signal}")
    problems += [f"not in {page}: {line}" for line in sorted(written - listed)]
    problems += [f"not in the VHDL: {line}" for line in sorted(listed - written)]
    return problems if written else problems + ["no attribute found"]
