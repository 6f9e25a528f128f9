-- SPDX-License-Identifier: Apache-2.0
-- updating: the depth map: winner takes all, local maximum, parabola, unload (paper, section 4.2.3).
--   Cell    : {best, prev, plane, frac, local_max, prev_valid}, 2 G_MNCC_W + clog2(G_PLANES) + G_FRAC_W + 2 bits in one
--             RAM. Two values of V suffice (the best and the one before it); the fraction of the parabola is computed
--             when the plane behind the best one comes by, and stored instead of a third.
--   Rate    : one cell per clock: read, change, write; unload: one cell per clock while m_tready = '1'
--   Latency : updating_latency(G_FRAC_W) clocks from a cell's V to its write (psweep_pkg); unload 2 clocks to the first
--             beat
--   Numbers : V ufix(0,G_MNCC_W); fraction a / (a + c) = offset + 1/2, ufix(0,G_FRAC_W), truncated
--   Planes  : counted here, by s_last; plane 0 ignores the stored word, so the map is never cleared. A plane must take
--             more clocks than the loop (control: at least 3 C_ROW_MIN)
--   Mask    : bit 0 outside, 1 no variance, 2 below threshold, 3 not a local maximum; while a cell has no winner, the
--             low bits of its fraction remember whether it was ever inside (0) and textured (1)
--   Reset   : and cancel: valids, counters; the map keeps its contents
--   Golden  : sw/golden/updating.hpp
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;

entity updating is
  generic (
    G_CELLS  : integer := 33280;
    G_PLANES : integer := 301;
    G_MNCC_W : integer := 13;
    G_FRAC_W : integer := 8
  );
  port (
    clk : in  std_logic;
    rst : in  std_logic;

    start  : in  std_logic; -- pulse: the next cell is the first of a new tile
    cancel : in  std_logic; -- pulse: forget what is on its way

    s_valid    : in  std_logic;
    s_last     : in  std_logic; -- last cell of the plane
    s_inside   : in  std_logic;
    s_textured : in  std_logic;
    s_v        : in  std_logic_vector(G_MNCC_W - 1 downto 0);
    threshold  : in  std_logic_vector(G_MNCC_W - 1 downto 0); -- static during a tile

    plane_done  : out std_logic; -- pulse: the last cell of a plane is in the map
    unload      : in  std_logic; -- pulse, behind the plane_done of the last plane
    unload_done : out std_logic; -- the last beat is being taken

    m_tvalid : out std_logic;
    m_tready : in  std_logic;
    m_tdata  : out std_logic_vector(4 + clog2(G_PLANES) + G_FRAC_W + G_MNCC_W - 1 downto 0); -- {mask, plane, frac, v}
    m_tlast  : out std_logic;

    -- Write port of the map.
    dbg_map_we         : out std_logic;
    dbg_map_addr       : out std_logic_vector(clog2(G_CELLS) - 1 downto 0);
    dbg_map_best       : out std_logic_vector(G_MNCC_W - 1 downto 0);
    dbg_map_prev       : out std_logic_vector(G_MNCC_W - 1 downto 0);
    dbg_map_plane      : out std_logic_vector(clog2(G_PLANES) - 1 downto 0);
    dbg_map_frac       : out std_logic_vector(G_FRAC_W - 1 downto 0);
    dbg_map_local_max  : out std_logic;
    dbg_map_prev_valid : out std_logic
  );
end entity updating;

