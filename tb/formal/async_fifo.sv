// SPDX-License-Identifier: Apache-2.0
// async_fifo with 4 words of 1 bit, two clocks that tick in the steps they like (w_clk, r_clk = '1'), resets at any
// time, and synchronisers that may take an old or a new bit (cdc_sync_model.sv). From power-on with all registers zero,
// for ever:
//   - a word is written only into a free place, and read only where one was written: the same, in the same order
//   - while a side works, what it sees of the other makes the FIFO no emptier (writer) or fuller (reader) than it is
//   - a pointer moves by one gray step, or jumps to zero while the other side stands still
// The ports from w_take on are internal signals, brought out by scripts/formal.sh.
module proof(input w_clk, w_rst, w_valid, w_data, r_clk, r_rst, r_ready);
  wire w_ready, r_valid, r_data, w_take, r_take, w_hold, r_hold;
  wire [2:0] w_gray, r_gray, w_gray_at_r, r_gray_at_w;
  async_fifo dut(
      .w_clk(w_clk), .w_rst(w_rst), .w_valid(w_valid), .w_ready(w_ready), .w_data(w_data), .r_clk(r_clk), .r_rst(r_rst),
      .r_valid(r_valid), .r_ready(r_ready), .r_data(r_data), .w_take(w_take), .r_take(r_take),
      .w_hold(w_hold), .r_hold(r_hold),
      .w_gray(w_gray), .r_gray(r_gray), .w_gray_at_r(w_gray_at_r), .r_gray_at_w(r_gray_at_w));

  function [2:0] count(input [2:0] gray);
    count = {gray[2], gray[2] ^ gray[1], gray[2] ^ gray[1] ^ gray[0]};
  endfunction
  function one_bit(input [2:0] change);
    one_bit = change == 1 || change == 2 || change == 4;
  endfunction
  wire [2:0] held = count(w_gray) - count(r_gray);
  wire [2:0] held_at_w = count(w_gray) - count(r_gray_at_w);
  wire [2:0] held_at_r = count(w_gray_at_r) - count(r_gray);

  reg [3:0] words = 0;  // by number
  wire [2:0] w_count = count(w_gray), r_count = count(r_gray);
  always @($global_clock) if (w_clk && w_take) words[w_count[1:0]] <= w_data;

  reg begun = 0, past_w_hold = 0, past_r_hold = 0;
  reg [2:0] past_w_gray = 0, past_r_gray = 0;
  always @($global_clock) begin
    begun <= 1;
    past_w_hold <= w_hold;
    past_r_hold <= r_hold;
    past_w_gray <= w_gray;
    past_r_gray <= r_gray;
  end

  always @* begin
    if (w_take) assert (held < 4);
    if (r_take) assert (held > 0 && held <= 4 && r_data == words[r_count[1:0]]);
    if (!w_hold) assert (held <= held_at_w && held_at_w <= 4);
    if (!r_hold) assert (held_at_r <= held && held <= 4);
    if (begun && w_gray != past_w_gray)
      assert (past_r_hold && w_gray == 0 ||
              one_bit(w_gray ^ past_w_gray) && w_count == count(past_w_gray) + 3'd1);
    if (begun && r_gray != past_r_gray)
      assert (past_w_hold && r_gray == 0 ||
              one_bit(r_gray ^ past_r_gray) && r_count == count(past_r_gray) + 3'd1);
  end
endmodule
