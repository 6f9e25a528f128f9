-- SPDX-License-Identifier: Apache-2.0
-- interpolation: one bilinear sample of each image per clock (paper, section 4.2.1), exact until one final rounding.
--   Rate     : one sample per clock
--   Latency  : interpolation_latency = 6 clocks from s_* to m_*, 3 with G_RECTIFIED
--   Numbers  : pixels ufix(G_PIX_W,0), fractions ufix(0,G_WEIGHT_W), result ufix(G_PIX_W,G_INTERP_F), rounded half up;
--              the result cannot exceed the largest of the four pixels, so there is no saturation
--   Structure: three linear interpolations a + (b - a) f per image: upper row, lower row, between the rows. Each is one
--              25x18 multiplier with its adders. Half a unit of the result, 2^(2W-F-1), is added where bits are free:
--              for F < W as 2^(W-F-1) on both rows (their difference stays the same), else between the rows.
--   Rectified: with G_RECTIFIED = 1 fy is 0 and the lower row is ignored; one linear interpolation per image, s1 to s3,
--              with the same results
--   Unusable : the sample is 0 unless it is usable in x and y
--   Reset    : clears the valids; data have no reset
--   Golden   : sw/golden/interpolation.hpp
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;

entity interpolation is
  generic (
    G_PIX_W     : integer := 8;
    G_WEIGHT_W  : integer := 8;
    G_INTERP_F  : integer := 2;
    G_RECTIFIED : integer := 0
  );
  port (
    clk : in  std_logic;
    rst : in  std_logic;

    -- As storage's m_*; s_fy_* hold for a row of at least 8 clocks.
    s_valid       : in  std_logic;
    s_row_first   : in  std_logic;
    s_plane_first : in  std_logic;
    s_plane_last  : in  std_logic;
    s_usable_x    : in  std_logic;
    s_usable_y    : in  std_logic;
    s_fx_left     : in  std_logic_vector(G_WEIGHT_W - 1 downto 0);
    s_fy_left     : in  std_logic_vector(G_WEIGHT_W - 1 downto 0);
    s_fx_right    : in  std_logic_vector(G_WEIGHT_W - 1 downto 0);
    s_fy_right    : in  std_logic_vector(G_WEIGHT_W - 1 downto 0);
    s_p00_left    : in  std_logic_vector(G_PIX_W - 1 downto 0);
    s_p10_left    : in  std_logic_vector(G_PIX_W - 1 downto 0);
    s_p01_left    : in  std_logic_vector(G_PIX_W - 1 downto 0);
    s_p11_left    : in  std_logic_vector(G_PIX_W - 1 downto 0);
    s_p00_right   : in  std_logic_vector(G_PIX_W - 1 downto 0);
    s_p10_right   : in  std_logic_vector(G_PIX_W - 1 downto 0);
    s_p01_right   : in  std_logic_vector(G_PIX_W - 1 downto 0);
    s_p11_right   : in  std_logic_vector(G_PIX_W - 1 downto 0);

    m_valid       : out std_logic;
    m_row_first   : out std_logic;
    m_plane_first : out std_logic;
    m_plane_last  : out std_logic;
    m_usable_x    : out std_logic;
    m_usable_y    : out std_logic;
    m_l           : out std_logic_vector(G_PIX_W + G_INTERP_F - 1 downto 0);
    m_r           : out std_logic_vector(G_PIX_W + G_INTERP_F - 1 downto 0)
  );
end entity interpolation;

