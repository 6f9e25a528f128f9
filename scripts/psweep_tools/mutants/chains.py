# SPDX-License-Identifier: Apache-2.0
"""Which tests look at an entity, in which order, and what each depends on.

Cheapest first: the entity's own test; then one small engine (or chip) under random tiles (or frames), for which only
that engine is built; then the tests of the whole engine or chip. Waves are left out of these builds, so the case of
test_psweep_top that opens some is, too; and so are the two largest engines. Last the original VHDL in GHDL, which
checks bounds and assertions: a recording of the mutant, replayed on the mutant."""
import hashlib
import re
from collections.abc import Callable
from dataclasses import dataclass

from ..evidence import sources
from .. import vhdl


@dataclass(frozen=True)
class Test:
    name: str
    build: str  # the build folder: 'all', engine_<configuration> or chip_<configuration> (workshop.py)
    targets: tuple[str, ...]
    command: tuple[str, ...]
    whole: bool  # of the whole engine or chip; else of the entity alone
    thorough: bool  # among those that only what the cheap ones let pass is worth
    starts: tuple[str, ...]  # C++ sources
    top: str  # entity that is simulated
    environment: tuple[tuple[str, str], ...] = ()
    files: tuple[str, ...] = ()  # other files that it depends on


def unit(name: str) -> Test:
    return Test(f"test_{name}", "all", (f"test_{name}",), (f"tb/units/test_{name}", "-a"), False, False,
                (f"tb/units/test_{name}.cpp",), name)


def _soak(config: str) -> Test:
    return Test(f"soak of {config}", f"engine_{config}", ("soak",), ("tb/soak/soak", "-a"), True, False,
                ("tb/soak/soak.cpp",), "psweep", (("PSWEEP_CONFIG", config), ("PSWEEP_TILES", "150")),
                (f"rtl/configs/engine/{config}.json", "tb/replay/engine.cpp.in", "scripts/psweep_tools/replay/"))


def _ctest(name: str, pattern: str, targets: tuple[str, ...], starts: tuple[str, ...], top: str) -> Test:
    command = ("ctest", "--no-tests=error", "--output-on-failure", "-R", pattern)
    return Test(name, "all", targets, command, True, True, starts, top, (), ("tb/replay/", "rtl/configs/engine/"))


def _program(folder: str, name: str, top: str, *arguments: str) -> Test:
    return Test(name, "all", (name,), (f"tb/{folder}/{name}", "-a", *arguments), True, True,
                (f"tb/{folder}/{name}.cpp",), top, (), ("rtl/configs/", "sw/verilated/"))


ENGINE = (
    _soak("tiny"),
    _soak("odd_2"),
    _program("engine", "test_control", "psweep"),
    _program("engine", "test_psweep", "psweep"),
    _program("engine", "test_rtl_engine", "psweep", "rtl engine: extreme*"),
    _ctest("elaboration", "^psweep: G_", (), (), "psweep"),
    _ctest("replay of engines", "^replay: (tiny|odd|rectified),", ("record_engine", "psweep_replay"),
           ("tb/replay/record_engine.cpp",), "psweep"),
)
_CHIP_FIRST = (
    Test("fuzz of tiny_min", "chip_tiny_min", ("test_fuzz",), ("tb/chip/test_fuzz", "-a"), True, False,
         ("tb/chip/test_fuzz.cpp",), "psweep_top", (("PSWEEP_FUZZ_CHIP", "tiny_min"), ("PSWEEP_FUZZ_FRAMES", "1000")),
         ("rtl/configs/engine/tiny_9.json", "rtl/configs/chip/tiny_min.json")),
    Test("pairs on tiny", "chip_tiny", ("test_psweep_top",),
         ("tb/chip/test_psweep_top", "-a",
          "chip: half duplex*,chip: reset in the*,chip: clocks of the*,chip: another host*"),
         True, False, ("tb/chip/test_psweep_top.cpp",), "psweep_top", (),
         ("rtl/configs/engine/tiny.json", "rtl/configs/chip/tiny.json")),
    _program("chip", "test_fuzz", "psweep_top"),
    _program("chip", "test_psweep_top", "psweep_top", "~chip: recording*"),
)
_CHIP_LAST = (
    _ctest("replay of the chip odd", "^replay: chip_odd,", ("record_chip", "psweep_top_replay"),
           ("tb/replay/record_chip.cpp",), "psweep_top"),
)
# Tests of the link alone, of the forecast, of speed and of the host; and those above.
_NOT_OF_THE_CHIP = {"test_link", "test_goodput", "test_link_plan_chip", "test_host", "test_fuzz", "test_psweep_top"}
# Packages, and what has its test elsewhere.
_OWN = {"psweep_pkg": ("address_generator", "ram_deep", "ram_2r", "storage", "updating"),
        "eth_pkg": ("mac_rx", "mac_tx", "packet_rx"),
        "link_pkg": ("packet_rx", "packet_tx", "row_buffer", "map_buffer")}


class Chains:
    """The chain of each entity of a copy of the tree, and the hash of what each test depends on."""

    def __init__(self, names: list[str], read: Callable[[str], str]) -> None:
        self._names, self._set = names, set(names)
        self._texts: dict[str, str] = {}
        self._read = read
        self.files = vhdl.listed(self.text("rtl/files.f"))
        self.order = list(self.files)
        others = sorted(m[1] for n in names if (m := re.fullmatch(r"tb/chip/(test_\w+)\.cpp", n)))
        chip = (*_CHIP_FIRST, *(_program("chip", n, "psweep_top") for n in others if n not in _NOT_OF_THE_CHIP),
                *_CHIP_LAST)
        engine = set(sources.rtl_closure("psweep", self.order, self._rtl))
        self.of: dict[str, tuple[Test, ...]] = {}
        for name in self.order:
            own = tuple(unit(n) for n in _OWN.get(name, (name,)) if f"tb/units/test_{n}.cpp" in self._set)
            # What the chip adds has no influence on the engine.
            self.of[name] = own + (ENGINE if name in engine else chip)
        self.of_chip = {name for name in self.order if name not in engine}
        self._hashes: dict[str, str] = {}

    def text(self, name: str) -> str:
        if name not in self._texts:
            self._texts[name] = self._read(name)
        return self._texts[name]

    def _rtl(self, entity: str) -> str:
        return self.text(f"rtl/{self.files[entity]}")

    def depends(self, test: Test) -> str:
        """Hash of the RTL and the sources of a test."""
        if test.name not in self._hashes:
            # By name alone: a file of the RTL that is moved is the same.
            rtl = sources.rtl_closure(test.top, self.order, self._rtl)
            parts = [f"rtl/{n}.vhd {sources.digest('a.vhd', self._rtl(n).encode('latin-1'))}" for n in sorted(rtl)]
            files = sources.include_closure(test.starts, self._set.__contains__, self.text)
            files += [n for n in self._names if n.startswith(tuple(test.files)) and test.files]
            parts += [f"{n} {sources.digest(n, self.text(n).encode('latin-1'))}" for n in sorted(set(files))]
            parts.append(repr((test.targets, test.command, test.environment)))
            if not test.whole:  # the generics of its models
                parts += [line for line in self.text("tb/units/CMakeLists.txt").splitlines() if test.top in line]
            self._hashes[test.name] = hashlib.sha256("\n".join(parts).encode()).hexdigest()[:16]
        return self._hashes[test.name]
