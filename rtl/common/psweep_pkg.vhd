-- SPDX-License-Identifier: Apache-2.0
-- psweep_pkg: constants and helpers shared by all entities of the engine.
--   Formats   : positions sfix(13,19) in 32 bits, steps ufix(2,19) in 21 bits    (docs/numeric_contract.md)
--   Latencies : clocks from an entity's input to its output; parents add them up, sw/golden/control.hpp mirrors them
--   Golden    : sw/contract/*.hpp (formats, states, errors), sw/golden/control.hpp (latencies)
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;

package psweep_pkg is

  -- Positions and steps.
  constant C_POS_W    : positive := 32;
  constant C_POS_FRAC : positive := 19;
  constant C_INT_W    : positive := C_POS_W - C_POS_FRAC; -- integer part, signed
  constant C_STEP_W   : positive := 21;
  -- A row takes at least this many clocks: the table words of a row are fetched one a clock, and the feedback loops of
  -- column sums and map close in time.
  constant C_ROW_MIN  : positive := 8;

  -- Control states, as on port state.
  constant C_STATE_IDLE   : std_logic_vector(2 downto 0) := "000";
  constant C_STATE_LOAD   : std_logic_vector(2 downto 0) := "001";
  constant C_STATE_SWEEP  : std_logic_vector(2 downto 0) := "010";
  constant C_STATE_FLUSH  : std_logic_vector(2 downto 0) := "011";
  constant C_STATE_UNLOAD : std_logic_vector(2 downto 0) := "100";
  constant C_STATE_DRAIN  : std_logic_vector(2 downto 0) := "101";

  -- Bits of port errors.
  constant C_ERROR_CONFIG  : natural := 0;
  constant C_ERROR_TABLE   : natural := 1;
  constant C_ERROR_SHORT   : natural := 2;
  constant C_ERROR_LONG    : natural := 3;
  constant C_ERROR_WINDOW  : natural := 4;
  constant C_ERROR_ADDRESS : natural := 5;
  constant C_ERROR_BUSY    : natural := 6;
  constant C_ERROR_UPSET   : natural := 7;

  -- Latencies, first input to first output.
  constant C_ADDRESS_LATENCY       : positive := 9; -- row strobe to position
  constant C_STORAGE_LATENCY       : positive := 4; -- position to 2x2 pixels

  -- RAM of up to so many words is made of LUTs (ram_sdp).
  constant C_LUT_WORDS : positive := 64;

  -- Values of attributes for the FPGA tools. docs/flows.md lists where they are and why; 'lint attributes' compares.
  constant C_RAM_BLOCK : string := "block";       -- ram_style
  constant C_RAM_LUT   : string := "distributed"; -- ram_style
  constant C_DSP       : string := "yes";         -- use_dsp48
  constant C_FANOUT    : string := "100";         -- max_fanout
  constant C_PAD       : string := "TRUE";        -- iob
  constant C_FSM_KEPT  : string := "no";          -- fsm_extract

  -- Pixels to sample. A build for rectified pairs has no interpolation between rows.
  function interpolation_latency (rectified : integer) return positive;

  -- Last sample of a window to its cell; cell to its write into the map.
  function similarity_latency (mncc_w : positive) return positive;
  function updating_latency (frac_w, lanes : integer) return positive;

  -- Bits that hold 0 .. n-1, at least 1. Requires n >= 1; the caller asserts this.
  function clog2 (n : integer) return positive;

  function imax (a, b : integer) return integer;

  -- Sets of `lanes` planes that are swept one after the other. The caller asserts that both numbers are legal.
  function plane_sets (planes, lanes : integer) return positive;

  -- Words of a bank of storage. Four banks an image, by the parities of x and y; two, by the parity of x, in a build
  -- for rectified pairs.
  function bank_depth (cols, rows, rectified : integer) return integer;
  -- Bits of its addresses.
  function bank_bits (cols, rows, rectified : integer) return positive;

  -- A RAM of many words is made of 1 .. 4 parts, powers of two, largest first (ram_deep, ram_2r): words of part n, 0 if
  -- there is no such part; the address at which it starts, a multiple of the size of the part before it; their number.
  function deep_part (depth, n : integer) return integer;
  function deep_start (depth, n : integer) return integer;
  function deep_parts (depth : integer) return positive;
  -- Bit n: the address is not in a part before n. A part starts at a multiple of the size of the one before it, so the
  -- few bits above that tell. The bit above the last part is '0'.
  function deep_reached (address : std_logic_vector; depth : integer) return std_logic_vector;
  -- The word of the last part that is reached.
  function deep_word (words, reached : std_logic_vector; width : integer) return std_logic_vector;

  -- true is '1'
  function to_sl (b : boolean) return std_logic;

end package psweep_pkg;

package body psweep_pkg is

  function similarity_latency (mncc_w : positive) return positive is
  begin
    return 16 + mncc_w;
  end function similarity_latency;

  function updating_latency (frac_w, lanes : integer) return positive is
  begin
    return 4 + lanes + frac_w;
  end function updating_latency;

  function clog2 (n : integer) return positive is
    variable v_bits : positive := 1;
  begin
    while 2 ** v_bits < n loop
      v_bits := v_bits + 1;
    end loop;
    return v_bits;
  end function clog2;

  function imax (a, b : integer) return integer is
  begin
    if a > b then
      return a;
    end if;
    return b;
  end function imax;

  function plane_sets (planes, lanes : integer) return positive is
  begin
    if planes < 1 or lanes < 1 then
      return 1;
    end if;
    return (planes + lanes - 1) / lanes;
  end function plane_sets;

  function interpolation_latency (rectified : integer) return positive is
  begin
    if rectified = 1 then
      return 3;
    end if;
    return 6;
  end function interpolation_latency;

  function bank_depth (cols, rows, rectified : integer) return integer is
  begin
    if rectified = 1 then
      return cols / 2 * rows;
    end if;
    return cols / 2 * (rows / 2);
  end function bank_depth;

  function bank_bits (cols, rows, rectified : integer) return positive is
  begin
    return clog2(bank_depth(cols, rows, rectified));
  end function bank_bits;

  function deep_part (depth, n : integer) return integer is
    constant C_MOST  : integer := 4;    -- parts: a multiplexer of one LUT6 a bit
    constant C_GRAIN : integer := 2048; -- a block of 16 or 18 bits: less is not worth a part
    constant C_LEAST : integer := 512;  -- half a block of 36 bits
    constant C_CAP   : integer := 16384; -- the deepest block that many devices have, of 1 or 2 bits
    variable v_left  : integer;
    variable v_size  : integer;
  begin
    v_left := depth;
    v_size := 0;
    for i in 0 to n loop
      if v_left <= 0 then
        v_size := 0;
      elsif i = 0 and v_left <= C_GRAIN then
        v_size := v_left;
      else
        v_size := 2 ** clog2(imax(v_left, C_LEAST));
        if v_size - v_left >= C_GRAIN and i < C_MOST - 1 then
          v_size := v_size / 2;
        end if;
        if v_size > C_CAP and depth <= C_MOST * C_CAP then
          v_size := C_CAP;
        end if;
      end if;
      v_left := v_left - v_size;
    end loop;
    return v_size;
  end function deep_part;

  function deep_start (depth, n : integer) return integer is
    variable v_start : integer := 0;
  begin
    for i in 0 to n - 1 loop
      v_start := v_start + deep_part(depth, i);
    end loop;
    return v_start;
  end function deep_start;

  function deep_parts (depth : integer) return positive is
    variable v_count : positive := 1;
  begin
    while deep_part(depth, v_count) > 0 loop
      v_count := v_count + 1;
    end loop;
    return v_count;
  end function deep_parts;

  function deep_reached (address : std_logic_vector; depth : integer) return std_logic_vector is
    constant C_PARTS   : positive := deep_parts(depth);
    variable v_reached : std_logic_vector(C_PARTS downto 0);
  begin
    v_reached    := (others => '0');
    v_reached(0) := '1';
    for i in 1 to C_PARTS - 1 loop
      v_reached(i) := to_sl(unsigned(address(address'high downto clog2(deep_part(depth, i - 1))))
                            >= deep_start(depth, i) / deep_part(depth, i - 1));
    end loop;
    return v_reached;
  end function deep_reached;

  function deep_word (words, reached : std_logic_vector; width : integer) return std_logic_vector is
    variable v_word : std_logic_vector(width - 1 downto 0);
  begin
    v_word := words(width - 1 downto 0);
    for i in 1 to reached'high - 1 loop
      if reached(i) = '1' then
        v_word := words((i + 1) * width - 1 downto i * width);
      end if;
    end loop;
    return v_word;
  end function deep_word;

  function to_sl (b : boolean) return std_logic is
  begin
    if b then
      return '1';
    end if;
    return '0';
  end function to_sl;

end package body psweep_pkg;
