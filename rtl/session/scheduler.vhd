-- SPDX-License-Identifier: Apache-2.0
-- scheduler: keeps the job words of the tile in the row buffer, and launches it when its rows are complete and the
--            engine is idle.
--   Launch    : 18 register writes, one per clock, in the order of START (docs/protocol.md), then COMMAND = 1 together
--               with go, running and run_tile. 20 clocks from the condition to go
--   running   : until map_last. If engine_busy falls without it, the tile has failed (refused or dropped): failed and
--               failed_tile hold until stop, tile_failed is '1' in their first clock
--   Watch     : if for 16 clocks in a row the engine has not begun after the start, or asks for pixels where there are
--               none (starved), or is busy though nothing was launched: COMMAND = 2 (abort), and a running tile has
--               failed
--   Lost      : a buffer was found in an illegal state and has forgotten its contents: the running or else the latest
--               tile has failed, COMMAND = 2. The same applies if the launch itself is disturbed
--   Upsets    : the states differ in two bits; any other code acts as lost. recovered is '1' for a clock with each
--   Job words : job_addr 0..17, written while no tile is staged, in any order; they survive a launch
--   Table     : t_* go to cfg_* in the same clock; only while nothing is staged or running,
--               and not in the clock after stop
--   stop      : everything is forgotten; COMMAND = 6 (abort, clear) one clock later. staged has to fall with it
--   cfg_*     : as s_cfg of the engine, which is always ready
--   Golden    : sw/golden/scheduler.hpp
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;

entity scheduler is
  port (
    clk : in  std_logic;
    rst : in  std_logic;

    job_we    : in  std_logic;
    job_addr  : in  std_logic_vector(4 downto 0);
    job_data  : in  std_logic_vector(31 downto 0);
    t_valid   : in  std_logic;
    t_address : in  std_logic_vector(15 downto 0);
    t_data    : in  std_logic_vector(31 downto 0);

    staged   : in  std_logic; -- the row buffer holds a tile that is not launched
    complete : in  std_logic;
    tile     : in  std_logic_vector(15 downto 0);
    stop     : in  std_logic;

    cfg_tvalid  : out std_logic;
    cfg_tdata   : out std_logic_vector(47 downto 0);
    engine_busy : in  std_logic;
    map_last    : in  std_logic;
    starved     : in  std_logic; -- the engine is ready for a pixel, the row buffer has none and awaits none
    lost        : in  std_logic;

    go          : out std_logic;
    running     : out std_logic;
    run_tile    : out std_logic_vector(15 downto 0);
    failed      : out std_logic;
    failed_tile : out std_logic_vector(15 downto 0);
    tile_failed : out std_logic;
    recovered   : out std_logic
  );
end entity scheduler;

architecture rtl of scheduler is

  constant C_WORDS : integer := 18;

  -- The codes differ in two bits.
  constant C_IDLE    : std_logic_vector(2 downto 0) := "000";
  constant C_LOADING : std_logic_vector(2 downto 0) := "011";
  constant C_RUNNING : std_logic_vector(2 downto 0) := "101";

  signal state      : std_logic_vector(2 downto 0);
  signal is_loading : std_logic;
  signal is_running : std_logic;
  signal word      : unsigned(4 downto 0);          -- while not loading: clocks of the watch
  signal word_last : std_logic;                     -- 18
  signal word_over : std_logic;                     -- more
  signal launch    : std_logic;
  signal give_up   : std_logic;
  signal count     : std_logic;
  signal address   : unsigned(4 downto 0);          -- engine register of this word
  signal address_q : std_logic_vector(4 downto 0);
  signal job       : std_logic_vector(31 downto 0);
  signal out_job   : std_logic;
  signal out_start : std_logic;
  signal out_abort : std_logic;
  signal out_clear : std_logic;
  signal risen     : std_logic; -- engine_busy has risen for the tile
  signal tile_q    : std_logic_vector(15 downto 0);

begin

  -- 0x01-0x06, 0x08-0x0B, 0x10-0x17.
  address <= word + 1 when word < 6
             else word + 2 when word < 10
             else word + 6;

  go          <= out_start;
  running     <= is_running;
  recovered   <= out_abort and not out_clear;
  run_tile    <= tile_q;
  cfg_tvalid  <= t_valid or out_job or out_start or out_abort;
  is_loading  <= to_sl(state = C_LOADING);
  is_running  <= to_sl(state = C_RUNNING);
  word_last   <= to_sl(word = C_WORDS);
  word_over   <= word(4) and (word(3) or word(2) or (word(1) and word(0)));
  launch      <= staged and complete and not engine_busy;
  -- An engine that is busy, or not, as it must not be, for 16 clocks on end; or a buffer has lost what runs.
  give_up     <= (word(4) and not is_loading) or (lost and is_running);
  count       <= is_loading and not word_last when is_running = '0' and engine_busy = '0'
                 else not word(4) and (not is_running or not risen or starved);

  p_cfg : process (t_valid, t_address, t_data, out_job, address_q, job, out_start, out_abort, out_clear)
  begin
    cfg_tdata <= (others => '0');
    if t_valid = '1' then
      cfg_tdata <= t_address & t_data;
    elsif out_job = '1' then
      cfg_tdata(36 downto 32) <= address_q;
      cfg_tdata(31 downto 0)  <= job;
    else
      cfg_tdata(0) <= out_start;
      cfg_tdata(1) <= out_abort;
      cfg_tdata(2) <= out_clear;
    end if;
  end process p_cfg;

  u_job : entity work.ram_sdp
    generic map (G_DATA_W => 32, G_DEPTH => 32, G_LATENCY => 1)
    port map (
      clk   => clk,
      we    => job_we,
      waddr => job_addr,
      wdata => job_data,
      raddr => std_logic_vector(word),
      rdata => job
    );

  p_launch : process (clk)
  begin
    if rising_edge(clk) then
      out_job     <= '0';
      out_start   <= '0';
      out_abort   <= stop or give_up;
      out_clear   <= stop;
      tile_failed <= '0';
      address_q   <= std_logic_vector(address);
      word        <= word + 1;

      if is_running = '1' then
        risen <= risen or engine_busy;
        if map_last = '1' then
          state <= C_IDLE;
        elsif give_up = '1' or (risen = '1' and engine_busy = '0') then
          state       <= C_IDLE;
          failed      <= '1';
          failed_tile <= tile_q;
          tile_failed <= '1';
        end if;
      else
        risen  <= '0';
        if state = C_IDLE and lost = '0' then
          if launch = '1' then
            state <= C_LOADING;
          end if;
        elsif is_loading = '0' or lost = '1' or engine_busy = '1' or word_last = '1' or word_over = '1' then
          -- Launched; or lost: then without a start, and the watch ends it.
          state  <= C_RUNNING;
          tile_q <= tile;
        end if;
        out_job   <= is_loading and not word_last;
        out_start <= is_loading and word_last and not lost and not engine_busy;
      end if;

      if rst = '1' or stop = '1' or count = '0' then
        word <= (others => '0');
      end if;
      if rst = '1' or stop = '1' then
        state       <= C_IDLE;
        out_job     <= '0';
        out_start   <= '0';
        risen       <= '0';
        failed      <= '0';
        tile_failed <= '0';
      end if;
      if rst = '1' then
        out_abort   <= '0';
        out_clear   <= '0';
        tile_q      <= (others => '0');
        failed_tile <= (others => '0');
      end if;
    end if;
  end process p_launch;

end architecture rtl;
