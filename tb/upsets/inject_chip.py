#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes every register of a converted chip one that can be upset.

  inject_chip.py IN.v OUT.v SITES.inc

IN.v is what GHDL makes of psweep_top. In OUT.v
  - every instance has a module of its own, so that an upset hits one of them, however often its entity is used;
  - registers take their values at both edges of their clock: one evaluation each, not two;
  - the top has three more inputs: at the edge at which flip_site is the number of a register, what that register takes
    is changed where flip_mask (flip_wide, if it has more than 64 bits) has ones. 0: nothing happens.
SITES.inc has a line for each register: {entity, name with the path of instances, bits, clock (0 clk, 1 mii_rx_clk,
2 mii_tx_clk)}, number 1 first. Words of RAMs are no registers; what they are read into is.
Anything that is not understood ends the script: no register may get lost.
"""
import pathlib
import re
import sys

TOP = "psweep_top"
CLOCKS = ("clk", "mii_rx_clk", "mii_tx_clk")
WIDE = 512
RTL = pathlib.Path(__file__).resolve().parents[2] / "rtl"


def die(text):
    sys.exit("inject_chip.py: " + text)


def read_modules(text):
    modules = {}
    for match in re.finditer(r"^module (\w+)\b(.*?)^endmodule\n", text, re.M | re.S):
        modules[match.group(1)] = match.group(2)
    return modules


def entity_of(module, entities):
    for entity in entities:
        if re.match(re.escape(entity) + r"(_\d|$)", module):
            return entity
    die(f"module {module} is no entity of rtl/")


class Injector:
    def __init__(self, modules, entities):
        self.modules = modules
        self.entities = entities
        self.sites = []
        self.out = []
        self.clones = 0

    def site(self, entity, name, bits, clock):
        if bits > WIDE:
            die(f"{name} has {bits} bits, more than {WIDE}")
        self.sites.append((entity, name, bits, clock))
        number = len(self.sites)
        mask = f"{TOP}.flip_mask" if bits <= 64 else f"{TOP}.flip_wide"
        return f"({TOP}.flip_site == {number} ? {mask}[{bits - 1}:0] : {bits}'d0)"

    def emit(self, module, path, clocks, name):
        """Writes `module` as `name`, after the modules of its instances. clocks: its clock ports -> number."""
        body = self.modules[module]
        entity = entity_of(module, self.entities)

        def instance(match):
            kind, label, ports = match.groups()
            if kind not in self.modules:
                return match.group(0)
            inner = {formal: clocks[actual]
                     for formal, actual in re.findall(r"\.(\w+)\s*\((\w+)\)", ports) if actual in clocks}
            self.clones += 1
            clone = f"{kind}__{self.clones}"
            self.emit(kind, path + label + ".", inner, clone)
            return f"  {clone} {label} ({ports});"

        body = re.sub(r"^  (\w+) (\w+) \(\n(.*?)\);", instance, body, flags=re.M | re.S)

        # Signals of the VHDL by the register behind them; a port's own name beats that of a copy.
        names = {}
        for signal, register in re.findall(r"assign (\w+) = (n\d+_q);", body):
            if register not in names or names[register].endswith("_q"):
                names[register] = signal
        bits = {register: int(high or 0) + 1
                for high, register in re.findall(r"^  reg (?:\[(\d+):0\] )?(n\d+_(?:q|data));", body, re.M)}
        seen = set()

        def assignment(register, value, clock):
            if register not in bits:
                die(f"{path}{register} of {module} is no register")
            seen.add(register)
            shown = names.get(register, "rdata" if register.endswith("_data") else register)
            return f"{register} <= {value} ^ {self.site(entity, path + shown, bits[register], clock)};"

        def block(match):
            edge, reset, rest = match.groups()
            if edge not in clocks:
                die(f"clock {edge} of {module} at {path or TOP} is not known")
            clock = clocks[edge]
            sense = f"  always @(posedge {edge} or negedge {edge}{reset or ''})\n"
            plain = re.fullmatch(r"    (n\d+_q) <= (\w+);\n", rest)
            if plain and not reset:
                return sense + "    " + assignment(plain.group(1), plain.group(2), clock) + "\n"
            both = re.fullmatch(r"    if \((\w+)\)\n      (n\d+_q) <= ([\w']+);\n    else\n      (n\d+_q) <= (\w+);\n",
                                rest)
            if both and reset and both.group(2) == both.group(4):
                test, register, start, _, value = both.groups()
                return (sense + f"    if ({test})\n      {register} <= {start};\n    else\n      "
                        + assignment(register, value, clock) + "\n")
            read = re.fullmatch(r"    if \(([\w']+)\)\n      (n\d+_data) <= (\w+\[\w+\]);\n", rest)
            if read and not reset:
                return (sense + f"    if ({read.group(1)})\n      " + assignment(read.group(2), read.group(3), clock)
                        + "\n")
            if re.fullmatch(r"    if \(\w+\)\n      \w+\[\w+\] <= \w+;\n", rest) and not reset:
                return sense + rest
            die(f"this of {module} was not understood:\n{match.group(0)}")

        body = re.sub(r"^  always @\(posedge (\w+)( or posedge \w+)?\)\n((?:    .*\n)+)", block, body, flags=re.M)
        for line in re.findall(r"^  always @\(posedge.*", body, re.M):
            if "negedge" not in line:
                die(f"this of {module} was not understood: {line}")
        lost = set(bits) - seen
        if lost:
            die(f"registers of {module} were not understood: {sorted(lost)}")
        if module == TOP:
            ports = f"\n  (input [15:0] flip_site,\n   input [63:0] flip_mask,\n   input [{WIDE - 1}:0] flip_wide,\n   "
            body = re.sub(r"\n  \(", lambda _: ports, body, count=1)
        self.out.append(f"module {name}{body}endmodule\n")


def main():
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    source, target, sites = (pathlib.Path(a) for a in sys.argv[1:])
    modules = read_modules(source.read_text())
    if TOP not in modules:
        die(f"no module {TOP}")
    entities = sorted((p.stem for p in RTL.glob("*.vhd")), key=len, reverse=True)
    injector = Injector(modules, entities)
    injector.emit(TOP, "", {name: number for number, name in enumerate(CLOCKS)}, TOP)
    if not injector.sites:
        die("no register")
    target.write_text("\n".join(injector.out))
    sites.write_text("".join('{"%s", "%s", %d, %d},\n' % site for site in injector.sites))


if __name__ == "__main__":
    main()
