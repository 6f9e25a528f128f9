# SPDX-License-Identifier: Apache-2.0
# Clocks, crossings and MII of the arbiter alone, for estimates without the engine; its other ports are wires. As
# psweep_top.sdc, which says why. Times in ns. Set clk_period to 1e6 / G_CLK_KHZ before reading this file, else 10 ns.
if {![info exists clk_period]} {
  set clk_period 10.0
}
set mii_period 40.0

create_clock -name clk -period $clk_period [get_ports clk]
create_clock -name rx_clk -period $mii_period [get_ports rx_clk]
create_clock -name tx_clk -period $mii_period [get_ports tx_clk]

set crossing [expr {min($clk_period, $mii_period)}]
foreach {from to} {
  rx_clk clk         clk rx_clk
  tx_clk clk         clk tx_clk
} {
  set_max_delay $crossing -from [get_clocks $from] -to [get_clocks $to]
  set_false_path -hold -from [get_clocks $from] -to [get_clocks $to]
}
set_false_path -from [get_clocks rx_clk] -to [get_clocks tx_clk]
set_false_path -from [get_clocks tx_clk] -to [get_clocks rx_clk]

# Inputs without a clock: into cdc_sync, or constant after reset.
set_false_path -from [get_ports {mii_crs mii_col pin_full_duplex pin_speed_100}]
set_false_path -from [get_ports {own_mac[*] own_ip[*]}]

set mii_in [get_ports {mii_rxd[*] mii_rx_dv mii_rx_er}]
set_input_delay -clock rx_clk -max [expr {$mii_period - 10.0}] $mii_in
set_input_delay -clock rx_clk -min 10.0 $mii_in
set mii_out [get_ports {mii_txd[*] mii_tx_en}]
set_output_delay -clock tx_clk -max [expr {$mii_period - 25.0}] $mii_out
set_output_delay -clock tx_clk -min 0.0 $mii_out

# Resets come from a reset_sync of their clock; the engine's side is registers of clk: no delay outside.
set_input_delay -clock rx_clk 0.0 [get_ports rx_rst]
set_input_delay -clock tx_clk 0.0 [get_ports tx_rst]
set_input_delay -clock clk 0.0 [get_ports {
  rst m_pix_tready s_map_tvalid s_map_tdata[*] s_map_tlast engine_busy engine_state[*] errors[*] error_count[*]
  tiles_done[*] tiles_dropped[*] window_errors[*] tile_clocks[*]
}]
set_output_delay -clock clk 0.0 [get_ports {
  session clock_missing[*] m_cfg_tvalid m_cfg_tdata[*] m_pix_tvalid m_pix_tdata[*] m_pix_tlast s_map_tready
}]
