// SPDX-License-Identifier: Apache-2.0
// stream_fifo with 3 bits, resets at any time, for ever after the first one:
//   - never more than two words inside, none taken out that was not put in
//   - word number n out is word number n in, for every n
//   - a word that is shown stays until it is taken; ready does not fall without a word having come
module proof(input clk, rst, s_tvalid, m_tready, input [2:0] s_tdata);
  wire s_tready, m_tvalid;
  wire [2:0] m_tdata;
  stream_fifo dut(.clk(clk), .rst(rst), .s_tvalid(s_tvalid), .s_tready(s_tready), .s_tdata(s_tdata),
                 .m_tvalid(m_tvalid), .m_tready(m_tready), .m_tdata(m_tdata));

  (* anyconst *) wire [2:0] chosen;  // numbers are counted modulo 8, and at most 2 are inside
  reg begun = 0, held = 0, was_ready = 0, came = 0;
  reg [2:0] in = 0, out = 0, word = 0, shown = 0;
  wire [2:0] inside = in - out;
  always @($global_clock) if (clk) begin
    if (rst) begun <= 1;
    in <= rst ? 0 : in + (s_tvalid && s_tready);
    out <= rst ? 0 : out + (m_tvalid && m_tready);
    if (s_tvalid && s_tready && in == chosen) word <= s_tdata;
    held <= m_tvalid && !m_tready && !rst;
    shown <= m_tdata;
    was_ready <= s_tready && !rst;
    came <= s_tvalid;
  end
  always @* if (begun) begin
    assert (inside <= 2);
    assert (m_tvalid == (inside > 0));
    assert (s_tready == (inside < 2));
    if (m_tvalid && out == chosen) assert (m_tdata == word);
    if (held) assert (m_tvalid && m_tdata == shown);
    if (was_ready && !came) assert (s_tready);
  end
endmodule
