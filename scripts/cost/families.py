# SPDX-License-Identifier: Apache-2.0
"""What differs between FPGA families: how Yosys is called, what its cells are, and which of their arcs take no clock.

xc6v Virtex-6, xc5v Virtex-5 (synth_xilinx), ecp5 (synth_ecp5), ng_medium (synth_nanoxplore). Yosys' nanoxplore flow
leaves products in logic; here they are mapped to blocks of 24 x 18 bits signed, as the DSP of NG-MEDIUM has them, with
Yosys' own mul2dsp.v (products of less than 4 bits a side stay logic). Registers next to these blocks are not packed
into them, so flip-flops are counted too high there.
"""
import inspect
import re

FAMILIES = ("xc6v", "xc5v", "ecp5", "ng_medium")

# The block of NG-MEDIUM that a product becomes; only its name is counted.
NX_MUL_CELL = "PSWEEP_NX_MUL"
NX_MUL_MAP = f"""
(* blackbox *) module {NX_MUL_CELL} (input [23:0] A, input [17:0] B, output [41:0] Y); endmodule
"""
# Yosys 0.70 maps small memories of NG-MEDIUM to a register file whose module it forgot: declared here, so that it can
# be counted (64 words of 16 bits).
NX_RFB_DECLARED = """
(* blackbox *) module NX_RFB_M_WRAP (input RCK, input WCK, input RE, input WE, input [15:0] I, input [5:0] RA,
  input [5:0] WA, output [15:0] O, output COR, output ERR);
  parameter mode = 0; parameter mem_ctxt = ""; parameter rck_edge = 1'b0; parameter wck_edge = 1'b0;
endmodule
"""
NX_MUL_TECHMAP = f"""
module \\$__NX_MUL (A, B, Y);
  parameter A_SIGNED = 1; parameter B_SIGNED = 1;
  parameter A_WIDTH = 24; parameter B_WIDTH = 18; parameter Y_WIDTH = 42;
  input [A_WIDTH-1:0] A; input [B_WIDTH-1:0] B; output [Y_WIDTH-1:0] Y;
  wire [41:0] y;
  {NX_MUL_CELL} _TECHMAP_REPLACE_ (
    .A({{{{(24 - A_WIDTH){{A_SIGNED ? A[A_WIDTH-1] : 1'b0}}}}, A}}),
    .B({{{{(18 - B_WIDTH){{B_SIGNED ? B[B_WIDTH-1] : 1'b0}}}}, B}}), .Y(y));
  assign Y = y;
endmodule
"""


def commands(family, top, no_dsp, work):
    """Yosys commands after read_verilog and keep_hierarchy; work: a folder for files that they need."""
    if family in ("xc6v", "xc5v"):
        return [f"synth_xilinx -family {family} -flatten -noiopad {'-nodsp' if no_dsp else ''} -top {top}"]
    if family == "ecp5":
        return ecp5_commands(top, no_dsp, work)
    if family == "ng_medium":
        return nx_commands(top, no_dsp, work)
    raise ValueError(f"unknown family '{family}': " + ", ".join(FAMILIES))


# Blocks of ECP5 for memories of more than 2048 words, as Yosys' share/lattice/brams_16kd.txt has them, but in widths of
# 1, 2 and 4 only. With the ninth bits Yosys saves one block of nine and puts a multiplexer of up to 16 inputs behind
# blocks that take most of a clock by themselves.
ECP5_DEEP = """
ram block $__DP16KD_ {
  abits 14; widths 1 2 4 per_port; cost 128; init no_undef;
  port srsw "A" "B" {
    clock anyedge; clken;
    portoption "WRITEMODE" "NORMAL" { rdwr no_change; }
    portoption "WRITEMODE" "WRITETHROUGH" { rdwr new; }
    portoption "WRITEMODE" "READBEFOREWRITE" { rdwr old; }
    option "RESETMODE" "SYNC" { rdsrst zero ungated block_wr; }
    option "RESETMODE" "ASYNC" { rdarst zero; }
    rdinit zero;
  }
}
"""


def ecp5_commands(top, no_dsp, work):
    """The same for ECP5."""
    (work / "ecp5_deep.txt").write_text(ECP5_DEEP)
    synth = f"synth_ecp5 {'-nodsp' if no_dsp else ''} -top {top}"
    return [f"{synth} -run begin:map_ram", f"memory_libmap -lib {work}/ecp5_deep.txt t:$mem_v2 r:SIZE>2048 %i",
            f"{synth} -run map_ram:"]


