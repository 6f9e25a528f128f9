// SPDX-License-Identifier: Apache-2.0
// Stands in for cdc_sync (width 5, 2 stages) in the proofs. clk ticks in the steps in which it is '1'. If d changed in
// the step before, the first stage takes the old or the new value of each bit, as the prover likes best.
module cdc_sync_model(input clk, input [4:0] d, output [4:0] q);
  (* anyseq *) wire [4:0] late;
  reg [4:0] past_d = 0, first = 0, second = 0;
  always @($global_clock) begin
    past_d <= d;
    if (clk) begin
      first <= (late & past_d) | (~late & d);
      second <= first;
    end
  end
  assign q = second;
endmodule