architecture rtl of interpolation is

  constant C_ROW_W   : integer := G_PIX_W + G_WEIGHT_W;     -- a row's interpolant, ufix(G_PIX_W,G_WEIGHT_W)
  constant C_EXACT_W : integer := G_PIX_W + 2 * G_WEIGHT_W; -- the exact result, ufix(G_PIX_W,2*G_WEIGHT_W)
  constant C_OUT_W   : integer := G_PIX_W + G_INTERP_F;
  constant C_DROP    : integer := 2 * G_WEIGHT_W - G_INTERP_F;

  -- The unit vector of bit k, width w; 0 if the bit is outside.
  function one_bit (k, w : integer) return signed is
    variable v_result : signed(w - 1 downto 0);
  begin
    v_result := (others => '0');
    for n in 0 to w - 1 loop
      if n = k then
        v_result(n) := '1';
      end if;
    end loop;
    return v_result;
  end function one_bit;

  -- Half a unit of the result, on the rows' interpolants or, if those have no bit so low, on the exact result.
  constant C_HALF_ROW : signed(C_ROW_W downto 0) := one_bit(G_WEIGHT_W - G_INTERP_F - 1, C_ROW_W + 1);

  function half_exact return signed is
  begin
    if G_INTERP_F < G_WEIGHT_W then
      return one_bit(-1, C_EXACT_W + 1);
    end if;
    return one_bit(C_DROP - 1, C_EXACT_W + 1);
  end function half_exact;

  constant C_HALF_EXACT : signed(C_EXACT_W downto 0) := half_exact;

  -- a * b without the top bit, which repeats the sign as b is never the most negative number.
  function product (a, b : signed) return signed is
    variable v_full : signed(a'length + b'length - 1 downto 0);
  begin
    v_full := a * b;
    return v_full(a'length + b'length - 2 downto 0);
  end function product;

  -- The result's bits of the exact sum, which is not negative.
  function drop (exact : signed) return std_logic_vector is
    variable v_exact    : signed(C_EXACT_W downto 0);
    variable v_extended : unsigned(C_EXACT_W + 8 downto 0);
  begin
    v_exact    := exact;
    v_extended := unsigned(v_exact) & "00000000"; -- for G_INTERP_F > 2 * G_WEIGHT_W
    return std_logic_vector(v_extended(C_DROP + 7 + C_OUT_W downto C_DROP + 8));
  end function drop;

  constant C_LAST : positive := interpolation_latency(G_RECTIFIED) - 1; -- the stage before the output

  -- Way of the strobes, index = stage.
  signal valid       : std_logic_vector(C_LAST downto 1);
  signal row_first   : std_logic_vector(C_LAST downto 1);
  signal plane_first : std_logic_vector(C_LAST downto 1);
  signal plane_last  : std_logic_vector(C_LAST downto 1);
  signal usable_x    : std_logic_vector(C_LAST downto 1);
  signal usable_y    : std_logic_vector(C_LAST downto 1);

  -- Both images behind each other, the left one in the low half, so that one generate serves both.
  signal s0_fx  : std_logic_vector(2 * G_WEIGHT_W - 1 downto 0);
  signal s0_fy  : std_logic_vector(2 * G_WEIGHT_W - 1 downto 0);
  signal s0_p00 : std_logic_vector(2 * G_PIX_W - 1 downto 0);
  signal s0_p10 : std_logic_vector(2 * G_PIX_W - 1 downto 0);
  signal s0_p01 : std_logic_vector(2 * G_PIX_W - 1 downto 0);
  signal s0_p11 : std_logic_vector(2 * G_PIX_W - 1 downto 0);
  signal s6_out : std_logic_vector(2 * C_OUT_W - 1 downto 0);

