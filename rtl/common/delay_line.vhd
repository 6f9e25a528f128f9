-- SPDX-License-Identifier: Apache-2.0
-- delay_line: delays a word by G_DELAY clocks, in shift registers where the device has them (SRL16/SRL32).
--   Rate    : one word per clock with ce = '1'; a clock without ce does not count
--   Latency : G_DELAY = 1 .. 64 enabled clocks
--   Reset   : none, because a reset turns every SRL into a row of flip-flops
--   Use     : for up to about 30 words; longer delays belong in ram_sdp
library ieee;
  use ieee.std_logic_1164.all;

entity delay_line is
  generic (
    G_DATA_W : integer := 8;
    G_DELAY  : integer := 4
  );
  port (
    clk   : in  std_logic;
    ce    : in  std_logic;
    s_data : in  std_logic_vector(G_DATA_W - 1 downto 0);
    m_data : out std_logic_vector(G_DATA_W - 1 downto 0)
  );
end entity delay_line;

architecture rtl of delay_line is

  -- Newest word in the low bits.
  signal shift : std_logic_vector(G_DATA_W * G_DELAY - 1 downto 0);

begin

  assert G_DATA_W >= 1
    report "delay_line: G_DATA_W"
           -- synthesis translate_off
           & "=" & integer'image(G_DATA_W)
           -- synthesis translate_on
           & " below 1"
    severity failure;
  assert G_DELAY >= 1 and G_DELAY <= 64
    report "delay_line: G_DELAY"
           -- synthesis translate_off
           & "=" & integer'image(G_DELAY)
           -- synthesis translate_on
           & " outside 1..64"
    severity failure;

  g_one : if G_DELAY = 1 generate

    p_shift : process (clk)
    begin
      if rising_edge(clk) then
        if ce = '1' then
          shift <= s_data;
        end if;
      end if;
    end process p_shift;

  end generate g_one;

  g_more : if G_DELAY > 1 generate

    p_shift : process (clk)
    begin
      if rising_edge(clk) then
        if ce = '1' then
          shift <= shift(G_DATA_W * (G_DELAY - 1) - 1 downto 0) & s_data;
        end if;
      end if;
    end process p_shift;

  end generate g_more;

  m_data <= shift(G_DATA_W * G_DELAY - 1 downto G_DATA_W * (G_DELAY - 1));

end architecture rtl;
