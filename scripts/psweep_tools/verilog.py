# SPDX-License-Identifier: Apache-2.0
"""Modules of the Verilog that GHDL and Yosys write."""
from __future__ import annotations

import re
from dataclasses import dataclass


class VerilogError(Exception):
    """A text that is not understood."""


@dataclass(frozen=True)
class Port:
    name: str
    is_input: bool
    bits: int


_RANGE = r"(?:\[\s*(\d+)\s*:\s*0\s*\]\s*)?"


def modules(text: str) -> dict[str, str]:
    """{name: what stands between the name and 'endmodule'}, in order; without attributes, which GHDL 5 writes."""
    text = re.sub(r"\(\* .*? \*\) ", "", text)
    return {m[1]: m[2] for m in re.finditer(r"^module (\w+)\b(.*?)^endmodule\n", text, re.M | re.S)}


def ports(text: str, name: str) -> list[Port]:
    """Ports of a module, declared in its head or in its body."""
    match = re.search(rf"^module\s+{re.escape(name)}\s*\((.*?)\)\s*;(.*?)^endmodule", text, re.M | re.S)
    if match is None:
        raise VerilogError(f"no module {name}")
    head, body = match.groups()
    if re.search(r"\b(?:input|output)\b", head):
        found = []
        for item in head.split(","):
            port = re.fullmatch(rf"\s*(input|output)\s+(?:wire\s+|reg\s+)?{_RANGE}(\w+)\s*", item)
            if port is None:
                raise VerilogError(f"{name}: port not understood: {item.strip()}")
            found.append(Port(port[3], port[1] == "input", int(port[2] or 0) + 1))
        return found
    declared = {m[3]: Port(m[3], m[1] == "input", int(m[2] or 0) + 1)
                for m in re.finditer(rf"^\s*(input|output)\s+{_RANGE}(\w+)\s*;", body, re.M)}
    names = ["".join(item.split()) for item in head.split(",")]
    for item in names:
        if item not in declared:
            raise VerilogError(f"{name}: port {item} not found")
    return [declared[item] for item in names]
