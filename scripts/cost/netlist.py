# SPDX-License-Identifier: Apache-2.0
"""Counts cells and walks the longest path of a netlist that Yosys wrote as JSON (write_json)."""
import re
from collections import Counter

from families import NX_MODES_ECC, STYLE, kind, nx_blocks

COUNTED = ("lut", "ff", "ram36", "ram18", "ram48", "rf", "dsp", "alu", "carry", "mux", "srl", "lutram")


def strip(name):
    return name[1:] if name.startswith("\\") else name


def entity_of(module, entities):
    """Entity of a module that GHDL wrote: its name, then its generics (similarity_13_..)."""
    return max((e for e in entities if re.fullmatch(re.escape(e) + r"(_[0-9a-f]+)*", strip(module))), key=len,
               default=None)


def is_module(netlist, cell):
    """A cell that is a module of its own, not a primitive."""
    module = netlist["modules"].get(cell["type"])
    return module is not None and not int(module.get("attributes", {}).get("blackbox", "0"), 2) \
        and not int(module.get("attributes", {}).get("whitebox", "0"), 2)


def tally(netlist, family, name):
    """Cells by type and children of one module."""
    cells, children = Counter(), Counter()
    for cell in netlist["modules"][name]["cells"].values():
        if is_module(netlist, cell):
            children[cell["type"]] += 1
        else:
            cells[cell["type"]] += 1
    return cells, children


def summary(family, cells):
    """Counts of a bag of primitives: see docs/cost.md, 'JSON'. Unknown primitives are an error, not a zero."""
    out = dict.fromkeys(COUNTED, 0)
    for cell_type, number in cells.items():
        if cell_type.startswith("$"):
            if cell_type in ("$scopeinfo", "$meta"):
                continue
            raise ValueError(f"cell {cell_type} was not mapped")
        found = kind(family, cell_type)
        if found is None:
            if cell_type in ("GND", "VCC", "VLO", "VHI"):
                continue
            raise ValueError(f"cell {cell_type} is not in scripts/cost/families.py ({family})")
        name, luts = found
        if name == "lut":
            out["lut"] += number * luts
        else:
            if name != "buffer":
                out[name] += number
            out["lut"] += number * luts
    out["ram36_equivalent"] = out["ram36"] + out["ram18"] / 2
    return out


