// SPDX-License-Identifier: Apache-2.0
// stream_fifo with 3 bits and 3 places, resets at any time, for ever after the first one:
//   - never more than three words inside, none taken out that was not put in; ready means a free place
//   - word number n out is word number n in, for every n
//   - a word that is shown stays until it is taken; one that has been inside for a clock is shown
//   - 'more' says whether there are words besides the one shown, 'few' whether less than two were taken a clock ago
module proof(input clk, rst, s_tvalid, m_tready, input [2:0] s_tdata);
  wire s_tready, m_tvalid, few, more;
  wire [2:0] m_tdata;
  stream_fifo dut(.clk(clk), .rst(rst), .s_tvalid(s_tvalid), .s_tready(s_tready), .s_tdata(s_tdata), .few(few),
                  .more(more), .m_tvalid(m_tvalid), .m_tready(m_tready), .m_tdata(m_tdata));

  (* anyconst *) wire [2:0] chosen;  // numbers are counted modulo 8, and at most 3 are inside
  reg begun = 0, held = 0, waits = 0, were_few = 1;
  reg [2:0] in = 0, out = 0, word = 0, shown = 0;
  wire [2:0] inside = in - out;
  always @($global_clock) if (clk) begin
    if (rst) begun <= 1;
    in <= rst ? 0 : in + (s_tvalid && s_tready);
    out <= rst ? 0 : out + (m_tvalid && m_tready);
    if (s_tvalid && s_tready && in == chosen) word <= s_tdata;
    held <= m_tvalid && !m_tready && !rst;
    shown <= m_tdata;
    waits <= !rst && inside > (m_tvalid && m_tready);
    were_few <= rst || inside < 2;
  end
  always @* if (begun) begin
    assert (inside <= 3);
    assert (s_tready == (inside < 3));
    if (m_tvalid) assert (inside > 0);
    if (waits) assert (m_tvalid);
    if (m_tvalid && out == chosen) assert (m_tdata == word);
    if (held) assert (m_tvalid && m_tdata == shown);
    assert (more == (inside > m_tvalid));
    assert (few == were_few);
  end
endmodule
