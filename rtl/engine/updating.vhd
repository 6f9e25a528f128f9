-- SPDX-License-Identifier: Apache-2.0
-- updating: the depth map: winner takes all, local maximum, parabola, unload (paper, section 4.2.3).
--   Cell    : {best, prev, plane, frac, local_max, prev_valid}, 2 G_MNCC_W + clog2(G_PLANES) + G_FRAC_W + 2 bits in one
--             RAM. Two values of V suffice (the best and the one before it); the fraction of the parabola is computed
--             when the plane after the best one passes, and stored instead of a third.
--   Rate    : one cell per clock: read, change, write; unload: one cell per clock while m_tready = '1'
--   Lanes   : a set of G_LANES planes comes at once, lane 0 in the low bits. The cell is read once, passes one stage
--             per lane in the order of planes, and is written once. Of the parabolas due in a set only the last one
--             counts (a better V later in the set voids those before it), so there is one divider
--   Latency : updating_latency(G_FRAC_W, G_LANES) clocks from a cell's V to its write (psweep_pkg); unload 5 clocks to
--             the first beat
--   Numbers : V ufix(0,G_MNCC_W); fraction a / (a + c) = offset + 1/2, ufix(0,G_FRAC_W), truncated
--   Planes  : sets are counted here, by s_last; set 0 ignores the stored word, so the map is never cleared. A set must
--             take more clocks than the loop (control: at least 3 C_ROW_MIN). A lane without s_valid in a set has no
--             plane there; lane 0 always has one
--   Mask    : bit 0 outside, 1 no variance, 2 below threshold, 3 not a local maximum; while a cell has no winner, the
--             low bits of its fraction remember whether it was ever inside (0) and textured (1)
--   Unload  : cells are read only while the FIFO behind is less than half full, and the RAM's address comes straight
--             from a counter, so that m_tready does not reach the blocks of the map
--   Reset   : as cancel: clears valids and counters; the map keeps its contents
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
    G_FRAC_W : integer := 8;
    G_LANES  : integer := 1
  );
  port (
    clk : in  std_logic;
    rst : in  std_logic;

    start  : in  std_logic; -- pulse: the next cell is the first of a new tile
    cancel : in  std_logic; -- pulse: forget what is on its way

    s_valid    : in  std_logic_vector(G_LANES - 1 downto 0);
    s_last     : in  std_logic; -- last cell of the set, of lane 0
    s_inside   : in  std_logic_vector(G_LANES - 1 downto 0);
    s_textured : in  std_logic_vector(G_LANES - 1 downto 0);
    s_v        : in  std_logic_vector(G_LANES * G_MNCC_W - 1 downto 0);
    threshold  : in  std_logic_vector(G_MNCC_W - 1 downto 0); -- static during a tile

    unload      : in  std_logic; -- pulse, when the last cell of the last set is in the map
    unload_more : out std_logic; -- beats will follow the one on m_*
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
  constant C_LANE_W  : integer := G_LANES / 2; -- bits of a lane's number: 0, 1 or 2
  constant C_SET_W   : integer := clog2(plane_sets(G_PLANES, G_LANES));
  constant C_WORD_W  : integer := 2 * G_MNCC_W + C_PLANE_W + G_FRAC_W + 2;
  constant C_DATA_W  : integer := 4 + C_PLANE_W + G_FRAC_W + G_MNCC_W;
  -- What a cell takes along while its fraction is computed: the word, and whether to take the quotient.
  constant C_WAIT_W  : integer := C_WORD_W + 1;

  signal clear : std_logic;

  -- Read side: the cell to be read next, in sweep and unload.
  signal read_cell : unsigned(C_ADDR_W - 1 downto 0);
  signal last_cell : unsigned(C_ADDR_W - 1 downto 0); -- of the tile
  signal at_last_cell : std_logic; -- in unload
  signal plane_set : unsigned(C_SET_W - 1 downto 0);
  signal set_before : unsigned(C_SET_W - 1 downto 0); -- plane_set - 1
  signal first     : std_logic;                        -- set 0
  signal word      : std_logic_vector(C_WORD_W - 1 downto 0);

  -- Fields of the word that comes out of the map.
  signal word_best       : std_logic_vector(G_MNCC_W - 1 downto 0);
  signal word_prev       : std_logic_vector(G_MNCC_W - 1 downto 0);
  signal word_plane      : std_logic_vector(C_PLANE_W - 1 downto 0);
  signal word_frac       : std_logic_vector(G_FRAC_W - 1 downto 0);
  signal word_local_max  : std_logic;
  signal word_prev_valid : std_logic;

  -- s1: V of all lanes, while the map is read.
  signal s1_valid    : std_logic;
  signal s1_last     : std_logic;
  signal s1_on       : std_logic_vector(G_LANES - 1 downto 0);
  signal s1_inside   : std_logic_vector(G_LANES - 1 downto 0);
  signal s1_textured : std_logic_vector(G_LANES - 1 downto 0);
  signal s1_v        : std_logic_vector(G_LANES * G_MNCC_W - 1 downto 0);
  signal s1_first    : std_logic;
  signal s1_set      : unsigned(C_SET_W - 1 downto 0);
  signal s1_before   : unsigned(C_SET_W + C_LANE_W - 1 downto 0); -- the plane before lane 0's
  -- s2: the same, while the word is in the RAM's output register.
  signal s2_valid    : std_logic;
  signal s2_last     : std_logic;
  signal s2_on       : std_logic_vector(G_LANES - 1 downto 0);
  signal s2_inside   : std_logic_vector(G_LANES - 1 downto 0);
  signal s2_textured : std_logic_vector(G_LANES - 1 downto 0);
  signal s2_v        : std_logic_vector(G_LANES * G_MNCC_W - 1 downto 0);
  signal s2_first    : std_logic;
  signal s2_set      : unsigned(C_SET_W - 1 downto 0);
  signal s2_before   : unsigned(C_SET_W + C_LANE_W - 1 downto 0);

  -- One stage per lane from s3 on. Of each signal element n enters the stage of lane n, and element G_LANES is s4, the
  -- word to be written but for its fraction, and whether there is a parabola. Of the parabola the lanes pass on the
  -- values beside the best one; the last of them makes best - prev and 2 best - prev - v.
  signal way_in_valid  : std_logic_vector(G_LANES downto 0);
  signal way_in_last   : std_logic_vector(G_LANES downto 0);
  signal way_set       : std_logic_vector((G_LANES + 1) * C_SET_W - 1 downto 0);
  signal way_best      : std_logic_vector((G_LANES + 1) * G_MNCC_W - 1 downto 0);
  signal way_prev      : std_logic_vector((G_LANES + 1) * G_MNCC_W - 1 downto 0);
  signal way_plane     : std_logic_vector((G_LANES + 1) * C_PLANE_W - 1 downto 0);
  signal way_frac      : std_logic_vector((G_LANES + 1) * G_FRAC_W - 1 downto 0);
  signal way_won       : std_logic_vector(G_LANES downto 0);
  signal way_local_max : std_logic_vector(G_LANES downto 0);
  signal way_prev_ok   : std_logic_vector(G_LANES downto 0);
  signal way_before    : std_logic_vector(G_LANES downto 0); -- the best plane is the one before this lane's
  signal way_parabola  : std_logic_vector(G_LANES downto 0);
  signal way_lower     : std_logic_vector(G_LANES * G_MNCC_W - 1 downto 0); -- V of the plane before the best one
  signal way_upper     : std_logic_vector(G_LANES * G_MNCC_W - 1 downto 0); -- and of the one behind it

  signal s4_word : std_logic_vector(C_WORD_W - 1 downto 0);
  signal s4_rise : unsigned(G_MNCC_W - 1 downto 0);
  signal s4_both : unsigned(G_MNCC_W downto 0);
  signal s4_num  : std_logic_vector(G_MNCC_W + 1 downto 0);
  signal s4_wait : std_logic_vector(C_WAIT_W - 1 downto 0);

  -- Behind the divider, and the write.
  signal way_valid  : std_logic_vector(G_FRAC_W downto 0);
  signal way_last   : std_logic_vector(G_FRAC_W downto 0);
  signal quot       : std_logic_vector(G_FRAC_W - 1 downto 0);
  signal waited     : std_logic_vector(C_WAIT_W - 1 downto 0);
  signal write_cell : unsigned(C_ADDR_W - 1 downto 0);
  signal write_word : std_logic_vector(C_WORD_W - 1 downto 0);

  -- Unload: a cell is read, is in the RAM's output register (fetched), is a beat (sent), and goes into a FIFO. It is
  -- read only while that is less than half full, so none on its way has to wait.
  signal unloading    : std_logic; -- cells are left to read
  signal fetch        : std_logic;
  signal read         : std_logic;
  signal read_last    : std_logic;
  signal fetched      : std_logic;
  signal fetched_last : std_logic;
  signal sent           : std_logic; -- out_data is the next beat
  signal sent_last      : std_logic;
  signal sent_best      : unsigned(G_MNCC_W - 1 downto 0);
  signal sent_plane     : std_logic_vector(C_PLANE_W - 1 downto 0);
  signal sent_frac      : std_logic_vector(G_FRAC_W - 1 downto 0);
  signal sent_local_max : std_logic;
  signal few          : std_logic;
  signal behind       : std_logic; -- beats behind the one that is shown
  signal out_ready    : std_logic; -- always '1' when it matters
  signal mask         : std_logic_vector(3 downto 0);
  signal empty        : std_logic; -- no winner
  signal out_data     : std_logic_vector(C_DATA_W downto 0);
  signal beat_valid   : std_logic;
  signal beat         : std_logic_vector(C_DATA_W downto 0);

begin

  assert G_CELLS >= 1 and G_CELLS <= 2 ** 22
    report "updating: G_CELLS"
           -- synthesis translate_off
           & "=" & integer'image(G_CELLS)
           -- synthesis translate_on
           & " outside 1..4194304"
    severity failure;
  assert G_PLANES >= 1 and G_PLANES <= 1024
    report "updating: G_PLANES"
           -- synthesis translate_off
           & "=" & integer'image(G_PLANES)
           -- synthesis translate_on
           & " outside 1..1024"
    severity failure;
  assert G_MNCC_W >= 4 and G_MNCC_W <= 16
    report "updating: G_MNCC_W"
           -- synthesis translate_off
           & "=" & integer'image(G_MNCC_W)
           -- synthesis translate_on
           & " outside 4..16"
    severity failure;
  -- The loop of updating_latency clocks must close within a plane of 3 C_ROW_MIN.
  assert G_FRAC_W >= 2 and G_FRAC_W <= 12
    report "updating: G_FRAC_W"
           -- synthesis translate_off
           & "=" & integer'image(G_FRAC_W)
           -- synthesis translate_on
           & " outside 2..12"
    severity failure;

  assert G_LANES = 1 or G_LANES = 2 or G_LANES = 4
    report "updating: G_LANES"
           -- synthesis translate_off
           & "=" & integer'image(G_LANES)
           -- synthesis translate_on
           & " is not 1, 2 or 4"
    severity failure;

  clear <= rst or cancel or start;

  -- Map --------------------------------------------------------------------------------------------------------------
  u_map : entity work.ram_deep
    generic map (
      G_DATA_W  => C_WORD_W,
      G_DEPTH   => imax(G_CELLS, 2), -- GHDL 2.0 cannot convert a RAM of one word
      G_LATENCY => 2
    )
    port map (
      clk   => clk,
      we    => way_valid(G_FRAC_W),
      waddr => std_logic_vector(write_cell),
      wdata => write_word,
      raddr => std_logic_vector(read_cell),
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
      if s_valid(0) = '1' then
        if s_last = '1' then
          read_cell <= (others => '0');
          last_cell <= read_cell;
          set_before <= plane_set;
          plane_set <= plane_set + 1;
          first     <= '0';
        else
          read_cell <= read_cell + 1;
        end if;
      elsif fetch = '1' and at_last_cell = '0' then -- the last one stays: an address that the map has, until start
        read_cell <= read_cell + 1;
      end if;
      if clear = '1' then
        read_cell <= (others => '0');
        plane_set <= (others => '0');
        first     <= '1';
      end if;
    end if;
  end process p_read;

  -- Update -----------------------------------------------------------------------------------------------------------
  p_first : process (clk)
  begin
    if rising_edge(clk) then
      s1_valid    <= s_valid(0);
      s1_last     <= s_last;
      s1_on       <= s_valid;
      s1_inside   <= s_inside;
      s1_textured <= s_textured;
      s1_v        <= s_v;
      for n in 0 to G_LANES - 1 loop
        if s_inside(n) = '0' then -- V of a window that is not inside counts as 0
          s1_v((n + 1) * G_MNCC_W - 1 downto n * G_MNCC_W) <= (others => '0');
        end if;
      end loop;
      s1_first <= first;
      s1_set   <= plane_set;
      -- The last plane of the set before: all lane bits are ones.
      s1_before(C_SET_W + C_LANE_W - 1 downto C_LANE_W) <= set_before;
      for k in 0 to C_LANE_W - 1 loop
        s1_before(k) <= '1';
      end loop;
      -- s2
      s2_valid    <= s1_valid;
      s2_last     <= s1_last;
      s2_on       <= s1_on;
      s2_inside   <= s1_inside;
      s2_textured <= s1_textured;
      s2_v        <= s1_v;
      s2_first    <= s1_first;
      s2_set      <= s1_set;
      s2_before   <= s1_before;
      -- s3: the stored word, empty at set 0
      way_in_valid(0)                      <= s2_valid;
      way_in_last(0)                       <= s2_last;
      way_set(C_SET_W - 1 downto 0)        <= std_logic_vector(s2_set);
      way_best(G_MNCC_W - 1 downto 0)      <= word_best;
      way_prev(G_MNCC_W - 1 downto 0)      <= word_prev;
      way_plane(C_PLANE_W - 1 downto 0)    <= word_plane;
      way_frac(G_FRAC_W - 1 downto 0)      <= word_frac;
      way_won(0)                           <= to_sl(unsigned(word_best) /= 0);
      way_local_max(0)                     <= word_local_max;
      way_prev_ok(0)                       <= word_prev_valid;
      way_before(0)                        <= to_sl(unsigned(word_plane) = resize(s2_before, C_PLANE_W));
      if s2_first = '1' then
        way_best(G_MNCC_W - 1 downto 0)    <= (others => '0');
        way_prev(G_MNCC_W - 1 downto 0)    <= (others => '0');
        way_plane(C_PLANE_W - 1 downto 0)  <= (others => '0');
        way_frac(G_FRAC_W - 1 downto 0)    <= (others => '0');
        way_won(0)                         <= '0';
        way_local_max(0)                   <= '0';
        way_prev_ok(0)                     <= '0';
        way_before(0)                      <= '0';
      end if;
      if rst = '1' or cancel = '1' then
        s1_valid        <= '0';
        s2_valid        <= '0';
        way_in_valid(0) <= '0';
      end if;
    end if;
  end process p_first;

  way_parabola(0)                        <= '0';
  way_lower(G_MNCC_W - 1 downto 0)       <= (others => '0');
  way_upper(G_MNCC_W - 1 downto 0)       <= (others => '0');

  g_lane : for n in 0 to G_LANES - 1 generate
    -- What the lane brings waits n + 1 clocks for its turn: sideband is {on, inside, textured, v}.
    constant C_SIDE_W : integer := G_MNCC_W + 3;
    signal side       : std_logic_vector((n + 1) * C_SIDE_W - 1 downto 0);
    signal on_q       : std_logic;
    signal inside     : std_logic;
    signal textured   : std_logic;
    signal v          : unsigned(G_MNCC_W - 1 downto 0);
    signal plane_now  : unsigned(C_SET_W + C_LANE_W - 1 downto 0);
    signal set_now    : std_logic_vector(C_SET_W - 1 downto 0);
    -- The cell as it comes, and as it goes.
    signal old_best      : unsigned(G_MNCC_W - 1 downto 0);
    signal old_prev      : unsigned(G_MNCC_W - 1 downto 0);
    signal old_plane     : std_logic_vector(C_PLANE_W - 1 downto 0);
    signal old_frac      : std_logic_vector(G_FRAC_W - 1 downto 0);
    signal better        : std_logic;
    signal won           : std_logic; -- there is a winner: old_best is not 0
    signal new_won       : std_logic;
    signal adjacent      : std_logic; -- and it is the plane before this one
    signal new_best      : unsigned(G_MNCC_W - 1 downto 0);
    signal new_prev      : unsigned(G_MNCC_W - 1 downto 0);
    signal new_plane     : std_logic_vector(C_PLANE_W - 1 downto 0);
    signal new_frac      : std_logic_vector(G_FRAC_W - 1 downto 0);
    signal lower         : unsigned(G_MNCC_W - 1 downto 0);
    signal upper         : unsigned(G_MNCC_W - 1 downto 0);
    signal new_local_max : std_logic;
    signal new_prev_ok   : std_logic;
    signal new_before    : std_logic;
    signal new_parabola  : std_logic;
    signal new_valid     : std_logic;
    signal new_last      : std_logic;
    signal new_set       : std_logic_vector(C_SET_W - 1 downto 0);
  begin

    p_side : process (clk)
    begin
      if rising_edge(clk) then
        side(C_SIDE_W - 1 downto 0) <= s2_on(n) & s2_inside(n) & s2_textured(n)
                                       & s2_v((n + 1) * G_MNCC_W - 1 downto n * G_MNCC_W);
        for k in 1 to n loop
          side((k + 1) * C_SIDE_W - 1 downto k * C_SIDE_W) <= side(k * C_SIDE_W - 1 downto (k - 1) * C_SIDE_W);
        end loop;
      end if;
    end process p_side;

    v        <= unsigned(side(n * C_SIDE_W + G_MNCC_W - 1 downto n * C_SIDE_W));
    textured <= side(n * C_SIDE_W + G_MNCC_W);
    inside   <= side(n * C_SIDE_W + G_MNCC_W + 1);
    on_q     <= to_sl(n = 0) or side(n * C_SIDE_W + G_MNCC_W + 2);

    set_now   <= way_set((n + 1) * C_SET_W - 1 downto n * C_SET_W);
    plane_now <= shift_left(resize(unsigned(set_now), C_SET_W + C_LANE_W), C_LANE_W) + n;
    old_best  <= unsigned(way_best((n + 1) * G_MNCC_W - 1 downto n * G_MNCC_W));
    old_prev  <= unsigned(way_prev((n + 1) * G_MNCC_W - 1 downto n * G_MNCC_W));
    old_plane <= way_plane((n + 1) * C_PLANE_W - 1 downto n * C_PLANE_W);
    old_frac  <= way_frac((n + 1) * G_FRAC_W - 1 downto n * G_FRAC_W);

    better   <= inside and to_sl(v > old_best) and on_q;
    won      <= way_won(n);
    adjacent <= won and way_before(n) and on_q;
    -- Without a parabola these mean nothing: the first lane need not choose.
    lower    <= old_prev when n = 0 or adjacent = '1'
                else unsigned(way_lower((n + 1) * G_MNCC_W - 1 downto n * G_MNCC_W));
    upper    <= v when n = 0 or adjacent = '1'
                else unsigned(way_upper((n + 1) * G_MNCC_W - 1 downto n * G_MNCC_W));

    p_update : process (clk)
    begin
      if rising_edge(clk) then
        new_valid    <= way_in_valid(n);
        new_last     <= way_in_last(n);
        new_set      <= set_now;
        new_before   <= better;
        new_won      <= won or better;
        new_best     <= old_best;
        new_prev     <= old_prev;
        new_prev_ok  <= way_prev_ok(n);
        new_plane    <= old_plane;
        new_frac     <= old_frac;
        new_local_max <= way_local_max(n);
        if better = '1' then
          new_best <= v;
          -- prev holds V of the plane before, unless that was the winner
          if adjacent = '1' then
            new_prev    <= old_best;
            new_prev_ok <= '1';
          end if;
          new_plane     <= std_logic_vector(resize(plane_now, C_PLANE_W));
          new_frac      <= (others => '0');
          new_local_max <= '0';
        elsif on_q = '1' then
          new_prev    <= v;
          new_prev_ok <= inside;
          if adjacent = '1' then
            new_local_max <= inside and way_prev_ok(n);
          elsif won = '0' then
            new_frac(0) <= old_frac(0) or inside;
            new_frac(1) <= old_frac(1) or textured;
          end if;
        end if;
        new_parabola <= (way_parabola(n) or adjacent) and not better;
        if rst = '1' or cancel = '1' then
          new_valid <= '0';
        end if;
      end if;
    end process p_update;

    way_in_valid(n + 1)  <= new_valid;
    way_in_last(n + 1)   <= new_last;
    way_before(n + 1)    <= new_before;
    way_won(n + 1)       <= new_won;
    way_local_max(n + 1) <= new_local_max;
    way_prev_ok(n + 1)   <= new_prev_ok;
    way_parabola(n + 1)  <= new_parabola;
    way_set((n + 2) * C_SET_W - 1 downto (n + 1) * C_SET_W)                 <= new_set;
    way_best((n + 2) * G_MNCC_W - 1 downto (n + 1) * G_MNCC_W)              <= std_logic_vector(new_best);
    way_prev((n + 2) * G_MNCC_W - 1 downto (n + 1) * G_MNCC_W)              <= std_logic_vector(new_prev);
    way_plane((n + 2) * C_PLANE_W - 1 downto (n + 1) * C_PLANE_W)           <= new_plane;
    way_frac((n + 2) * G_FRAC_W - 1 downto (n + 1) * G_FRAC_W)              <= new_frac;

    g_pass : if n < G_LANES - 1 generate

      p_pass : process (clk)
      begin
        if rising_edge(clk) then
          way_lower((n + 2) * G_MNCC_W - 1 downto (n + 1) * G_MNCC_W) <= std_logic_vector(lower);
          way_upper((n + 2) * G_MNCC_W - 1 downto (n + 1) * G_MNCC_W) <= std_logic_vector(upper);
        end if;
      end process p_pass;

    end generate g_pass;

    g_operands : if n = G_LANES - 1 generate

      p_operands : process (clk)
      begin
        if rising_edge(clk) then
          s4_rise <= old_best - lower;
          s4_both <= (old_best & '0') - resize(lower, G_MNCC_W + 1) - resize(upper, G_MNCC_W + 1);
        end if;
      end process p_operands;

    end generate g_operands;

  end generate g_lane;

  s4_word <= way_best((G_LANES + 1) * G_MNCC_W - 1 downto G_LANES * G_MNCC_W)
             & way_prev((G_LANES + 1) * G_MNCC_W - 1 downto G_LANES * G_MNCC_W)
             & way_plane((G_LANES + 1) * C_PLANE_W - 1 downto G_LANES * C_PLANE_W)
             & way_frac((G_LANES + 1) * G_FRAC_W - 1 downto G_LANES * G_FRAC_W)
             & way_local_max(G_LANES) & way_prev_ok(G_LANES);
  s4_num  <= "00" & std_logic_vector(s4_rise);
  s4_wait <= way_parabola(G_LANES) & s4_word;

  u_divider : entity work.divider
    generic map (
      G_NUM_W  => G_MNCC_W + 1,
      G_QUOT_W => G_FRAC_W
    )
    port map (
      clk    => clk,
      s_num  => s4_num,
      s_den  => std_logic_vector(s4_both),
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
      s_data => s4_wait,
      m_data => waited
    );

  p_write : process (clk)
  begin
    if rising_edge(clk) then
      way_valid  <= way_valid(G_FRAC_W - 1 downto 0) & way_in_valid(G_LANES);
      way_last   <= way_last(G_FRAC_W - 1 downto 0) & way_in_last(G_LANES);
      write_word <= waited(C_WORD_W - 1 downto 0);
      if waited(C_WORD_W) = '1' then
        write_word(G_FRAC_W + 1 downto 2) <= quot;
      end if;
      if way_valid(G_FRAC_W) = '1' then
        if way_last(G_FRAC_W) = '1' then
          write_cell <= (others => '0');
        else
          write_cell <= write_cell + 1;
        end if;
      end if;
      if clear = '1' then
        way_valid  <= (others => '0');
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
  at_last_cell <= to_sl(read_cell = last_cell);

  fetch        <= unloading and few;

  p_unload : process (clk)
  begin
    if rising_edge(clk) then
      if unload = '1' then
        unloading <= '1';
      elsif fetch = '1' and at_last_cell = '1' then
        unloading <= '0';
      end if;
      read         <= fetch;
      read_last    <= at_last_cell;
      fetched      <= read;
      fetched_last <= read_last;
      if rst = '1' or cancel = '1' then
        unloading <= '0';
        read      <= '0';
        fetched   <= '0';
      end if;
    end if;
  end process p_unload;

  p_beat : process (clk)
  begin
    if rising_edge(clk) then
      sent           <= fetched;
      sent_last      <= fetched_last;
      sent_best      <= unsigned(word_best);
      sent_plane     <= word_plane;
      sent_frac      <= word_frac;
      sent_local_max <= word_local_max;
      if rst = '1' or cancel = '1' then
        sent <= '0';
      end if;
    end if;
  end process p_beat;

  empty   <= to_sl(sent_best = 0);
  mask(0) <= empty and not sent_frac(0);
  mask(1) <= empty and sent_frac(0) and not sent_frac(1);
  mask(2) <= to_sl(sent_best < unsigned(threshold)) and not (empty and not (sent_frac(0) and sent_frac(1)));
  mask(3) <= not sent_local_max and not (empty and not (sent_frac(0) and sent_frac(1)));

  out_data <= sent_last & mask & sent_plane & sent_frac & std_logic_vector(sent_best);

  u_out : entity work.stream_fifo
    generic map (
      G_DATA_W     => C_DATA_W + 1,
      G_DEPTH_LOG2 => 4
    )
    port map (
      clk      => clk,
      rst      => clear,
      s_tvalid => sent,
      s_tready => out_ready,
      s_tdata  => out_data,
      few      => few,
      more     => behind,
      m_tvalid => beat_valid,
      m_tready => m_tready,
      m_tdata  => beat
    );

  m_tvalid    <= beat_valid;
  m_tlast     <= beat(C_DATA_W);
  m_tdata     <= beat(C_DATA_W - 1 downto 0);
  unload_more <= unloading or read or fetched or sent or behind;
  unload_done <= beat_valid and m_tready and beat(C_DATA_W);

  -- synthesis translate_off
  -- Rules, in simulators.
  p_rules : process (clk)
    variable v_way : std_logic; -- a cell is on its way to the map
  begin
    if rising_edge(clk) then
      v_way := s_valid(0) or s1_valid or s2_valid;
      for n in 0 to G_LANES loop
        v_way := v_way or way_in_valid(n);
      end loop;
      for n in 0 to G_FRAC_W loop
        v_way := v_way or way_valid(n);
      end loop;
      assert unload /= '1' or v_way = '0'
        report "updating: unloading begins while cells are on their way to the map"
        severity failure;
      assert s_valid(0) /= '1' or (unloading or read or fetched or sent) = '0'
        report "updating: a cell comes while the map is unloaded"
        severity failure;
      assert s2_valid /= '1' or s2_first = '1' or not is_x(word)
        report "updating: a cell of the map is unknown: never written, or read in the clock of its write"
        severity failure;
      assert fetched /= '1' or not is_x(word)
        report "updating: a cell that leaves is unknown"
        severity failure;
      assert sent /= '1' or out_ready = '1'
        report "updating: a cell that leaves finds no place"
        severity failure;
      assert way_valid(G_FRAC_W) /= '1' or to_integer(write_cell) < G_CELLS
        report "updating: more cells than the map has"
        severity failure;
      if way_in_valid(G_LANES) = '1' and way_parabola(G_LANES) = '1' then
        assert s4_rise <= s4_both and s4_both /= 0
          report "updating: the parabola's quotient is not in 0..1"
          severity failure;
      end if;
    end if;
  end process p_rules;
  -- synthesis translate_on

end architecture rtl;
