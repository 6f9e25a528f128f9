#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The one reader of configurations: rtl/configs/{engine,chip}.schema.json and the JSON files beside them.

  configurations.py check             every configuration against its schema; the schema against the VHDL, the pages and
                                      sw/contract/fields.hpp
  configurations.py list              names and descriptions
  configurations.py show NAME         all values, defaults included
  configurations.py generics NAME     as G_X=n, one a line; those of its engine included
  configurations.py new KEY=n ..      writes build/configs/<NAME>.json (make config)
  configurations.py cmake OUT         all of them as CMake variables (sw/verilated); --own: those of the build folder
  configurations.py header            writes sw/contract/fields.hpp from the schema
  --kind engine|chip, --json (list, show, generics), --build FOLDER (default build)

A key that is left out takes the schema's default. Users' own configurations lie in build/configs and build/chips.
Python 3.8 and later, without packages: the vendors' tools bring their own. Exit code 2 and one line with file and key
if something is wrong."""
import argparse
import functools
import json
import pathlib
import re
import sys
from typing import Any, Dict, List, NamedTuple, Optional, Tuple

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))

from psweep_tools import vhdl  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parent.parent
CONFIGS = ROOT / "rtl" / "configs"
HEADER = ROOT / "sw" / "contract" / "fields.hpp"
# Kind: folder of the project's own, folder of the user's own (in the build folder), entity, struct of the header.
KINDS = {"engine": ("engine", "configs", "psweep"), "chip": ("chip", "chips", "psweep_top")}
NAME = re.compile(r"[a-z][a-z0-9_]*")


class ConfigError(Exception):
    """Names file and key."""


class Field(NamedTuple):
    """A generic: its key, range and meaning."""
    key: str
    generic: str
    default: int
    meaning: str
    lowest: int
    highest: Optional[int]
    allowed: Tuple[int, ...]  # empty: all from lowest to highest
    multiple: int
    odd: bool
    forbidden: Optional[int]
    role: str  # size: the request must fit; format: decides bits of the results; build: neither
    info: int  # word of the INFO message, 0: none
    asserted: Tuple[str, ...]  # entity.generic that checks it; empty: all of its name
    derived: Optional[int]  # value for 'follows from the others', which the asserting entity never sees

    def range(self) -> str:
        """In the words of messages and pages."""
        if self.allowed:
            texts = [str(n) for n in self.allowed]
            return f"{', '.join(texts[:-1])} or {texts[-1]}"
        text = f"{self.lowest} .. {self.highest}" if self.highest is not None else f"at least {self.lowest}"
        if self.multiple > 1:
            text += ", even" if self.multiple == 2 else f", a multiple of {self.multiple}"
        if self.odd:
            text += ", odd"
        if self.forbidden is not None:
            text += f", not {self.forbidden}"
        return text

    def holds(self, value: int) -> bool:
        """Is the value legal?"""
        if self.allowed:
            return value in self.allowed
        return (value >= self.lowest and (self.highest is None or value <= self.highest)
                and value % self.multiple == 0 and not (self.odd and value % 2 == 0) and value != self.forbidden)


class Configuration(NamedTuple):
    """One JSON file, defaults filled in."""
    kind: str
    name: str
    path: pathlib.Path
    description: str
    waves: bool
    values: Dict[str, int]  # by key, in the order of the schema
    engine: Optional["Configuration"]  # of a chip

    def generics(self) -> Dict[str, int]:
        """All of the entity, the engine's first."""
        own = {field.generic: self.values[field.key] for field in fields(self.kind)}
        return {**self.engine.generics(), **own} if self.engine else own


@functools.lru_cache(maxsize=None)
def schema(kind: str) -> Dict[str, Any]:
    """The schema as it stands in the file."""
    content: Dict[str, Any] = json.loads((CONFIGS / f"{kind}.schema.json").read_text())
    return content


@functools.lru_cache(maxsize=None)
def fields(kind: str) -> Tuple[Field, ...]:
    """The generics of a kind in the order of the schema."""
    found = []
    for key, about in schema(kind)["properties"].items():
        if "generic" not in about:
            continue
        without = about.get("not", {})
        found.append(Field(key, about["generic"], about["default"], about["description"],
                           about.get("minimum", min(about.get("enum", [0]))),
                           about.get("maximum", max(about["enum"]) if "enum" in about else None),
                           tuple(about.get("enum", ())), about.get("multipleOf", 1),
                           without.get("multipleOf") == 2, without.get("const"), about["role"], about.get("info", 0),
                           tuple(about.get("asserted", ())), about.get("derived")))
    return tuple(found)


