-- SPDX-License-Identifier: Apache-2.0
-- cdc_sync: a row of flip-flops, the only way for a bit from one clock to another.
--   Input   : d comes straight from a flip-flop of any clock. Several bits must be independent of each other, or gray
--             code (one bit changes at a time), as each may be seen one clock earlier or later than its neighbour
--   Latency : G_STAGES clocks, one more if d changes in the set-up time of the first flip-flop
--   Reset   : none; q is undefined for the first G_STAGES clocks
--   Tools   : ASYNC_REG keeps the row together and out of shift register LUTs (constraints/crossings.md)
library ieee;
  use ieee.std_logic_1164.all;

entity cdc_sync is
  generic (
    G_WIDTH  : integer := 1;
    G_STAGES : integer := 2
  );
  port (
    clk : in  std_logic;
    d   : in  std_logic_vector(G_WIDTH - 1 downto 0);
    q   : out std_logic_vector(G_WIDTH - 1 downto 0)
  );
end entity cdc_sync;

architecture rtl of cdc_sync is

  -- Oldest stage on the left.
  signal stages : std_logic_vector(G_STAGES * G_WIDTH - 1 downto 0);

  attribute keep : string;

  attribute keep of stages : signal is "TRUE";

  attribute async_reg     : string;
  attribute shreg_extract : string;

  attribute async_reg of stages     : signal is "TRUE";
  attribute shreg_extract of stages : signal is "NO";

begin

  assert G_WIDTH >= 1
    report "cdc_sync: G_WIDTH"
           -- synthesis translate_off
           & "=" & integer'image(G_WIDTH)
           -- synthesis translate_on
           & " below 1"
    severity failure;
  assert G_STAGES >= 2 and G_STAGES <= 4
    report "cdc_sync: G_STAGES"
           -- synthesis translate_off
           & "=" & integer'image(G_STAGES)
           -- synthesis translate_on
           & " outside 2..4"
    severity failure;

  q <= stages(stages'high downto (G_STAGES - 1) * G_WIDTH);

  p_stages : process (clk)
  begin
    if rising_edge(clk) then
      stages <= stages((G_STAGES - 1) * G_WIDTH - 1 downto 0) & d;
    end if;
  end process p_stages;

end architecture rtl;
