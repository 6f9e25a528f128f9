# SPDX-License-Identifier: Apache-2.0
# Clocks, crossings and MII of psweep_top in SDC, with commands that most tools know. Times in ns. Why each is needed:
# ../crossings.md. Set clk_period to 1e6 / G_CLK_KHZ before reading this file, else it is 10 ns.
if {![info exists clk_period]} {
  set clk_period 10.0
}
# 100 Mbit/s; at 10 Mbit/s the PHY's clocks are ten times slower, which needs no other numbers.
set mii_period 40.0

create_clock -name clk -period $clk_period [get_ports clk]
create_clock -name mii_rx_clk -period $mii_period [get_ports mii_rx_clk]
create_clock -name mii_tx_clk -period $mii_period [get_ports mii_tx_clk]

# Crossings: no phase between the clocks, but no bit later than its neighbours by more than one period of the faster
# clock. Tools that know it want -datapath_only (Vivado) or -ignore_clock_latency (OpenSTA) here; without, the clocks'
# own delays count, which errs on the safe side or asks for too much.
set crossing [expr {min($clk_period, $mii_period)}]
foreach {from to} {
  mii_rx_clk clk         clk mii_rx_clk
  mii_tx_clk clk         clk mii_tx_clk
} {
  set_max_delay $crossing -from [get_clocks $from] -to [get_clocks $to]
  set_false_path -hold -from [get_clocks $from] -to [get_clocks $to]
}
# From one MII clock to the other goes one level alone, into cdc_sync of mac_rx.
set_false_path -from [get_clocks mii_rx_clk] -to [get_clocks mii_tx_clk]
set_false_path -from [get_clocks mii_tx_clk] -to [get_clocks mii_rx_clk]

# Inputs without a clock: into cdc_sync, reset_sync, or constant after reset.
set_false_path -from [get_ports {arst_n mii_crs mii_col phy_full_duplex phy_speed_100}]
set_false_path -from [get_ports {straps[*]}]
# Outputs for the eye, and for waves.
set_false_path -to [get_ports {led_session led_busy clock_missing[*]}]
set_false_path -to [get_ports {dbg_*}]

# MII (IEEE 802.3, 22.3): RXD, RX_DV and RX_ER are stable from 10 ns before to 10 ns after the rising edge at the MAC;
# TXD and TX_EN have to change 0 to 25 ns after it. Delays of the board's wires come on top.
set mii_in [get_ports {mii_rxd[*] mii_rx_dv mii_rx_er}]
set_input_delay -clock mii_rx_clk -max [expr {$mii_period - 10.0}] $mii_in
set_input_delay -clock mii_rx_clk -min 10.0 $mii_in
set mii_out [get_ports {mii_txd[*] mii_tx_en}]
set_output_delay -clock mii_tx_clk -max [expr {$mii_period - 25.0}] $mii_out
set_output_delay -clock mii_tx_clk -min 0.0 $mii_out
