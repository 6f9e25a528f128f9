// SPDX-License-Identifier: Apache-2.0
// crc32_nibble of eth_pkg, for every register and every nibble: it equals four steps of the definition, one bit each
// (IEEE 802.3, 3.2.9, bits in the order of the wire); and a register followed by its own FCS ends as C_CRC_RESIDUE.
module proof(input [31:0] crc, input [3:0] nibble);
  wire [31:0] crc_next, residue;
  crc_step dut(.crc(crc), .nibble(nibble), .crc_next(crc_next), .residue(residue));

  // x^32+x^26+x^23+x^22+x^16+x^12+x^11+x^10+x^8+x^7+x^5+x^4+x^2+x+1; the coefficient of x^31 is bit 0 of the register.
  function [31:0] bit_step(input [31:0] register, input data);
    integer i;
    reg feedback;
    begin
      feedback = register[0] ^ data;
      for (i = 0; i < 31; i = i + 1) bit_step[i] = register[i + 1];
      bit_step[31] = 1'b0;
      if (feedback) begin
        bit_step[31 - 0] = bit_step[31 - 0] ^ 1'b1;
        bit_step[31 - 1] = bit_step[31 - 1] ^ 1'b1;
        bit_step[31 - 2] = bit_step[31 - 2] ^ 1'b1;
        bit_step[31 - 4] = bit_step[31 - 4] ^ 1'b1;
        bit_step[31 - 5] = bit_step[31 - 5] ^ 1'b1;
        bit_step[31 - 7] = bit_step[31 - 7] ^ 1'b1;
        bit_step[31 - 8] = bit_step[31 - 8] ^ 1'b1;
        bit_step[31 - 10] = bit_step[31 - 10] ^ 1'b1;
        bit_step[31 - 11] = bit_step[31 - 11] ^ 1'b1;
        bit_step[31 - 12] = bit_step[31 - 12] ^ 1'b1;
        bit_step[31 - 16] = bit_step[31 - 16] ^ 1'b1;
        bit_step[31 - 22] = bit_step[31 - 22] ^ 1'b1;
        bit_step[31 - 23] = bit_step[31 - 23] ^ 1'b1;
        bit_step[31 - 26] = bit_step[31 - 26] ^ 1'b1;
      end
    end
  endfunction
  wire [31:0] one = bit_step(crc, nibble[0]);
  wire [31:0] two = bit_step(one, nibble[1]);
  wire [31:0] three = bit_step(two, nibble[2]);
  wire [31:0] four = bit_step(three, nibble[3]);

  wire [31:0] register_0 = crc, register_1, register_2, register_3, register_4, register_5, register_6, register_7;
  wire [31:0] register_8;
  crc_step f0(.crc(register_0), .nibble(~crc[3:0]), .crc_next(register_1));
  crc_step f1(.crc(register_1), .nibble(~crc[7:4]), .crc_next(register_2));
  crc_step f2(.crc(register_2), .nibble(~crc[11:8]), .crc_next(register_3));
  crc_step f3(.crc(register_3), .nibble(~crc[15:12]), .crc_next(register_4));
  crc_step f4(.crc(register_4), .nibble(~crc[19:16]), .crc_next(register_5));
  crc_step f5(.crc(register_5), .nibble(~crc[23:20]), .crc_next(register_6));
  crc_step f6(.crc(register_6), .nibble(~crc[27:24]), .crc_next(register_7));
  crc_step f7(.crc(register_7), .nibble(~crc[31:28]), .crc_next(register_8));

  always @* begin
    assert (crc_next == four);
    assert (register_8 == residue);
  end
endmodule