def read(path: pathlib.Path, kind: str, build: pathlib.Path) -> Configuration:
    """A file, checked; ConfigError names it and the key."""
    def wrong(text: str) -> ConfigError:
        return ConfigError(f"{path}: {text}")

    if not NAME.fullmatch(path.stem):
        raise wrong("a configuration's name consists of a-z, 0-9 and _, and begins with a letter")
    try:
        content = json.loads(path.read_text())
    except (OSError, ValueError) as error:
        raise wrong(f"cannot be read: {error}") from error
    if not isinstance(content, dict):
        raise wrong("must be an object of keys and values")
    known = schema(kind)["properties"]
    for key in content:
        if key not in known:
            raise wrong(f"unknown key '{key}'; known: {', '.join(known)}")
    for key in schema(kind)["required"]:
        if key not in content:
            raise wrong(f"{key} is missing")
    values = {}
    for field in fields(kind):
        value = content.get(field.key, field.default)
        if not isinstance(value, int) or isinstance(value, bool):
            raise wrong(f"{field.key} is not a whole number")
        if not field.holds(value):
            raise wrong(f"{field.key}={value} must be {field.range()}")
        values[field.key] = value
    for key, kinds in (("description", str), ("waves", bool), ("engine", str)):
        if key in content and not isinstance(content[key], kinds):
            raise wrong(f"{key} must be {'true or false' if kinds is bool else 'a text'}")
    engine = find(content["engine"], "engine", build) if kind == "chip" else None
    return Configuration(kind, path.stem, path, content["description"], content.get("waves", False), values, engine)


def files(kind: str, build: pathlib.Path, own_only: bool = False) -> Dict[str, pathlib.Path]:
    """All configurations by name, those of the build folder last; a name may stand once."""
    folder, user, _ = KINDS[kind]
    found: Dict[str, pathlib.Path] = {}
    for place in ([] if own_only else [CONFIGS / folder]) + [build / user]:
        for path in sorted(place.glob("*.json")):
            if path.stem in found:
                raise ConfigError(f"{path}: there is already a configuration {path.stem}: {found[path.stem]}")
            found[path.stem] = path
    return found


def find(name: str, kind: str = "engine", build: pathlib.Path = ROOT / "build") -> Configuration:
    """By name."""
    known = files(kind, build)
    if name not in known:
        raise ConfigError(f"no configuration '{name}' of the {kind}; there are: {', '.join(known)}"
                          + (" (make config makes one)" if kind == "engine" else ""))
    return read(known[name], kind, build)


# For CMake and C++ ----------------------------------------------------------------------------------------------------
def cmake_text(build: pathlib.Path, own: bool) -> str:
    """PSWEEP_<KIND>_NAMES: all; for each PSWEEP_<KIND>_<name>_{DESCRIPTION,WAVES,GENERICS,VALUES}. VALUES: C++
    that assigns to members of c; of a chip also _ENGINE and _ENGINE_VALUES."""
    lines = ["# Written by scripts/configurations.py."]
    for kind in KINDS:
        known = {} if own and kind == "chip" else files(kind, build, own)
        upper = kind.upper()
        lines.append(f"set(PSWEEP_{upper}_NAMES {' '.join(known)})")
        for name, path in known.items():
            config = read(path, kind, build)
            about = {"DESCRIPTION": config.description, "WAVES": "ON" if config.waves else "OFF",
                     "GENERICS": ";".join(f"{generic}={value}" for generic, value in config.generics().items()),
                     "VALUES": _assignments(config.values)}
            if config.engine:
                about.update({"ENGINE": config.engine.name, "ENGINE_VALUES": _assignments(config.engine.values)})
            lines += [f"set(PSWEEP_{upper}_{name}_{key} [==[{value}]==])" for key, value in about.items()]
    return "\n".join(lines) + "\n"


def _assignments(values: Dict[str, int]) -> str:
    return "".join(f"  c.{key} = {value};\n" for key, value in values.items())


_HEADER = """\
// SPDX-License-Identifier: Apache-2.0
// The generics of engine and chip: structs with a member each, and tables to loop over them.
// Written by scripts/configurations.py header from rtl/configs/{engine,chip}.schema.json; not by hand.
#pragma once
#include <array>
#include <cstdint>

namespace psweep {

// size: what is asked for must fit into it; format: it decides the bits of the results; build: neither.
enum class Role { size, format, build };

// One generic. Legal values: if allowed is not 0, it has a one for each; else lowest .. highest with value mod
// multiple = rest, and not forbidden.
template <class Struct>
struct Generic {
  const char* key;
  const char* generic;
  const char* meaning;
  const char* range;  // in words
  Role role;
  int Struct::*value;
  int lowest, highest, multiple, rest, forbidden;
  uint64_t allowed;
  int info;  // word of the INFO message, 0: none

  constexpr bool holds(int64_t v) const {
    if (allowed != 0) return v >= 0 && v < 64 && (allowed >> v & 1) != 0;
    return v >= lowest && v <= highest && v % multiple == rest && v != forbidden;
  }
};
"""


