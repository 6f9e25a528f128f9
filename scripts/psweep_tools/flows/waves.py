# SPDX-License-Identifier: Apache-2.0
"""The pictures of the page about waves: GTKWave, without a screen (Xvfb), on what `make waves` writes for a cell of
configuration tiny. Needs a built build/psweep-waves and the packages of group `waves`; half a minute.
Writes docs/images/waves_<stage>.png."""
from __future__ import annotations

import os
import pathlib
import re
import subprocess
import tempfile
import time

from .. import work
from ..paths import ROOT
from ..work import Failure

MOST = 80000  # bytes a picture may have
WIDTH = 1400
# Enough for all signals of a stage, or for those of its first groups where all of them are too many for a picture.
HEIGHT = {"psweep": 1720, "control": 1110, "address_generator": 1370, "storage": 1500, "interpolation": 1400,
          "similarity": 1400, "updating": 1400}


def picture(stage: str, folder: pathlib.Path) -> None:
    work.run(["build/psweep-waves", "--stage", stage, "--config", "tiny", "--out", folder, "--no-table"], quiet=True)
    save = next(iter(sorted(folder.glob(f"tiny_{stage}_*.gtkw"))))
    text = re.sub(r"^\[size\].*", f"[size] {WIDTH} {HEIGHT[stage]}", save.read_text(), flags=re.M)
    save.write_text(re.sub(r"^\[pos\].*", "[pos] 0 0", text, flags=re.M))
    options = [word for value in ("hide_sst on", "splash_disable on", "fontname_waves DejaVu Sans Mono 9",
                                  "fontname_signals DejaVu Sans Mono 9") for word in ("--rcvar", value)]
    with open(folder / "gtkwave.log", "wb") as log, subprocess.Popen(
            ["gtkwave", *options, "-S", "/dev/null", str(save)], stdout=log, stderr=log) as viewer:
        try:
            windows = work.output(["timeout", "30", "xdotool", "search", "--sync", "--onlyvisible", "--name",
                                   f"^GTKWave - .*tiny_{stage}"]).split()
            time.sleep(2)  # it draws when it has shown its window
            work.run(["import", "-window", windows[-1], folder / f"{stage}.png"])
        except Failure:
            raise Failure(f"GTKWave shows no window: {work.tail(folder / 'gtkwave.log', 1)}") from None
        finally:
            viewer.terminate()
    to = f"docs/images/waves_{stage}.png"
    # Without title and tool bar; few colours are enough.
    work.run(["convert", folder / f"{stage}.png", "-gravity", "north", "-chop", "0x110", "+repage", "+dither",
              "-colors", "32", "-depth", "8", "-strip", "-define", "png:compression-level=9", f"PNG8:{to}"])
    size = (ROOT / to).stat().st_size
    print(f"wave_pictures: {to}, {work.output(['identify', '-format', '%wx%h', to])}, {size} bytes", flush=True)
    if size > MOST:
        raise Failure(f"{to} is larger than {MOST} bytes")


def main(arguments: list[str]) -> int:
    options = work.parser("scripts/wave_pictures.sh", __doc__)
    options.add_argument("stages", nargs="*", metavar="STAGE", help=f"default: {' '.join(HEIGHT)}")
    stages = options.parse_args(arguments).stages or list(HEIGHT)
    for stage in stages:
        if stage not in HEIGHT:
            options.error(f"unknown stage '{stage}'; there are: {' '.join(HEIGHT)}")
    if not (ROOT / "build" / "psweep-waves").exists():
        raise Failure("build/psweep-waves is missing; make wave-pictures builds it")
    work.need("gtkwave", "Xvfb", "xdotool", "import", "convert", how="scripts/setup.sh waves installs it")
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        # The server tells the first display number that is free.
        read, write = os.pipe()
        with open(folder / "xvfb.log", "wb") as log, subprocess.Popen(
                ["Xvfb", "-displayfd", str(write), "-screen", "0", f"{WIDTH}x2000x24"], pass_fds=(write,), stdout=log,
                stderr=log) as server:
            try:
                os.close(write)
                with open(read) as display:
                    number = display.readline().strip()
                if not number:
                    raise Failure(f"Xvfb does not start: {work.tail(folder / 'xvfb.log', 1)}")
                os.environ["DISPLAY"] = f":{number}"
                for stage in stages:
                    picture(stage, folder)
            finally:
                server.terminate()
    return 0
