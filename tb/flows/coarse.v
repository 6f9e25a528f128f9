// SPDX-License-Identifier: Apache-2.0
// For scripts/flows/sta.py: arithmetic as one exclusive-or of all operands. Timing checks of constraints want to know
// which register reaches which, not what is calculated; adders and multipliers would take minutes.
(* techmap_celltype = "$add $sub $mul $lt $le $gt $ge $eq $ne" *)
module coarse (A, B, Y);
  parameter A_SIGNED = 0;
  parameter B_SIGNED = 0;
  parameter A_WIDTH = 1;
  parameter B_WIDTH = 1;
  parameter Y_WIDTH = 1;
  input [A_WIDTH-1:0] A;
  input [B_WIDTH-1:0] B;
  output [Y_WIDTH-1:0] Y;
  assign Y = {Y_WIDTH{^{A, B}}};
endmodule