def header_text() -> str:
    """sw/contract/fields.hpp."""
    text = _HEADER
    for kind, (_, _, entity) in KINDS.items():
        struct = f"{kind.capitalize()}Fields"
        all_fields = fields(kind)
        text += f"\n// {'Generics of entity ' + entity if kind == 'engine' else 'Those that ' + entity + ' adds'}.\n"
        text += f"struct {struct} {{\n"
        for f in all_fields:
            text += f"  // {f.generic}: {f.meaning}; {f.range()}\n  int {f.key} = {f.default};\n"
        text += "};\n\n// clang-format off\n"
        text += f"inline constexpr std::array<Generic<{struct}>, {len(all_fields)}> k{struct} = {{{{\n"
        for f in all_fields:
            allowed = sum(1 << n for n in f.allowed)
            numbers = (f.lowest, 2147483647 if f.highest is None else f.highest, 2 if f.odd else f.multiple,
                       1 if f.odd else 0, -1 if f.forbidden is None else f.forbidden, allowed, f.info)
            text += (f'    {{"{f.key}", "{f.generic}",\n     "{f.meaning}",\n     "{f.range()}", Role::{f.role}, '
                     f"&{struct}::{f.key}, {', '.join(str(n) for n in numbers)}}},\n")
        text += "}};\n// clang-format on\n"
    return text + "\n}  // namespace psweep\n"


# Checks ---------------------------------------------------------------------------------------------------------------
_BOUND = re.compile(r"(G_\w+) (>=|<=|=|/=|mod) (\d+)(?: = (\d+))?")


def vhdl_limits(design: vhdl.Design) -> Dict[str, List[Tuple[str, int, int]]]:
    """What the assertions of an entity ask of its generics: operator, number, and the remainder of a mod."""
    found: Dict[str, List[Tuple[str, int, int]]] = {}
    for assertion in design.assertions:
        for generic, operator, number, rest in _BOUND.findall(assertion.condition if assertion.of_generic else ""):
            found.setdefault(generic, []).append((operator, int(number), int(rest or 0)))
    return found


def _agrees(field: Field, limits: List[Tuple[str, int, int]]) -> bool:
    """Do the assertions let pass just what the schema does? Tried at and around all numbers that either names."""
    equal = {number for operator, number, _ in limits if operator == "="}

    def passes(value: int) -> bool:
        if value == field.derived:
            return True
        if equal:
            return value in equal
        return all({">=": value >= number, "<=": value <= number, "/=": value != number,
                    "mod": value % max(number, 1) == rest}[operator] for operator, number, rest in limits)

    numbers = {n for operator, n, _ in limits if operator != "mod"} | {field.lowest, *field.allowed}
    if field.highest is not None:
        numbers.add(field.highest)
    return all(passes(value) == field.holds(value) for n in numbers for value in range(n - 2, n + 3))


def problems(build: pathlib.Path, rtl: pathlib.Path, pages: pathlib.Path) -> List[str]:
    """All that is wrong, a line each."""
    found: List[str] = []
    sources = vhdl.Rtl(rtl)
    asserted = {unit: vhdl_limits(sources.design(unit)) for unit in sources.units}
    info = {int(word): value for word, value in
            re.findall(r"v_words\((\d+)\)\s*:=\s*std_logic_vector\(to_unsigned\((G_\w+), 32\)\)",
                       sources.text("info_rom"))}
    seen = set()
    for kind, (folder, _, entity) in KINDS.items():
        generics = {generic.name: int(generic.default) for generic in sources.entity(entity).generics}
        page = (pages / f"{entity}.md").read_text() if (pages / f"{entity}.md").exists() else ""
        for field in fields(kind):
            where = f"rtl/configs/{kind}.schema.json: {field.key}"
            seen.add(field.generic)
            if field.generic not in generics:
                found.append(f"{where}: entity {entity} has no generic {field.generic}")
            elif generics[field.generic] != field.default:
                found.append(f"{where}: default {field.default}, but {generics[field.generic]} in {entity}")
            if not field.holds(field.default):
                found.append(f"{where}: default {field.default} is not {field.range()}")
            if field.info and info.get(field.info) != field.generic:
                found.append(f"{where}: word {field.info} of INFO is {info.get(field.info)} in info_rom")
            limits = [limit for name in field.asserted or (f"{n}.{field.generic}" for n in sources.units)
                      for limit in asserted[name.split(".")[0]].get(name.split(".")[1], [])]
            if not limits:
                found.append(f"{where}: no assertion in rtl/ checks {field.generic}")
            elif not _agrees(field, limits):
                found.append(f"{where}: {field.range()}, but rtl/ asserts {sorted(set(limits))}")
            if page and f"| {field.generic} |" not in page:
                found.append(f"docs/{entity}.md: no row for {field.generic}")
        if kind == "chip":
            for generic in generics:
                if generic not in seen:
                    found.append(f"rtl/configs: no key for {generic} of {entity}")
        for name, path in files(kind, build).items():
            try:
                read(path, kind, build)
            except ConfigError as error:
                found.append(str(error))
    if not HEADER.exists() or HEADER.read_text() != header_text():
        found.append("sw/contract/fields.hpp: not what the schema says; scripts/configurations.py header")
    return found


