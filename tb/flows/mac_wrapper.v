// SPDX-License-Identifier: Apache-2.0
// mac_rx and mac_tx side by side for the cocotb bench. The frame RAM of mac_tx (two slots of 2048 bytes, latency 1) is
// in here and written by the bench; everything else goes straight to the ports.
`timescale 1ns / 1ps
module mac_wrapper (
  input             clk,
  input             rst,
  input       [3:0] rx_d,
  input             rx_dv,
  input             rx_er,
  output            m_valid,
  output            m_last,
  output      [7:0] m_data,
  input             full_duplex,
  input             crs,
  input             col,
  output      [3:0] tx_d,
  output            tx_en,
  input       [1:0] f_request,
  input      [10:0] f_length_0,
  input      [10:0] f_length_1,
  output      [1:0] f_done,
  output      [1:0] f_result_0,
  output      [1:0] f_result_1,
  output            collisions
);

  reg [7:0] memory[0:4095];
  reg [7:0] r_data;
  wire [11:0] r_addr;
  integer i;

  initial for (i = 0; i < 4096; i = i + 1) memory[i] = 8'h00;

  always @(posedge clk) r_data <= memory[r_addr];

  mac_rx u_rx (
    .clk(clk),
    .rst(rst),
    .mii_rxd(rx_d),
    .mii_rx_dv(rx_dv),
    .mii_rx_er(rx_er),
    .m_valid(m_valid),
    .m_ready(1'b1),
    .m_last(m_last),
    .m_data(m_data)
  );

  mac_tx u_tx (
    .clk(clk),
    .rst(rst),
    .full_duplex(full_duplex),
    .mii_crs(crs),
    .mii_col(col),
    .mii_txd(tx_d),
    .mii_tx_en(tx_en),
    .f_request(f_request),
    .f_length_0(f_length_0),
    .f_length_1(f_length_1),
    .f_done(f_done),
    .f_result_0(f_result_0),
    .f_result_1(f_result_1),
    .collisions(collisions),
    .r_addr(r_addr),
    .r_data(r_data)
  );

endmodule
