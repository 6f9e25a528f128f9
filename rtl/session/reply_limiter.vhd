-- SPDX-License-Identifier: Apache-2.0
-- reply_limiter: answers to senders that are not authenticated, 15 of each kind at once and then one a millisecond.
--   Buckets   : ARP, OPEN, all else. They pass in a circle by one decrement and increment: each has its turn every
--               third clock, so a request waits for two clocks at most
--   Reset     : full buckets
--   Golden    : sw/golden/reply_limiter.hpp
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;

entity reply_limiter is
  port (
    clk : in  std_logic;
    rst : in  std_logic;

    tick_ms : in  std_logic;
    request : in  std_logic;                    -- holds until grant or refuse
    bucket  : in  std_logic_vector(1 downto 0); -- 0 ARP, 1 OPEN, 2 all else
    grant   : out std_logic;                    -- in the clock in which an answer is taken
    refuse  : out std_logic                     -- none is left
  );
end entity reply_limiter;

architecture rtl of reply_limiter is

  signal turn     : unsigned(1 downto 0); -- whose bucket is bucket_0
  signal bucket_0 : unsigned(3 downto 0);
  signal bucket_1 : unsigned(3 downto 0);
  signal bucket_2 : unsigned(3 downto 0);
  signal refill   : std_logic_vector(2 downto 0);
  signal at_turn  : std_logic;

begin

  at_turn <= request and to_sl(turn = unsigned(bucket));
  grant   <= at_turn and to_sl(bucket_0 /= 0);
  refuse  <= at_turn and to_sl(bucket_0 = 0);

  p_buckets : process (clk)
  begin
    if rising_edge(clk) then
      turn     <= turn + 1;
      bucket_0 <= bucket_1;
      bucket_1 <= bucket_2;
      bucket_2 <= bucket_0;
      refill   <= refill(1 downto 0) & tick_ms;
      if turn = 2 then
        turn <= (others => '0');
      end if;
      if at_turn = '1' and bucket_0 /= 0 then
        if refill = "000" then
          bucket_2 <= bucket_0 - 1;
        end if;
      elsif refill /= "000" and bucket_0 /= 15 then
        bucket_2 <= bucket_0 + 1;
      end if;
      if rst = '1' then
        turn     <= (others => '0');
        bucket_0 <= (others => '1');
        bucket_1 <= (others => '1');
        bucket_2 <= (others => '1');
        refill   <= (others => '0');
      end if;
    end if;
  end process p_buckets;

end architecture rtl;
