-- SPDX-License-Identifier: Apache-2.0
-- similarity: MNCC of the left and right samples over G_WINDOW x G_WINDOW windows (paper, section 4.2.2, equation 1).
--   Method  : V = 2 (n S(lr) - S(l) S(r)) / (n S(l^2 + r^2) - S(l)^2 - S(r)^2), n = M*M, S over the window: twice the
--             covariance over the sum of the variances. An offset of l or r changes nothing, and a mirrored r only the
--             sign of the covariance, so the circuit uses l' = l - 2^(S-1) and r' = 2^(S-1) - 1 - r: bits inverted. For
--             each column one RAM keeps the sums of l', r', x = l'r' and y = l'^2 + r'^2 over the last M rows; a new
--             sample changes them by new - old: with a = l' - l'old and c = r' - r'old, dx = a r' + l'old c and
--             dy = a (l' + l'old) + c (r' + r'old). Window sums follow from column sums in the same way, as running
--             sums. M only affects the depth of a RAM and a few bits of the sums.
--   Divider : G_DIVIDER = 0 is divider, one bit per stage; 1 is divider_mul, three products. Same results and latency
--   Split   : G_SPLIT = 1 multiplies the differences of x and y by n in two parts each, for devices whose multipliers
--             have 18 x 18 bits. Same results and latency
--   Slices  : every product is followed by the one sum that uses it, both registered, so that they fit the multiplier
--             and adder of one DSP slice: column sums of x and y are chains of two, n S(x) and n S(y) accumulate their
--             own multiples, the squares are added to them; l' + l'old fits the adder before a multiplier. Nine slices.
--             Accumulators of slices begin with 0, as far as tools infer them. The -1 of an inverted denominator is in
--             S(l)^2 - 1 = (S(l) + 1)(S(l) - 1): S(l) - 1 is accumulated in LUTs, the adder before the multiplier adds
--             2
--   Rate    : one sample per clock; cells leave in raster order
--   Latency : similarity_latency(G_MNCC_W) clocks from the last sample of a window to its cell (psweep_pkg)
--   Numbers : samples ufix(G_SAMPLE_W,0); all sums exact; operands of the division truncated to G_MNCC_W+3 bits, the
--             denominator's leading one on top; V ufix(0,G_MNCC_W) truncated, 0 where cov <= 0, both flat or outside
--   Rows    : any length from G_WINDOW to G_MAX_COLS, the same for all rows of a plane; a row takes at least C_ROW_MIN
--             clocks, which is what the loop through the column sums needs
--   State   : a plane begins with s_plane_first; nothing is carried over from the plane before
--   Reset   : clears the valids; sums, delays and memories have no reset
--   Golden  : sw/golden/similarity.hpp
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;

entity similarity is
  generic (
    G_WINDOW   : integer := 13;
    G_SAMPLE_W : integer := 10;
    G_MNCC_W   : integer := 13;
    G_MAX_COLS : integer := 268;
    G_DIVIDER  : integer := 0;
    G_SPLIT    : integer := 0
  );
  port (
    clk : in  std_logic;
    rst : in  std_logic;

    s_valid       : in  std_logic;
    s_row_first   : in  std_logic; -- i = 0, only with s_valid
    s_plane_first : in  std_logic; -- j = 0, for the whole row
    s_plane_last  : in  std_logic; -- last sample of the plane
    s_usable_x    : in  std_logic; -- the column is usable
    s_usable_y    : in  std_logic; -- the row is usable; constant over a row
    s_l           : in  std_logic_vector(G_SAMPLE_W - 1 downto 0);
    s_r           : in  std_logic_vector(G_SAMPLE_W - 1 downto 0);

    m_valid    : out std_logic;
    m_last     : out std_logic; -- last cell of the plane
    m_inside   : out std_logic; -- all M*M samples are usable
    m_textured : out std_logic; -- inside, and not flat: var(l) + var(r) > 0
    m_v        : out std_logic_vector(G_MNCC_W - 1 downto 0)
  );
end entity similarity;