begin

  assert G_PIX_W >= 1 and G_PIX_W <= 12
    report "interpolation: G_PIX_W"
           -- synthesis translate_off
           & "=" & integer'image(G_PIX_W)
           -- synthesis translate_on
           & " outside 1..12"
    severity failure;
  assert G_WEIGHT_W >= 1 and G_WEIGHT_W <= 12
    report "interpolation: G_WEIGHT_W"
           -- synthesis translate_off
           & "=" & integer'image(G_WEIGHT_W)
           -- synthesis translate_on
           & " outside 1..12"
    severity failure;
  assert G_INTERP_F >= 0 and G_INTERP_F <= 8
    report "interpolation: G_INTERP_F"
           -- synthesis translate_off
           & "=" & integer'image(G_INTERP_F)
           -- synthesis translate_on
           & " outside 0..8"
    severity failure;
  assert G_RECTIFIED = 0 or G_RECTIFIED = 1
    report "interpolation: G_RECTIFIED"
           -- synthesis translate_off
           & "=" & integer'image(G_RECTIFIED)
           -- synthesis translate_on
           & " is neither 0 nor 1"
    severity failure;

  s0_fx  <= s_fx_right & s_fx_left;
  s0_fy  <= s_fy_right & s_fy_left;
  s0_p00 <= s_p00_right & s_p00_left;
  s0_p10 <= s_p10_right & s_p10_left;
  s0_p01 <= s_p01_right & s_p01_left;
  s0_p11 <= s_p11_right & s_p11_left;

  g_image : for n in 0 to 1 generate
    signal fx  : std_logic_vector(G_WEIGHT_W - 1 downto 0);
    signal p00 : std_logic_vector(G_PIX_W - 1 downto 0);
    signal p10 : std_logic_vector(G_PIX_W - 1 downto 0);
    -- s1: difference along the row, sfix(G_PIX_W+1,0)
    signal s1_fx          : signed(G_WEIGHT_W downto 0);
    signal s1_upper_step  : signed(G_PIX_W downto 0);
    signal s1_upper_start : signed(C_ROW_W downto 0);
    -- s2: times fx
    signal s2_upper_product : signed(C_ROW_W downto 0);
    signal s2_upper_start   : signed(C_ROW_W downto 0);
    signal s2_upper         : signed(C_ROW_W downto 0);
    -- s6 (s3 with G_RECTIFIED): result, ufix(G_PIX_W,G_INTERP_F)
    signal s6_sample : std_logic_vector(C_OUT_W - 1 downto 0);

    attribute use_dsp48 : string;

    attribute use_dsp48 of s2_upper_product : signal is C_DSP;
  begin

    fx  <= s0_fx((n + 1) * G_WEIGHT_W - 1 downto n * G_WEIGHT_W);
    p00 <= s0_p00((n + 1) * G_PIX_W - 1 downto n * G_PIX_W);
    p10 <= s0_p10((n + 1) * G_PIX_W - 1 downto n * G_PIX_W);

    p_upper : process (clk)
    begin
      if rising_edge(clk) then
        s1_fx            <= signed('0' & fx);
        s1_upper_step    <= signed('0' & p10) - signed('0' & p00);
        s1_upper_start   <= shift_left(resize(signed('0' & p00), C_ROW_W + 1), G_WEIGHT_W) or C_HALF_ROW;
        s2_upper_product <= product(s1_upper_step, s1_fx);
        s2_upper_start   <= s1_upper_start;
      end if;
    end process p_upper;

    -- The sum lies between two pixels, so it is not negative and below 2^C_ROW_W.
    s2_upper <= s2_upper_start + s2_upper_product;

    -- synthesis translate_off
    p_rules_upper : process (clk)
    begin
      if rising_edge(clk) then
        assert valid(2) /= '1' or usable_x(2) = '0' or usable_y(2) = '0' or s2_upper >= 0
          report "interpolation: the upper row's sum is out of range"
          severity failure;
      end if;
    end process p_rules_upper;
    -- synthesis translate_on

    g_rows : if G_RECTIFIED = 0 generate
      signal fy  : std_logic_vector(G_WEIGHT_W - 1 downto 0);
      signal p01 : std_logic_vector(G_PIX_W - 1 downto 0);
      signal p11 : std_logic_vector(G_PIX_W - 1 downto 0);
      -- s1, s2: as the upper row
      signal s1_lower_step    : signed(G_PIX_W downto 0);
      signal s1_lower_start   : signed(C_ROW_W downto 0);
      signal s2_lower_product : signed(C_ROW_W downto 0);
      signal s2_lower_start   : signed(C_ROW_W downto 0);
      -- s3: rows' interpolants, ufix(G_PIX_W,G_WEIGHT_W) in signed vectors
      signal s3_upper : signed(C_ROW_W downto 0);
      signal s3_lower : signed(C_ROW_W downto 0);
      -- s4: difference between the rows, sfix(G_PIX_W+1,G_WEIGHT_W)
      signal s4_fy    : signed(G_WEIGHT_W downto 0);
      signal s4_step  : signed(C_ROW_W downto 0);
      signal s4_start : signed(C_EXACT_W downto 0);
      -- s5: times fy
      signal s5_product : signed(C_EXACT_W downto 0);
      signal s5_start   : signed(C_EXACT_W downto 0);

      attribute use_dsp48 of s2_lower_product, s5_product : signal is C_DSP;
    begin

      fy  <= s0_fy((n + 1) * G_WEIGHT_W - 1 downto n * G_WEIGHT_W);
      p01 <= s0_p01((n + 1) * G_PIX_W - 1 downto n * G_PIX_W);
      p11 <= s0_p11((n + 1) * G_PIX_W - 1 downto n * G_PIX_W);

      p_pipe : process (clk)
      begin
        if rising_edge(clk) then
          s1_lower_step    <= signed('0' & p11) - signed('0' & p01);
          s1_lower_start   <= shift_left(resize(signed('0' & p01), C_ROW_W + 1), G_WEIGHT_W) or C_HALF_ROW;
          s2_lower_product <= product(s1_lower_step, s1_fx);
          s2_lower_start   <= s1_lower_start;
          -- s3
          s3_upper <= s2_upper;
          s3_lower <= s2_lower_start + s2_lower_product;
          -- s4
          s4_step  <= s3_lower - s3_upper;
          s4_start <= shift_left(resize(s3_upper, C_EXACT_W + 1), G_WEIGHT_W) or C_HALF_EXACT;
          -- fy is constant over a row: one register instead of a delay line.
          if row_first(3) = '1' then
            s4_fy <= signed('0' & fy);
          end if;
          -- s5
          s5_product <= product(s4_step, s4_fy);
          s5_start   <= s4_start;
          -- s6
          s6_sample <= drop(s5_start + s5_product);
          if usable_x(C_LAST) = '0' or usable_y(C_LAST) = '0' then
            s6_sample <= (others => '0');
          end if;
        end if;
      end process p_pipe;

      -- synthesis translate_off
      p_rules : process (clk)
      begin
        if rising_edge(clk) then
          assert valid(3) /= '1' or usable_x(3) = '0' or usable_y(3) = '0' or s3_lower >= 0
            report "interpolation: the lower row's sum is out of range"
            severity failure;
          assert valid(5) /= '1' or usable_x(5) = '0' or usable_y(5) = '0' or s5_start + s5_product >= 0
            report "interpolation: the sum between the rows is out of range"
            severity failure;
        end if;
      end process p_rules;
      -- synthesis translate_on

    end generate g_rows;

    g_row : if G_RECTIFIED = 1 generate

      p_cut : process (clk)
      begin
        if rising_edge(clk) then
          s6_sample <= drop(shift_left(resize(s2_upper, C_EXACT_W + 1), G_WEIGHT_W));
          if usable_x(C_LAST) = '0' or usable_y(C_LAST) = '0' then
            s6_sample <= (others => '0');
          end if;
        end if;
      end process p_cut;

    end generate g_row;

    s6_out((n + 1) * C_OUT_W - 1 downto n * C_OUT_W) <= s6_sample;

  end generate g_image;

  m_l <= s6_out(C_OUT_W - 1 downto 0);
  m_r <= s6_out(2 * C_OUT_W - 1 downto C_OUT_W);

  p_sideband : process (clk)
  begin
    if rising_edge(clk) then
      valid         <= valid(C_LAST - 1 downto 1) & s_valid;
      row_first     <= row_first(C_LAST - 1 downto 1) & s_row_first;
      plane_first   <= plane_first(C_LAST - 1 downto 1) & s_plane_first;
      plane_last    <= plane_last(C_LAST - 1 downto 1) & s_plane_last;
      usable_x      <= usable_x(C_LAST - 1 downto 1) & s_usable_x;
      usable_y      <= usable_y(C_LAST - 1 downto 1) & s_usable_y;
      m_valid       <= valid(C_LAST);
      m_row_first   <= row_first(C_LAST);
      m_plane_first <= plane_first(C_LAST);
      m_plane_last  <= plane_last(C_LAST);
      m_usable_x    <= usable_x(C_LAST);
      m_usable_y    <= usable_y(C_LAST);
      if rst = '1' then
        valid   <= (others => '0');
        m_valid <= '0';
      end if;
    end if;
  end process p_sideband;

end architecture rtl;
