-- SPDX-License-Identifier: Apache-2.0
-- address_generator: computes where each sample of a plane lies in both images (paper, section 4.2). Owns the plane
--                    table.
--   Rate     : one sample per clock; rows at least C_ROW_MIN clocks apart
--   Latency  : C_ADDRESS_LATENCY = 9 clocks from s_* to m_*; no bubble between rows or planes
--   Numbers  : positions sfix(13,19), accumulated modulo 2^32 (exact); steps ufix(2,19): bits above 20 of a word must
--              be 0 (those of dx are ignored, those of dy are added); fractions truncated to G_WEIGHT_W bits
--   Row      : the strobe of a row (clock t) starts the fetch of its words, one per clock, in this order: y0 or dy of
--              both images, x0 of both, dx of both. One 32-bit adder makes all four start values. The y parts (floor,
--              fraction, tests, bank row addresses) are computed once per row and change with its first sample.
--   usable_* : inside both images and loaded; x and y are separate, as x depends on the column only and y on the row
--   Rectified: with G_RECTIFIED = 1 the rows of samples must fall on rows of pixels. A sample between two rows counts
--              as not loaded: it is not usable, and a window error if it is inside both images
--   Table    : 8 words per plane (docs/registers.md); written only while no sample is in flight
--   Parity   : words of table and offsets carry an even parity bit; m_word_error reports one clock later that a word
--              read by a row, or its parity bit, is not what was written
--   Idle     : m_row_* are 0 from the clock after the last sample of a plane until the next row
--   Reset    : clears the strobes in flight, m_row_* and usable_y; positions have no reset
--   Golden   : sw/golden/address_generator.hpp
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;

entity address_generator is
  generic (
    G_PLANES    : integer := 301;
    G_IMG_COLS  : integer := 340;
    G_IMG_ROWS  : integer := 144;
    G_WEIGHT_W  : integer := 8;
    G_RECTIFIED : integer := 0
  );
  port (
    clk : in  std_logic;
    rst : in  std_logic;

    -- Plane table and tile offsets (0-3: x left, y left, x right, y right) share the data.
    table_we    : in  std_logic;
    table_addr  : in  std_logic_vector(clog2(G_PLANES) + 2 downto 0);
    offset_we   : in  std_logic;
    offset_addr : in  std_logic_vector(1 downto 0);
    cfg_data    : in  std_logic_vector(31 downto 0);
    cfg_parity  : in  std_logic; -- '1' if cfg_data has an odd number of ones

    -- Static during a tile: last loaded column and row, bounds of the images in window coordinates.
    win_last_col : in  std_logic_vector(clog2(G_IMG_COLS) - 1 downto 0);
    win_last_row : in  std_logic_vector(clog2(G_IMG_ROWS) - 1 downto 0);
    left_x_lo    : in  std_logic_vector(C_INT_W - 1 downto 0);
    left_x_hi    : in  std_logic_vector(C_INT_W - 1 downto 0);
    left_y_lo    : in  std_logic_vector(C_INT_W - 1 downto 0);
    left_y_hi    : in  std_logic_vector(C_INT_W - 1 downto 0);
    right_x_lo   : in  std_logic_vector(C_INT_W - 1 downto 0);
    right_x_hi   : in  std_logic_vector(C_INT_W - 1 downto 0);
    right_y_lo   : in  std_logic_vector(C_INT_W - 1 downto 0);
    right_y_hi   : in  std_logic_vector(C_INT_W - 1 downto 0);

    -- Strobes. s_plane and s_plane_first hold for the whole row, C_ROW_MIN clocks at least.
    s_valid       : in  std_logic;
    s_row_first   : in  std_logic; -- i = 0, only with s_valid
    s_plane_first : in  std_logic; -- j = 0
    s_plane_last  : in  std_logic; -- last sample of the plane
    s_plane       : in  std_logic_vector(clog2(G_PLANES) - 1 downto 0);

    m_valid       : out std_logic;
    m_row_first   : out std_logic;
    m_plane_first : out std_logic;
    m_plane_last  : out std_logic;
    m_xi_left     : out std_logic_vector(C_INT_W - 1 downto 0);
    m_yi_left     : out std_logic_vector(C_INT_W - 1 downto 0);
    m_fx_left     : out std_logic_vector(G_WEIGHT_W - 1 downto 0);
    m_fy_left     : out std_logic_vector(G_WEIGHT_W - 1 downto 0);
    m_xi_right    : out std_logic_vector(C_INT_W - 1 downto 0);
    m_yi_right    : out std_logic_vector(C_INT_W - 1 downto 0);
    m_fx_right    : out std_logic_vector(G_WEIGHT_W - 1 downto 0);
    m_fy_right    : out std_logic_vector(G_WEIGHT_W - 1 downto 0);
    -- Bank address of column 0 of the sample's upper and lower neighbours: the even and the odd one of rows yi, yi+1.
    -- With G_RECTIFIED both are row yi. Meaningful where m_usable_y.
    m_row_even_left  : out std_logic_vector(bank_bits(G_IMG_COLS, G_IMG_ROWS, G_RECTIFIED) - 1 downto 0);
    m_row_odd_left   : out std_logic_vector(bank_bits(G_IMG_COLS, G_IMG_ROWS, G_RECTIFIED) - 1 downto 0);
    m_row_even_right : out std_logic_vector(bank_bits(G_IMG_COLS, G_IMG_ROWS, G_RECTIFIED) - 1 downto 0);
    m_row_odd_right  : out std_logic_vector(bank_bits(G_IMG_COLS, G_IMG_ROWS, G_RECTIFIED) - 1 downto 0);
    m_usable_x       : out std_logic;
    m_usable_y       : out std_logic;
    m_window_error   : out std_logic; -- inside both images, not loaded in at least one; only with m_valid
    m_word_error     : out std_logic  -- a row has read a word with wrong parity; within C_ROW_MIN clocks of its strobe
  );
