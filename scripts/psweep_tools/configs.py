# SPDX-License-Identifier: Apache-2.0
"""The named configurations of engine and chip, and the generics that their keys become."""
from __future__ import annotations

import json
import pathlib

from .paths import RTL

ENGINE = {"img_cols": "G_IMG_COLS", "img_rows": "G_IMG_ROWS", "plane_cols": "G_PLANE_COLS",
          "plane_rows": "G_PLANE_ROWS", "planes": "G_PLANES", "window": "G_WINDOW", "pix_bits": "G_PIX_W",
          "weight_bits": "G_WEIGHT_W", "interp_frac": "G_INTERP_F", "mncc_bits": "G_MNCC_W", "frac_bits": "G_FRAC_W",
          "lanes": "G_LANES", "rectified": "G_RECTIFIED", "divider": "G_DIVIDER"}
CHIP = {"clk_khz": "G_CLK_KHZ", "chunk_bytes": "G_CHUNK_BYTES", "row_slots": "G_ROW_SLOTS",
        "map_depth": "G_MAP_DEPTH", "rx_slots": "G_RX_SLOTS", "session_ms": "G_SESSION_MS"}


class ConfigurationError(Exception):
    """A configuration that is not as it should be."""


def _take(path: pathlib.Path, keys: dict[str, str]) -> dict[str, int]:
    found = json.loads(path.read_text())
    missing = [key for key in keys if not isinstance(found.get(key), int)]
    if missing:
        raise ConfigurationError(f"{path.name}: no number for {', '.join(missing)}")
    return {generic: int(found[key]) for key, generic in keys.items()}


def engine(path: pathlib.Path) -> dict[str, int]:
    """Generics of psweep."""
    return _take(path, ENGINE)


def chip(path: pathlib.Path, rtl: pathlib.Path = RTL) -> dict[str, int]:
    """Generics of psweep_top: those of its engine and its own."""
    name = json.loads(path.read_text()).get("engine")
    return {**engine(rtl / "configs" / "engine" / f"{name}.json"), **_take(path, CHIP)}


def engines(rtl: pathlib.Path = RTL) -> list[pathlib.Path]:
    return sorted((rtl / "configs" / "engine").glob("*.json"))


def chips(rtl: pathlib.Path = RTL) -> list[pathlib.Path]:
    return sorted((rtl / "configs" / "chip").glob("*.json"))
