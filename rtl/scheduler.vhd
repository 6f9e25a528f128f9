-- SPDX-License-Identifier: Apache-2.0
-- scheduler: keeps the job words of the tile in the row buffer, and launches it when its rows are complete and the
--            engine is idle.
--   Launch    : 18 register writes, one a clock, in the order of START (docs/protocol.md), then COMMAND = 1 together
--               with go, running and run_tile. 20 clocks from the condition to go
--   running   : until map_last; or, if engine_busy falls without it, the tile has failed (refused or dropped): failed
--               and failed_tile hold until stop. engine_busy has to rise after the start, whenever that is
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

    go          : out std_logic;
    running     : out std_logic;
    run_tile    : out std_logic_vector(15 downto 0);
    failed      : out std_logic;
    failed_tile : out std_logic_vector(15 downto 0)
  );
end entity scheduler;

architecture rtl of scheduler is

  constant C_WORDS : integer := 18;

  signal loading   : std_logic;
  signal word      : unsigned(4 downto 0);
  signal address   : unsigned(4 downto 0);          -- engine register of this word
  signal address_q : std_logic_vector(4 downto 0);
  signal job       : std_logic_vector(31 downto 0);
  signal out_job   : std_logic;
  signal out_start : std_logic;
  signal out_stop  : std_logic;
  signal running_q : std_logic;
  signal risen     : std_logic; -- engine_busy has risen for the tile
  signal tile_q    : std_logic_vector(15 downto 0);

begin

  -- 0x01-0x06, 0x08-0x0B, 0x10-0x17.
  address <= word + 1 when word < 6
             else word + 2 when word < 10
             else word + 6;

  go          <= out_start;
  running     <= running_q;
  run_tile    <= tile_q;
  cfg_tvalid  <= t_valid or out_job or out_start or out_stop;

  p_cfg : process (t_valid, t_address, t_data, out_job, address_q, job, out_start, out_stop)
  begin
    cfg_tdata <= (others => '0');
    if t_valid = '1' then
      cfg_tdata <= t_address & t_data;
    elsif out_job = '1' then
      cfg_tdata(36 downto 32) <= address_q;
      cfg_tdata(31 downto 0)  <= job;
    else
      cfg_tdata(0) <= out_start;
      cfg_tdata(1) <= out_stop;
      cfg_tdata(2) <= out_stop;
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
      out_job   <= '0';
      out_start <= '0';
      out_stop  <= stop;
      address_q <= std_logic_vector(address);

      if loading = '1' then
        word    <= word + 1;
        out_job <= '1';
        if word = C_WORDS then
          word      <= (others => '0');
          loading   <= '0';
          out_job   <= '0';
          out_start <= '1';
          running_q <= '1';
          tile_q    <= tile;
        end if;
      elsif running_q = '0' then
        loading <= staged and complete and not engine_busy;
      end if;

      if running_q = '1' then
        if engine_busy = '1' then
          risen <= '1';
        end if;
        if map_last = '1' then
          running_q <= '0';
          risen     <= '0';
        elsif risen = '1' and engine_busy = '0' then
          running_q   <= '0';
          risen       <= '0';
          failed      <= '1';
          failed_tile <= tile_q;
        end if;
      end if;

      if rst = '1' or stop = '1' then
        loading   <= '0';
        word      <= (others => '0');
        out_job   <= '0';
        out_start <= '0';
        running_q <= '0';
        risen     <= '0';
        failed    <= '0';
      end if;
      if rst = '1' then
        out_stop    <= '0';
        tile_q      <= (others => '0');
        failed_tile <= (others => '0');
      end if;
    end if;
  end process p_launch;

end architecture rtl;