end entity address_generator;

architecture rtl of address_generator is

  constant C_PITCH  : integer := G_IMG_COLS / 2;
  constant C_ROW_W  : integer := clog2(bank_depth(2, G_IMG_ROWS, G_RECTIFIED)); -- of the number of a bank's row
  constant C_BANK_W : integer := bank_bits(G_IMG_COLS, G_IMG_ROWS, G_RECTIFIED);

  -- Words of the table. A few more, up to a power of two, save the multiplexer behind its blocks.
  function table_words return integer is
    constant C_USED  : integer := 8 * imax(G_PLANES, 2);
    constant C_WHOLE : integer := 2 ** clog2(C_USED);
  begin
    if C_WHOLE - C_USED < 1024 then
      return C_WHOLE;
    end if;
    return C_USED;
  end function table_words;

  constant C_TABLE : integer := table_words;

  -- Strobes on their way: row(n) is '1' n clocks after the strobe of a row. These are also the clock numbers below.
  signal row         : std_logic_vector(8 downto 0);
  signal valid       : std_logic_vector(8 downto 1);
  signal plane_last  : std_logic_vector(8 downto 1);
  signal plane_first : std_logic; -- of the row in work, held past the end of a short row

  -- Clocks 0 - 7: table words and tile offsets.
  signal table_field  : std_logic_vector(2 downto 0);
  signal table_raddr  : std_logic_vector(clog2(G_PLANES) + 2 downto 0);
  signal write_word   : std_logic_vector(32 downto 0); -- parity bit on top, here and in the next two
  signal table_word   : std_logic_vector(32 downto 0);
  signal offset_raddr : std_logic_vector(1 downto 0);
  signal offset_word  : std_logic_vector(32 downto 0);
  -- Clocks 3 - 8: both words of the clock before in parts of six bits, that is, a LUT each: the part has odd parity.
  signal word_reading : std_logic;
  signal part_odd     : std_logic_vector(10 downto 0);

  -- Clocks 2 - 5: the four start values of the row. (y_older, y_newer) rotate: left, right, left, right ..
  signal base          : unsigned(31 downto 0);
  signal start_value   : unsigned(31 downto 0);
  signal y_older       : unsigned(31 downto 0);
  signal y_newer       : unsigned(31 downto 0);
  signal x_start_left  : unsigned(31 downto 0);
  signal x_start_right : unsigned(31 downto 0);

  -- Clocks 3 - 8: y parts; y_newer is the left one in clock 3, the right one from clock 4 on.
  signal y_lo         : std_logic_vector(C_INT_W - 1 downto 0);
  signal y_hi         : std_logic_vector(C_INT_W - 1 downto 0);
  signal y_inside_now : std_logic;
  signal y_loaded_now : std_logic;
  signal y_inside     : std_logic; -- both images, once clock 5 has come
  signal y_loaded     : std_logic;
  signal y_half       : unsigned(C_ROW_W - 1 downto 0);
  signal product      : unsigned(C_BANK_W - 1 downto 0);
  signal row_now      : unsigned(C_BANK_W - 1 downto 0);
  signal y_is_odd     : std_logic; -- of the image that row_now is of
  signal row_up       : unsigned(C_BANK_W - 1 downto 0); -- as row_now, of the even one of rows yi, yi+1
  signal row_left     : unsigned(C_BANK_W - 1 downto 0);
  signal row_left_up  : unsigned(C_BANK_W - 1 downto 0);

  -- Clocks 6 - 8: steps. They are 0 in clock 7, when the positions restart.
  signal next_dx_left : unsigned(C_STEP_W - 1 downto 0);
  signal dx_left      : unsigned(C_STEP_W - 1 downto 0);
  signal dx_right     : unsigned(C_STEP_W - 1 downto 0);

  -- Clock 8: position of sample 0.
  signal x_left  : unsigned(31 downto 0);
  signal x_right : unsigned(31 downto 0);

  -- Clock 9: tests of the samples.
  signal left_ge_lo    : std_logic;
  signal left_le_hi    : std_logic;
  signal left_loaded   : std_logic;
  signal right_ge_lo   : std_logic;
  signal right_le_hi   : std_logic;
  signal right_loaded  : std_logic;
  signal out_valid     : std_logic;
  signal out_last      : std_logic;
  signal out_inside_y  : std_logic;
  signal out_loaded_y  : std_logic;
  signal out_inside_x  : std_logic;
  signal out_loaded_x  : std_logic;

  attribute use_dsp48 : string;

  attribute use_dsp48 of product : signal is C_DSP;

  function floor_of (position : unsigned) return signed is
  begin
    return signed(position(31 downto C_POS_FRAC));
  end function floor_of;

  function fraction_of (position : unsigned) return std_logic_vector is
  begin
    return std_logic_vector(position(C_POS_FRAC - 1 downto C_POS_FRAC - G_WEIGHT_W));
  end function fraction_of;

  -- Of a usable sample it is 0 anyway with G_RECTIFIED; as a constant it costs no register.
  function fraction_between_rows (position : unsigned) return std_logic_vector is
    variable v_fraction : std_logic_vector(G_WEIGHT_W - 1 downto 0);
  begin
    v_fraction := (others => '0');
    if G_RECTIFIED = 0 then
      v_fraction := fraction_of(position);
    end if;
    return v_fraction;
  end function fraction_between_rows;

  -- position <= hi on the truncated position. One more bit stands for "fraction is not 0".
  function at_most (position : unsigned; hi : std_logic_vector) return std_logic is
    variable v_fraction : std_logic;
  begin
    v_fraction := '0';
    for k in C_POS_FRAC - G_WEIGHT_W to C_POS_FRAC - 1 loop
      v_fraction := v_fraction or position(k);
    end loop;
    return to_sl(signed(hi & '0') >= floor_of(position) & v_fraction);
  end function at_most;

  function at_least (position : unsigned; lo : std_logic_vector) return std_logic is
  begin
    return to_sl(floor_of(position) >= signed(lo));
  end function at_least;

  -- 0 <= floor and floor + 1 <= last: as unsigned numbers, negative positions are the largest.
  function is_loaded (position : unsigned; last : std_logic_vector) return std_logic is
  begin
    return to_sl(position(31 downto C_POS_FRAC) < resize(unsigned(last), C_INT_W));
  end function is_loaded;