class Levels:
    """Longest path of a flat module: LUTs first, carry cells second. Starts and ends: registers, memories, ports."""

    def __init__(self, family, module):
        self.style = STYLE[family]
        self.family = family
        self.names = self._names(module)
        self.driver = {}   # bit -> (cell name, port, index)
        self.cells = module["cells"]
        for cell_name, cell in self.cells.items():
            for port, bits in cell["connections"].items():
                if cell["port_directions"][port] == "output":
                    for index, bit in enumerate(bits):
                        self.driver[bit] = (cell_name, port, index)
        self.outputs = [(name, index, bit) for name, port in module["ports"].items()
                        if port["direction"] == "output" for index, bit in enumerate(port["bits"])]
        self.memo = {}

    @staticmethod
    def _names(module):
        """A readable name of every net bit: of the source, not Yosys' own, the shortest."""
        names = {}
        for name, net in module["netnames"].items():
            rank = (int(net.get("hide_name", 0)), "$" in name, "NX_" in name,
                    bool(re.search(r"(^|[._])_?n\d+(_[oq]_?)?$", name)), len(name))
            for index, bit in enumerate(net["bits"]):
                if isinstance(bit, int) and (bit not in names or rank < names[bit][0]):
                    names[bit] = (rank, f"{name}[{index}]" if len(net["bits"]) > 1 else name)
        return {bit: name for bit, (_, name) in names.items()}

    def what(self, cell):
        found = kind(self.family, cell["type"])
        return found[0] if found else "module"

    def arcs(self, cell, port, index):
        """Inputs of which this output is a function without a clock, and (LUTs, carries) of the way; None: a start."""
        what = self.what(cell)
        pins = cell["connections"]
        inputs = [p for p in pins if cell["port_directions"][p] == "input"]
        if what in ("lut", "mux", "buffer"):
            return [b for p in inputs for b in pins[p]], (1, 0) if what == "lut" else (0, 0)
        if what == "carry":
            if self.style == "xilinx":
                bits = [b for p in ("CI", "CYINIT") for b in pins.get(p, [])]
                return bits + [b for p in ("S", "DI") for b in pins.get(p, [])[:index + 1]], (0, 1)
            if self.style == "ecp5":
                last = 0 if port == "S0" else 1
                return [b for p in inputs if p == "CIN" or p[-1] <= str(last) for b in pins[p]], (0, 1)
            last = 4 if port == "CO" else int(port[1])
            return [b for p in inputs if p == "CI" or int(p[1]) <= last for b in pins[p]], (0, 1)
        if what == "srl":
            return None
        if what == "lutram":
            clocks = ("WCLK", "WCK", "WE", "WRE", "D", "DI", "DIA", "DIB", "DIC", "DID", "WAD")
            return [b for p in inputs if p not in clocks for b in pins[p]], (1, 0)
        if what == "dsp" and self.style == "xilinx":
            def registers(name):
                value = cell["parameters"].get(name, "1")
                return value if isinstance(value, int) else int(re.sub("[^01]", "0", value), 2)
            if registers("PREG"):
                return None
            bits = list(pins.get("C", [])) if not registers("CREG") else []
            if not registers("MREG"):
                bits += [b for p, r in (("A", "AREG"), ("B", "BREG")) if not registers(r) for b in pins.get(p, [])]
            return bits, (0, 0)
        return None

    def clocked_inputs(self, cell):
        """(port, bit) where a path ends: data, enables and resets of what has a clock."""
        what = self.what(cell)
        if what in ("lut", "mux", "carry", "buffer"):
            return []
        return [(p, b) for p, bits in cell["connections"].items() if cell["port_directions"][p] == "input"
                and (what == "module" or not re.search(r"CLK|^CK|CK$|^C$", p) or p == "C" and what == "dsp")
                for b in bits]

    def arrival(self, bit):
        """(LUTs, carries, bit before) of the longest way to a bit."""
        stack = [bit]
        while stack:
            top = stack[-1]
            if top in self.memo and self.memo[top] != "open":
                stack.pop()
                continue
            source = self.driver.get(top)
            found = self.arcs(self.cells[source[0]], source[1], source[2]) if source else None
            if not found or not found[0]:
                self.memo[top] = (0, 0, None)
                stack.pop()
                continue
            inputs, (luts, carries) = found
            inputs = [b for b in inputs if isinstance(b, int)]
            todo = [b for b in inputs if b not in self.memo]
            if todo:
                if self.memo.get(top) == "open" and any(self.memo.get(b) == "open" for b in todo):
                    raise ValueError(f"a loop without a register at {self.name(top)}")
                self.memo.setdefault(top, "open")
                for b in todo:
                    stack.append(b)
                continue
            if any(self.memo[b] == "open" for b in inputs):
                raise ValueError(f"a loop without a register at {self.name(top)}")
            best = max(((self.memo[b][0], self.memo[b][1], b) for b in inputs), default=(0, 0, None))
            self.memo[top] = (best[0] + luts, best[1] + carries, best[2])
            stack.pop()
        return self.memo[bit]

    def name(self, bit):
        return self.names.get(bit, str(bit))

    def start_name(self, bit):
        source = self.driver.get(bit)
        if source is None:
            return f"port {self.name(bit)}"
        cell = self.cells[source[0]]
        what = self.what(cell)
        own = self.name(bit) if what in ("ff", "srl") else self.cell_name(source[0]) or self.name(bit)
        return own if what == "ff" else f"{what} {own}"

    @staticmethod
    def cell_name(name):
        """Name of a mapped memory or DSP without what Yosys appended."""
        return re.sub(r"(\.\d+)+$|_reg.*$", "", re.sub(r"\$.*?(?=u_|$)", "", strip(name)))

    def ends(self):
        """Every end: (LUTs, carries, start, end)."""
        for cell_name, cell in self.cells.items():
            sinks = self.clocked_inputs(cell)
            if not sinks:
                continue
            outputs = [b for p, bits in cell["connections"].items() if cell["port_directions"][p] == "output"
                       for b in bits if b in self.names]
            what = self.what(cell)
            own = self.name(outputs[0]) if outputs and what in ("ff", "srl") else \
                self.cell_name(cell_name) or (self.name(outputs[0]) if outputs else "")
            for port, bit in sinks:
                if isinstance(bit, int):
                    yield self._end(bit, f"{own if what == 'ff' else what + ' ' + own}/{port}")
        for name, index, bit in self.outputs:
            if isinstance(bit, int):
                yield self._end(bit, f"port {name}[{index}]")

    def _end(self, bit, end):
        luts, carries, before = self.arrival(bit)
        first = bit
        while before is not None:
            first, before = before, self.memo[before][2]
        return luts, carries, self.start_name(first), end


# Read ports of block RAMs: outputs, clock, parameters that switch the output register on, their value, its enables.
_XILINX = (("DOA(DO)?|DOPA(DOP)?", "CLKA(RDCLK)?", ("DOA_REG",), "1", ("REGCEA(REGCE)?",)),
           ("DOB(DO)?|DOPB(DOP)?", "CLKB(WRCLK)?", ("DOB_REG",), "1", ("REGCEB",)))
