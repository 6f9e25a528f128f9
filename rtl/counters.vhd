-- SPDX-License-Identifier: Apache-2.0
-- counters: G_COUNT event counters of 32 bits in one RAM with one adder; they wrap.
--   Events   : a pulse sets a pending bit; a scanner visits one counter every 4 clocks, adds its bit and clears it. So
--              each event may pulse once in 4*G_COUNT clocks; faster pulses of one event count as one
--   Read     : r_valid = '1': r_data is the counter r_index, read after r_index became what it is; both hold until
--              r_index changes. Up to 7 clocks later. A number from G_COUNT on reads something without meaning
--   Phases   : 0 read the scanned counter, 1 write it back, 2 read r_index, 3 take it
--   Reset    : rst only. A first scan of 4*G_COUNT clocks writes zeros; events before its end are lost, r_valid is '0'
--   Golden   : sw/golden/counters.hpp
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;

entity counters is
  generic (
    G_COUNT : integer := 32
  );
  port (
    clk     : in  std_logic;
    rst     : in  std_logic;
    events  : in  std_logic_vector(G_COUNT - 1 downto 0);
    r_index : in  std_logic_vector(4 downto 0);
    r_valid : out std_logic;
    r_data  : out std_logic_vector(31 downto 0)
  );
end entity counters;

architecture rtl of counters is

  constant C_INDEX_W : integer := clog2(G_COUNT);

  signal phase    : unsigned(1 downto 0);
  signal scan     : unsigned(C_INDEX_W - 1 downto 0);
  signal first    : std_logic; -- scan after reset
  signal pending  : std_logic_vector(G_COUNT - 1 downto 0);
  signal increase : unsigned(0 downto 0);
  signal write    : std_logic;
  signal raddr    : std_logic_vector(C_INDEX_W - 1 downto 0);
  signal rdata    : std_logic_vector(31 downto 0);
  signal wdata    : std_logic_vector(31 downto 0);
  signal index_q  : std_logic_vector(4 downto 0);
  signal same     : std_logic;
  signal have     : std_logic;

begin

  assert G_COUNT >= 1 and G_COUNT <= 32
    report "counters: G_COUNT=" & integer'image(G_COUNT) & " outside 1..32"
    severity failure;

  write <= to_bit(phase = 1);
  raddr <= r_index(C_INDEX_W - 1 downto 0) when phase(1) = '1' else std_logic_vector(scan);
  wdata <= (others => '0') when first = '1' else std_logic_vector(unsigned(rdata) + increase);

  p_pick : process (pending, scan)
  begin
    increase <= "0";
    for i in 0 to G_COUNT - 1 loop
      if scan = i then
        increase(0) <= pending(i);
      end if;
    end loop;
  end process p_pick;

  u_words : entity work.ram_sdp
    generic map (G_DATA_W => 32, G_DEPTH => 2 ** C_INDEX_W, G_LATENCY => 1)
    port map (
      clk   => clk,
      we    => write,
      waddr => std_logic_vector(scan),
      wdata => wdata,
      raddr => raddr,
      rdata => rdata
    );

  p_scan : process (clk)
  begin
    if rising_edge(clk) then
      phase <= phase + 1;
      if phase = 3 then
        scan <= scan + 1;
        if scan = G_COUNT - 1 then
          scan  <= (others => '0');
          first <= '0';
        end if;
      end if;
      for i in 0 to G_COUNT - 1 loop
        if events(i) = '1' then
          pending(i) <= '1';
        elsif write = '1' and scan = i then
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

  -- In phase 3, same says that rdata belongs to r_index.
  same    <= to_bit(r_index = index_q);
  r_valid <= have and same;

  p_read : process (clk)
  begin
    if rising_edge(clk) then
      index_q <= r_index;
      if same = '0' then
        have <= '0';
      elsif phase = 3 and have = '0' and first = '0' then
        have   <= '1';
        r_data <= rdata;
      end if;
      if rst = '1' then
        have <= '0';
      end if;
    end if;
  end process p_read;

end architecture rtl;
