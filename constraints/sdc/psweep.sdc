# SPDX-License-Identifier: Apache-2.0
# The engine alone: one clock, synchronous reset, ports that are wires to registers of the same clock. Time in ns.
# Set clk_period before reading this file, else it is 10 ns.
if {![info exists clk_period]} {
  set clk_period 10.0
}
create_clock -name clk -period $clk_period [get_ports clk]

set_input_delay -clock clk 0.0 [get_ports {
  rst s_cfg_tvalid s_cfg_tdata[*] s_pix_tvalid s_pix_tdata[*] s_pix_tlast m_map_tready
}]
set_output_delay -clock clk 0.0 [get_ports {
  s_cfg_tready s_pix_tready m_map_tvalid m_map_tdata[*] m_map_tlast
  busy state[*] errors[*] error_count[*] tiles_done[*] tiles_dropped[*] window_errors[*] tile_clocks[*]
}]
# Outputs for waves.
set_false_path -to [get_ports {dbg_*}]
