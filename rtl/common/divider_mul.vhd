-- SPDX-License-Identifier: Apache-2.0
-- divider_mul: the quotients of divider after the same clocks, from three products, for a den whose top bit is '1':
--              floor(num * 2^G_QUOT_W / den), all ones for num = den. About a quarter of the logic.
--   Rate    : one division per clock
--   Latency : G_QUOT_W clocks
--   Numbers : operands ufix(G_QUOT_W+3,0), 0 <= num <= den, quotient ufix(0,G_QUOT_W), truncated. If the top bit of den
--             is '0' the quotient is undefined
--   Method  : reciprocal = base + slope * not den(low bits), both from a table addressed by the bits below the leading
--             one; guess = num * reciprocal, which is the quotient or one more (docs/divider_mul.md). The adder behind
--             guess * den corrects it
--   Bits    : below 8 bits there is no time for three products and little to save, so a divider is built
--   Reset   : none; the parent carries the valid bit
--   Reasons : den comes inverted because both its products need it so. Every product has registers around it and at
--             most one sum behind it, so that it fits a DSP slice
--   Golden  : divide_fraction() in sw/golden/similarity.hpp
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;

entity divider_mul is
  generic (
    G_QUOT_W : integer := 13
  );
  port (
    clk    : in  std_logic;
    s_num  : in  std_logic_vector(G_QUOT_W + 2 downto 0);
    s_nden : in  std_logic_vector(G_QUOT_W + 2 downto 0); -- den, all bits inverted
    m_quot : out std_logic_vector(G_QUOT_W - 1 downto 0)
  );
end entity divider_mul;

architecture rtl of divider_mul is

  constant C_NUM_W   : integer := G_QUOT_W + 3;
  constant C_REC_W   : integer := G_QUOT_W + 3;                 -- fraction bits of the reciprocal of 1.0 .. 2.0
  constant C_INDEX_W : integer := G_QUOT_W / 2;
  constant C_LINES   : integer := 2 ** C_INDEX_W;
  constant C_LOW_W   : integer := C_NUM_W - 1 - C_INDEX_W;
  constant C_SLOPE_W : integer := C_REC_W - C_INDEX_W;

  -- ceil(2**power / den), without numbers above 2 den.
  function inverse (power : natural; den : positive) return natural is
    variable v_rest : natural := 1;
    variable v_quot : natural := 0;
  begin
    for i in 1 to power loop
      v_rest := 2 * v_rest;
      v_quot := 2 * v_quot;
      if v_rest >= den then
        v_rest := v_rest - den;
        v_quot := v_quot + 1;
      end if;
    end loop;
    if v_rest > 0 then
      v_quot := v_quot + 1;
    end if;
    return v_quot;
  end function inverse;

  -- Reciprocal of the smallest and of the largest den of a line of the table. Lines are numbered by inverted bits.
  function at_low (line : natural) return natural is
  begin
    return inverse(C_NUM_W - 1 + C_REC_W, (2 ** (C_INDEX_W + 1) - 1 - line) * 2 ** C_LOW_W);
  end function at_low;

  function at_high (line : natural) return natural is
  begin
    return inverse(C_NUM_W - 1 + C_REC_W, (2 ** (C_INDEX_W + 1) - line) * 2 ** C_LOW_W - 1);
  end function at_high;

  -- What 2**C_LOW_W steps of den add from the largest of the line downwards, rounded up.
  function slope_at (line : natural) return natural is
  begin
    return ((at_low(line) - at_high(line)) * 2 ** C_LOW_W + 2 ** C_LOW_W - 2) / (2 ** C_LOW_W - 1);
  end function slope_at;

  type t_bases is array (0 to C_LINES - 1) of unsigned(C_REC_W - 1 downto 0);

  type t_slopes is array (0 to C_LINES - 1) of unsigned(C_SLOPE_W - 1 downto 0);

  function bases return t_bases is
    variable v_table : t_bases;
  begin
    for i in t_bases'range loop
      v_table(i) := to_unsigned(at_high(i), C_REC_W);
    end loop;
    return v_table;
  end function bases;

  function slopes return t_slopes is
    variable v_table : t_slopes;
  begin
    for i in t_slopes'range loop
      v_table(i) := to_unsigned(slope_at(i), C_SLOPE_W);
    end loop;
    return v_table;
  end function slopes;

  constant C_BASES  : t_bases  := bases;
  constant C_SLOPES : t_slopes := slopes;

