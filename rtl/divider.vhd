-- SPDX-License-Identifier: Apache-2.0
-- divider: floor(num * 2^G_QUOT_W / den) for 0 <= num <= den, den > 0; all ones for num = den.
--   Rate    : one division per clock
--   Latency : G_QUOT_W clocks
--   Numbers : operands ufix(G_NUM_W,0), quotient ufix(0,G_QUOT_W), truncated. Outside 0 <= num <= den, den > 0 the
--             quotient means nothing
--   Method  : non-restoring, one quotient bit a stage: remainder' = 2 remainder -/+ den, subtracting after a remainder
--             >= 0. The signs are those of restoring division, without its multiplexer: one adder a stage.
--   Reset   : none; validity travels outside
--   Why so  : the first stage and, behind it, a divider of one bit less. Recursion gives every stage its own signals,
--             where an array of remainders would become one wide word in the converted netlist.
--   Golden  : divide_fraction() in sw/golden/similarity.hpp
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;

entity divider is
  generic (
    G_NUM_W  : integer := 16;
    G_QUOT_W : integer := 13
  );
  port (
    clk    : in  std_logic;
    -- Two's complement, -den .. den: num itself for the user, the partial remainder between stages.
    s_num  : in  std_logic_vector(G_NUM_W downto 0);
    s_den  : in  std_logic_vector(G_NUM_W - 1 downto 0);
    m_quot : out std_logic_vector(G_QUOT_W - 1 downto 0)
  );
end entity divider;

architecture rtl of divider is

  signal addend    : unsigned(G_NUM_W downto 0); -- +den or -den-1, the missing 1 enters as carry
  signal sum       : unsigned(G_NUM_W + 1 downto 0);
  signal remainder : std_logic_vector(G_NUM_W downto 0);
  signal den       : std_logic_vector(G_NUM_W - 1 downto 0);
  signal quot_bit  : std_logic_vector(0 downto 0);

begin

  assert G_NUM_W >= 2 and G_NUM_W <= 32
    report "divider: G_NUM_W=" & integer'image(G_NUM_W) & " outside 2..32"
    severity failure;
  assert G_QUOT_W >= 1 and G_QUOT_W <= 24
    report "divider: G_QUOT_W=" & integer'image(G_QUOT_W) & " outside 1..24"
    severity failure;

  addend <= unsigned('0' & s_den) when s_num(G_NUM_W) = '1' else unsigned('1' & not s_den);
  -- The carry is made by a bit below the operands, so that this is one adder; its own bit is cut off.
  sum    <= unsigned(s_num(G_NUM_W - 1 downto 0) & '0' & not s_num(G_NUM_W))
            + (addend & not s_num(G_NUM_W));

  p_step : process (clk)
  begin
    if rising_edge(clk) then
      remainder <= std_logic_vector(sum(G_NUM_W + 1 downto 1));
      den       <= s_den;
    end if;
  end process p_step;

  quot_bit(0) <= not remainder(G_NUM_W);

  g_last : if G_QUOT_W = 1 generate
    m_quot <= quot_bit;
  end generate g_last;

  g_more : if G_QUOT_W > 1 generate

    u_rest : entity work.divider
      generic map (
        G_NUM_W  => G_NUM_W,
        G_QUOT_W => G_QUOT_W - 1
      )
      port map (
        clk    => clk,
        s_num  => remainder,
        s_den  => den,
        m_quot => m_quot(G_QUOT_W - 2 downto 0)
      );

    u_wait : entity work.delay_line
      generic map (
        G_DATA_W => 1,
        G_DELAY  => G_QUOT_W - 1
      )
      port map (
        clk    => clk,
        ce     => '1',
        s_data => quot_bit,
        m_data => m_quot(G_QUOT_W - 1 downto G_QUOT_W - 1)
      );

  end generate g_more;

end architecture rtl;