architecture rtl of updating is

  constant C_ADDR_W  : integer := clog2(G_CELLS);
  constant C_PLANE_W : integer := clog2(G_PLANES);
  constant C_WORD_W  : integer := 2 * G_MNCC_W + C_PLANE_W + G_FRAC_W + 2;
  constant C_DATA_W  : integer := 4 + C_PLANE_W + G_FRAC_W + G_MNCC_W;
  -- What a cell takes along while its fraction is computed: the word, and whether to take the quotient.
  constant C_WAIT_W  : integer := C_WORD_W + 1;

  signal clear : std_logic;

  -- Read side: the cell to be read next, in sweep and unload.
  signal read_cell : unsigned(C_ADDR_W - 1 downto 0);
  signal held_cell : unsigned(C_ADDR_W - 1 downto 0); -- the one read in the clock before
  signal last_cell : unsigned(C_ADDR_W - 1 downto 0); -- of the tile
  signal plane     : unsigned(C_PLANE_W - 1 downto 0);
  signal plane_before : unsigned(C_PLANE_W - 1 downto 0); -- plane - 1
  signal first     : std_logic;                        -- plane 0
  signal raddr     : std_logic_vector(C_ADDR_W - 1 downto 0);
  signal word      : std_logic_vector(C_WORD_W - 1 downto 0);

  -- Fields of the word that comes out of the map.
  signal word_best       : std_logic_vector(G_MNCC_W - 1 downto 0);
  signal word_prev       : std_logic_vector(G_MNCC_W - 1 downto 0);
  signal word_plane      : std_logic_vector(C_PLANE_W - 1 downto 0);
  signal word_frac       : std_logic_vector(G_FRAC_W - 1 downto 0);
  signal word_local_max  : std_logic;
  signal word_prev_valid : std_logic;

  -- s1: V and its plane, while the map is read
  signal s1_valid    : std_logic;
  signal s1_last     : std_logic;
  signal s1_inside   : std_logic;
  signal s1_textured : std_logic;
  signal s1_v        : unsigned(G_MNCC_W - 1 downto 0);
  signal s1_first    : std_logic;
  signal s1_plane    : unsigned(C_PLANE_W - 1 downto 0);
  signal s1_before   : unsigned(C_PLANE_W - 1 downto 0);

  -- s2: the stored word, empty at plane 0
  signal s2_valid      : std_logic;
  signal s2_last       : std_logic;
  signal s2_inside     : std_logic;
  signal s2_textured   : std_logic;
  signal s2_v          : unsigned(G_MNCC_W - 1 downto 0);
  signal s2_now        : unsigned(C_PLANE_W - 1 downto 0);
  signal s2_best       : unsigned(G_MNCC_W - 1 downto 0);
  signal s2_prev       : unsigned(G_MNCC_W - 1 downto 0);
  signal s2_plane      : unsigned(C_PLANE_W - 1 downto 0);
  signal s2_frac       : std_logic_vector(G_FRAC_W - 1 downto 0);
  signal s2_local_max  : std_logic;
  signal s2_prev_valid : std_logic;
  signal s2_is_before  : std_logic; -- the stored plane is the one before this one
  signal s2_better     : std_logic;
  signal s2_won        : std_logic; -- there is a winner
  signal s2_adjacent   : std_logic; -- and it is the plane before this one

  -- s3: the new word but for its fraction; operands of the parabola, a = best - prev and a + c = 2 best - prev - v
  signal s3_valid    : std_logic;
  signal s3_last     : std_logic;
  signal s3_parabola : std_logic; -- the fraction comes from the divider
  signal s3_word     : std_logic_vector(C_WORD_W - 1 downto 0);
  signal s3_rise     : unsigned(G_MNCC_W - 1 downto 0);
  signal s3_both     : unsigned(G_MNCC_W downto 0);
  signal s3_num      : std_logic_vector(G_MNCC_W + 1 downto 0);
  signal s3_wait     : std_logic_vector(C_WAIT_W - 1 downto 0);

  -- Behind the divider, and the write.
  signal way_valid  : std_logic_vector(G_FRAC_W downto 0);
  signal way_last   : std_logic_vector(G_FRAC_W downto 0);
  signal quot       : std_logic_vector(G_FRAC_W - 1 downto 0);
  signal waited     : std_logic_vector(C_WAIT_W - 1 downto 0);
  signal write_cell : unsigned(C_ADDR_W - 1 downto 0);
  signal write_word : std_logic_vector(C_WORD_W - 1 downto 0);

  -- Unload: fetched = word holds the next beat.
  signal unloading    : std_logic; -- cells are left to fetch
  signal fetched      : std_logic;
  signal fetched_last : std_logic;
  signal fetch        : std_logic;
  signal out_ready    : std_logic;
  signal mask         : std_logic_vector(3 downto 0);
  signal empty        : std_logic; -- no winner
  signal out_data     : std_logic_vector(C_DATA_W downto 0);
  signal beat_valid   : std_logic;
  signal beat         : std_logic_vector(C_DATA_W downto 0);

