// SPDX-License-Identifier: Apache-2.0
// Models of RAMB18E1 and RAMB36E1, which Yosys' cells_sim.v declares only: true and simple dual port, widths 1 to 72,
// byte enables, write modes, output register. Contents start as x; a word that one port reads while the other writes it
// reads as x, and so does a read at an unknown address; a write at an unknown address makes all words x. A reset of
// the output, cascades and start values are not modelled: used ones give x (scripts/sim_gates.sh refuses start values).
`timescale 1ns / 1ps

// One port of 2**ADDRESS data bits with a parity bit for each 8: DATA wires of data, DATA / 8 of parity and enables.
module block_ram #(
    parameter ADDRESS = 14, DATA = 16, READ_A = 0, READ_B = 0, WRITE_A = 0, WRITE_B = 0, REG_A = 0, REG_B = 0,
    parameter MODE_A = "WRITE_FIRST", MODE_B = "WRITE_FIRST") (
    input clk_a, input en_a, input ce_a, input [ADDRESS-1:0] addr_a, input [DATA-1:0] di_a, input [DATA/8-1:0] dip_a,
    input [DATA/8-1:0] we_a, output [DATA-1:0] do_a, output [DATA/8-1:0] dop_a,
    input clk_b, input en_b, input ce_b, input [ADDRESS-1:0] addr_b, input [DATA-1:0] di_b, input [DATA/8-1:0] dip_b,
    input [DATA/8-1:0] we_b, output [DATA-1:0] do_b, output [DATA/8-1:0] dop_b);
  localparam PARITY = DATA / 8, WORDS = 1 << (ADDRESS - 3);
  reg [8:0] memory[0:WORDS-1];  // parity, byte
  reg [DATA+PARITY-1:0] now_a, late_a, now_b, late_b;

  // Data bits of a port of this width with its parity.
  function integer data_bits(input integer width);
    data_bits = width >= 9 ? width / 9 * 8 : width;
  endfunction

  function [DATA+PARITY-1:0] word(input [ADDRESS-1:0] address, input integer width);
    integer j, first;
    begin
      word = 0;
      first = address / data_bits(width) * data_bits(width);
      for (j = 0; j < data_bits(width); j = j + 1) word[j] = memory[(first + j) >> 3][(first + j) & 7];
      if (width >= 9) for (j = 0; j < data_bits(width) / 8; j = j + 1) word[DATA+j] = memory[(first >> 3) + j][8];
      if (^address === 1'bx) word = {DATA + PARITY{1'bx}};
    end
  endfunction

  // Do the words at these addresses share a bit?
  function meet(input [ADDRESS-1:0] one, input integer one_width, input [ADDRESS-1:0] two, input integer two_width);
    integer width;
    begin
      width = data_bits(one_width) > data_bits(two_width) ? data_bits(one_width) : data_bits(two_width);
      meet = ^one === 1'bx || ^two === 1'bx || one / width == two / width;
    end
  endfunction

  task write(input [ADDRESS-1:0] address, input integer width, input [DATA-1:0] data, input [PARITY-1:0] parity,
             input [PARITY-1:0] enables);
    integer j, first;
    begin
      if (^address === 1'bx || ^enables === 1'bx) begin
        for (j = 0; j < WORDS; j = j + 1) memory[j] = 9'hx;
      end else begin
        first = address / data_bits(width) * data_bits(width);
        for (j = 0; j < data_bits(width); j = j + 1)
          if (enables[width >= 9 ? j / 8 : 0]) memory[(first + j) >> 3][(first + j) & 7] = data[j];
        if (width >= 9)
          for (j = 0; j < data_bits(width) / 8; j = j + 1)
            if (enables[j]) memory[(first >> 3) + j][8] = parity[j];
      end
    end
  endtask

  // What a port shows of its own write.
  function [DATA+PARITY-1:0] merged(input [DATA+PARITY-1:0] old, input integer width, input [DATA-1:0] data,
                                    input [PARITY-1:0] parity, input [PARITY-1:0] enables);
    integer j;
    begin
      merged = old;
      for (j = 0; j < DATA; j = j + 1) if (enables[width >= 9 ? j / 8 : 0]) merged[j] = data[j];
      for (j = 0; j < PARITY; j = j + 1) if (enables[j]) merged[DATA+j] = parity[j];
    end
  endfunction

  // Reads see the words before the edge; writes follow them in the same step.
  wire write_a = WRITE_A != 0 && en_a !== 0 && |we_a !== 0;
  wire write_b = WRITE_B != 0 && en_b !== 0 && |we_b !== 0;
  always @(posedge clk_a) begin
    if (ce_a) late_a <= now_a;
    if (READ_A != 0 && en_a !== 0) begin
      if (en_a !== 1 || (write_b && meet(addr_a, READ_A, addr_b, WRITE_B))) now_a <= {DATA + PARITY{1'bx}};
      else if (!write_a || MODE_A == "READ_FIRST") now_a <= word(addr_a, READ_A);
      else if (MODE_A == "WRITE_FIRST")
        now_a <= READ_A == WRITE_A ? merged(word(addr_a, READ_A), WRITE_A, di_a, dip_a, we_a) : {DATA + PARITY{1'bx}};
    end
  end
  always @(posedge clk_b) begin
    if (ce_b) late_b <= now_b;
    if (READ_B != 0 && en_b !== 0) begin
      if (en_b !== 1 || (write_a && meet(addr_b, READ_B, addr_a, WRITE_A))) now_b <= {DATA + PARITY{1'bx}};
      else if (!write_b || MODE_B == "READ_FIRST") now_b <= word(addr_b, READ_B);
      else if (MODE_B == "WRITE_FIRST")
        now_b <= READ_B == WRITE_B ? merged(word(addr_b, READ_B), WRITE_B, di_b, dip_b, we_b) : {DATA + PARITY{1'bx}};
    end
  end
  reg [ADDRESS-1:0] waddr_a, waddr_b;
  reg [DATA-1:0] wdata_a, wdata_b;
  reg [PARITY-1:0] wparity_a, wparity_b, wenable_a = 0, wenable_b = 0;
  event store_a, store_b;
  always @(posedge clk_a) if (write_a) begin
    waddr_a = addr_a; wdata_a = di_a; wparity_a = dip_a; wenable_a = we_a & {PARITY{en_a}};
    -> store_a;
  end
  always @(posedge clk_b) if (write_b) begin
    waddr_b = addr_b; wdata_b = di_b; wparity_b = dip_b; wenable_b = we_b & {PARITY{en_b}};
    -> store_b;
  end
  // A moment later, when all reads of this edge are done.
  always @(store_a) begin #0.1 write(waddr_a, WRITE_A, wdata_a, wparity_a, wenable_a); end
  always @(store_b) begin #0.1 write(waddr_b, WRITE_B, wdata_b, wparity_b, wenable_b); end

  assign {dop_a, do_a} = REG_A != 0 ? late_a : now_a;
  assign {dop_b, do_b} = REG_B != 0 ? late_b : now_b;
endmodule

module RAMB18E1 #(
    parameter DOA_REG = 0, DOB_REG = 0, RAM_MODE = "TDP", READ_WIDTH_A = 0, READ_WIDTH_B = 0, WRITE_WIDTH_A = 0,
    parameter WRITE_WIDTH_B = 0, WRITE_MODE_A = "WRITE_FIRST", WRITE_MODE_B = "WRITE_FIRST", SRVAL_A = 0, SRVAL_B = 0,
    parameter INIT_A = 0, INIT_B = 0, SIM_DEVICE = "VIRTEX6", RDADDR_COLLISION_HWCONFIG = "DELAYED_WRITE") (
    input CLKARDCLK, CLKBWRCLK, ENARDEN, ENBWREN, REGCEAREGCE, REGCEB, RSTRAMARSTRAM, RSTRAMB, RSTREGARSTREG, RSTREGB,
    input [13:0] ADDRARDADDR, ADDRBWRADDR, input [15:0] DIADI, DIBDI, input [1:0] DIPADIP, DIPBDIP, WEA,
    input [3:0] WEBWE, output [15:0] DOADO, DOBDO, output [1:0] DOPADOP, DOPBDOP);
  wire reset = (RSTRAMARSTRAM | RSTRAMB | RSTREGARSTREG | RSTREGB) !== 0;
  generate
    if (RAM_MODE == "SDP") begin
      wire [31:0] data;
      wire [3:0] parity;
      block_ram #(.ADDRESS(14), .DATA(32), .READ_A(READ_WIDTH_A), .WRITE_B(WRITE_WIDTH_B), .REG_A(DOA_REG)) ram (
        .clk_a(CLKARDCLK), .en_a(ENARDEN), .ce_a(REGCEAREGCE), .addr_a(ADDRARDADDR), .di_a(32'd0), .dip_a(4'd0),
        .we_a(4'd0), .do_a(data), .dop_a(parity), .clk_b(CLKBWRCLK), .en_b(ENBWREN), .ce_b(1'b0), .addr_b(ADDRBWRADDR),
        .di_b({DIBDI, DIADI}), .dip_b({DIPBDIP, DIPADIP}), .we_b(WEBWE), .do_b(), .dop_b());
      assign {DOBDO, DOADO} = data ^ {32{reset ? 1'bx : 1'b0}};
      assign {DOPBDOP, DOPADOP} = parity ^ {4{reset ? 1'bx : 1'b0}};
    end else begin
      wire [15:0] data_a, data_b;
      wire [1:0] parity_a, parity_b;
      block_ram #(.ADDRESS(14), .DATA(16), .READ_A(READ_WIDTH_A), .READ_B(READ_WIDTH_B), .WRITE_A(WRITE_WIDTH_A),
        .WRITE_B(WRITE_WIDTH_B), .REG_A(DOA_REG), .REG_B(DOB_REG), .MODE_A(WRITE_MODE_A), .MODE_B(WRITE_MODE_B)) ram (
        .clk_a(CLKARDCLK), .en_a(ENARDEN), .ce_a(REGCEAREGCE), .addr_a(ADDRARDADDR), .di_a(DIADI), .dip_a(DIPADIP),
        .we_a(WEA), .do_a(data_a), .dop_a(parity_a), .clk_b(CLKBWRCLK), .en_b(ENBWREN), .ce_b(REGCEB),
        .addr_b(ADDRBWRADDR), .di_b(DIBDI), .dip_b(DIPBDIP), .we_b(WEBWE[1:0]), .do_b(data_b), .dop_b(parity_b));
      assign {DOPBDOP, DOPADOP, DOBDO, DOADO} = {parity_b, parity_a, data_b, data_a} ^ {36{reset ? 1'bx : 1'b0}};
    end
  endgenerate
endmodule

module RAMB36E1 #(
    parameter DOA_REG = 0, DOB_REG = 0, RAM_MODE = "TDP", READ_WIDTH_A = 0, READ_WIDTH_B = 0, WRITE_WIDTH_A = 0,
    parameter WRITE_WIDTH_B = 0, WRITE_MODE_A = "WRITE_FIRST", WRITE_MODE_B = "WRITE_FIRST", SRVAL_A = 0, SRVAL_B = 0,
    parameter INIT_A = 0, INIT_B = 0, SIM_DEVICE = "VIRTEX6", RDADDR_COLLISION_HWCONFIG = "DELAYED_WRITE",
    parameter EN_ECC_READ = "FALSE", EN_ECC_WRITE = "FALSE", RAM_EXTENSION_A = "NONE", RAM_EXTENSION_B = "NONE") (
    input CLKARDCLK, CLKBWRCLK, ENARDEN, ENBWREN, REGCEAREGCE, REGCEB, RSTRAMARSTRAM, RSTRAMB, RSTREGARSTREG, RSTREGB,
    input [15:0] ADDRARDADDR, ADDRBWRADDR, input [31:0] DIADI, DIBDI, input [3:0] DIPADIP, DIPBDIP, WEA,
    input [7:0] WEBWE, output [31:0] DOADO, DOBDO, output [3:0] DOPADOP, DOPBDOP);
  wire unknown = (RSTRAMARSTRAM | RSTRAMB | RSTREGARSTREG | RSTREGB) !== 0 || RAM_EXTENSION_A != "NONE"
                 || RAM_EXTENSION_B != "NONE" || EN_ECC_READ != "FALSE" || EN_ECC_WRITE != "FALSE";
  generate
    if (RAM_MODE == "SDP") begin
      wire [63:0] data;
      wire [7:0] parity;
      block_ram #(.ADDRESS(15), .DATA(64), .READ_A(READ_WIDTH_A), .WRITE_B(WRITE_WIDTH_B), .REG_A(DOA_REG)) ram (
        .clk_a(CLKARDCLK), .en_a(ENARDEN), .ce_a(REGCEAREGCE), .addr_a(ADDRARDADDR[14:0]), .di_a(64'd0), .dip_a(8'd0),
        .we_a(8'd0), .do_a(data), .dop_a(parity), .clk_b(CLKBWRCLK), .en_b(ENBWREN), .ce_b(1'b0),
        .addr_b(ADDRBWRADDR[14:0]), .di_b({DIBDI, DIADI}), .dip_b({DIPBDIP, DIPADIP}), .we_b(WEBWE), .do_b(),
        .dop_b());
      assign {DOBDO, DOADO} = data ^ {64{unknown ? 1'bx : 1'b0}};
      assign {DOPBDOP, DOPADOP} = parity ^ {8{unknown ? 1'bx : 1'b0}};
    end else begin
      wire [31:0] data_a, data_b;
      wire [3:0] parity_a, parity_b;
      block_ram #(.ADDRESS(15), .DATA(32), .READ_A(READ_WIDTH_A), .READ_B(READ_WIDTH_B), .WRITE_A(WRITE_WIDTH_A),
        .WRITE_B(WRITE_WIDTH_B), .REG_A(DOA_REG), .REG_B(DOB_REG), .MODE_A(WRITE_MODE_A), .MODE_B(WRITE_MODE_B)) ram (
        .clk_a(CLKARDCLK), .en_a(ENARDEN), .ce_a(REGCEAREGCE), .addr_a(ADDRARDADDR[14:0]), .di_a(DIADI),
        .dip_a(DIPADIP), .we_a(WEA), .do_a(data_a), .dop_a(parity_a), .clk_b(CLKBWRCLK), .en_b(ENBWREN),
        .ce_b(REGCEB), .addr_b(ADDRBWRADDR[14:0]), .di_b(DIBDI), .dip_b(DIPBDIP), .we_b(WEBWE[3:0]), .do_b(data_b),
        .dop_b(parity_b));
      assign {DOPBDOP, DOPADOP, DOBDO, DOADO} = {parity_b, parity_a, data_b, data_a} ^ {72{unknown ? 1'bx : 1'b0}};
    end
  endgenerate
endmodule
