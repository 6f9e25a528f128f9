-- SPDX-License-Identifier: Apache-2.0
-- map_sender: the READ in force: which chunks of which map are still to be sent, and when the next one can be.
--   READ      : its header names the tile and the first chunk, its argument how many, and below which one all chunks
--               have arrived (keep). The map of another tile may come later: the READ waits for it
--   Turn      : due says that a chunk can be sent; it goes before the next message if something was answered since the
--               latest one (first = '1')
--   Reset     : no READ, no map
--   Golden    : sw/golden/map_sender.hpp
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;
  use work.link_pkg.all;

entity map_sender is
  port (
    clk : in  std_logic;
    rst : in  std_logic;

    clear     : in  std_logic; -- the session ends or begins
    decide    : in  std_logic; -- word is a message's number and index
    read_head : in  std_logic; -- .. of a READ, which replaces the one in force
    read_tail : in  std_logic; -- word_next is its argument
    word      : in  std_logic_vector(31 downto 0);
    word_next : in  std_logic_vector(31 downto 0);
    number_ok : in  std_logic; -- with decide: the number is that of map_tile
    answered  : in  std_logic; -- a reply begins
    started   : in  std_logic; -- a chunk begins
    sent      : in  std_logic; -- .. is over
    due       : out std_logic;
    first     : out std_logic;

    -- map_buffer, scheduler
    map_started : in  std_logic;
    map_busy    : in  std_logic;
    run_tile    : in  std_logic_vector(15 downto 0);
    f_ready     : in  std_logic;
    f_chunk     : out std_logic_vector(15 downto 0);
    map_keep    : out std_logic_vector(15 downto 0);
    map_tile    : out std_logic_vector(15 downto 0) -- tile of the map in the buffer
  );
end entity map_sender;

architecture rtl of map_sender is

  signal active    : std_logic;
  signal of_map    : std_logic; -- the READ that is being taken is for the map in the buffer
  signal tile      : unsigned(15 downto 0);
  signal held_tile : unsigned(15 downto 0);
  signal chunk     : unsigned(15 downto 0);
  signal left      : unsigned(15 downto 0);        -- not (chunks to come): counts up
  signal keep      : std_logic_vector(15 downto 0);
  signal stale     : std_logic_vector(3 downto 0); -- f_ready may be that of an earlier question

begin

  due      <= active and map_busy and f_ready and not stale(0) and to_sl(tile = held_tile);
  f_chunk  <= std_logic_vector(chunk);
  map_keep <= keep;
  map_tile <= std_logic_vector(held_tile);

  p_read : process (clk)
    -- A register that is loaded or counted: what goes into its adder.
    variable v_chunk : unsigned(15 downto 0);
    variable v_left  : unsigned(15 downto 0);
    variable v_sent  : unsigned(0 downto 0);
  begin
    if rising_edge(clk) then
      v_chunk   := chunk;
      v_left    := left;
      v_sent(0) := sent;
      if decide = '1' then
        of_map <= number_ok;
      end if;
      if read_head = '1' then
        active  <= '0';
        tile    <= unsigned(word(31 downto 16));
        v_chunk := unsigned(word(15 downto 0));
      end if;
      if read_tail = '1' then
        v_left := not unsigned(word_next(31 downto 16));
        active <= to_sl(unsigned(word_next(31 downto 16)) /= 0);
      end if;
      if sent = '1' and left = 16#fffe# then
        active <= '0';
      end if;
      chunk <= v_chunk + v_sent;
      left  <= v_left + v_sent;
      if rst = '1' or clear = '1' then
        active <= '0';
      end if;
    end if;
  end process p_read;

  p_map : process (clk)
  begin
    if rising_edge(clk) then
      stale <= '0' & stale(3 downto 1);
      if map_started = '1' or read_tail = '1' or sent = '1' then
        stale <= (others => '1');
      end if;
      if map_started = '1' then
        held_tile <= unsigned(run_tile);
      end if;
      if read_tail = '1' and of_map = '1' then
        keep <= word_next(15 downto 0);
      end if;
      if map_started = '1' then
        keep <= (others => '0');
      end if;
      if started = '1' then
        first <= '0';
      elsif answered = '1' then
        first <= '1';
      end if;
      if rst = '1' or clear = '1' then
        held_tile <= (others => '1');
      end if;
      if rst = '1' then
        first <= '0';
      end if;
    end if;
  end process p_map;

end architecture rtl;
