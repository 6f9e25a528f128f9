# SPDX-License-Identifier: Apache-2.0
# Compile order, relative to this folder.
psweep_pkg.vhd
ram_sdp.vhd
stream_reg.vhd
control.vhd
address_generator.vhd
storage.vhd
interpolation.vhd
delay_line.vhd
divider.vhd
similarity.vhd
updating.vhd
psweep.vhd
cdc_sync.vhd
reset_sync.vhd
ram_dc.vhd
async_fifo.vhd
packet_rx.vhd
packet_tx.vhd
row_buffer.vhd
map_buffer.vhd
counters.vhd
scheduler.vhd
responder.vhd