begin

  assert G_QUOT_W >= 1 and G_QUOT_W <= 16
    report "divider_mul: G_QUOT_W"
           -- synthesis translate_off
           & "=" & integer'image(G_QUOT_W)
           -- synthesis translate_on
           & " outside 1..16"
    severity failure;

  g_steps : if G_QUOT_W < 8 generate
    signal num : std_logic_vector(C_NUM_W downto 0);
    signal den : std_logic_vector(C_NUM_W - 1 downto 0);
  begin

    num <= '0' & s_num;
    den <= not s_nden;

    u_divider : entity work.divider
      generic map (
        G_NUM_W  => C_NUM_W,
        G_QUOT_W => G_QUOT_W
      )
      port map (
        clk    => clk,
        s_num  => num,
        s_den  => den,
        m_quot => m_quot
      );

  end generate g_steps;

  g_products : if G_QUOT_W >= 8 generate
    -- s1, s2, s3: the reciprocal, rounded up
    signal s1_nden    : std_logic_vector(C_NUM_W - 2 downto 0);
    signal s1_slope   : unsigned(C_SLOPE_W - 1 downto 0);
    signal s2_base    : unsigned(C_REC_W - 1 downto 0);
    signal s2_growth  : unsigned(C_SLOPE_W + C_LOW_W - 1 downto 0);
    signal s3_sum     : unsigned(C_REC_W + C_LOW_W downto 0);
    -- s4, s5: the guess. One of 2**G_QUOT_W, for num = den or just below, is replaced by all ones, which is right there
    signal s1_num     : unsigned(C_NUM_W - 1 downto 0);
    signal s2_num     : unsigned(C_NUM_W - 1 downto 0);
    signal s3_num     : unsigned(C_NUM_W - 1 downto 0);
    signal s4_product : unsigned(C_NUM_W + C_REC_W downto 0);
    signal s5_guess   : unsigned(G_QUOT_W - 1 downto 0);
    -- s6, s7: guess * 2**(C_NUM_W+1) + num * 2**G_QUOT_W - guess * den; the last two together are the remainder, which
    -- takes one from the guess where it is below 0
    signal s5_num     : std_logic_vector(C_NUM_W - 1 downto 0);
    signal s5_nden    : std_logic_vector(C_NUM_W - 1 downto 0);
    signal s6_start   : unsigned(C_NUM_W + G_QUOT_W - 1 downto 0);
    signal s6_product : unsigned(C_NUM_W + G_QUOT_W downto 0);
    signal s7_sum     : unsigned(C_NUM_W + G_QUOT_W downto 0);
    signal s7_quot    : std_logic_vector(G_QUOT_W - 1 downto 0);

    attribute use_dsp48 : string;

    attribute use_dsp48 of s2_growth, s4_product, s6_product : signal is C_DSP;
  begin

    p_pipe : process (clk)
      constant C_ONES : unsigned(C_LOW_W - 1 downto 0) := (others => '1');
    begin
      if rising_edge(clk) then
        -- s1
        s1_nden  <= s_nden(C_NUM_W - 2 downto 0);
        s1_slope <= C_SLOPES(to_integer(unsigned(s_nden(C_NUM_W - 2 downto C_LOW_W))));
        s1_num   <= unsigned(s_num);
        -- s2
        s2_base   <= C_BASES(to_integer(unsigned(s1_nden(C_NUM_W - 2 downto C_LOW_W))));
        s2_growth <= s1_slope * unsigned(s1_nden(C_LOW_W - 1 downto 0));
        s2_num    <= s1_num;
        -- s3
        s3_sum <= ('0' & s2_base & C_ONES) + s2_growth;
        s3_num <= s2_num;
        -- s4
        s4_product <= s3_num * s3_sum(s3_sum'high downto C_LOW_W);
        -- s5
        s5_guess <= s4_product(C_NUM_W - 2 + C_REC_W downto C_NUM_W - 1 + C_REC_W - G_QUOT_W);
        if s4_product(C_NUM_W - 1 + C_REC_W) = '1' then
          s5_guess <= (others => '1');
        end if;
        -- s6
        s6_start   <= unsigned(s5_num) & s5_guess;
        s6_product <= s5_guess * unsigned('1' & s5_nden);
        -- s7
        s7_sum <= ('0' & s6_start) + s6_product;
      end if;
    end process p_pipe;

    u_num : entity work.delay_line
      generic map (
        G_DATA_W => C_NUM_W,
        G_DELAY  => 5
      )
      port map (
        clk    => clk,
        ce     => '1',
        s_data => s_num,
        m_data => s5_num
      );

    u_nden : entity work.delay_line
      generic map (
        G_DATA_W => C_NUM_W,
        G_DELAY  => 5
      )
      port map (
        clk    => clk,
        ce     => '1',
        s_data => s_nden,
        m_data => s5_nden
      );

    s7_quot <= std_logic_vector(s7_sum(s7_sum'high downto C_NUM_W + 1));

    u_quot : entity work.delay_line
      generic map (
        G_DATA_W => G_QUOT_W,
        G_DELAY  => G_QUOT_W - 7
      )
      port map (
        clk    => clk,
        ce     => '1',
        s_data => s7_quot,
        m_data => m_quot
      );

  end generate g_products;

end architecture rtl;