begin

  assert G_CELLS >= 1 and G_CELLS <= 2 ** 22
    report "updating: G_CELLS=" & integer'image(G_CELLS) & " outside 1..4194304"
    severity failure;
  assert G_PLANES >= 1 and G_PLANES <= 1024
    report "updating: G_PLANES=" & integer'image(G_PLANES) & " outside 1..1024"
    severity failure;
  assert G_MNCC_W >= 4 and G_MNCC_W <= 16
    report "updating: G_MNCC_W=" & integer'image(G_MNCC_W) & " outside 4..16"
    severity failure;
  -- The loop of updating_latency clocks must close within a plane of 3 C_ROW_MIN.
  assert G_FRAC_W >= 2 and G_FRAC_W <= 12
    report "updating: G_FRAC_W=" & integer'image(G_FRAC_W) & " outside 2..12"
    severity failure;

  clear <= rst or cancel or start;

  -- Map --------------------------------------------------------------------------------------------------------------
  raddr <= std_logic_vector(held_cell) when fetched = '1' and out_ready = '0' else std_logic_vector(read_cell);

  u_map : entity work.ram_sdp
    generic map (
      G_DATA_W  => C_WORD_W,
      G_DEPTH   => imax(G_CELLS, 2), -- GHDL 2.0 cannot convert a RAM of one word
      G_LATENCY => 1
    )
    port map (
      clk   => clk,
      we    => way_valid(G_FRAC_W),
      waddr => std_logic_vector(write_cell),
      wdata => write_word,
      raddr => raddr,
      rdata => word
    );

  word_prev_valid <= word(0);
  word_local_max  <= word(1);
  word_frac       <= word(G_FRAC_W + 1 downto 2);
  word_plane      <= word(C_PLANE_W + G_FRAC_W + 1 downto G_FRAC_W + 2);
  word_prev       <= word(G_MNCC_W + C_PLANE_W + G_FRAC_W + 1 downto C_PLANE_W + G_FRAC_W + 2);
  word_best       <= word(C_WORD_W - 1 downto G_MNCC_W + C_PLANE_W + G_FRAC_W + 2);

  p_read : process (clk)
  begin
    if rising_edge(clk) then
      held_cell <= unsigned(raddr);
      if s_valid = '1' then
        if s_last = '1' then
          read_cell <= (others => '0');
          last_cell <= read_cell;
          plane_before <= plane;
          plane     <= plane + 1;
          first     <= '0';
        else
          read_cell <= read_cell + 1;
        end if;
      elsif fetch = '1' then
        if read_cell = last_cell then
          read_cell <= (others => '0');
        else
          read_cell <= read_cell + 1;
        end if;
      end if;
      if clear = '1' then
        read_cell <= (others => '0');
        plane     <= (others => '0');
        first     <= '1';
      end if;
      if rst = '1' then
        held_cell <= (others => '0'); -- addresses are legal from the first clock on
      end if;
    end if;
  end process p_read;

  -- Update -----------------------------------------------------------------------------------------------------------
  s2_better   <= s2_inside and to_bit(s2_v > s2_best);
  s2_won      <= to_bit(s2_best /= 0);
  s2_adjacent <= s2_won and s2_is_before;

  p_update : process (clk)
    variable v_best       : unsigned(G_MNCC_W - 1 downto 0);
    variable v_prev       : unsigned(G_MNCC_W - 1 downto 0);
    variable v_plane      : unsigned(C_PLANE_W - 1 downto 0);
    variable v_frac       : std_logic_vector(G_FRAC_W - 1 downto 0);
    variable v_local_max  : std_logic;
    variable v_prev_valid : std_logic;
  begin
    if rising_edge(clk) then
      -- s1: V of a window that is not inside counts as 0
      s1_valid    <= s_valid;
      s1_last     <= s_last;
      s1_inside   <= s_inside;
      s1_textured <= s_textured;
      s1_v        <= unsigned(s_v);
      if s_inside = '0' then
        s1_v <= (others => '0');
      end if;
      s1_first  <= first;
      s1_plane  <= plane;
      s1_before <= plane_before;
      -- s2
      s2_valid      <= s1_valid;
      s2_last       <= s1_last;
      s2_inside     <= s1_inside;
      s2_textured   <= s1_textured;
      s2_v          <= s1_v;
      s2_now        <= s1_plane;
      s2_best       <= unsigned(word_best);
      s2_prev       <= unsigned(word_prev);
      s2_plane      <= unsigned(word_plane);
      s2_frac       <= word_frac;
      s2_local_max  <= word_local_max;
      s2_prev_valid <= word_prev_valid;
      s2_is_before  <= to_bit(unsigned(word_plane) = s1_before);
      if s1_first = '1' then
        s2_best       <= (others => '0');
        s2_prev       <= (others => '0');
        s2_plane      <= (others => '0');
        s2_frac       <= (others => '0');
        s2_local_max  <= '0';
        s2_prev_valid <= '0';
        s2_is_before  <= '0';
      end if;
      -- s3
      v_best       := s2_best;
      v_prev       := s2_v;
      v_plane      := s2_plane;
      v_frac       := s2_frac;
      v_local_max  := s2_local_max;
      v_prev_valid := s2_inside;
      if s2_better = '1' then
        v_best       := s2_v;
        v_prev       := s2_prev; -- holds V of the plane before, unless that was the winner
        v_prev_valid := s2_prev_valid;
        if s2_adjacent = '1' then
          v_prev       := s2_best;
          v_prev_valid := '1';
        end if;
        v_plane     := s2_now;
        v_frac      := (others => '0');
        v_local_max := '0';
      elsif s2_adjacent = '1' then
        v_local_max := s2_inside and s2_prev_valid;
      elsif s2_won = '0' then
        v_frac(0) := s2_frac(0) or s2_inside;
        v_frac(1) := s2_frac(1) or s2_textured;
      end if;
      s3_valid    <= s2_valid;
      s3_last     <= s2_last;
      s3_parabola <= s2_adjacent and not s2_better;
      s3_word     <= std_logic_vector(v_best) & std_logic_vector(v_prev) & std_logic_vector(v_plane) & v_frac
                     & v_local_max & v_prev_valid;
      s3_rise     <= s2_best - s2_prev;
      s3_both     <= (s2_best & '0') - resize(s2_prev, G_MNCC_W + 1) - resize(s2_v, G_MNCC_W + 1);
      if rst = '1' or cancel = '1' then
        s1_valid <= '0';
        s2_valid <= '0';
        s3_valid <= '0';
      end if;
    end if;
  end process p_update;

  s3_num  <= "00" & std_logic_vector(s3_rise);
  s3_wait <= s3_parabola & s3_word;

  u_divider : entity work.divider
    generic map (
      G_NUM_W  => G_MNCC_W + 1,
      G_QUOT_W => G_FRAC_W
    )
    port map (
      clk    => clk,
      s_num  => s3_num,
      s_den  => std_logic_vector(s3_both),
      m_quot => quot
    );

  u_wait : entity work.delay_line
    generic map (
      G_DATA_W => C_WAIT_W,
      G_DELAY  => G_FRAC_W
    )
    port map (
      clk    => clk,
      ce     => '1',
      s_data => s3_wait,
      m_data => waited
    );

  p_write : process (clk)
  begin
    if rising_edge(clk) then
      way_valid  <= way_valid(G_FRAC_W - 1 downto 0) & s3_valid;
      way_last   <= way_last(G_FRAC_W - 1 downto 0) & s3_last;
      write_word <= waited(C_WORD_W - 1 downto 0);
      if waited(C_WORD_W) = '1' then
        write_word(G_FRAC_W + 1 downto 2) <= quot;
      end if;
      plane_done <= way_valid(G_FRAC_W) and way_last(G_FRAC_W);
      if way_valid(G_FRAC_W) = '1' then
        if way_last(G_FRAC_W) = '1' then
          write_cell <= (others => '0');
        else
          write_cell <= write_cell + 1;
        end if;
      end if;
      if clear = '1' then
        way_valid  <= (others => '0');
        plane_done <= '0';
        write_cell <= (others => '0');
      end if;
    end if;
  end process p_write;

  dbg_map_we         <= way_valid(G_FRAC_W);
  dbg_map_addr       <= std_logic_vector(write_cell);
  dbg_map_prev_valid <= write_word(0);
  dbg_map_local_max  <= write_word(1);
  dbg_map_frac       <= write_word(G_FRAC_W + 1 downto 2);
  dbg_map_plane      <= write_word(C_PLANE_W + G_FRAC_W + 1 downto G_FRAC_W + 2);
  dbg_map_prev       <= write_word(G_MNCC_W + C_PLANE_W + G_FRAC_W + 1 downto C_PLANE_W + G_FRAC_W + 2);
  dbg_map_best       <= write_word(C_WORD_W - 1 downto G_MNCC_W + C_PLANE_W + G_FRAC_W + 2);

  -- Unload -----------------------------------------------------------------------------------------------------------
  -- The map has no read enable: a word that is not taken is kept by reading it again.
  fetch <= unloading and (not fetched or out_ready);

  p_unload : process (clk)
  begin
    if rising_edge(clk) then
      if unload = '1' then
        unloading <= '1';
      elsif fetch = '1' and read_cell = last_cell then
        unloading <= '0';
      end if;
      if fetch = '1' then
        fetched      <= '1';
        fetched_last <= to_bit(read_cell = last_cell);
      elsif out_ready = '1' then
        fetched <= '0';
      end if;
      if rst = '1' or cancel = '1' then
        unloading <= '0';
        fetched   <= '0';
      end if;
    end if;
  end process p_unload;

  empty   <= to_bit(unsigned(word_best) = 0);
  mask(0) <= empty and not word_frac(0);
  mask(1) <= empty and word_frac(0) and not word_frac(1);
  mask(2) <= to_bit(unsigned(word_best) < unsigned(threshold)) and not (empty and not (word_frac(0) and word_frac(1)));
  mask(3) <= not word_local_max and not (empty and not (word_frac(0) and word_frac(1)));

  out_data <= fetched_last & mask & word_plane & word_frac & word_best;

  u_out : entity work.stream_reg
    generic map (
      G_DATA_W => C_DATA_W + 1
    )
    port map (
      clk      => clk,
      rst      => clear,
      s_tvalid => fetched,
      s_tready => out_ready,
      s_tdata  => out_data,
      m_tvalid => beat_valid,
      m_tready => m_tready,
      m_tdata  => beat
    );

  m_tvalid    <= beat_valid;
  m_tlast     <= beat(C_DATA_W);
  m_tdata     <= beat(C_DATA_W - 1 downto 0);
  unload_done <= beat_valid and m_tready and beat(C_DATA_W);

end architecture rtl;
