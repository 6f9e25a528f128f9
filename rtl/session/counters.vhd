-- SPDX-License-Identifier: Apache-2.0
-- counters: G_COUNT event counters of 32 bits in two RAMs with one adder; they wrap.
--   Events   : a pulse sets a pending bit. A scanner adds one counter's bit every 4 clocks; four bits at a time move
--              into a shift register first, which takes less logic than selecting and clearing single ones. So each
--              event may pulse once in 4*G_COUNT clocks; faster pulses of one event count as one. An event is counted
--              after at most 4*G_COUNT + 15 clocks
--   Read     : while r_valid = '1', r_data is the counter r_index, read after r_index took its value; both hold until
--              r_index changes. It takes at most 7 clocks. A number from G_COUNT on reads a meaningless word
--   Phases   : words are kept in halves, for an adder of 16 bits, each half in its own RAM. Phase 0 reads the scanned
--              counter's lower half, 1 writes it back and reads the upper one, 2 writes that back, 3 reads both halves
--              of r_index, and 0 takes them. A word that is read while it is written is not used
--   Reset    : rst only starts a first scan of 4*G_COUNT clocks that writes zeros; events until then may be lost, and
--              r_valid is '0'
--   Golden   : sw/golden/counters.hpp
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;

entity counters is
  generic (
    G_COUNT : integer := 40
  );
  port (
    clk     : in  std_logic;
    rst     : in  std_logic;
    events  : in  std_logic_vector(G_COUNT - 1 downto 0);
    r_index : in  std_logic_vector(5 downto 0);
    r_valid : out std_logic;
    r_data  : out std_logic_vector(31 downto 0)
  );
end entity counters;

architecture rtl of counters is

  constant C_INDEX_W : integer := imax(3, clog2(G_COUNT));
  constant C_GROUPS  : integer := 2 ** (C_INDEX_W - 2);

  signal phase    : unsigned(1 downto 0);
  signal scan     : unsigned(C_INDEX_W - 1 downto 0);
  signal first    : std_logic; -- scan after reset
  signal four     : unsigned(C_INDEX_W - 3 downto 0);
  signal move     : std_logic;
  signal wide     : std_logic_vector(4 * C_GROUPS - 1 downto 0); -- events
  signal pending  : std_logic_vector(4 * C_GROUPS - 1 downto 0);
  signal moved    : std_logic_vector(3 downto 0);
  signal due      : std_logic_vector(3 downto 0); -- of the group, the scanned one first
  signal add      : unsigned(0 downto 0);
  signal carry    : std_logic;
  signal addend   : unsigned(15 downto 0);
  signal sum      : unsigned(16 downto 0);
  signal write_low  : std_logic;
  signal write_high : std_logic;
  signal raddr    : std_logic_vector(C_INDEX_W - 1 downto 0);
  signal low      : std_logic_vector(15 downto 0);
  signal high     : std_logic_vector(15 downto 0);
  signal index_q  : std_logic_vector(5 downto 0);
  signal same     : std_logic;
  signal have     : std_logic;

begin

  assert G_COUNT >= 1 and G_COUNT <= 64
    report "counters: G_COUNT"
           -- synthesis translate_off
           & "=" & integer'image(G_COUNT)
           -- synthesis translate_on
           & " outside 1..64"
    severity failure;

  four       <= scan(C_INDEX_W - 1 downto 2);
  move       <= to_sl(phase = 0) and to_sl(scan(1 downto 0) = 0);
  write_low  <= to_sl(phase = 1);
  write_high <= to_sl(phase = 2);
  raddr      <= r_index(C_INDEX_W - 1 downto 0) when phase(1) = '1' else std_logic_vector(scan);

  -- Zeros go in, not out: so they cost nothing.
  add(0)   <= not first and due(0) when phase(0) = '1' else not first and carry;
  addend   <= (others => '0') when first = '1'
              else unsigned(low) when phase(0) = '1'
              else unsigned(high);
  sum      <= ('0' & addend) + add;

  g_column : for i in 0 to 3 generate
    signal column : std_logic_vector(C_GROUPS - 1 downto 0);
  begin

    g_bit : for k in 0 to C_GROUPS - 1 generate
      column(k) <= pending(4 * k + i);
    end generate g_bit;

    moved(i) <= column(to_integer(four));

  end generate g_column;

  p_wide : process (events)
  begin
    wide                       <= (others => '0');
    wide(G_COUNT - 1 downto 0) <= events;
  end process p_wide;

  u_low : entity work.ram_sdp
    generic map (G_DATA_W => 16, G_DEPTH => 2 ** C_INDEX_W, G_LATENCY => 1)
    port map (
      clk   => clk,
      we    => write_low,
      waddr => std_logic_vector(scan),
      wdata => std_logic_vector(sum(15 downto 0)),
      raddr => raddr,
      rdata => low
    );

  u_high : entity work.ram_sdp
    generic map (G_DATA_W => 16, G_DEPTH => 2 ** C_INDEX_W, G_LATENCY => 1)
    port map (
      clk   => clk,
      we    => write_high,
      waddr => std_logic_vector(scan),
      wdata => std_logic_vector(sum(15 downto 0)),
      raddr => raddr,
      rdata => high
    );

  p_scan : process (clk)
  begin
    if rising_edge(clk) then
      phase <= phase + 1;
      carry <= sum(16);
      if phase = 3 then
        scan <= scan + 1;
        if scan = G_COUNT - 1 then
          scan  <= (others => '0');
          first <= '0';
        end if;
      end if;
      if move = '1' then
        due <= moved;
      elsif phase = 3 then
        due <= '0' & due(3 downto 1);
      end if;
      for i in 0 to 4 * C_GROUPS - 1 loop
        if i >= G_COUNT then
          pending(i) <= '0';
        elsif wide(i) = '1' then
          pending(i) <= '1';
        elsif move = '1' and four = i / 4 then
          pending(i) <= '0';
        end if;
      end loop;
      if rst = '1' then
        phase <= (others => '0');
        scan  <= (others => '0');
        first <= '1';
      end if;
    end if;
  end process p_scan;

  -- Says that rdata belongs to r_index, where it is taken.
  same    <= to_sl(r_index = index_q);
  r_valid <= have and same;

  p_read : process (clk)
  begin
    if rising_edge(clk) then
      index_q <= r_index;
      -- Read in phase 3, in which nothing is written.
      if phase = 0 and have = '0' then
        have   <= not first;
        r_data <= high & low;
      end if;
      if same = '0' or rst = '1' then
        have <= '0';
      end if;
    end if;
  end process p_read;

end architecture rtl;
