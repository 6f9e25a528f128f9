# SPDX-License-Identifier: Apache-2.0
"""Clocks, crossings and MII for NanoXplore's nxpython: the statements of ../sdc/<top>.sdc in its own methods.

apply(project, top, clk_ns, pads): clk_ns is the period of clk, pads the names of the pads (psweep_top only). Methods
and arguments are those of NanoXplore's page "NX Design Constraint" (createClock, setMaxDelay, setFalsePath,
setInputDelay, setOutputDelay; times in ns since nxpython); no release of the tool has run this file here. Whether
setMaxDelay counts the clocks' own delays is not said there: if it does, it errs on the safe side. Why each is needed:
../crossings.md.
"""
MII_NS = 40.0  # 100 Mbit/s; slower at 10 Mbit/s, which needs no other numbers


def port(name):
    return "getPort({})".format(name)


def apply(project, top, clk_ns, pads=()):
    if top == "psweep_top":
        rx, tx = "mii_rx_clk", "mii_tx_clk"
        asynchronous = ("arst_n", "mii_crs", "mii_col", "phy_full_duplex", "phy_speed_100", "straps")
        free_outputs = ("led_session", "led_busy", "clock_missing")
    elif top == "arbiter":
        rx, tx = "rx_clk", "tx_clk"
        asynchronous = free_outputs = ()  # without pads
    else:
        clock(project, "clk", clk_ns)
        return

    clock(project, "clk", clk_ns)
    clock(project, rx, MII_NS)
    clock(project, tx, MII_NS)
    bound = min(clk_ns, MII_NS)
    for source, target in ((rx, "clk"), ("clk", rx), (tx, "clk"), ("clk", tx)):
        project.setMaxDelay(source="getRegistersByClock({})".format(source),
                            target="getRegistersByClock({})".format(target), delay=bound)
    for source, target in ((rx, tx), (tx, rx)):
        project.setFalsePath(source="getRegistersByClock({})".format(source),
                             target="getRegistersByClock({})".format(target))
    for pad in pads:
        name = pad.split("[")[0]
        if name in asynchronous:
            project.setFalsePath(source=port(pad), target="")
        elif name in free_outputs:
            project.setFalsePath(source="", target=port(pad))
        elif name in ("mii_rxd", "mii_rx_dv", "mii_rx_er"):
            # Stable from 10 ns before to 10 ns after the edge.
            project.setInputDelay(clock="getClock({})".format(rx), clockMode="rise", min=10.0, max=MII_NS - 10.0,
                                  ports=port(pad))
        elif name in ("mii_txd", "mii_tx_en"):
            # To be sent within 25 ns after it.
            project.setOutputDelay(clock="getClock({})".format(tx), clockMode="rise", min=0.0, max=MII_NS - 25.0,
                                   ports=port(pad))
        elif name not in ("clk", rx, tx):
            raise ValueError("timing.py: pad {} has no constraint".format(pad))


def clock(project, name, period):
    project.createClock(target="getClockNet({})".format(name), name=name, period=period, rising=0, falling=period / 2)