begin

  assert G_PLANES >= 1 and G_PLANES <= 1024
    report "address_generator: G_PLANES"
           -- synthesis translate_off
           & "=" & integer'image(G_PLANES)
           -- synthesis translate_on
           & " outside 1..1024"
    severity failure;
  assert G_IMG_COLS >= 4 and G_IMG_COLS <= 4096 and G_IMG_COLS mod 2 = 0
    report "address_generator: G_IMG_COLS"
           -- synthesis translate_off
           & "=" & integer'image(G_IMG_COLS)
           -- synthesis translate_on
           & " outside 4..4096 or odd"
    severity failure;
  assert G_IMG_ROWS >= 4 and G_IMG_ROWS <= 4096 and G_IMG_ROWS mod 2 = 0
    report "address_generator: G_IMG_ROWS"
           -- synthesis translate_off
           & "=" & integer'image(G_IMG_ROWS)
           -- synthesis translate_on
           & " outside 4..4096 or odd"
    severity failure;
  assert G_WEIGHT_W >= 1 and G_WEIGHT_W <= 12
    report "address_generator: G_WEIGHT_W"
           -- synthesis translate_off
           & "=" & integer'image(G_WEIGHT_W)
           -- synthesis translate_on
           & " outside 1..12"
    severity failure;
  assert G_RECTIFIED = 0 or G_RECTIFIED = 1
    report "address_generator: G_RECTIFIED"
           -- synthesis translate_off
           & "=" & integer'image(G_RECTIFIED)
           -- synthesis translate_on
           & " is neither 0 nor 1"
    severity failure;

  row(0) <= s_row_first;

  p_strobes : process (clk)
  begin
    if rising_edge(clk) then
      row(8 downto 1) <= row(7 downto 0);
      valid           <= valid(7 downto 1) & s_valid;
      plane_last      <= plane_last(7 downto 1) & s_plane_last;
      out_valid       <= valid(8);
      m_row_first     <= row(8);
      out_last        <= plane_last(8);
      if row(7) = '1' then
        plane_first <= s_plane_first;
      end if;
      if row(8) = '1' then
        m_plane_first <= plane_first;
      end if;
      if rst = '1' then
        row(8 downto 1) <= (others => '0');
        valid           <= (others => '0');
        out_valid       <= '0';
        m_row_first     <= '0';
      end if;
    end if;
  end process p_strobes;

  -- Table ------------------------------------------------------------------------------------------------------------
  -- Fields: 0 x0_left, 1 y0_left, 2 x0_right, 3 y0_right, 4 dx_left, 5 dy_left, 6 dx_right, 7 dy_right.
  table_field(0) <= row(0) or row(1);
  table_field(1) <= row(1) or row(3) or row(5);
  table_field(2) <= ((row(0) or row(1)) and not s_plane_first) or row(4) or row(5);
  table_raddr    <= s_plane & table_field;

  write_word  <= cfg_parity & cfg_data;

  u_table : entity work.ram_sdp
    generic map (
      G_DATA_W  => 33,
      G_DEPTH   => C_TABLE,
      G_LATENCY => 2
    )
    port map (
      clk   => clk,
      we    => table_we,
      waddr => table_addr,
      wdata => write_word,
      raddr => table_raddr,
      rdata => table_word
    );

  -- Four words in a RAM instead of registers: read in step with the table, a clock later as their RAM is faster.
  offset_raddr(0) <= row(1) or row(2);
  offset_raddr(1) <= row(2) or row(4);

  u_offsets : entity work.ram_sdp
    generic map (
      G_DATA_W  => 33,
      G_DEPTH   => 4,
      G_LATENCY => 1
    )
    port map (
      clk   => clk,
      we    => offset_we,
      waddr => offset_addr,
      wdata => write_word,
      raddr => offset_raddr,
      rdata => offset_word
    );

  -- Parity -----------------------------------------------------------------------------------------------------------
  -- Only words that a row in work has asked for: of the table, others may never have been written. (The words of the
  -- offsets come a clock earlier in the row, and word 0 behind them.)
  word_reading <= to_sl(row(7 downto 2) /= "000000");

  p_parity : process (clk)
    variable v_words : std_logic_vector(65 downto 0);
    variable v_odd   : std_logic;
  begin
    if rising_edge(clk) then
      v_words := offset_word & table_word;
      for n in part_odd'range loop
        v_odd := '0';
        for k in 6 * n to 6 * n + 5 loop
          v_odd := v_odd xor v_words(k);
        end loop;
        part_odd(n) <= v_odd;
      end loop;
      if word_reading = '0' then
        part_odd <= (others => '0');
      end if;
    end if;
  end process p_parity;

  p_word_error : process (part_odd)
    variable v_odd : std_logic;
  begin
    v_odd := '0';
    for n in part_odd'range loop
      v_odd := v_odd xor part_odd(n);
    end loop;
    m_word_error <= v_odd;
  end process p_word_error;

  -- Start values -----------------------------------------------------------------------------------------------------
  base        <= y_older when (row(2) = '1' or row(3) = '1') and s_plane_first = '0'
                 else unsigned(offset_word(31 downto 0));
  start_value <= unsigned(table_word(31 downto 0)) + base;

  p_start : process (clk)
  begin
    if rising_edge(clk) then
      if row(2) = '1' or row(3) = '1' then
        y_newer <= start_value;
        y_older <= y_newer;
      end if;
      if row(4) = '1' then
        x_start_left <= start_value;
      end if;
      if row(5) = '1' then
        x_start_right <= start_value;
      end if;
    end if;
  end process p_start;

  -- y parts ----------------------------------------------------------------------------------------------------------
  y_inside_now <= at_least(y_newer, y_lo) and at_most(y_newer, y_hi);
  y_loaded_now <= is_loaded(y_newer, win_last_row) and to_sl(G_RECTIFIED = 0 or unsigned(fraction_of(y_newer)) = 0);
  -- Higher bits are 0 where the sample is loaded.
  y_half       <= y_newer(C_POS_FRAC + C_ROW_W - G_RECTIFIED downto C_POS_FRAC + 1 - G_RECTIFIED);
  -- One adder for both images, the left one in clock 5.
  y_is_odd     <= y_older(C_POS_FRAC) when row(5) = '1' else y_newer(C_POS_FRAC);
  row_up       <= row_now + C_PITCH when G_RECTIFIED = 0 and y_is_odd = '1' else row_now;

  p_row : process (clk)
  begin
    if rising_edge(clk) then
      -- Bounds of the image that y_newer will be of, chosen ahead so that the comparison comes first in its clock.
      if row(2) = '1' then
        y_lo <= left_y_lo;
        y_hi <= left_y_hi;
      else
        y_lo <= right_y_lo;
        y_hi <= right_y_hi;
      end if;
      -- A DSP block with its registers.
      product <= resize(y_half * to_unsigned(C_PITCH, clog2(C_PITCH + 1)), C_BANK_W);
      row_now <= product;
      if row(3) = '1' then
        y_inside <= y_inside_now;
        y_loaded <= y_loaded_now;
      elsif row(4) = '1' then
        y_inside <= y_inside and y_inside_now;
        y_loaded <= y_loaded and y_loaded_now;
      end if;
      if row(5) = '1' then
        row_left    <= row_now;
        row_left_up <= row_up;
      end if;
      if row(8) = '1' then
        m_yi_left        <= std_logic_vector(floor_of(y_older));
        m_fy_left        <= fraction_between_rows(y_older);
        m_yi_right       <= std_logic_vector(floor_of(y_newer));
        m_fy_right       <= fraction_between_rows(y_newer);
        m_row_odd_left   <= std_logic_vector(row_left);
        m_row_odd_right  <= std_logic_vector(row_now);
        m_row_even_left  <= std_logic_vector(row_left_up);
        m_row_even_right <= std_logic_vector(row_up);
        out_inside_y <= y_inside;
        out_loaded_y <= y_loaded;
      end if;
      -- Behind a plane, so that storage adds nothing to the addresses of pixels that are loaded.
      if rst = '1' or (out_valid = '1' and out_last = '1' and row(8) = '0') then
        m_row_odd_left   <= (others => '0');
        m_row_odd_right  <= (others => '0');
        m_row_even_left  <= (others => '0');
        m_row_even_right <= (others => '0');
      end if;
      if rst = '1' then
        out_inside_y <= '0';
        out_loaded_y <= '0';
      end if;
    end if;
  end process p_row;

  -- x ----------------------------------------------------------------------------------------------------------------
  p_position : process (clk)
  begin
    if rising_edge(clk) then
      if row(6) = '1' then
        next_dx_left <= unsigned(table_word(C_STEP_W - 1 downto 0));
        dx_left      <= (others => '0');
        dx_right     <= (others => '0');
      elsif row(7) = '1' then
        dx_left  <= next_dx_left;
        dx_right <= unsigned(table_word(C_STEP_W - 1 downto 0));
      end if;
      -- A single adder per bit: with the step 0, "restart" needs no multiplexer behind the sum.
      if row(7) = '1' then
        x_left  <= resize(dx_left, 32) + x_start_left;
        x_right <= resize(dx_right, 32) + x_start_right;
      else
        x_left  <= resize(dx_left, 32) + x_left;
        x_right <= resize(dx_right, 32) + x_right;
      end if;
    end if;
  end process p_position;

  p_sample : process (clk)
  begin
    if rising_edge(clk) then
      m_xi_left    <= std_logic_vector(floor_of(x_left));
      m_fx_left    <= fraction_of(x_left);
      m_xi_right   <= std_logic_vector(floor_of(x_right));
      m_fx_right   <= fraction_of(x_right);
      left_ge_lo   <= at_least(x_left, left_x_lo);
      left_le_hi   <= at_most(x_left, left_x_hi);
      left_loaded  <= is_loaded(x_left, win_last_col);
      right_ge_lo  <= at_least(x_right, right_x_lo);
      right_le_hi  <= at_most(x_right, right_x_hi);
      right_loaded <= is_loaded(x_right, win_last_col);
    end if;
  end process p_sample;

  out_inside_x   <= left_ge_lo and left_le_hi and right_ge_lo and right_le_hi;
  out_loaded_x   <= left_loaded and right_loaded;
  m_valid        <= out_valid;
  m_plane_last   <= out_last;
  m_usable_x     <= out_inside_x and out_loaded_x;
  m_usable_y     <= out_inside_y and out_loaded_y;
  m_window_error <= out_valid and out_inside_x and out_inside_y and not (out_loaded_x and out_loaded_y);

  -- synthesis translate_off
  -- Rules, in simulators.
  p_rules : process (clk)
    variable v_gap   : natural := C_ROW_MIN; -- clocks since the strobe of a row, at most C_ROW_MIN
    variable v_plane : std_logic_vector(s_plane'range);
    variable v_first : std_logic;
    -- What m_* show.
    variable v_xi_left  : unsigned(C_INT_W - 1 downto 0);
    variable v_xi_right : unsigned(C_INT_W - 1 downto 0);
    variable v_yi_left  : unsigned(C_INT_W - 1 downto 0);
    variable v_yi_right : unsigned(C_INT_W - 1 downto 0);
  begin
    if rising_edge(clk) then
      if s_row_first = '1' then
        assert s_valid = '1' and v_gap >= C_ROW_MIN
          report "address_generator: a row without a sample, or too close to the one before"
          severity failure;
        v_gap   := 0;
        v_plane := s_plane;
        v_first := s_plane_first;
      end if;
      if v_gap < C_ROW_MIN then
        v_gap := v_gap + 1;
      end if;
      if v_gap < C_ROW_MIN and rst = '0' then
        assert s_plane = v_plane and s_plane_first = v_first
          report "address_generator: the plane changed within a row"
          severity failure;
      end if;
      assert (table_we = '0' and offset_we = '0') or (s_valid = '0' and row(8 downto 1) = "00000000") or rst /= '0'
        report "address_generator: the table is written while a row is read from it"
        severity failure;
      if out_valid = '1' then
        assert not is_x(std_logic_vector(v_xi_left & v_xi_right & v_yi_left & v_yi_right))
          report "address_generator: a position is unknown: its table words or offsets were never written"
          severity failure;
        assert (out_inside_x and out_loaded_x and out_inside_y and out_loaded_y) /= '1'
               or (v_xi_left < unsigned(win_last_col) and v_xi_right < unsigned(win_last_col)
                   and v_yi_left < unsigned(win_last_row) and v_yi_right < unsigned(win_last_row))
          report "address_generator: a usable sample lies outside the window"
          severity failure;
      end if;
      v_xi_left  := unsigned(floor_of(x_left));
      v_xi_right := unsigned(floor_of(x_right));
      if row(8) = '1' then
        v_yi_left  := unsigned(floor_of(y_older));
        v_yi_right := unsigned(floor_of(y_newer));
      end if;
    end if;
  end process p_rules;
  -- synthesis translate_on

end architecture rtl;