_XILINX_SDP = (("DOP?", "RDCLK", ("DO_REG",), "1", ("REGCE",)),)
READ_PORTS = {
    "DP16KD": ((r"DOA\d+", "CLKA", ("REGMODE_A",), "OUTREG", ()), (r"DOB\d+", "CLKB", ("REGMODE_B",), "OUTREG", ())),
    "PDPW16KD": ((r"DO\d+", "CLKR", ("REGMODE",), "OUTREG", ()),),
    "RAMB18E1": _XILINX, "RAMB36E1": _XILINX, "RAMB18": _XILINX, "RAMB36": _XILINX,
    "RAMB18SDP": _XILINX_SDP, "RAMB36SDP": _XILINX_SDP,
}
# Simple dual port of Virtex-6: one read port over both halves.
_XILINX_WIDE = (("DO[AB]DO|DOP[AB]DOP", "CLKARDCLK", ("DOA_REG", "DOB_REG"), "1", ("REGCEAREGCE", "REGCEB")),)


def merge_output_registers(netlist):
    """Registers that do nothing but hold what a block RAM put out become the block's own output register: the devices
    have one, vendor tools use it, Yosys does not. Only registers without enable and reset, all that look at the port.
    Returns how many FF went. scripts/sim_gates.sh simulates the result for Virtex-6."""
    return sum(_merge(module) for module in netlist["modules"].values())


def merge_multiplier_registers(netlist):
    """ECP5: the registers around a MULT18X18D become its own, likewise. A register in front that others look at, too,
    stays for them. Returns how many FF went."""
    gone = 0
    for module in netlist["modules"].values():
        cells, driver = module["cells"], {}
        for name, cell in cells.items():
            if cell["type"] == "TRELLIS_FF":
                driver[cell["connections"]["Q"][0]] = name
        sinks = _sinks(module)
        for cell in [c for c in cells.values() if c["type"] == "MULT18X18D"]:
            pins = cell["connections"]
            used = [port for port, bits in pins.items() if re.fullmatch(r"P\d+", port) and bits and sinks.get(bits[0])]
            ends = [sinks[pins[port][0]] for port in used]
            clocks = {tuple(cells[e[0][0]]["connections"]["CLK"]) for e in ends
                      if e[0][0] in cells and cells[e[0][0]]["type"] == "TRELLIS_FF"}
            if len(clocks) != 1:
                continue
            clock = list(clocks.pop())
            if not all(len(e) == 1 and _plain(cells, e[0][0], clock) == e[0][1] for e in ends):
                continue
            for port, end in zip(used, ends):
                pins[port] = cells.pop(end[0][0])["connections"]["Q"]
                gone += 1
            _clocked(cell, "OUTPUT", clock)
            # nextpnr has times for all registers or the output's alone.
            ports = [p for p, bits in pins.items() if re.fullmatch(r"[AB]\d+", p) and isinstance(bits[0], int)]
            if all(_plain(cells, driver.get(pins[p][0]), clock) for p in ports):
                for port in ports:
                    pins[port] = cells[driver[pins[port][0]]]["connections"]["DI"]
                _clocked(cell, "INPUTA", clock)
                _clocked(cell, "INPUTB", clock)
        sinks = _sinks(module)
        for bit, name in driver.items():
            if name in cells and not sinks.get(bit):
                del cells[name]
                gone += 1
    return gone


def _clocked(cell, part, clock):
    cell["parameters"].update({f"REG_{part}_CLK": "CLK0", f"REG_{part}_CE": "CE0", f"REG_{part}_RST": "RST0"})
    cell["connections"].update({"CLK0": clock, "CE0": ["1"], "RST0": ["0"]})
    cell["port_directions"].update({"CLK0": "input", "CE0": "input", "RST0": "input"})


def _sinks(module):
    """Bit -> (cell, port) of all that look at it; a port of the module is (None, '')."""
    sinks = {}
    for name, cell in module["cells"].items():
        for port, bits in cell["connections"].items():
            if cell["port_directions"].get(port, "input") == "input":
                for bit in bits:
                    sinks.setdefault(bit, []).append((name, port))
    for port in module["ports"].values():
        for bit in port["bits"]:
            sinks.setdefault(bit, []).append((None, ""))
    return sinks


