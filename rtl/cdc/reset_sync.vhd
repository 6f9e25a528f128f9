-- SPDX-License-Identifier: Apache-2.0
-- reset_sync: makes the synchronous reset of one clock from an asynchronous one.
--   Begin : rst rises with arst, even while clk stands still
--   End   : rst falls with the third rising edge of clk after arst has fallen, so that all flip-flops of the clock see
--           it fall in the same clock. If arst falls in the recovery time of the first flip-flop, one clock later.
--   Tools : ASYNC_REG keeps the flip-flops together (constraints/crossings.md)
library ieee;
  use ieee.std_logic_1164.all;

entity reset_sync is
  port (
    clk  : in  std_logic;
    arst : in  std_logic;
    rst  : out std_logic
  );
end entity reset_sync;

architecture rtl of reset_sync is

  signal stages : std_logic_vector(2 downto 0);

  attribute keep : string;

  attribute keep of stages : signal is "TRUE";

  attribute async_reg     : string;
  attribute shreg_extract : string;

  attribute async_reg of stages     : signal is "TRUE";
  attribute shreg_extract of stages : signal is "NO";

begin

  rst <= stages(2);

  p_stages : process (clk, arst)
  begin
    if arst = '1' then
      stages <= "111";
    elsif rising_edge(clk) then
      stages <= stages(1 downto 0) & '0';
    end if;
  end process p_stages;

end architecture rtl;