def nx_commands(top, no_dsp, work):
    """The same for NG-MEDIUM."""
    (work / "nx_rfb.v").write_text(NX_RFB_DECLARED)
    products = [f"read_verilog -lib {work}/nx_rfb.v"]
    if not no_dsp:
        (work / "nx_mul.v").write_text(NX_MUL_MAP)
        (work / "nx_mul_map.v").write_text(NX_MUL_TECHMAP)
        products += [
            f"read_verilog -lib {work}/nx_mul.v",
            f"hierarchy -check -top {top}", "proc", "flatten", "opt", "wreduce", "opt_clean",
            "techmap -map +/mul2dsp.v -D DSP_A_MAXWIDTH=24 -D DSP_B_MAXWIDTH=18 -D DSP_A_MINWIDTH=4"
            " -D DSP_B_MINWIDTH=4 -D DSP_Y_MINWIDTH=9 -D DSP_SIGNEDONLY=1 -D DSP_NAME=$__NX_MUL",
            "chtype -set $mul t:$__soft_mul",
            f"techmap -map {work}/nx_mul_map.v",
        ]
    return products + [f"synth_nanoxplore -family medium -noiopad -top {top}"]


def fingerprint(family):
    """All that is particular to a family, as text: a kept result is good only as long as this does not change."""
    own = {"ng_medium": (inspect.getsource(nx_commands), NX_MUL_MAP, NX_RFB_DECLARED, NX_MUL_TECHMAP),
           "ecp5": (inspect.getsource(ecp5_commands), ECP5_DEEP)}
    return repr((inspect.getsource(commands), KINDS[STYLE[family]], own.get(family, ())))


# Kind of a cell, by the first pattern that matches; how many LUTs one of them takes.
KINDS = {
    "xilinx": (
        (r"LUT[1-6]$|INV$", "lut", 1), (r"CARRY4$", "carry", 0), (r"MUXF[789]$", "mux", 0), (r"FD", "ff", 0),
        (r"SRL", "srl", 1),
        (r"RAM(32M|64M|128X1D)$", "lutram", 4), (r"RAM(32X1D|64X1D|128X1S)$", "lutram", 2),
        (r"RAM(32|64)X1S$", "lutram", 1),
        (r"RAMB36", "ram36", 0), (r"RAMB18", "ram18", 0), (r"DSP48", "dsp", 0), (r"BUF", "buffer", 0),
    ),
    "ecp5": (
        (r"LUT4$", "lut", 1), (r"CCU2C$", "carry", 2), (r"PFUMX$|L6MUX21$", "mux", 0), (r"TRELLIS_FF$", "ff", 0),
        (r"TRELLIS_DPR16X4$", "lutram", 6), (r"DP16KD$|PDPW16KD$", "ram18", 0),
        (r"MULT18X18D$", "dsp", 0), (r"ALU54B$", "alu", 0),
    ),
    "nx": (
        (r"NX_LUT$", "lut", 1), (r"NX_CY$", "carry", 0), (r"NX_DFF$|NX_DFR$", "ff", 0), (r"NX_RAM", "ram48", 0),
        (r"NX_RFB", "rf", 0), (NX_MUL_CELL, "dsp", 0), (r"NX_BD|NX_BUFG", "buffer", 0),
    ),
}
STYLE = {"xc6v": "xilinx", "xc5v": "xilinx", "ecp5": "ecp5", "ng_medium": "nx"}
_memo = {}


def kind(family, cell_type):
    """(kind, LUTs) of a cell; None if it is not in the table above."""
    key = (STYLE[family], cell_type)
    if key not in _memo:
        _memo[key] = next(((name, luts) for pattern, name, luts in KINDS[key[0]] if re.match(pattern, cell_type)), None)
    return _memo[key]


# Blocks of 48 kbit of NG-MEDIUM: words, bits of a word; the modes without ECC and the one with (Yosys 0.70,
# share/nanoxplore/brams.txt and cells_sim.v, parameter std_mode of NX_RAM). Yosys uses whole powers of two words only
# (32768 of the 48k words of 1 bit, ..).
NX_MODES = ((49152, 1), (24576, 2), (12288, 4), (6144, 8), (4096, 12), (2048, 24))
NX_MODES_ECC = ((2048, 18),)


def nx_blocks(words, bits, modes=NX_MODES):
    """Fewest blocks of a memory that is cut into columns, each of one mode and as deep as the memory."""
    best = [0] + [None] * bits
    for width in range(1, bits + 1):
        best[width] = min(best[max(0, width - w)] + -(-words // d) for d, w in modes)
    return best[bits]