def _plain(cells, name, clock):
    """Data pin of a register without enable and reset, of this clock; else None."""
    if name not in cells:
        return None
    cell = cells[name]
    pins, parameters = cell["connections"], cell["parameters"]

    def constant(port, value):
        return pins.get(port, [value])[0] in (value, "x")
    if cell["type"] == "TRELLIS_FF":
        enabled = parameters.get("CEMUX", "1") == "1" or constant("CE", "1")
        good = enabled and constant("LSR", "0") and parameters.get("CLKMUX", "CLK") == "CLK"
        return "DI" if good and pins["CLK"] == clock else None
    if cell["type"] == "FDRE":
        inverted = any(_on(v) for k, v in parameters.items() if k.startswith("IS_"))
        good = constant("CE", "1") and constant("R", "0") and not inverted and parameters.get("INIT", "x")[-1] != "1"
        return "D" if good and pins["C"] == clock else None
    return None


def _on(value):
    """A parameter as Yosys writes it: a number as bits, or a text."""
    text = str(value)
    return text if not set(text) <= set("01xz") else int(text.replace("x", "0").replace("z", "0"), 2) != 0


def _merge(module):
    cells, sinks, gone = module["cells"], _sinks(module), 0

    def ports_of(cell):
        if cell["type"] in ("RAMB18E1", "RAMB36E1") and cell["parameters"].get("RAM_MODE") == "SDP":
            return _XILINX_WIDE
        return READ_PORTS.get(cell["type"], ())

    for cell in list(cells.values()):
        if any(cell["parameters"].get(f"RAM_EXTENSION_{side}", "NONE") != "NONE" for side in "AB"):
            continue  # a block that another one's outputs go through
        for outputs, clock_pin, modes, value, enables in ports_of(cell):
            pins = cell["connections"]
            clock = next((bits for port, bits in pins.items() if re.fullmatch(clock_pin, port)), None)
            used = [(port, place) for port, bits in pins.items() if re.fullmatch(outputs, port)
                    for place, bit in enumerate(bits) if sinks.get(bit)]
            ends = [sinks[pins[port][place]] for port, place in used]
            if not used or any(_on(cell["parameters"].get(mode, "0")) not in (False, "NOREG") for mode in modes):
                continue
            if not all(len(e) == 1 and _plain(cells, e[0][0], clock) == e[0][1] for e in ends):
                continue
            for mode in modes:
                cell["parameters"][mode] = value
            for port in pins:
                if any(re.fullmatch(pattern, port) for pattern in enables):
                    pins[port] = ["1"]
            for (port, place), end in zip(used, ends):
                pins[port][place] = cells.pop(end[0][0])["connections"]["Q"][0]
                gone += 1
    return gone


def owner(path_end, entities):
    """Entity in which an end of a path lies, by the instance names u_<entity> of the source; '' for the top."""
    found = re.findall(r"u_([a-z0-9_]+?)(?=[.\[/ ]|_u_|$)", path_end)
    return next((e for e in found if e in entities), "")


def longest(levels, entities):
    """Longest path of all and of each entity (of its end), with the histogram of LUTs."""
    best, histogram = {}, Counter()
    for luts, carries, start, end in levels.ends():
        histogram[luts] += 1
        for key in {"", owner(end, entities)}:
            if key not in best or (luts, carries) > (best[key]["lut"], best[key]["carry"]):
                best[key] = {"lut": luts, "carry": carries, "start": start, "end": end}
    return best, dict(sorted(histogram.items()))


def memories(netlist, top, units):
    """Memories and products before mapping (cells $mem_v2, $mul), each with the unit in which it lies."""
    rams, products = [], []

    def number(cell, key):
        value = cell["parameters"][key]
        return value if isinstance(value, int) else int(value, 2)

    def walk(module, path, unit):
        for name, cell in netlist["modules"][module]["cells"].items():
            if cell["type"] in ("$mem_v2", "$mem"):
                words, bits = number(cell, "SIZE"), number(cell, "WIDTH")
                rams.append({"path": ".".join(path), "unit": unit, "words": words, "bits": bits,
                             "reads": number(cell, "RD_PORTS"), "writes": number(cell, "WR_PORTS"),
                             "nx_ram48": nx_blocks(words, bits), "nx_ram48_ecc": nx_blocks(words, bits, NX_MODES_ECC)})
            elif cell["type"] == "$mul":
                products.append({"unit": unit, "a": number(cell, "A_WIDTH"), "b": number(cell, "B_WIDTH"),
                                 "result": number(cell, "Y_WIDTH"), "signed": bool(number(cell, "A_SIGNED"))})
            elif is_module(netlist, cell):
                walk(cell["type"], path + [strip(name)], entity_of(cell["type"], units) or unit)
    walk(top, [], entity_of(top, units) or "")
    return sorted(rams, key=lambda m: m["path"]), sorted(products, key=lambda m: (m["unit"], m["a"], m["b"]))
