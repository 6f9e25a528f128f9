-- SPDX-License-Identifier: Apache-2.0
-- divider: floor(num * 2^G_QUOT_W / den) for 0 <= num <= den, den > 0; all ones for num = den.
--   Rate    : one division per clock
--   Latency : G_QUOT_W clocks
--   Numbers : operands ufix(G_NUM_W,0), quotient ufix(0,G_QUOT_W), truncated. Outside 0 <= num <= den, den > 0 the
--             quotient is undefined
--   Method  : non-restoring, one quotient bit per stage: remainder' = 2 remainder -/+ den, subtracting after a
--             remainder >= 0. The signs are those of restoring division, without its multiplexer: one adder per stage
--   Reset   : none; the parent carries the valid bit
--   Stages  : stage 0 gets s_num and s_den, every other one the remainder and den of the stage before. One word holds
--             the remainders of all stages and another the dens, stage n from bit n times the width on
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

  constant C_REM_W : integer := G_NUM_W + 1;

  -- What stage i gets, from bit i * width on. The last ones come out of the last stage.
  signal remainders : std_logic_vector((G_QUOT_W + 1) * C_REM_W - 1 downto 0);
  signal dens       : std_logic_vector((G_QUOT_W + 1) * G_NUM_W - 1 downto 0);

begin

  assert G_NUM_W >= 2 and G_NUM_W <= 32
    report "divider: G_NUM_W"
           -- synthesis translate_off
           & "=" & integer'image(G_NUM_W)
           -- synthesis translate_on
           & " outside 2..32"
    severity failure;
  assert G_QUOT_W >= 1 and G_QUOT_W <= 24
    report "divider: G_QUOT_W"
           -- synthesis translate_off
           & "=" & integer'image(G_QUOT_W)
           -- synthesis translate_on
           & " outside 1..24"
    severity failure;

  remainders(C_REM_W - 1 downto 0) <= s_num;
  dens(G_NUM_W - 1 downto 0)       <= s_den;

  g_stages : for i in 0 to G_QUOT_W - 1 generate
    signal num       : std_logic_vector(C_REM_W - 1 downto 0);
    signal den       : std_logic_vector(G_NUM_W - 1 downto 0);
    signal addend    : unsigned(G_NUM_W downto 0); -- +den or -den-1, the missing 1 enters as carry
    signal sum       : unsigned(G_NUM_W + 1 downto 0);
    signal remainder : std_logic_vector(C_REM_W - 1 downto 0);
    signal den_kept  : std_logic_vector(G_NUM_W - 1 downto 0);
    signal quot_bit  : std_logic_vector(0 downto 0);
  begin

    num <= remainders((i + 1) * C_REM_W - 1 downto i * C_REM_W);
    den <= dens((i + 1) * G_NUM_W - 1 downto i * G_NUM_W);

    addend <= unsigned('0' & den) when num(G_NUM_W) = '1' else unsigned('1' & not den);
    -- The carry is made by a bit below the operands, so that this is one adder; its own bit is cut off.
    sum    <= unsigned(num(G_NUM_W - 1 downto 0) & '0' & not num(G_NUM_W)) + (addend & not num(G_NUM_W));

    p_step : process (clk)
    begin
      if rising_edge(clk) then
        remainder <= std_logic_vector(sum(G_NUM_W + 1 downto 1));
        den_kept  <= den;
      end if;
    end process p_step;

    remainders((i + 2) * C_REM_W - 1 downto (i + 1) * C_REM_W) <= remainder;
    dens((i + 2) * G_NUM_W - 1 downto (i + 1) * G_NUM_W)       <= den_kept;

    quot_bit(0) <= not remainder(G_NUM_W);

    -- The first bit waits for all others, the last one for none.
    g_last : if i = G_QUOT_W - 1 generate
      m_quot(0) <= quot_bit(0);
    end generate g_last;

    g_wait : if i < G_QUOT_W - 1 generate

      u_wait : entity work.delay_line
        generic map (
          G_DATA_W => 1,
          G_DELAY  => G_QUOT_W - 1 - i
        )
        port map (
          clk    => clk,
          ce     => '1',
          s_data => quot_bit,
          m_data => m_quot(G_QUOT_W - 1 - i downto G_QUOT_W - 1 - i)
        );

    end generate g_wait;

  end generate g_stages;

end architecture rtl;
