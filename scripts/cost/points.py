# SPDX-License-Identifier: Apache-2.0
"""The configurations of docs/cost.md, and the figures of others that they are compared with."""
import pathlib
import sys

sys.path.insert(1, str(pathlib.Path(__file__).resolve().parents[1]))

from psweep_tools import vhdl

# Each: what is measured (entity, unit of it, configuration or generics, no_dsp), in which families flat and with the
# hierarchy kept; tile, pixels, planes of its frame (for clocks, by the planner). 'quick': part of 'make sim'.
BANDS = {"config": "bands", "tile": (1092, 30)}
TILE = {"config": "tile", "tile": (256, 130)}
NG_TILE = {"G_LANES": 2, "G_PLANE_COLS": 131, "G_PLANE_ROWS": 101, "G_IMG_COLS": 234, "G_IMG_ROWS": 114}

POINTS = {
    "bands": {"title": "bands 44-30-13-13 (`rtl/configs/engine/bands.json`)", **BANDS, "default": True,
              "flat": ("xc6v", "xc5v", "ecp5", "ng_medium"), "units": ("xc6v",), "quick": ("xc6v",)},
    "bands_no_dsp": {"title": "bands, products in LUTs", **BANDS, "no_dsp": True, "default": True,
                     "flat": ("xc6v",)},
    "tile": {"title": "`tile`: 256 x 130 cells, buffer 362 x 144", **TILE, "default": True,
             "flat": ("xc6v",)},
    "tile_rectified": {"title": "`tile`, rectified", **TILE, "generics": {"G_RECTIFIED": 1}, "default": True,
                       "flat": ("xc6v",)},
    "tile_2": {"title": "`tile`, two lanes", **TILE, "generics": {"G_LANES": 2}, "default": True,
               "flat": ("xc6v", "ecp5")},
    "tile_4": {"title": "`tile`, four lanes", **TILE, "generics": {"G_LANES": 4}, "default": True,
               "flat": ("xc6v",)},
    "tile_2_mul": {"title": "`tile`, two lanes, G_DIVIDER = 1", **TILE, "generics": {"G_LANES": 2, "G_DIVIDER": 1},
                   "default": True, "flat": ("xc6v",)},
    "tile_4_mul": {"title": "`tile`, four lanes, G_DIVIDER = 1", **TILE, "generics": {"G_LANES": 4, "G_DIVIDER": 1},
                   "default": True, "flat": ("xc6v",)},
    "tile_mul": {"title": "`tile`, G_DIVIDER = 1", **TILE, "generics": {"G_DIVIDER": 1}, "flat": ("xc6v",)},
    "tile_split": {"title": "`tile`, G_SPLIT = 1", **TILE, "generics": {"G_SPLIT": 1}, "flat": ("xc6v", "ecp5")},
    "mbit": {"title": "117 x 93 cells, buffer 220 x 106: 1 Mbit", "tile": (117, 93), "default": True, "flat": ("xc6v",),
             "generics": {"G_IMG_COLS": 220, "G_IMG_ROWS": 106, "G_PLANE_COLS": 117, "G_PLANE_ROWS": 93}},
    "integer": {"title": "128 integer depths, 1950 x 1950 pixels, rectified, two lanes", "tile": (256, 130),
                "pixels": 1950, "planes": 128, "flat": ("xc6v",),
                "generics": {"G_IMG_COLS": 426, "G_IMG_ROWS": 144, "G_PLANES": 128, "G_INTERP_F": 0, "G_RECTIFIED": 1,
                             "G_LANES": 2}},
    "arbiter": {"title": "MAC, stack, arbiter; smallest buffers of rows and map", "entity": "arbiter", **BANDS,
                "tile": None, "generics": {"G_ROW_SLOTS": 2, "G_MAP_DEPTH": 704}, "default": True, "flat": ("xc6v",)},
    "arbiter_double": {"title": "MAC, stack, arbiter with both buffers of 44-30-13-13",
                       "entity": "arbiter", **BANDS, "tile": None,
                       "default": True, "flat": ("xc6v",)},
    "chip": {"title": "chip `psweep_top`: `tile`, one lane, both buffers", "entity": "psweep_top", **TILE,
             "default": True, "flat": ("xc6v",)},
    "chip_v5qv": {"title": "chip: `tile`, four lanes, both buffers", "entity": "psweep_top", **TILE,
                  "generics": {"G_LANES": 4}, "flat": ("xc5v",)},
    # Rings of rows and map as large as the blocks that are left: G_ROW_SLOTS, G_MAP_DEPTH.
    "chip_ng": {"title": "chip: 131 x 101 cells, buffer 234 x 114, two lanes, rings", "entity": "psweep_top",
                "tile": (131, 101), "link_mhz": 60, "generics": {**NG_TILE, "G_ROW_SLOTS": 17, "G_MAP_DEPTH": 5984},
                "flat": ("ng_medium",)},
    "similarity": {"title": "unit similarity of bands", "unit": "similarity", **BANDS, "tile": None,
                   "flat": ("xc6v", "ng_medium"), "quick": ("ng_medium",)},
    "similarity_tile": {"title": "unit similarity of `tile`", "unit": "similarity", **TILE, "tile": None,
                        "flat": ("xc6v",)},
    "updating": {"title": "unit updating of bands", "unit": "updating", **BANDS, "tile": None,
                 "flat": ("ng_medium",), "quick": ("ng_medium",)},
}
# One generic of `tile` at a time.
BITS = {"G_INTERP_F": (0, 1, 2, 3, 4), "G_MNCC_W": (10, 12, 13, 14, 16), "G_FRAC_W": (6, 8, 10)}
SHIPPED = {"G_INTERP_F": 2, "G_MNCC_W": 13, "G_FRAC_W": 8}
# Other generics of `tile`, for docs/psweep.md: value there, values tried.
SIZES = {"G_IMG_COLS": (362, (724,)), "G_IMG_ROWS": (144, (288,)), "G_PLANE_COLS": (256, (512,)),
         "G_PLANE_ROWS": (130, (260,)), "G_PLANES": (301, (602,)), "G_WINDOW": (13, (7, 21)), "G_PIX_W": (8, (10,)),
         "G_WEIGHT_W": (8, (10,))}