architecture rtl of similarity is

  constant C_N     : integer := G_WINDOW * G_WINDOW;
  constant C_GROW  : integer := clog2(G_WINDOW); -- bits that a sum of M values adds
  constant C_NGROW : integer := clog2(C_N);      -- likewise of M*M values
  constant C_NORM  : integer := G_MNCC_W + 3;
  constant C_SAT_W : integer := clog2(G_WINDOW + 1);

  -- Widths: column sums of l' (r'), x, y; their differences need one more; window sums of l' (r'); numerator and
  -- denominator, at most n^2 2^(2 G_SAMPLE_W - 1): what leads to them is needed modulo 2^C_DEN_W only.
  constant C_CL_W  : integer := G_SAMPLE_W + C_GROW;
  constant C_CX_W  : integer := 2 * G_SAMPLE_W - 1 + C_GROW;
  constant C_XY_W  : integer := 2 * C_CX_W;
  constant C_SL_W  : integer := G_SAMPLE_W + C_NGROW;
  constant C_DEN_W : integer := 2 * G_SAMPLE_W - 1 + clog2(C_N * C_N);

  -- Words of the column RAM are two bits shorter than the sums (kept, below); one with 15 rows, whose sum of y comes
  -- too near to the end of its range, and where x has less than 4 bits.
  constant C_FOLD   : boolean := 8 * G_WINDOW <= 7 * 2 ** C_GROW and C_CX_W >= 4;
  constant C_KEPT_W : integer := C_XY_W - 1 - boolean'pos(C_FOLD); -- of x and y
  constant C_C_W    : integer := C_KEPT_W + 2 * C_CL_W;

  -- The lower bits of a difference of x or y that are multiplied by themselves, and whether they are.
  constant C_LOW_W : integer := 16;
  constant C_SPLIT : boolean := G_SPLIT = 1 and C_CX_W >= 18;

  -- Delay of M rows: one circular buffer, begun anew when M rows have been written, so that it fits any row length.
  constant C_LINE_DEPTH : integer := G_WINDOW * G_MAX_COLS;

  signal next_line : unsigned(clog2(C_LINE_DEPTH) - 1 downto 0); -- s1_line of the next clock

  -- s1: counters; each describes the sample in s1
  signal s1_valid       : std_logic;
  signal s1_row_first   : std_logic;
  signal s1_plane_first : std_logic;
  signal s1_plane_last  : std_logic;
  signal s1_l           : std_logic_vector(G_SAMPLE_W - 1 downto 0);
  signal s1_r           : std_logic_vector(G_SAMPLE_W - 1 downto 0);
  signal s1_col         : unsigned(clog2(G_MAX_COLS) - 1 downto 0);
  signal s1_line        : unsigned(clog2(C_LINE_DEPTH) - 1 downto 0); -- address in the delay of M rows
  signal s1_slot        : unsigned(C_SAT_W - 1 downto 0);             -- j mod M
  signal s1_warm        : std_logic;                                  -- j >= M: there is a sample M rows above
  signal s1_before      : unsigned(C_SAT_W - 1 downto 0);             -- samples before this one in its row, at most M
  signal s1_run_x       : unsigned(C_SAT_W - 1 downto 0);             -- usable columns up to here, at most M
  signal s1_run_y       : unsigned(C_SAT_W - 1 downto 0);             -- usable rows up to here, at most M
  signal s1_wide        : std_logic;                                  -- i >= M
  signal s1_cell        : std_logic;                                  -- the window is complete
  signal s1_inside      : std_logic;

  -- s2: the sample M rows above comes out of the delay
  signal s2_valid : std_logic;
  signal s2_warm  : std_logic;
  signal s2_l     : std_logic_vector(G_SAMPLE_W - 1 downto 0);
  signal s2_r     : std_logic_vector(G_SAMPLE_W - 1 downto 0);
  signal s2_line  : std_logic_vector(clog2(C_LINE_DEPTH) - 1 downto 0);
  signal s2_col   : std_logic_vector(clog2(G_MAX_COLS) - 1 downto 0);
  signal s2_write : std_logic_vector(2 * G_SAMPLE_W - 1 downto 0);
  signal s2_old   : std_logic_vector(2 * G_SAMPLE_W - 1 downto 0);

  -- s3: new - old, and what it is multiplied with
  signal s3_valid : std_logic;
  signal s3_col   : std_logic_vector(clog2(G_MAX_COLS) - 1 downto 0);
  signal s3_a     : signed(G_SAMPLE_W downto 0);
  signal s3_c     : signed(G_SAMPLE_W downto 0);
  signal s3_l     : signed(G_SAMPLE_W - 1 downto 0);
  signal s3_r     : signed(G_SAMPLE_W - 1 downto 0);
  signal s3_l_old : signed(G_SAMPLE_W - 1 downto 0);
  signal s3_r_old : signed(G_SAMPLE_W - 1 downto 0);

  -- s4: new + old of l; the column sums come out of their RAM
  signal s4_valid  : std_logic;
  signal s4_first  : std_logic; -- j = 0
  signal s4_a      : signed(G_SAMPLE_W downto 0);
  signal s4_c      : signed(G_SAMPLE_W downto 0);
  signal s4_b      : signed(G_SAMPLE_W downto 0);
  signal s4_r      : signed(G_SAMPLE_W - 1 downto 0);
  signal s4_l_old  : signed(G_SAMPLE_W - 1 downto 0);
  signal s4_r_old  : signed(G_SAMPLE_W - 1 downto 0);
  signal s4_column : std_logic_vector(C_C_W - 1 downto 0);

  -- s5, s6, s7: column sums with the new sample; before it they are 0 in the first row
  signal s5_valid : std_logic;
  signal s5_c     : signed(G_SAMPLE_W downto 0);
  signal s5_e     : signed(G_SAMPLE_W downto 0); -- new + old of r
  signal s5_l_old : signed(G_SAMPLE_W - 1 downto 0);
  signal s5_ar    : signed(2 * G_SAMPLE_W downto 0);
  signal s5_ab    : signed(2 * G_SAMPLE_W downto 0);
  signal s5_cl    : signed(C_CL_W - 1 downto 0);
  signal s5_cr    : signed(C_CL_W - 1 downto 0);
  signal s5_cx    : signed(C_CX_W - 1 downto 0);
  signal s5_cy    : signed(C_CX_W - 1 downto 0); -- modulo 2^C_CX_W, as are s6_cy and s7_cy, never below 0
  signal s6_valid : std_logic;
  signal s6_lc    : signed(2 * G_SAMPLE_W downto 0);
  signal s6_ce    : signed(2 * G_SAMPLE_W downto 0);
  signal s6_cl    : signed(C_CL_W - 1 downto 0);
  signal s6_cr    : signed(C_CL_W - 1 downto 0);
  signal s6_cx    : signed(C_CX_W - 1 downto 0);
  signal s6_cy    : signed(C_CX_W - 1 downto 0);
  signal s7_valid : std_logic;
  signal s7_col   : std_logic_vector(clog2(G_MAX_COLS) - 1 downto 0);
  signal s7_cl    : signed(C_CL_W - 1 downto 0);
  signal s7_cr    : signed(C_CL_W - 1 downto 0);
  signal s7_cx    : signed(C_CX_W - 1 downto 0);
  signal s7_cy    : signed(C_CX_W - 1 downto 0);
  signal s7_xy     : std_logic_vector(C_XY_W - 1 downto 0);
  signal s7_column : std_logic_vector(C_C_W - 1 downto 0);

  -- Columns that leave the window, M columns back. Sums of l' and r' go ahead of those of x and y by one clock.
  signal s6_wide    : std_logic;
  signal s6_lr      : std_logic_vector(2 * C_CL_W - 1 downto 0);
  signal s6_lr_left : std_logic_vector(2 * C_CL_W - 1 downto 0);
  signal s7_wide    : std_logic;
  signal s7_xy_left : std_logic_vector(C_XY_W - 1 downto 0);
  signal s7_flags   : std_logic_vector(1 downto 0);

  -- s7, s8: new column - column that leaves; the other way round for x and y, because a constant factor below 0 would
  -- be converted wrongly. s8: window sums of l', less 1, and of r'
  signal s7_dl        : signed(C_CL_W downto 0);
  signal s7_dr        : signed(C_CL_W downto 0);
  signal s8_valid     : std_logic;
  signal s8_flags     : std_logic_vector(1 downto 0);
  signal s8_dx        : signed(C_CX_W downto 0);
  signal s8_dy        : signed(C_CX_W downto 0);
  signal s8_l         : signed(C_SL_W - 1 downto 0);
  signal s8_r         : signed(C_SL_W - 1 downto 0);

  -- s9: differences of x and y times n; with C_SPLIT the parts above C_LOW_W bits, and the lower parts, times n
  signal s9_valid     : std_logic;
  signal s9_cell      : std_logic;
  signal s9_row_first : std_logic;
  signal s9_l         : signed(C_SL_W - 1 downto 0); -- as s8_l
  signal s9_l_2       : signed(C_SL_W - 1 downto 0); -- S(l) + 1
  signal s9_r         : signed(C_SL_W - 1 downto 0);
  signal s9_n_dx      : signed(C_CX_W + C_NGROW + 1 downto 0);
  signal s9_n_dy      : signed(C_CX_W + C_NGROW + 1 downto 0);
  signal s9_n_low_x   : unsigned(C_LOW_W + C_NGROW - 1 downto 0);
  signal s9_n_low_y   : unsigned(C_LOW_W + C_NGROW - 1 downto 0);

  -- s10: -n S(x), -n S(y); S(l)^2 - 1, the -1 of what becomes the denominator inverted
  signal s10_valid : std_logic;
  signal s10_l     : signed(C_SL_W - 1 downto 0);
  signal s10_r     : signed(C_SL_W - 1 downto 0);
  signal s10_ll    : signed(2 * C_SL_W - 1 downto 0);
  signal s10_x     : signed(C_DEN_W - 1 downto 0);
  signal s10_y     : signed(C_DEN_W - 1 downto 0);

  -- s11, s12: half the numerator, S(l) S(r) - n S(x); S(l)^2 + S(r)^2 - n S(y) - 1, which is the denominator inverted
  signal s11_valid  : std_logic;
  signal s11_lr     : signed(2 * C_SL_W - 1 downto 0);
  signal s11_rr     : signed(2 * C_SL_W - 1 downto 0);
  signal s11_x      : signed(C_DEN_W - 1 downto 0);
  signal s11_y      : signed(C_DEN_W - 1 downto 0);
  signal s12_valid  : std_logic;
  signal s12_inside : std_logic;
  signal s12_half   : signed(C_DEN_W - 1 downto 0);
  signal s12_nden   : signed(C_DEN_W - 1 downto 0);

  -- s13, s14, s15: shifted left by a multiple of 16, of 4, of 1, until the leading one of den is on top
  signal s13_valid    : std_logic;
  signal s13_num      : unsigned(C_NORM + 14 downto 0);
  signal s13_den      : unsigned(C_NORM + 14 downto 0);
  signal s13_textured : std_logic_vector(0 downto 0);
  signal s14_valid    : std_logic;
  signal s14_num      : unsigned(C_NORM + 2 downto 0);
  signal s14_den      : unsigned(C_NORM + 2 downto 0);
  signal s15_valid    : std_logic;
  signal s15_num      : unsigned(C_NORM - 1 downto 0);
  signal s15_kept     : unsigned(C_NORM - 1 downto 0); -- den, inverted for divider_mul
  signal s15_den      : unsigned(C_NORM - 1 downto 0);

  -- Division and what waits for it.
  signal div_valid    : std_logic_vector(G_MNCC_W downto 0);
  signal div_quot     : std_logic_vector(G_MNCC_W - 1 downto 0);
  signal div_textured : std_logic_vector(0 downto 0);
  signal flags_out    : std_logic_vector(1 downto 0);

  attribute use_dsp48 : string;

  attribute use_dsp48 of s5_ar, s5_ab, s6_lc, s6_ce, s9_n_dx, s9_n_dy, s10_ll, s11_lr, s11_rr : signal is C_DSP;

  -- One usable flag more: the run goes on up to M, or breaks.
  function next_run (run : unsigned; usable : std_logic; restart : std_logic) return unsigned is
    variable v_run : unsigned(run'length - 1 downto 0);
  begin
    v_run := run;
    if usable = '0' then
      v_run := (others => '0');
    elsif restart = '1' then
      v_run := to_unsigned(1, run'length);
    elsif run /= G_WINDOW then
      v_run := run + 1;
    end if;
    return v_run;
  end function next_run;

  -- `high` with as many zeros below as make it `width` bits.
  function fill_low (high : unsigned; width : positive) return unsigned is
    variable v_all : unsigned(width - 1 downto 0);
  begin
    v_all := (others => '0');
    v_all(width - 1 downto width - high'length) := high;
    return v_all;
  end function fill_low;

  -- A left sample less half its range: the same bits with the top one inverted.
  function centred (sample : std_logic_vector) return signed is
    variable v_word : std_logic_vector(sample'length - 1 downto 0);
  begin
    v_word := sample;
    v_word(v_word'high) := not v_word(v_word'high);
    return signed(v_word);
  end function centred;

  -- -1 less that, of a right sample.
  function mirrored (sample : std_logic_vector) return signed is
  begin
    return not centred(sample);
  end function mirrored;

  -- `number` modulo 2^width, where numeric_std's resize would keep the sign.
  function fit (number : signed; width : positive) return signed is
    variable v_wide : signed(imax(width, number'length) - 1 downto 0);
  begin
    v_wide := resize(number, v_wide'length);
    return v_wide(width - 1 downto 0);
  end function fit;

  -- What the column RAM keeps of a column's sums of y and x. Bit 0 of y is left out: squares are odd where l' and r'
  -- are, so it follows from their sums. Of t, the upper 3 bits of y, and u, the upper 4 of x, one bit is left out:
  -- 2 |x| <= y says that -t-1 <= u <= t, so that rows t and 6-t of a table of u have 16 places together. Rows 0, 1, 2
  -- take those that rows 6, 5, 4 leave free: kept are the number of the pair of rows, and u with its sign inverted in
  -- rows 0, 1, 2. t = 7 is the largest y of 7 rows, all samples at the low end: u = 7, which row 3 leaves free.
  constant C_T : integer := C_XY_W - 4; -- place of t where bit 0 of y is left out, of u
  constant C_U : integer := C_CX_W - 4;

  function kept (y, x : signed) return std_logic_vector is
    variable v_xy    : std_logic_vector(C_XY_W - 2 downto 0);
    variable v_lower : std_logic; -- t < 3
  begin
    v_xy := std_logic_vector(y(C_CX_W - 1 downto 1)) & std_logic_vector(x);
    if C_FOLD then
      v_lower       := not (v_xy(C_T + 2) or (v_xy(C_T + 1) and v_xy(C_T)));
      v_xy(C_T + 1) := v_xy(C_T + 1) xor (v_xy(C_T + 2) and not v_xy(C_T));
      v_xy(C_U + 3) := v_xy(C_U + 3) xor v_lower;
    end if;
    return v_xy(C_KEPT_W - 1 downto 0);
  end function kept;

  -- The reverse: y and x.
  function restored (word : std_logic_vector; odd : std_logic) return std_logic_vector is
    variable v_xy   : std_logic_vector(C_XY_W - 2 downto 0);
    variable v_pair : unsigned(1 downto 0);
    variable v_size : unsigned(2 downto 0); -- u, or -1-u where it is below 0
  begin
    v_xy                        := (others => '0');
    v_xy(C_KEPT_W - 1 downto 0) := word;
    if C_FOLD then
      v_pair := unsigned(v_xy(C_T + 1 downto C_T));
      v_size := unsigned(v_xy(C_U + 2 downto C_U));
      if v_xy(C_U + 3) = '1' then
        v_size := not v_size;
      end if;
      if resize(v_size, 4) + resize(v_pair, 4) < 7 then
        -- Row 6, 5, 4 or 3.
        v_xy(C_T + 2) := not (v_pair(1) and v_pair(0));
        v_xy(C_T + 1) := v_pair(1) xnor v_pair(0);
      else
        -- Row 0, 1, 2 or 7.
        v_xy(C_T + 2) := v_pair(1) and v_pair(0);
        v_xy(C_U + 3) := v_xy(C_U + 3) xnor v_xy(C_T + 2);
      end if;
    end if;
    return v_xy(C_XY_W - 2 downto C_CX_W) & odd & v_xy(C_CX_W - 1 downto 0);
  end function restored;

begin

  assert G_WINDOW >= 3 and G_WINDOW <= 21 and G_WINDOW mod 2 = 1
    report "similarity: G_WINDOW"
           -- synthesis translate_off
           & "=" & integer'image(G_WINDOW)
           -- synthesis translate_on
           & " outside 3..21 or even"
    severity failure;
  assert G_SAMPLE_W >= 1 and G_SAMPLE_W <= 20
    report "similarity: G_SAMPLE_W"
           -- synthesis translate_off
           & "=" & integer'image(G_SAMPLE_W)
           -- synthesis translate_on
           & " outside 1..20"
    severity failure;
  assert G_MNCC_W >= 4 and G_MNCC_W <= 16
    report "similarity: G_MNCC_W"
           -- synthesis translate_off
           & "=" & integer'image(G_MNCC_W)
           -- synthesis translate_on
           & " outside 4..16"
    severity failure;
  assert G_DIVIDER = 0 or G_DIVIDER = 1
    report "similarity: G_DIVIDER"
           -- synthesis translate_off
           & "=" & integer'image(G_DIVIDER)
           -- synthesis translate_on
           & " is neither 0 nor 1"
    severity failure;
  assert G_SPLIT = 0 or G_SPLIT = 1
    report "similarity: G_SPLIT"
           -- synthesis translate_off
           & "=" & integer'image(G_SPLIT)
           -- synthesis translate_on
           & " is neither 0 nor 1"
    severity failure;
  assert G_MAX_COLS >= G_WINDOW and G_MAX_COLS <= 4096
    report "similarity: G_MAX_COLS"
           -- synthesis translate_off
           & "=" & integer'image(G_MAX_COLS)
           -- synthesis translate_on
           & " outside G_WINDOW..4096"
    severity failure;

  -- s1 ---------------------------------------------------------------------------------------------------------------
  p_next_line : process (s_valid, s_row_first, s_plane_first, s1_slot, s1_line)
  begin
    next_line <= s1_line;
    if s_valid = '1' then
      next_line <= s1_line + 1;
      if s_row_first = '1' and (s_plane_first = '1' or s1_slot = G_WINDOW - 1) then
        next_line <= (others => '0');
      end if;
    end if;
  end process p_next_line;

  p_count : process (clk)
  begin
    if rising_edge(clk) then
      s1_valid       <= s_valid;
      s1_row_first   <= s_row_first;
      s1_plane_first <= s_plane_first;
      s1_plane_last  <= s_plane_last;
      s1_l           <= s_l;
      s1_r           <= s_r;
      s1_line        <= next_line;
      if s_valid = '1' then
        s1_run_x <= next_run(s1_run_x, s_usable_x, s_row_first);
        if s_row_first = '1' then
          s1_col    <= (others => '0');
          s1_before <= (others => '0');
          s1_run_y  <= next_run(s1_run_y, s_usable_y, s_plane_first);
          if s_plane_first = '1' then
            s1_slot <= (others => '0');
            s1_warm <= '0';
          elsif s1_slot = G_WINDOW - 1 then
            s1_slot <= (others => '0');
            s1_warm <= '1';
          else
            s1_slot <= s1_slot + 1;
          end if;
        else
          s1_col <= s1_col + 1;
          if s1_wide = '0' then
            s1_before <= s1_before + 1;
          end if;
        end if;
      end if;
      if rst = '1' then
        s1_valid <= '0';
        -- Addresses must be legal from the first clock on.
        s1_col   <= (others => '0');
        s1_line  <= (others => '0');
      end if;
    end if;
  end process p_count;

  s1_wide   <= to_sl(s1_before = G_WINDOW);
  s1_cell   <= s1_valid and to_sl(s1_before >= G_WINDOW - 1) and (s1_warm or to_sl(s1_slot = G_WINDOW - 1));
  s1_inside <= to_sl(s1_run_x = G_WINDOW) and to_sl(s1_run_y = G_WINDOW);

  -- Bits that wait for the stage which needs them.

  u_first : entity work.delay_line
    generic map (
      G_DATA_W => 1,
      G_DELAY  => 3
    )
    port map (
      clk       => clk,
      ce        => '1',
      s_data(0) => s1_plane_first,
      m_data(0) => s4_first
    );

  u_wide : entity work.delay_line
    generic map (
      G_DATA_W => 1,
      G_DELAY  => 5
    )
    port map (
      clk       => clk,
      ce        => '1',
      s_data(0) => s1_wide,
      m_data(0) => s6_wide
    );

  u_row_first : entity work.delay_line
    generic map (
      G_DATA_W => 2,
      G_DELAY  => 6
    )
    port map (
      clk       => clk,
      ce        => '1',
      s_data(1) => s1_cell,
      s_data(0) => s1_row_first,
      m_data    => s7_flags
    );

  u_inside : entity work.delay_line
    generic map (
      G_DATA_W => 1,
      G_DELAY  => 11
    )
    port map (
      clk       => clk,
      ce        => '1',
      s_data(0) => s1_inside,
      m_data(0) => s12_inside
    );

  u_out : entity work.delay_line
    generic map (
      G_DATA_W => 2,
      G_DELAY  => G_MNCC_W + 14
    )
    port map (
      clk       => clk,
      ce        => '1',
      s_data(1) => s1_inside,
      s_data(0) => s1_plane_last,
      m_data    => flags_out
    );

  -- s2: delay of M rows ----------------------------------------------------------------------------------------------
  -- A word is read two clocks before it is replaced: the buffer holds exactly M rows.
  s2_write <= s2_r & s2_l;

  u_lines : entity work.ram_wide
    generic map (
      G_DATA_W  => 2 * G_SAMPLE_W,
      G_DEPTH   => C_LINE_DEPTH,
      G_LATENCY => 2
    )
    port map (
      clk   => clk,
      we    => s2_valid,
      waddr => s2_line,
      wdata => s2_write,
      raddr => std_logic_vector(next_line),
      rdata => s2_old
    );

  p_s2 : process (clk)
  begin
    if rising_edge(clk) then
      s2_valid <= s1_valid;
      s2_warm  <= s1_warm;
      s2_l     <= s1_l;
      s2_r     <= s1_r;
      s2_line  <= std_logic_vector(s1_line);
      s2_col   <= std_logic_vector(s1_col);
      if rst = '1' then
        s2_valid <= '0';
      end if;
    end if;
  end process p_s2;

  -- s3 - s7: column sums ---------------------------------------------------------------------------------------------
  u_col : entity work.delay_line
    generic map (
      G_DATA_W => clog2(G_MAX_COLS),
      G_DELAY  => 4
    )
    port map (
      clk    => clk,
      ce     => '1',
      s_data => s3_col,
      m_data => s7_col
    );

  u_columns : entity work.ram_sdp
    generic map (
      G_DATA_W  => C_C_W,
      G_DEPTH   => G_MAX_COLS,
      G_LATENCY => 2
    )
    port map (
      clk   => clk,
      we    => s7_valid,
      waddr => s7_col,
      wdata => s7_column,
      raddr => s2_col,
      rdata => s4_column
    );

  p_columns : process (clk)
    variable v_l     : signed(G_SAMPLE_W - 1 downto 0);
    variable v_r     : signed(G_SAMPLE_W - 1 downto 0);
    variable v_l_old : signed(G_SAMPLE_W - 1 downto 0);
    variable v_r_old : signed(G_SAMPLE_W - 1 downto 0);
    variable v_cl    : signed(C_CL_W - 1 downto 0);
    variable v_cr    : signed(C_CL_W - 1 downto 0);
    variable v_xy    : std_logic_vector(C_XY_W - 1 downto 0);
  begin
    if rising_edge(clk) then
      -- s3
      s3_valid <= s2_valid;
      s3_col   <= s2_col;
      v_l      := centred(s2_l);
      v_r      := mirrored(s2_r);
      v_l_old  := centred(s2_old(G_SAMPLE_W - 1 downto 0));
      v_r_old  := mirrored(s2_old(2 * G_SAMPLE_W - 1 downto G_SAMPLE_W));
      if s2_warm = '0' then
        v_l_old := (others => '0');
        v_r_old := (others => '0');
      end if;
      s3_l     <= v_l;
      s3_r     <= v_r;
      s3_l_old <= v_l_old;
      s3_r_old <= v_r_old;
      s3_a     <= resize(v_l, G_SAMPLE_W + 1) - resize(v_l_old, G_SAMPLE_W + 1);
      s3_c     <= resize(v_r, G_SAMPLE_W + 1) - resize(v_r_old, G_SAMPLE_W + 1);
      -- s4
      s4_valid <= s3_valid;
      s4_a     <= s3_a;
      s4_c     <= s3_c;
      s4_r     <= s3_r;
      s4_l_old <= s3_l_old;
      s4_r_old <= s3_r_old;
      s4_b     <= resize(s3_l, G_SAMPLE_W + 1) + resize(s3_l_old, G_SAMPLE_W + 1);
      -- s5
      s5_valid <= s4_valid;
      s5_c     <= s4_c;
      s5_l_old <= s4_l_old;
      s5_e     <= resize(s4_r, G_SAMPLE_W + 1) + resize(s4_r_old, G_SAMPLE_W + 1);
      s5_ar    <= s4_a * s4_r;
      s5_ab    <= fit(s4_b * s4_a, 2 * G_SAMPLE_W + 1);
      v_cl     := signed(s4_column(C_CL_W - 1 downto 0));
      v_cr     := signed(s4_column(2 * C_CL_W - 1 downto C_CL_W));
      v_xy     := restored(s4_column(C_C_W - 1 downto 2 * C_CL_W), v_cl(0) xor v_cr(0));
      if s4_first = '1' then
        v_cl := (others => '0');
        v_cr := (others => '0');
        v_xy := (others => '0');
      end if;
      s5_cx <= signed(v_xy(C_CX_W - 1 downto 0));
      s5_cy <= signed(v_xy(C_XY_W - 1 downto C_CX_W));
      s5_cl <= v_cl + resize(s4_a, C_CL_W);
      s5_cr <= v_cr + resize(s4_c, C_CL_W);
      -- s6
      s6_valid <= s5_valid;
      s6_lc    <= s5_c * s5_l_old;
      s6_ce    <= fit(s5_e * s5_c, 2 * G_SAMPLE_W + 1);
      s6_cl    <= s5_cl;
      s6_cr    <= s5_cr;
      s6_cx    <= s5_cx + fit(s5_ar, C_CX_W);
      s6_cy    <= s5_cy + fit(s5_ab, C_CX_W);
      -- s7
      s7_valid <= s6_valid;
      s7_cl    <= s6_cl;
      s7_cr    <= s6_cr;
      s7_cx    <= s6_cx + fit(s6_lc, C_CX_W);
      s7_cy    <= s6_cy + fit(s6_ce, C_CX_W);
      if rst = '1' then
        s3_valid <= '0';
        s4_valid <= '0';
        s5_valid <= '0';
        s6_valid <= '0';
        s7_valid <= '0';
      end if;
    end if;
  end process p_columns;

  s7_xy     <= std_logic_vector(s7_cy) & std_logic_vector(s7_cx);
  s7_column <= kept(s7_cy, s7_cx) & std_logic_vector(s7_cr) & std_logic_vector(s7_cl);

  -- s7 - s10: window sums ---------------------------------------------------------------------------------------------
  s6_lr <= std_logic_vector(s6_cr) & std_logic_vector(s6_cl);

  u_leaving_lr : entity work.delay_line
    generic map (
      G_DATA_W => 2 * C_CL_W,
      G_DELAY  => G_WINDOW
    )
    port map (
      clk    => clk,
      ce     => s6_valid,
      s_data => s6_lr,
      m_data => s6_lr_left
    );

  u_leaving_xy : entity work.delay_line
    generic map (
      G_DATA_W => 2 * C_CX_W,
      G_DELAY  => G_WINDOW
    )
    port map (
      clk    => clk,
      ce     => s7_valid,
      s_data => s7_xy,
      m_data => s7_xy_left
    );

  p_window : process (clk)
    variable v_lr : std_logic_vector(2 * C_CL_W - 1 downto 0);
    variable v_xy : std_logic_vector(C_XY_W - 1 downto 0);
    variable v_l  : signed(C_SL_W - 1 downto 0);
    variable v_r  : signed(C_SL_W - 1 downto 0);
    variable v_x  : signed(C_DEN_W - 1 downto 0);
    variable v_y  : signed(C_DEN_W - 1 downto 0);
  begin
    if rising_edge(clk) then
      -- s7
      s7_wide <= s6_wide;
      v_lr    := s6_lr_left;
      if s6_wide = '0' then
        v_lr := (others => '0');
      end if;
      s7_dl <= resize(s6_cl, C_CL_W + 1) - resize(signed(v_lr(C_CL_W - 1 downto 0)), C_CL_W + 1);
      s7_dr <= resize(s6_cr, C_CL_W + 1) - resize(signed(v_lr(2 * C_CL_W - 1 downto C_CL_W)), C_CL_W + 1);
      -- s8
      s8_valid <= s7_valid;
      s8_flags <= s7_flags;
      v_xy     := s7_xy_left;
      if s7_wide = '0' then
        v_xy := (others => '0');
      end if;
      s8_dx <= resize(signed(v_xy(C_CX_W - 1 downto 0)), C_CX_W + 1) - resize(s7_cx, C_CX_W + 1);
      s8_dy <= signed('0' & v_xy(C_XY_W - 1 downto C_CX_W)) - signed('0' & s7_cy);
      if s7_valid = '1' then
        v_l := s8_l;
        v_r := s8_r;
        if s7_flags(0) = '1' then
          v_l := (others => s7_flags(0)); -- ones; as a constant of this width they would be converted wrongly
          v_r := (others => '0');
        end if;
        s8_l <= v_l + resize(s7_dl, C_SL_W);
        s8_r <= v_r + resize(s7_dr, C_SL_W);
      end if;
      -- s9
      s9_valid     <= s8_valid;
      s9_cell      <= s8_flags(1);
      s9_row_first <= s8_flags(0);
      s9_l         <= s8_l;
      s9_l_2       <= (s8_l(C_SL_W - 1 downto 1) + 1) & s8_l(0); -- + 2; as one sum Yosys 0.70 packs it wrongly
      s9_r         <= s8_r;
      if C_SPLIT then
        s9_n_dx    <= resize(s8_dx(C_CX_W downto C_LOW_W) * to_signed(C_N, C_NGROW + 1), s9_n_dx'length);
        s9_n_dy    <= resize(s8_dy(C_CX_W downto C_LOW_W) * to_signed(C_N, C_NGROW + 1), s9_n_dy'length);
        s9_n_low_x <= unsigned(s8_dx(C_LOW_W - 1 downto 0)) * to_unsigned(C_N, C_NGROW);
        s9_n_low_y <= unsigned(s8_dy(C_LOW_W - 1 downto 0)) * to_unsigned(C_N, C_NGROW);
      else
        s9_n_dx <= s8_dx * to_signed(C_N, C_NGROW + 1);
        s9_n_dy <= s8_dy * to_signed(C_N, C_NGROW + 1);
      end if;
      -- s10
      s10_valid <= s9_valid and s9_cell;
      s10_l     <= (s9_l(C_SL_W - 1 downto 1) + signed('0' & s9_l(0 downto 0))) & not s9_l(0); -- + 1, same reason
      s10_r     <= s9_r;
      s10_ll    <= s9_l_2 * s9_l;
      if s9_valid = '1' then
        v_x := s10_x;
        v_y := s10_y;
        if s9_row_first = '1' then
          v_x := (others => '0');
          v_y := (others => '0');
        end if;
        if C_SPLIT then
          s10_x <= v_x + fit(s9_n_dx & to_signed(0, C_LOW_W), C_DEN_W) + fit(signed('0' & s9_n_low_x), C_DEN_W);
          s10_y <= v_y + fit(s9_n_dy & to_signed(0, C_LOW_W), C_DEN_W) + fit(signed('0' & s9_n_low_y), C_DEN_W);
        else
          s10_x <= v_x + fit(s9_n_dx, C_DEN_W);
          s10_y <= v_y + fit(s9_n_dy, C_DEN_W);
        end if;
      end if;
      if rst = '1' then
        s8_valid <= '0';
        s9_valid <= '0';
        s10_valid <= '0';
      end if;
    end if;
  end process p_window;

  -- s11, s12: numerator and denominator ------------------------------------------------------------------------------
  p_fraction : process (clk)
  begin
    if rising_edge(clk) then
      -- s11
      s11_valid <= s10_valid;
      s11_x     <= s10_x;
      s11_lr    <= s10_l * s10_r;
      s11_y     <= s10_y + fit(s10_ll, C_DEN_W);
      s11_rr    <= s10_r * s10_r;
      -- s12
      s12_valid <= s11_valid;
      s12_half  <= s11_x + fit(s11_lr, C_DEN_W);
      s12_nden  <= s11_y + fit(s11_rr, C_DEN_W);
      if rst = '1' then
        s11_valid <= '0';
        s12_valid <= '0';
      end if;
    end if;
  end process p_fraction;

  -- s13 - s15: normalisation -----------------------------------------------------------------------------------------
  p_normalise : process (clk)
    variable v_num     : unsigned(63 downto 0);
    variable v_den     : unsigned(63 downto 0);
    variable v_low_num : unsigned(63 downto 0); -- the low half, and zeros that a shift by 48 moves in
    variable v_low_den : unsigned(63 downto 0);
    variable v_s15_den : unsigned(C_NORM - 1 downto 0);
  begin
    if rising_edge(clk) then
      -- s13
      s13_valid       <= s12_valid;
      v_num           := fill_low(unsigned(s12_half(C_DEN_W - 2 downto 0)) & '0', 64);
      v_den           := fill_low(unsigned(not s12_nden), 64);
      s13_textured(0) <= s12_inside and to_sl(v_den /= 0);
      v_low_num       := v_num(31 downto 0) & to_unsigned(0, 32);
      v_low_den       := v_den(31 downto 0) & to_unsigned(0, 32);
      if v_den(63 downto 48) /= 0 then
        s13_num <= v_num(63 downto 49 - C_NORM);
        s13_den <= v_den(63 downto 49 - C_NORM);
      elsif v_den(47 downto 32) /= 0 then
        s13_num <= v_num(47 downto 33 - C_NORM);
        s13_den <= v_den(47 downto 33 - C_NORM);
      elsif v_den(31 downto 16) /= 0 then
        s13_num <= v_low_num(63 downto 49 - C_NORM);
        s13_den <= v_low_den(63 downto 49 - C_NORM);
      else
        s13_num <= v_low_num(47 downto 33 - C_NORM);
        s13_den <= v_low_den(47 downto 33 - C_NORM);
      end if;
      if s12_half(C_DEN_W - 1) = '1' then
        s13_num <= (others => '0');
      end if;
      -- s14
      s14_valid <= s13_valid;
      if s13_den(C_NORM + 14 downto C_NORM + 11) /= 0 then
        s14_num <= s13_num(C_NORM + 14 downto 12);
        s14_den <= s13_den(C_NORM + 14 downto 12);
      elsif s13_den(C_NORM + 10 downto C_NORM + 7) /= 0 then
        s14_num <= s13_num(C_NORM + 10 downto 8);
        s14_den <= s13_den(C_NORM + 10 downto 8);
      elsif s13_den(C_NORM + 6 downto C_NORM + 3) /= 0 then
        s14_num <= s13_num(C_NORM + 6 downto 4);
        s14_den <= s13_den(C_NORM + 6 downto 4);
      else
        s14_num <= s13_num(C_NORM + 2 downto 0);
        s14_den <= s13_den(C_NORM + 2 downto 0);
      end if;
      -- s15
      s15_valid <= s14_valid;
      if s14_den(C_NORM + 2) = '1' then
        s15_num   <= s14_num(C_NORM + 2 downto 3);
        v_s15_den := s14_den(C_NORM + 2 downto 3);
      elsif s14_den(C_NORM + 1) = '1' then
        s15_num   <= s14_num(C_NORM + 1 downto 2);
        v_s15_den := s14_den(C_NORM + 1 downto 2);
      elsif s14_den(C_NORM) = '1' then
        s15_num   <= s14_num(C_NORM downto 1);
        v_s15_den := s14_den(C_NORM downto 1);
      else
        s15_num   <= s14_num(C_NORM - 1 downto 0);
        v_s15_den := s14_den(C_NORM - 1 downto 0);
      end if;
      s15_kept <= v_s15_den;
      if G_DIVIDER = 1 then
        s15_kept <= not v_s15_den;
      end if;
      if rst = '1' then
        s13_valid <= '0';
        s14_valid <= '0';
        s15_valid <= '0';
      end if;
    end if;
  end process p_normalise;

  s15_den <= s15_kept when G_DIVIDER = 0 else not s15_kept;

  -- Division ---------------------------------------------------------------------------------------------------------
  g_steps : if G_DIVIDER = 0 generate
    signal num : std_logic_vector(C_NORM downto 0);
  begin

    num <= '0' & std_logic_vector(s15_num);

    u_divider : entity work.divider
      generic map (
        G_NUM_W  => C_NORM,
        G_QUOT_W => G_MNCC_W
      )
      port map (
        clk    => clk,
        s_num  => num,
        s_den  => std_logic_vector(s15_den),
        m_quot => div_quot
      );

  end generate g_steps;

  g_products : if G_DIVIDER /= 0 generate
    signal nden : std_logic_vector(C_NORM - 1 downto 0);
  begin

    nden <= not std_logic_vector(s15_den);

    u_divider : entity work.divider_mul
      generic map (
        G_QUOT_W => G_MNCC_W
      )
      port map (
        clk    => clk,
        s_num  => std_logic_vector(s15_num),
        s_nden => nden,
        m_quot => div_quot
      );

  end generate g_products;

  u_textured : entity work.delay_line
    generic map (
      G_DATA_W => 1,
      G_DELAY  => G_MNCC_W + 2
    )
    port map (
      clk    => clk,
      ce     => '1',
      s_data => s13_textured,
      m_data => div_textured
    );

  p_out : process (clk)
  begin
    if rising_edge(clk) then
      div_valid  <= div_valid(G_MNCC_W - 1 downto 0) & s15_valid;
      m_last     <= flags_out(0);
      m_inside   <= flags_out(1);
      m_textured <= div_textured(0);
      m_v        <= div_quot;
      if div_textured(0) = '0' then
        m_v <= (others => '0');
      end if;
      if rst = '1' then
        div_valid <= (others => '0');
      end if;
    end if;
  end process p_out;

  m_valid <= div_valid(G_MNCC_W);

  -- synthesis translate_off
  -- Rules, in simulators.
  p_rules : process (clk)
    variable v_gap  : natural := C_ROW_MIN; -- clocks since the strobe of a row, at most C_ROW_MIN
    variable v_den  : unsigned(C_DEN_W downto 0);
    variable v_half : unsigned(C_DEN_W downto 0);
  begin
    if rising_edge(clk) then
      if s_valid = '1' and s_row_first = '1' then
        assert v_gap >= C_ROW_MIN
          report "similarity: a row too close to the one before"
          severity failure;
        v_gap := 0;
      end if;
      if v_gap < C_ROW_MIN then
        v_gap := v_gap + 1;
      end if;
      assert s2_valid /= '1' or s2_warm = '0' or not is_x(s2_old)
        report "similarity: the sample M rows above is unknown: never written, or read in the clock of its write"
        severity failure;
      assert s4_valid /= '1' or s4_first = '1' or not is_x(s4_column)
        report "similarity: the sums of a column are unknown: never written, or read in the clock of their write"
        severity failure;
      if s8_valid = '1' and s8_flags(1) = '1' then
        assert s8_l >= -C_N * 2 ** (G_SAMPLE_W - 1) - 1 and s8_l < C_N * 2 ** (G_SAMPLE_W - 1) - 1
          report "similarity: the sum of l is out of range"
          severity failure;
        assert s8_r >= -C_N * 2 ** (G_SAMPLE_W - 1) and s8_r < C_N * 2 ** (G_SAMPLE_W - 1)
          report "similarity: the sum of r is out of range"
          severity failure;
      end if;
      if s12_valid = '1' then
        -- 2 |cov| <= var + var. Sums are kept modulo their width, so this tells a lost carry, too.
        v_den  := resize(unsigned(not s12_nden), C_DEN_W + 1);
        v_half := unsigned(s12_half(C_DEN_W - 1) & s12_half);
        if s12_half(C_DEN_W - 1) = '1' then
          v_half := 0 - v_half;
        end if;
        assert v_half(C_DEN_W - 1 downto 0) & '0' <= v_den
          report "similarity: the covariance is larger than the variances allow"
          severity failure;
      end if;
      if s15_valid = '1' then
        assert s15_num <= s15_den and (s15_den = 0 or s15_den(C_NORM - 1) = '1')
          report "similarity: the quotient's operands are not normalised, or its numerator is the larger one"
          severity failure;
      end if;
    end if;
  end process p_rules;
  -- synthesis translate_on

end architecture rtl;
