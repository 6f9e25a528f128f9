-- SPDX-License-Identifier: Apache-2.0
-- reset_filter: makes the reset of clk from an asynchronous pin, without its glitches.
--   Begin : rst rises with the 18th edge of clk in a row that finds arst_n low. A pulse that covers at most 15 edges is
--           ignored
--   End   : rst falls with the 18th edge in a row that finds arst_n high. So it lasts for at least 16 clocks, even if
--           an upset of a flip-flop began it
--   Power : arst_n must be low for at least 18 edges; whatever state the flip-flops start in, rst is '1' then
--   Output: rst comes from a flip-flop, so that reset_sync can make the resets of other clocks from it
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;

entity reset_filter is
  port (
    clk    : in  std_logic;
    arst_n : in  std_logic;
    rst    : out std_logic
  );
end entity reset_filter;

architecture rtl of reset_filter is

  signal pins  : std_logic_vector(0 downto 0);
  signal high  : std_logic_vector(0 downto 0);
  -- 0: works; to 15: low for so long; 16: reset; to 31: high for so long. The start value is for simulators with
  -- unknown values, which would keep one for ever; a flip-flop is one or the other. It is the reset, so that no rule
  -- about registers speaks before they have been reset.
  signal count : unsigned(4 downto 0)
  -- synthesis translate_off
    := (4 => '1', others => '0')
  -- synthesis translate_on
    ;

begin

  rst     <= count(4);
  pins(0) <= arst_n;

  u_pin : entity work.cdc_sync
    generic map (
      G_WIDTH  => 1,
      G_STAGES => 2
    )
    port map (
      clk => clk,
      d   => pins,
      q   => high
    );

  p_count : process (clk)
  begin
    if rising_edge(clk) then
      if count(4) = high(0) then
        count <= count + 1;
      else
        count(3 downto 0) <= (others => '0');
      end if;
    end if;
  end process p_count;

end architecture rtl;
