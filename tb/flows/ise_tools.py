#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Stand-in for xst, ngdbuild, map, par, trce and bitgen of ISE 14.7: ise_tools.py PROGRAM ARGUMENT .., called by small
scripts of their names that scripts/check_flows.py writes.

Logs its arguments as a line of JSON to $ISE_LOG, refuses what the real ones would refuse as far as known (unknown
option, unknown value, missing file, unknown top or generic), writes the files that the next one reads, and copies a
report of $ISE_REPORTS. Programs named in $ISE_FAIL fail; $ISE_TWR is the timing report to copy.
Options: UG627 and UG687 (xst), UG628 (the others).
"""
import json
import os
import pathlib
import re
import sys

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))

from psweep_tools import vhdl  # noqa: E402

YES = {"yes", "no"}
# Run-script options of xst and their values; None: anything.
XST = {
    "ifn": None, "ifmt": {"mixed", "vhdl", "verilog"}, "ofn": None, "ofmt": {"ngc"}, "p": None, "top": None,
    "generics": None, "opt_mode": {"speed", "area"}, "opt_level": {"0", "1", "2"}, "iuc": YES,
    "keep_hierarchy": {"yes", "no", "soft"}, "netlist_hierarchy": {"as_optimized", "rebuilt"},
    "hierarchy_separator": {"/", "_"}, "bus_delimiter": {"<>", "[]", "{}", "()"},
    "case": {"maintain", "upper", "lower"}, "fsm_extract": YES,
    "fsm_encoding": {"auto", "one-hot", "compact", "sequential", "gray", "johnson", "speed1", "user"},
    "ram_extract": YES, "ram_style": {"auto", "block", "distributed", "pipe_distributed"}, "rom_extract": YES,
    "rom_style": {"auto", "block", "distributed"}, "shreg_extract": YES,
    "use_dsp48": {"auto", "automax", "yes", "no"}, "resource_sharing": YES, "async_to_sync": YES,
    "register_duplication": YES, "register_balancing": YES | {"forward", "backward"},
    "equivalent_register_removal": YES, "lc": {"auto", "area", "off"}, "reduce_control_sets": {"auto", "no"},
    "iobuf": YES, "iob": {"auto", "true", "false"},
}
# Options of the programs: number of arguments; then how many files, and the endings of those that must be there.
PROGRAMS = {
    "xst": ({"-intstyle": 1, "-ifn": 1, "-ofn": 1}, 0, ()),
    "ngdbuild": ({"-intstyle": 1, "-dd": 1, "-nt": 1, "-uc": 1, "-p": 1}, 2, (".ngc",)),
    "map": ({"-intstyle": 1, "-p": 1, "-w": 0, "-detail": 0, "-ol": 1, "-pr": 1, "-o": 1}, 2, (".ngd",)),
    "par": ({"-intstyle": 1, "-w": 0, "-ol": 1}, 3, (".ncd", None, ".pcf")),
    "trce": ({"-intstyle": 1, "-v": 1, "-n": 1, "-xml": 1, "-o": 1}, 2, (".ncd", ".pcf")),
    "bitgen": ({"-intstyle": 1, "-w": 0}, 3, (".ncd", None, ".pcf")),
}
VALUES = {"-intstyle": {"ise", "xflow", "silent"}, "-ol": {"std", "high"}, "-pr": {"off", "i", "o", "b"},
          "-nt": {"timestamp", "on", "off"}, "-p": None}
PART = r"x[cq]r?[56]v\w+?-[123]-?[a-z]{2}\d+\Z"


def refuse(program, text):
    sys.exit("ERROR:{}: {}".format(program, text))


def read_arguments(program, arguments):
    options, number, endings = PROGRAMS[program]
    found, files, rest = {}, [], list(arguments)
    while rest:
        word = rest.pop(0)
        if word.startswith("-"):
            if word not in options:
                refuse(program, "unknown option " + word)
            found[word] = rest.pop(0) if options[word] and rest else ""
            if VALUES.get(word) and found[word] not in VALUES[word]:
                refuse(program, "{} {}".format(word, found[word]))
        else:
            files.append(word)
    if len(files) != number:
        refuse(program, "takes {} files, got {}".format(number, files))
    for file, ending in zip(files, endings):
        if ending and not (file.endswith(ending) and pathlib.Path(file).is_file()):
            refuse(program, "no {} in {}".format(ending, file))
    if "-p" in options and not re.match(PART, found.get("-p", "")):
        refuse(program, "part {}".format(found.get("-p")))
    return found, files


def synthesise(found):
    script = pathlib.Path(found["-ifn"]).read_text().splitlines()
    if "run" not in script:
        refuse("xst", "no 'run'")
    for line in script[:script.index("run")]:
        match = re.match(r"set -(?:tmpdir|xsthdpdir) (\S+)\Z", line)
        if not match or not pathlib.Path(match[1]).is_dir():
            refuse("xst", line)
    options = {}
    for line in script[script.index("run") + 1:]:
        match = re.match(r"-(\w+) (.+)\Z", line)
        if not match or match[1] not in XST or match[1] in options:
            refuse("xst", "option: " + line)
        if XST[match[1]] and match[2].lower() not in XST[match[1]]:
            refuse("xst", "value: " + line)
        options[match[1]] = match[2]
    for name in ("ifn", "ofn", "p", "top"):
        if name not in options:
            refuse("xst", "no -" + name)
    if not re.match(PART, options["p"]):
        refuse("xst", "part " + options["p"])
    entities = {}
    for line in pathlib.Path(options["ifn"]).read_text().splitlines():
        match = re.match(r'vhdl work "(.+)"\Z', line)
        if not match or not pathlib.Path(match[1]).is_file():
            refuse("xst", "project: " + line)
        design = vhdl.parse(pathlib.Path(match[1]).read_text())
        declared = {entity.name: entity for entity in design.entities}
        for instance in design.instances:
            if instance.entity not in entities and instance.entity not in declared:
                refuse("xst", "{} uses {} before it is analysed".format(match[1], instance.entity))
        entities.update(declared)
    if options["top"] not in entities:
        refuse("xst", "no entity " + options["top"])
    known = [generic.name for generic in entities[options["top"]].generics]
    generics = options.get("generics", "{}")
    if not re.match(r"\{(\w+=-?\d+( |(?=\})))*\}\Z", generics):
        refuse("xst", "-generics " + generics)
    for name in re.findall(r"(\w+)=", generics):
        if name not in known:
            refuse("xst", "no generic " + name)
    return options


def main():
    program, arguments = pathlib.Path(sys.argv[1]).name, sys.argv[2:]
    with open(os.environ["ISE_LOG"], "a") as log:
        log.write(json.dumps([program] + arguments) + "\n")
    found, files = read_arguments(program, arguments)
    if program in os.environ.get("ISE_FAIL", "").split():
        refuse(program, "told to fail")
    reports = pathlib.Path(os.environ["ISE_REPORTS"])

    def write(name, report=None):
        pathlib.Path(name).write_text((reports / report).read_text() if report else "made by a stand-in\n")
    if program == "xst":
        options = synthesise(found)
        write(options["ofn"] + ".ngc")
        write(found["-ofn"], "virtex6.syr")
    elif program == "ngdbuild":
        if not pathlib.Path(found["-uc"]).is_file():
            refuse(program, "no " + found["-uc"])
        write(files[1])
    elif program == "map":
        write(found["-o"])
        write(files[1])
        virtex6 = found["-p"].startswith("xc6v")
        write(found["-o"].replace(".ncd", ".mrp"), "virtex6_map.mrp" if virtex6 else "virtex5_map.mrp")
    elif program == "trce":
        write(found["-o"], os.environ.get("ISE_TWR", "virtex6.twr"))
    else:
        write(files[1])


if __name__ == "__main__":
    main()
