-- SPDX-License-Identifier: Apache-2.0
-- stream_fifo: a small FIFO between a pipeline that cannot stop at once and a stream; cuts every path between them.
--   Rate     : one beat per clock in and out
--   Latency  : 2 clocks; 2 ** G_DEPTH_LOG2 - 1 places
--   Contract : m_tvalid never waits for m_tready; a beat shown on m_* holds until it is taken (or reset)
--   few      : one clock ago less than half of the places were taken. A sender that begins beats only while few = '1'
--              and needs at most 2 ** (G_DEPTH_LOG2 - 1) - 2 clocks from there to s_tvalid need not look at s_tready
--   Reset    : all places become empty; data have no reset
--   Structure: a RAM is read at the place that will be shown next, so a beat that is not taken is read again. Two
--              pointers and a LUT RAM are smaller than two registers per bit, and no enable lies before all of them
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;

entity stream_fifo is
  generic (
    G_DATA_W     : integer := 8;
    G_DEPTH_LOG2 : integer := 4
  );
  port (
    clk      : in  std_logic;
    rst      : in  std_logic;
    s_tvalid : in  std_logic;
    s_tready : out std_logic;
    s_tdata  : in  std_logic_vector(G_DATA_W - 1 downto 0);
    few      : out std_logic;
    more     : out std_logic; -- there are beats besides the one shown
    m_tvalid : out std_logic;
    m_tready : in  std_logic;
    m_tdata  : out std_logic_vector(G_DATA_W - 1 downto 0)
  );
end entity stream_fifo;

architecture rtl of stream_fifo is

  signal write_place : unsigned(G_DEPTH_LOG2 - 1 downto 0);
  signal read_place  : unsigned(G_DEPTH_LOG2 - 1 downto 0); -- of the beat shown, or to come
  signal next_place  : unsigned(G_DEPTH_LOG2 - 1 downto 0); -- of the one in the clock to come
  signal taken       : unsigned(G_DEPTH_LOG2 - 1 downto 0); -- places, with that of the beat shown
  signal s_ready     : std_logic;
  signal s_fire      : std_logic;
  signal m_valid     : std_logic;
  signal m_data      : std_logic_vector(G_DATA_W - 1 downto 0);

begin

  assert G_DATA_W >= 1
    report "stream_fifo: G_DATA_W"
           -- synthesis translate_off
           & "=" & integer'image(G_DATA_W)
           -- synthesis translate_on
           & " below 1"
    severity failure;
  assert G_DEPTH_LOG2 >= 2 and G_DEPTH_LOG2 <= 6
    report "stream_fifo: G_DEPTH_LOG2"
           -- synthesis translate_off
           & "=" & integer'image(G_DEPTH_LOG2)
           -- synthesis translate_on
           & " outside 2..6"
    severity failure;

  taken      <= write_place - read_place;
  s_ready    <= to_sl(write_place + 1 /= read_place);
  s_fire     <= s_tvalid and s_ready;
  next_place <= read_place + 1 when m_valid = '1' and m_tready = '1' else read_place;
  s_tready   <= s_ready;
  m_tvalid   <= m_valid;
  m_tdata    <= m_data;

  u_places : entity work.ram_sdp
    generic map (
      G_DATA_W  => G_DATA_W,
      G_DEPTH   => 2 ** G_DEPTH_LOG2,
      G_LATENCY => 1
    )
    port map (
      clk   => clk,
      we    => s_fire,
      waddr => std_logic_vector(write_place),
      wdata => s_tdata,
      raddr => std_logic_vector(next_place),
      rdata => m_data
    );

  p_places : process (clk)
  begin
    if rising_edge(clk) then
      if s_fire = '1' then
        write_place <= write_place + 1;
      end if;
      read_place <= next_place;
      m_valid    <= to_sl(next_place /= write_place); -- written before this clock
      few        <= not taken(G_DEPTH_LOG2 - 1);
      more       <= s_fire or (to_sl(next_place /= write_place) and to_sl(next_place + 1 /= write_place));
      if rst = '1' then
        write_place <= (others => '0');
        read_place  <= (others => '0');
        m_valid     <= '0';
        few         <= '1';
        more        <= '0';
      end if;
    end if;
  end process p_places;

  -- synthesis translate_off
  -- Rules of a stream, in simulators: a beat that was not taken is still there, on both sides.
  p_rules : process (clk)
    variable v_s_waits : boolean := false;
    variable v_m_waits : boolean := false;
    variable v_s_data  : std_logic_vector(G_DATA_W - 1 downto 0);
    variable v_m_data  : std_logic_vector(G_DATA_W - 1 downto 0);
  begin
    if rising_edge(clk) then
      if rst = '0' then
        assert not v_s_waits or (s_tvalid = '1' and s_tdata = v_s_data)
          report "stream_fifo: a beat that waited at s_* was withdrawn or changed"
          severity failure;
        assert not v_m_waits or (m_valid = '1' and m_data = v_m_data)
          report "stream_fifo: a beat that waited at m_* was withdrawn or changed"
          severity failure;
        assert m_valid /= '1' or not is_x(m_data)
          report "stream_fifo: a beat is unknown"
          severity failure;
      end if;
      v_s_waits := rst = '0' and s_tvalid = '1' and s_ready = '0';
      v_m_waits := rst = '0' and m_valid = '1' and m_tready = '0';
      v_s_data  := s_tdata;
      v_m_data  := m_data;
    end if;
  end process p_rules;
  -- synthesis translate_on

end architecture rtl;