# Command line ---------------------------------------------------------------------------------------------------------
def new(arguments: List[str], build: pathlib.Path) -> pathlib.Path:
    """KEY=n .. of make config (in capitals or not) -> build/configs/<NAME>.json."""
    given = {}
    for argument in arguments:
        key, equals, value = argument.partition("=")
        if not equals:
            raise ConfigError(f"make config: '{argument}' is not KEY=VALUE")
        if value:
            given[key.lower()] = value
    name = given.pop("name", "")
    if not NAME.fullmatch(name):
        raise ConfigError(f"make config: NAME='{name}' must consist of a-z, 0-9 and _, and begin with a letter")
    values: Dict[str, Any] = {}
    for key, value in given.items():
        if not re.fullmatch(r"-?\d+", value):
            raise ConfigError(f"make config: {key.upper()}='{value}' is not a whole number")
        values[key] = int(value)
    # Columns between the disparities of the nearest and the farthest plane, halved between both images.
    disparity = values.pop("disparity", 90)
    if not 0 <= disparity <= 4096:
        raise ConfigError(f"make config: DISPARITY={disparity} must be 0 .. 4096")
    content: Dict[str, Any] = {"description": "added by make config"}
    by_key = {field.key: field for field in fields("engine")}
    for key in values:
        if key not in by_key and key != "waves":
            raise ConfigError(f"make config: unknown key {key.upper()}; known: NAME, DISPARITY, WAVES, "
                              + ", ".join(k.upper() for k in by_key))
    for key, field in by_key.items():
        content[key] = values.get(key, field.default)
    # The largest tile with its skirt, and two pixels for the interpolation.
    if "img_cols" not in values:
        content["img_cols"] = (content["plane_cols"] + content["window"] + 1 + disparity + 1) // 2 * 2
    if "img_rows" not in values:
        content["img_rows"] = (content["plane_rows"] + content["window"] + 1 + 1) // 2 * 2
    for key, field in by_key.items():
        if not field.holds(content[key]):
            raise ConfigError(f"make config: {key.upper()}={content[key]} must be {field.range()}")
    content["waves"] = values.get("waves", 0) != 0
    path = build / "configs" / f"{name}.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(content, indent=2) + "\n")
    return path


def write_if_different(path: pathlib.Path, text: str) -> None:
    """So that nothing is built again for nothing."""
    if not path.exists() or path.read_text() != text:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)


def main(arguments: List[str]) -> int:
    """Exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("command", choices=["check", "list", "show", "generics", "new", "cmake", "header"])
    parser.add_argument("values", nargs="*")
    parser.add_argument("--kind", choices=list(KINDS), default="engine")
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--own", action="store_true")
    options = parser.parse_intermixed_args(arguments)
    try:
        return run(options)
    except ConfigError as error:
        print(f"configurations: {error}", file=sys.stderr)
        return 2


def run(options: argparse.Namespace) -> int:
    """One command."""
    if options.command == "check":
        found = problems(options.build, ROOT / "rtl", ROOT / "docs")
        for line in found:
            print(line, file=sys.stderr)
        print(f"configurations: {sum(len(files(kind, options.build)) for kind in KINDS)} of "
              f"{sum(len(fields(kind)) for kind in KINDS)} generics, {len(found)} problems")
        return 1 if found else 0
    if options.command == "header":
        write_if_different(HEADER, header_text())
    elif options.command == "new":
        print(f"configurations: wrote {new(options.values, options.build)}")
    elif options.command == "cmake":
        write_if_different(pathlib.Path(options.values[0]), cmake_text(options.build, options.own))
    elif options.command == "list":
        found_all = [read(path, options.kind, options.build) for path in files(options.kind, options.build).values()]
        if options.json:
            print(json.dumps({c.name: c.description for c in found_all}, indent=1))
        else:
            for config in found_all:
                print(f"{config.name:14} {config.description}")
    else:
        for name in options.values:
            config = find(name, options.kind, options.build)
            content = config.values if options.command == "show" else config.generics()
            print(json.dumps(content, indent=1) if options.json else "\n".join(f"{k}={v}" for k, v in content.items()))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