for _generic, _values in {**BITS, **{g: values for g, (_, values) in SIZES.items()}}.items():
    for _value in _values:
        if _value != SHIPPED.get(_generic):
            POINTS[f"{_generic}_{_value}"] = {"title": f"`tile`, {_generic} = {_value}", **TILE,
                                              "generics": {_generic: _value}, "flat": ("xc6v",)}

# Each entity with its generics as by default: the line 'cost' of its page.
for _entity in vhdl.Rtl().entities:
    POINTS[f"entity_{_entity}"] = {"title": f"entity {_entity}, generics as by default", "entity": _entity,
                                   "tile": None, "flat": ("xc6v",)}

# Engines that 'make pnr' places in an ECP5-85, whose multipliers have 18 x 18 bits: title, what is changed of `tile`.
PNR = {
    "`tile`": ("one lane", {"G_SPLIT": 1}),
    "`tile`, two lanes": ("two lanes, 256 x 130", {"G_SPLIT": 1, "G_LANES": 2}),
    "131 x 101 cells, two lanes": ("two lanes, 131 x 101", {"G_SPLIT": 1, **NG_TILE}),
}

# The paper's table 4 (Virtex-6 xc6vlx240t, ISE 14.7): LUT, FF, RAMB36, DSP.
PAPER_UNITS = {"control": (115, 51, 0, 0), "address_generator": (498, 427, 1, 0), "storage": (783, 812, 28, 0),
               "interpolation": (437, 594, 0, 8), "similarity": (2293, 2481, 12, 45), "updating": (1322, 1382, 59, 0)}
PAPER_ALL = (5448, 5747, 100, 53)
PAPER_CLOCKS = 515e6  # 3.1 s at 166 MHz (section 5.4)

# The paper's table 5, column by column: name, RAMB / LUT, PDS, PDS / LUT; then one more peer, with its source.
PEERS = (
    ("Lentaris 2012", "109 / 8.5K", "109 M", "13K", "the paper's table 5"),
    ("Tomasi 2012", "99 / 58K", "4,505 M", "78K", "the same"),
    ("Wang 2015", "about 830 / 222K", "10,472 M", "47K", "the same"),
    ("Cocorullo 2016", "32 / 70K", "1,253 M", "18K", "the same"),
    ("the paper", "100 / 5.5K", "222 M", "40K", "the same"),
    ("SAD5 of JPL: 5 x 5 window, 1280 x 960, 128 disparities, 39 Hz at 100 MHz", "80 / 52K", "6,134 M", "118K",
     "[NASA Tech Briefs, January 2011](https://www.techbriefs.com/component/content/article/tb/techbriefs/"
     "semiconductors-and-ics/8997): \"less than 80 BRAM, 52k Slices on a Virtex 5LX330T, 25 % and 24 % of resources\", "
     "a tenth of the columns as disparities; read as LUTs, of which 52k are 25 %"),
)

# Devices of the targets: LUT, FF, RAM, DSP.
V5QV = {"lut": 81920, "ram": 298, "dsp": 320}
NG_MEDIUM = {"lut": 34272, "ff": 32256, "ram": 56, "dsp": 112}
