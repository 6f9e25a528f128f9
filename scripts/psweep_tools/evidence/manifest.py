# SPDX-License-Identifier: Apache-2.0
"""The kinds of evidence: how each is made, what it depends on, where its output lies.

Order: the most telling first; `make evidence` runs what is stale in this order. What a kind depends on are globs
(sources.expand): '@engine', '@chip' is the RTL. Its tables stand in the pages between `<!-- evidence: NAME -->` and
`<!-- /evidence -->`, NAME being the kind, or the kind, a dot and more (tables.py); the older markers `<!-- cost: X -->`
belong to 'cost' and 'pnr' and are filled by scripts/cost/report.py."""
from dataclasses import dataclass

BUILD = ("CMakeLists.txt", "scripts/cmake/**")
MODEL = ("sw/contract/**", "sw/golden/**", "sw/simulator/**", "tb/support/**", "rtl/configs/engine/**")
PLAN = ("sw/plan/**", "sw/contract/**", "sw/golden/**", "sw/scene/**")
BUILT = ("sw/verilated/**", "sw/desk/chip_model.hpp")
CHIP = ("@chip", *BUILD, *MODEL, *BUILT, "rtl/configs/chip/**", "sw/desk/**", "sw/net/**", "tb/chip/**",
        "!tb/chip/test_*", "!tb/chip/link_speed.cpp")
ENGINE = ("@engine", *BUILD, *MODEL, *BUILT, "tb/engine/engine_bench.hpp", "tb/engine/configurations.hpp",
          "sw/scene/stimulus.hpp")
REPLAY = ("tb/replay/**", "scripts/psweep_tools/replay/**", "!tb/replay/record_*")
UPSETS = "scripts/psweep_tools/upsets/**"


@dataclass(frozen=True)
class Kind:
    name: str
    command: tuple[str, ...]  # of make; each is run
    depends: tuple[str, ...]
    minutes: float  # about, on two idle cores
    output: str = ""  # file that is read; '': what the commands print
    # Valid although the command said that something is wrong: the table says so.
    speaks_for_itself: bool = False
    takes_a_copy: bool = False  # of the sources as it begins, so that edits during the run do no harm
    goes_on: str = ""  # how an interrupted run goes on; '': from the start
    needs: str = ""  # beyond the packages that `make` installs


KINDS: tuple[Kind, ...] = (
    Kind("mutants", ("mutants",),
         ("@chip", *BUILD, *MODEL, *BUILT, "rtl/configs/chip/**", "tb/units/**", "tb/engine/**", "tb/chip/**",
          "!tb/chip/link_speed.cpp", "!tb/chip/test_goodput.cpp", "!tb/chip/test_link*", "tb/replay/**", "tb/soak/**",
          "sw/desk/**", "sw/net/**", "sw/plan/**", "sw/scene/**", "scripts/psweep_tools/mutants/**",
          "scripts/mutants_equivalent.txt"),
         60, "build/evidence/mutants.json", speaks_for_itself=True, takes_a_copy=True,
         goes_on="mutant by mutant, also after edits: build/mutants/results.jsonl"),
    Kind("flips-chip", ("flips-chip",), (*CHIP, "tb/upsets/**", UPSETS, "scripts/flips_chip.py"), 15,
         "build/flips_chip.txt"),
    Kind("flips", ("flips",), (*ENGINE, "tb/upsets/flips.cpp", UPSETS, "scripts/flips.sh"), 2,
         "build/flips.txt"),
    Kind("soak", ("soak",), (*ENGINE, *REPLAY, "tb/soak/**", "scripts/psweep_tools/soak.py"), 4),
    Kind("formal", ("formal",),
         ("@chip", "tb/formal/**", "scripts/psweep_tools/formal.py"), 4),
    Kind("rules", ("rules",), (*ENGINE, *REPLAY, "tb/replay/record_engine.cpp", "scripts/psweep_tools/edits.py"), 2),
    Kind("cost", ("cost-update",),
         ("@chip", "rtl/configs/**", "sw/forecast/**", *PLAN,
          "scripts/cost/**", "!scripts/cost/baseline.json", "!scripts/cost/pnr.py", "!scripts/cost/report.py"),
         20, "scripts/cost/baseline.json", goes_on="count by count: build/cost/cache"),
    Kind("gates", ("sim-gates",),
         (*ENGINE, *REPLAY, "tb/replay/record_engine.cpp", "tb/gates/**", "scripts/psweep_tools/flows/gates.py",
          "scripts/cost/**", "!scripts/cost/baseline.json", "!scripts/cost/report.py", "!scripts/cost/points.py"), 6),
    Kind("link-speed", ("link-speed",),
         (*CHIP, "tb/chip/link_speed.cpp", "tb/chip/test_goodput.cpp", "sw/fast/**", *PLAN, "scripts/link_speed.sh"),
         8),
    Kind("sim-ghdl", ("sim-ghdl",), (*ENGINE, *REPLAY, "tb/replay/record_engine.cpp"), 6),
    Kind("link-table", ("link-table",), ("sw/forecast/link_*", *PLAN), 2),
    Kind("shape-table", ("shape-table",), ("sw/forecast/shape_table.cpp", *PLAN, "scripts/psweep_tools/shapes.py"), 1),
    Kind("sweep", ("sweep",),
         (*ENGINE, *REPLAY, "tb/soak/**", "scripts/psweep_tools/sweep.py", "scripts/configurations.py"), 6,
         "build/sweep/results.txt"),
    Kind("coverage-lines", ("coverage-lines",),
         (*CHIP, "tb/replay/**",
          "scripts/psweep_tools/coverage/**", "scripts/coverage_holes.txt"),
         20, "build/coverage/lines.txt", needs="GHDL 4 or newer (Debian 13)"),
    Kind("coverage-toggles", ("coverage-toggles",),
         ("@chip", *BUILD, *MODEL, *BUILT, "rtl/configs/chip/**", "tb/units/**", "tb/engine/**", "tb/chip/**",
          "sw/desk/**", "sw/net/**", "scripts/psweep_tools/coverage/**"),
         35, "build/coverage/toggles.txt"),
    Kind("accuracy", ("accuracy",),
         ("sw/eval/**", "sw/app/accuracy.cpp", "sw/scene/**", "sw/reference/**", "sw/contract/**", "sw/golden/**",
          "sw/fast/**", "sw/core/**"), 30),
    Kind("pnr", ("pnr-update",), ("@engine", "rtl/configs/engine/tile.json", "scripts/cost/**",
                                  "!scripts/cost/baseline.json", "!scripts/cost/report.py"), 60,
         "scripts/cost/baseline.json"),
    Kind("fresh-machine", ("fresh-machine SUITE=bookworm", "fresh-machine SUITE=trixie"),
         ("@chip", "CMakeLists.txt", "Makefile", "tb/**", "sw/**", "scripts/setup.sh", "scripts/packages.txt",
          "scripts/psweep_tools/**"), 50, needs="root and debootstrap"),
)
BY_NAME = {kind.name: kind for kind in KINDS}


def chosen(names: list[str]) -> list[Kind]:
    """Kinds by name; 'coverage' means all that begin with 'coverage-' (if there is none of that very name)."""
    out: list[Kind] = []
    for name in names:
        found = [BY_NAME[name]] if name in BY_NAME else [k for k in KINDS if k.name.startswith(f"{name}-")]
        if not found:
            raise ValueError(f"no kind of evidence '{name}': " + ", ".join(BY_NAME))
        out += [kind for kind in found if kind not in out]
    return [kind for kind in KINDS if kind in out]
