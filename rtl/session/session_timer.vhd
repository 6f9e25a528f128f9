-- SPDX-License-Identifier: Apache-2.0
-- session_timer: milliseconds; the silence after which a session ends; the watchdog of the message under way.
--   Silence   : milliseconds since alive, at most G_SESSION_MS; then expired stays until alive
--   Watchdog  : stuck, one clock: with a session 1 ms after it has expired, without one after G_SESSION_MS or 1024 ms
--   Waiting   : a pulse at every 256th clock in which the engine waits for rows, or its cell for room in the map buffer
--   Reset     : milliseconds and waits begin anew; the silence only with alive
--   Golden    : sw/golden/session_timer.hpp
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;

entity session_timer is
  generic (
    G_CLK_KHZ    : integer := 166000; -- 1000 .. 1000000
    G_SESSION_MS : integer := 10000   -- 1 .. 65535
  );
  port (
    clk : in  std_logic;
    rst : in  std_logic;

    alive    : in  std_logic; -- the host was heard; or there is no session, and nothing is under way
    session  : in  std_logic;
    no_rows  : in  std_logic;
    no_room  : in  std_logic;

    tick_ms   : out std_logic;
    expired   : out std_logic;
    stuck     : out std_logic;
    wait_rows : out std_logic;
    wait_map  : out std_logic
  );
end entity session_timer;

architecture rtl of session_timer is

  signal ms_clock   : unsigned(clog2(G_CLK_KHZ) - 1 downto 0);
  signal ms_tick    : std_logic;
  signal silence_ms : unsigned(15 downto 0);
  signal time_up    : std_logic; -- it has lasted as long as a session may be silent
  signal over       : std_logic;
  signal no_rows_q  : std_logic;
  signal rows_clock : unsigned(7 downto 0);
  signal map_clock  : unsigned(7 downto 0);

begin

  assert G_CLK_KHZ >= 1000 and G_CLK_KHZ <= 1000000
    report "session_timer: G_CLK_KHZ"
           -- synthesis translate_off
           & "=" & integer'image(G_CLK_KHZ)
           -- synthesis translate_on
           & " outside 1000..1000000"
    severity failure;
  assert G_SESSION_MS >= 1 and G_SESSION_MS <= 65535
    report "session_timer: G_SESSION_MS"
           -- synthesis translate_off
           & "=" & integer'image(G_SESSION_MS)
           -- synthesis translate_on
           & " outside 1..65535"
    severity failure;

  time_up <= ms_tick and to_sl(silence_ms = G_SESSION_MS - 1);
  stuck   <= (over and ms_tick) or (not session and (time_up or silence_ms(10)));
  tick_ms <= ms_tick;
  expired <= over;

  p_silence : process (clk)
  begin
    if rising_edge(clk) then
      if ms_tick = '1' then
        silence_ms <= silence_ms + 1;
      end if;
      if time_up = '1' then
        silence_ms <= (others => '0');
        over       <= '1';
      end if;
      if alive = '1' then
        silence_ms <= (others => '0');
        over       <= '0';
      end if;
    end if;
  end process p_silence;

  p_millisecond : process (clk)
  begin
    if rising_edge(clk) then
      ms_tick  <= to_sl(ms_clock = G_CLK_KHZ - 1);
      ms_clock <= ms_clock + 1;
      if rst = '1' or ms_clock = G_CLK_KHZ - 1 then
        ms_clock <= (others => '0');
      end if;
    end if;
  end process p_millisecond;

  p_waits : process (clk)
  begin
    if rising_edge(clk) then
      no_rows_q <= no_rows;
      wait_rows <= '0';
      wait_map  <= '0';
      if no_rows_q = '1' then
        rows_clock <= rows_clock + 1;
        wait_rows  <= to_sl(rows_clock = 255);
      end if;
      if no_room = '1' then
        map_clock <= map_clock + 1;
        wait_map  <= to_sl(map_clock = 255);
      end if;
      if rst = '1' then
        rows_clock <= (others => '0');
        map_clock  <= (others => '0');
        wait_rows  <= '0';
        wait_map   <= '0';
      end if;
    end if;
  end process p_waits;

end architecture rtl;
