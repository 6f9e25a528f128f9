# SPDX-License-Identifier: Apache-2.0
"""Banks and pads of psweep_top on NG-MEDIUM: a template without locations, because no public board with MII is known.

To make a board of it: copy this folder, set "pads": "known" in board.json, list the banks in BANKS with their voltage,
and give every pad a 'location' ('IOB12_D09P': bank, pair, side), clocks on pads that reach a clock generator. The
oscillator of the development kit (25 MHz) is too slow for clk, which needs 30 MHz: a PLL would have to come between.
The 50 MHz in board.json are what is asked for: nobody knows yet what the device reaches.
Without locations the tool places the pads as it likes: good for resources and clock, not for a board.
Names: ports of the VHDL, bits in brackets. 'registered': the flip-flop next to the pad goes into it.
"""
BANKS = {}

_INPUT = {"standard": "LVCMOS", "weakTermination": "None"}
_OUTPUT = {"standard": "LVCMOS", "drive": "2mA", "slewRate": "Medium", "weakTermination": "None"}

PADS = {"clk": _INPUT, "arst_n": _INPUT, "mii_rx_clk": _INPUT, "mii_tx_clk": _INPUT}
for _name in ["mii_rxd[%d]" % i for i in range(4)] + ["mii_rx_dv", "mii_rx_er"]:
    PADS[_name] = dict(_INPUT, registered="I")
for _name in ["mii_txd[%d]" % i for i in range(4)] + ["mii_tx_en"]:
    PADS[_name] = dict(_OUTPUT, registered="O")
for _name in ["mii_crs", "mii_col", "phy_full_duplex", "phy_speed_100"] + ["straps[%d]" % i for i in range(8)]:
    PADS[_name] = _INPUT
for _name in ("led_session", "led_busy", "clock_missing[0]", "clock_missing[1]"):
    PADS[_name] = _OUTPUT
