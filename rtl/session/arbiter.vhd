-- SPDX-License-Identifier: Apache-2.0
-- arbiter: the Ethernet front end, everything between the pins of an MII PHY and the streams of the engine, without a
--          CPU (paper, sections 4.1 and 5.4).
--   Structure : mac_rx -> async_fifo -> packet_rx -> responder -> packet_tx -> ram_dc -> mac_tx;
--               responder -> row_buffer -> s_pix, responder -> scheduler -> s_cfg, m_map -> map_buffer -> responder
--   Clocks    : clk, rx_clk and tx_clk are independent. Between them pass the words of async_fifo, the frames in ram_dc
--               with their toggles, and levels that hardly ever change (constraints/)
--   Buffering : the rows of the next tile arrive and the map of the last one leaves while a tile is swept. G_ROW_SLOTS
--               and G_MAP_DEPTH set how much of them is buffered (docs/link.md)
--   Missing   : clock_missing(0) is set if rx_clk, (1) if tx_clk has not ticked from one millisecond of clk to the
--   clocks      next, which counters 37 and 38 count; it is cleared in the millisecond after the clock has returned.
--               Without tx_clk no frame is sent, without rx_clk none is received; everything else works
--   Protocol  : docs/protocol.md
--   Reset     : synchronous, one for each clock
--   Golden    : sw/golden/arbiter.hpp
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;
  use work.link_pkg.all;

entity arbiter is
  generic (
    G_IMG_COLS    : integer := 340;
    G_IMG_ROWS    : integer := 144;
    G_PLANE_COLS  : integer := 256;
    G_PLANE_ROWS  : integer := 130;
    G_PLANES      : integer := 301;
    G_WINDOW      : integer := 13;
    G_PIX_W       : integer := 8;
    G_WEIGHT_W    : integer := 8;
    G_INTERP_F    : integer := 2;
    G_MNCC_W      : integer := 13;
    G_FRAC_W      : integer := 8;
    G_LANES       : integer := 1;
    G_RECTIFIED   : integer := 0;
    G_CLK_KHZ     : integer := 166000;
    G_CHUNK_BYTES : integer := 1408; -- 16 .. 1440
    G_ROW_SLOTS   : integer := 0; -- chunks; 0: as many as the largest window needs
    G_MAP_DEPTH   : integer := 0; -- cells, rounded up to chunks; 0: the largest tile
    G_RX_SLOTS    : integer := 2; -- 2 or 4
    G_SESSION_MS  : integer := 10000; -- 1 .. 65535
    G_UDP_PORT    : integer := 20563;
    G_SEED        : integer := 1 -- of the backoff's random numbers, 1 .. 131071; another one for every station
  );
  port (
    clk    : in  std_logic;
    rst    : in  std_logic;
    rx_clk : in  std_logic;
    rx_rst : in  std_logic;
    tx_clk : in  std_logic;
    tx_rst : in  std_logic;

    mii_rxd   : in  std_logic_vector(3 downto 0);
    mii_rx_dv : in  std_logic;
    mii_rx_er : in  std_logic;
    mii_txd   : out std_logic_vector(3 downto 0);
    mii_tx_en : out std_logic;
    mii_crs   : in  std_logic;
    mii_col   : in  std_logic;

    own_mac         : in  std_logic_vector(47 downto 0);
    own_ip          : in  std_logic_vector(31 downto 0);
    pin_full_duplex : in  std_logic; -- still, or slow: synchronised here
    pin_speed_100   : in  std_logic;
    session         : out std_logic;
    clock_missing   : out std_logic_vector(1 downto 0); -- rx_clk, tx_clk

    -- The engine.
    m_cfg_tvalid : out std_logic;
    m_cfg_tdata  : out std_logic_vector(47 downto 0);
    m_pix_tvalid : out std_logic;
    m_pix_tready : in  std_logic;
    m_pix_tdata  : out std_logic_vector(2 * G_PIX_W - 1 downto 0);
    m_pix_tlast  : out std_logic;
    s_map_tvalid : in  std_logic;
    s_map_tready : out std_logic;
    s_map_tdata  : in  std_logic_vector(4 + clog2(G_PLANES) + G_FRAC_W + G_MNCC_W - 1 downto 0);
    s_map_tlast  : in  std_logic;

    engine_busy   : in  std_logic;
    engine_state  : in  std_logic_vector(2 downto 0);
    errors        : in  std_logic_vector(7 downto 0);
    error_count   : in  std_logic_vector(15 downto 0);
    tiles_done    : in  std_logic_vector(15 downto 0);
    tiles_dropped : in  std_logic_vector(15 downto 0);
    window_errors : in  std_logic_vector(15 downto 0);
    tile_clocks   : in  std_logic_vector(31 downto 0)
  );
end entity arbiter;

architecture rtl of arbiter is

  constant C_CHUNK_PAIRS : integer := chunk_pairs(G_CHUNK_BYTES, G_PIX_W);
  constant C_CELL_W      : integer := cell_bits(G_PLANES, G_FRAC_W, G_MNCC_W);
  constant C_CHUNK_CELLS : integer := chunk_cells(G_CHUNK_BYTES, C_CELL_W);
  constant C_CELLS       : integer := G_PLANE_COLS * G_PLANE_ROWS;

  function row_slots return integer is
  begin
    if G_ROW_SLOTS > 0 then
      return G_ROW_SLOTS;
    end if;
    return imax(2, (G_IMG_COLS * G_IMG_ROWS + C_CHUNK_PAIRS - 1) / imax(C_CHUNK_PAIRS, 1)); -- 0: refused below
  end function row_slots;

  function map_depth return integer is
  begin
    if G_MAP_DEPTH > 0 and G_MAP_DEPTH < C_CELLS then
      return imax(2, (G_MAP_DEPTH + C_CHUNK_CELLS - 1) / C_CHUNK_CELLS) * C_CHUNK_CELLS;
    end if;
    return C_CELLS;
  end function map_depth;

  constant C_ROW_SLOTS : integer := row_slots;
  constant C_MAP_DEPTH : integer := map_depth;

  signal byte_valid     : std_logic;
  signal byte_ready     : std_logic;
  signal byte_word      : std_logic_vector(8 downto 0);
  signal rx_valid       : std_logic;
  signal rx_ready       : std_logic;
  signal rx_word        : std_logic_vector(8 downto 0);
  signal m_valid        : std_logic;
  signal m_kind         : std_logic_vector(1 downto 0);
  signal m_length       : std_logic_vector(10 downto 0);
  signal m_done         : std_logic;
  signal r_addr         : std_logic_vector(10 downto 0);
  signal r_data         : std_logic_vector(7 downto 0);
  signal rx_events      : std_logic_vector(18 downto 0);
  signal full_duplex    : std_logic;
  signal duplex_q       : std_logic;
  signal half_duplex    : std_logic;
  signal sending        : std_logic;
  signal tick_ms        : std_logic;
  signal ticks          : std_logic_vector(1 downto 0);
  signal ticks_q        : std_logic_vector(1 downto 0);
  signal ticks_last     : std_logic_vector(1 downto 0);
  signal ticked         : std_logic_vector(1 downto 0); -- since the last millisecond
  signal missing        : std_logic_vector(1 downto 0);
  signal msg_events     : std_logic_vector(39 downto 0);
  signal pins           : std_logic_vector(1 downto 0);
  signal pins_q         : std_logic_vector(1 downto 0);
  signal s_ready        : std_logic;
  signal s_start        : std_logic;
  signal s_kind         : std_logic_vector(1 downto 0);
  signal s_bank         : std_logic;
  signal tx_abort       : std_logic;
  signal p_valid        : std_logic;
  signal p_ready        : std_logic;
  signal p_data         : std_logic_vector(7 downto 0);
  signal p_last         : std_logic;
  signal peer_we        : std_logic;
  signal peer_bank      : std_logic;
  signal peer_index     : std_logic_vector(3 downto 0);
  signal peer_data      : std_logic_vector(7 downto 0);
  signal row_clear      : std_logic;
  signal row_open       : std_logic;
  signal row_pixels     : std_logic_vector(23 downto 0);
  signal row_chunks     : std_logic_vector(15 downto 0);
  signal row_busy       : std_logic;
  signal row_base       : std_logic_vector(15 downto 0);
  signal row_received   : std_logic_vector(15 downto 0);
  signal w_check        : std_logic;
  signal w_chunk        : std_logic_vector(15 downto 0);
  signal w_new          : std_logic;
  signal w_repeated     : std_logic;
  signal w_valid        : std_logic;
  signal w_data         : std_logic_vector(7 downto 0);
  signal w_commit       : std_logic;
  signal b_hold         : std_logic;
  signal b_index        : std_logic_vector(9 downto 0);
  signal b_bit          : std_logic;
  signal map_release    : std_logic;
  signal map_clear      : std_logic;
  signal map_keep       : std_logic_vector(15 downto 0);
  signal map_started    : std_logic;
  signal map_busy       : std_logic;
  signal map_complete   : std_logic;
  signal map_count      : std_logic_vector(23 downto 0);
  signal f_chunk        : std_logic_vector(15 downto 0);
  signal f_ready        : std_logic;
  signal f_start        : std_logic;
  signal f_valid        : std_logic;
  signal f_take         : std_logic;
  signal f_data         : std_logic_vector(7 downto 0);
  signal f_last         : std_logic;
  signal c_index        : std_logic_vector(5 downto 0);
  signal c_valid        : std_logic;
  signal c_data         : std_logic_vector(31 downto 0);
  signal job_we         : std_logic;
  signal job_addr       : std_logic_vector(4 downto 0);
  signal job_data       : std_logic_vector(31 downto 0);
  signal t_valid        : std_logic;
  signal t_address      : std_logic_vector(15 downto 0);
  signal t_data         : std_logic_vector(31 downto 0);
  signal staged         : std_logic;
  signal tile           : std_logic_vector(15 downto 0);
  signal stop           : std_logic;
  signal running        : std_logic;
  signal run_tile       : std_logic_vector(15 downto 0);
  signal failed         : std_logic;
  signal failed_tile    : std_logic_vector(15 downto 0);
  signal tile_failed    : std_logic;
  signal row_lost       : std_logic;
  signal map_lost       : std_logic;
  signal lost           : std_logic;
  signal starved        : std_logic;
  signal recovered      : std_logic;
  signal engine_wait    : std_logic;
  signal events         : std_logic_vector(C_EVENTS - 1 downto 0);
  signal ev_sent        : std_logic;
  signal ev_late        : std_logic;
  signal ev_excessive   : std_logic;
  signal ev_deferred    : std_logic;
  signal ev_recovered   : std_logic;
  signal flips          : std_logic_vector(2 downto 0); -- toggles of mac_tx: collision, recovered, resynchronised
  signal flips_seen     : std_logic_vector(2 downto 0);
  signal flips_last     : std_logic_vector(2 downto 0);
  signal flipped        : std_logic_vector(2 downto 0);
  signal tx_down        : std_logic;
  signal f_request      : std_logic_vector(1 downto 0);
  signal f_length_0     : std_logic_vector(10 downto 0);
  signal f_length_1     : std_logic_vector(10 downto 0);
  signal f_done         : std_logic_vector(1 downto 0);
  signal f_result_0     : std_logic_vector(1 downto 0);
  signal f_result_1     : std_logic_vector(1 downto 0);
  signal frame_we       : std_logic;
  signal frame_waddr    : std_logic_vector(11 downto 0);
  signal frame_wdata    : std_logic_vector(7 downto 0);
  signal frame_raddr    : std_logic_vector(11 downto 0);
  signal frame_rdata    : std_logic_vector(7 downto 0);
  signal row_complete   : std_logic;
  signal go             : std_logic;
  signal map_valid      : std_logic;
  signal map_last       : std_logic;
  signal done_clocks    : std_logic_vector(31 downto 0); -- tile_clocks of the tile whose map is in the buffer
  signal map_ready      : std_logic;
  signal map_cell       : std_logic_vector(C_CELL_W - 1 downto 0);

begin

  assert C_CHUNK_PAIRS >= 1 and C_CHUNK_CELLS >= 1
    report "arbiter: G_CHUNK_BYTES"
           -- synthesis translate_off
           & "=" & integer'image(G_CHUNK_BYTES)
           -- synthesis translate_on
           & " holds no pair or no cell"
    severity failure;
  assert G_ROW_SLOTS >= 0 and G_ROW_SLOTS /= 1
    report "arbiter: G_ROW_SLOTS"
           -- synthesis translate_off
           & "=" & integer'image(G_ROW_SLOTS)
           -- synthesis translate_on
           & " is neither 0 nor from 2 on"
    severity failure;
  assert G_MAP_DEPTH >= 0
    report "arbiter: G_MAP_DEPTH"
           -- synthesis translate_off
           & "=" & integer'image(G_MAP_DEPTH)
           -- synthesis translate_on
           & " below 0"
    severity failure;

  -- Receive -----------------------------------------------------------------------------------------------------------
  u_mac_rx : entity work.mac_rx
    port map (
      clk         => rx_clk,
      rst         => rx_rst,
      full_duplex => duplex_q,
      sending     => sending,
      mii_rxd     => mii_rxd,
      mii_rx_dv   => mii_rx_dv,
      mii_rx_er   => mii_rx_er,
      m_valid     => byte_valid,
      m_ready     => byte_ready,
      m_last      => byte_word(8),
      m_data      => byte_word(7 downto 0),
      tick        => ticks(0)
    );

  u_fifo : entity work.async_fifo
    generic map (
      G_DATA_W     => 9,
      G_DEPTH_LOG2 => 4
    )
    port map (
      w_clk   => rx_clk,
      w_rst   => rx_rst,
      w_valid => byte_valid,
      w_ready => byte_ready,
      w_data  => byte_word,
      r_clk   => clk,
      r_rst   => rst,
      r_valid => rx_valid,
      r_ready => rx_ready,
      r_data  => rx_word
    );

  u_packet_rx : entity work.packet_rx
    generic map (
      G_SLOTS    => G_RX_SLOTS,
      G_UDP_PORT => G_UDP_PORT
    )
    port map (
      clk         => clk,
      rst         => rst,
      s_valid     => rx_valid,
      s_ready     => rx_ready,
      s_last      => rx_word(8),
      s_data      => rx_word(7 downto 0),
      own_mac     => own_mac,
      own_ip      => own_ip,
      half_duplex => half_duplex,
      m_valid     => m_valid,
      m_kind      => m_kind,
      m_length    => m_length,
      m_done      => m_done,
      r_addr      => r_addr,
      r_data      => r_data,
      events      => rx_events
    );

  half_duplex <= not duplex_q;

  -- Messages ----------------------------------------------------------------------------------------------------------
  pins <= pin_speed_100 & pin_full_duplex;

  u_pins : entity work.cdc_sync
    generic map (
      G_WIDTH => 2
    )
    port map (
      clk => clk,
      d   => pins,
      q   => pins_q
    );

  u_responder : entity work.responder
    generic map (
      G_IMG_COLS    => G_IMG_COLS,
      G_IMG_ROWS    => G_IMG_ROWS,
      G_PLANE_COLS  => G_PLANE_COLS,
      G_PLANE_ROWS  => G_PLANE_ROWS,
      G_PLANES      => G_PLANES,
      G_WINDOW      => G_WINDOW,
      G_PIX_W       => G_PIX_W,
      G_WEIGHT_W    => G_WEIGHT_W,
      G_INTERP_F    => G_INTERP_F,
      G_MNCC_W      => G_MNCC_W,
      G_FRAC_W      => G_FRAC_W,
      G_LANES       => G_LANES,
      G_RECTIFIED   => G_RECTIFIED,
      G_CLK_KHZ     => G_CLK_KHZ,
      G_CHUNK_BYTES => G_CHUNK_BYTES,
      G_ROW_SLOTS   => C_ROW_SLOTS,
      G_MAP_DEPTH   => C_MAP_DEPTH,
      G_RX_SLOTS    => G_RX_SLOTS,
      G_SESSION_MS  => G_SESSION_MS
    )
    port map (
      clk             => clk,
      rst             => rst,
      own_mac         => own_mac,
      pin_full_duplex => pins_q(0),
      pin_speed_100   => pins_q(1),
      full_duplex     => full_duplex,
      session         => session,
      events          => msg_events,
      tick_ms         => tick_ms,
      m_valid         => m_valid,
      m_kind          => m_kind,
      m_length        => m_length,
      m_done          => m_done,
      r_addr          => r_addr,
      r_data          => r_data,
      s_ready         => s_ready,
      s_start         => s_start,
      s_kind          => s_kind,
      s_bank          => s_bank,
      tx_abort        => tx_abort,
      p_valid         => p_valid,
      p_ready         => p_ready,
      p_data          => p_data,
      p_last          => p_last,
      peer_we         => peer_we,
      peer_bank       => peer_bank,
      peer_index      => peer_index,
      peer_data       => peer_data,
      row_clear       => row_clear,
      row_open        => row_open,
      row_pixels      => row_pixels,
      row_chunks      => row_chunks,
      row_busy        => row_busy,
      row_base        => row_base,
      row_received    => row_received,
      w_check         => w_check,
      w_chunk         => w_chunk,
      w_new           => w_new,
      w_repeated      => w_repeated,
      w_valid         => w_valid,
      w_data          => w_data,
      w_commit        => w_commit,
      b_hold          => b_hold,
      b_index         => b_index,
      b_bit           => b_bit,
      map_release     => map_release,
      map_clear       => map_clear,
      map_keep        => map_keep,
      map_started     => map_started,
      map_busy        => map_busy,
      map_complete    => map_complete,
      map_count       => map_count,
      f_chunk         => f_chunk,
      f_ready         => f_ready,
      f_start         => f_start,
      f_valid         => f_valid,
      f_take          => f_take,
      f_data          => f_data,
      f_last          => f_last,
      c_index         => c_index,
      c_valid         => c_valid,
      c_data          => c_data,
      job_we          => job_we,
      job_addr        => job_addr,
      job_data        => job_data,
      t_valid         => t_valid,
      t_address       => t_address,
      t_data          => t_data,
      staged          => staged,
      tile            => tile,
      stop            => stop,
      running         => running,
      run_tile        => run_tile,
      failed          => failed,
      failed_tile     => failed_tile,
      engine_state    => engine_state,
      engine_wait     => engine_wait,
      errors          => errors,
      error_count     => error_count,
      tiles_done      => tiles_done,
      tiles_dropped   => tiles_dropped,
      window_errors   => window_errors,
      tile_clocks     => done_clocks
    );

  u_counters : entity work.counters
    generic map (
      G_COUNT => C_EVENTS
    )
    port map (
      clk     => clk,
      rst     => rst,
      events  => events,
      r_index => c_index,
      r_valid => c_valid,
      r_data  => c_data
    );

  -- Numbers of the protocol's counters: 0 to 15 are packet_rx's own, whose others follow them.
  events(15 downto 0)                                  <= rx_events(15 downto 0);
  events(C_EV_FOREIGN downto C_EV_BAD_MESSAGE)         <= msg_events(C_EV_FOREIGN downto C_EV_BAD_MESSAGE);
  events(C_EV_SENT)                                    <= ev_sent;
  events(C_EV_COLLISION)                               <= flipped(0);
  events(C_EV_LATE)                                    <= ev_late;
  events(C_EV_EXCESSIVE)                               <= ev_excessive;
  events(C_EV_MAP_PACKET downto C_EV_SESSION)          <= msg_events(C_EV_MAP_PACKET downto C_EV_SESSION);
  events(C_EV_BAD_SOURCE)                              <= rx_events(16);
  events(C_EV_ANSWER downto C_EV_LIMITED)              <= msg_events(C_EV_ANSWER downto C_EV_LIMITED);
  events(C_EV_RX_FRAGMENT)                             <= rx_events(17);
  events(C_EV_DEFERRED)                                <= ev_deferred;
  events(C_EV_UNREACHABLE)                             <= msg_events(C_EV_UNREACHABLE);
  events(C_EV_RECOVERED)                               <= msg_events(C_EV_RECOVERED) or ev_recovered or flipped(1) or
                                                          recovered;
  events(C_EV_RESYNCHRONISED)                          <= rx_events(18) or flipped(2);
  events(C_EV_TX_CLOCK_LOST downto C_EV_RX_CLOCK_LOST) <= not ticked and not missing and (tick_ms & tick_ms);
  events(C_EV_TILE_FAILED)                             <= tile_failed;

  u_flips : entity work.cdc_sync
    generic map (
      G_WIDTH => 3
    )
    port map (
      clk => clk,
      d   => flips,
      q   => flips_seen
    );

  -- In its reset mac_tx lays them down, wherever they were.
  flipped <= (flips_seen xor flips_last) and not (tx_down & tx_down & tx_down);

  p_flips : process (clk)
  begin
    if rising_edge(clk) then
      flips_last <= flips_seen;
    end if;
  end process p_flips;

  -- Clocks of the PHY -------------------------------------------------------------------------------------------------
  u_ticks : entity work.cdc_sync
    generic map (
      G_WIDTH => 2
    )
    port map (
      clk => clk,
      d   => ticks,
      q   => ticks_q
    );

  clock_missing <= missing;

  p_missing : process (clk)
  begin
    if rising_edge(clk) then
      ticks_last <= ticks_q;
      if tick_ms = '1' then
        missing <= not ticked;
        ticked  <= "00";
      end if;
      if ticks_q(0) /= ticks_last(0) then
        ticked(0) <= '1';
      end if;
      if ticks_q(1) /= ticks_last(1) then
        ticked(1) <= '1';
      end if;
      if rst = '1' then
        missing <= "00";
        ticked  <= "11";
      end if;
    end if;
  end process p_missing;

  -- Transmit ----------------------------------------------------------------------------------------------------------
  u_packet_tx : entity work.packet_tx
    generic map (
      G_UDP_PORT => G_UDP_PORT
    )
    port map (
      clk          => clk,
      rst          => rst,
      own_mac      => own_mac,
      own_ip       => own_ip,
      s_ready      => s_ready,
      s_start      => s_start,
      s_kind       => s_kind,
      s_bank       => s_bank,
      s_abort      => tx_abort,
      p_valid      => p_valid,
      p_ready      => p_ready,
      p_data       => p_data,
      p_last       => p_last,
      peer_we      => peer_we,
      peer_bank    => peer_bank,
      peer_index   => peer_index,
      peer_data    => peer_data,
      ram_we       => frame_we,
      ram_waddr    => frame_waddr,
      ram_wdata    => frame_wdata,
      tx_rst       => tx_rst,
      tx_down      => tx_down,
      f_request    => f_request,
      f_length_0   => f_length_0,
      f_length_1   => f_length_1,
      f_done       => f_done,
      f_result_0   => f_result_0,
      f_result_1   => f_result_1,
      ev_sent      => ev_sent,
      ev_excessive => ev_excessive,
      ev_late      => ev_late,
      ev_deferred  => ev_deferred,
      ev_recovered => ev_recovered
    );

  -- What crosses has to come from a flip-flop: a gate may glitch at the very edge.
  p_duplex : process (clk)
  begin
    if rising_edge(clk) then
      duplex_q <= full_duplex;
    end if;
  end process p_duplex;

  u_frames : entity work.ram_dc
    generic map (
      G_DATA_W => 8,
      G_DEPTH  => 4096
    )
    port map (
      w_clk => clk,
      we    => frame_we,
      waddr => frame_waddr,
      wdata => frame_wdata,
      r_clk => tx_clk,
      raddr => frame_raddr,
      rdata => frame_rdata
    );

  u_mac_tx : entity work.mac_tx
    generic map (
      G_SEED => G_SEED
    )
    port map (
      clk            => tx_clk,
      rst            => tx_rst,
      full_duplex    => duplex_q,
      mii_crs        => mii_crs,
      mii_col        => mii_col,
      mii_txd        => mii_txd,
      mii_tx_en      => mii_tx_en,
      sending        => sending,
      f_request      => f_request,
      f_length_0     => f_length_0,
      f_length_1     => f_length_1,
      f_done         => f_done,
      f_result_0     => f_result_0,
      f_result_1     => f_result_1,
      collisions     => flips(0),
      r_addr         => frame_raddr,
      r_data         => frame_rdata,
      recovered      => flips(1),
      resynchronised => flips(2),
      tick           => ticks(1)
    );

  -- Tiles -------------------------------------------------------------------------------------------------------------
  u_row_buffer : entity work.row_buffer
    generic map (
      G_PIX_W       => G_PIX_W,
      G_CHUNK_PAIRS => C_CHUNK_PAIRS,
      G_SLOTS       => C_ROW_SLOTS
    )
    port map (
      clk         => clk,
      rst         => rst,
      clear       => row_clear,
      open_tile   => row_open,
      open_pixels => row_pixels,
      open_chunks => row_chunks,
      fail        => tile_failed,
      recovered   => row_lost,
      busy        => row_busy,
      staged      => staged,
      base        => row_base,
      received    => row_received,
      w_check     => w_check,
      w_chunk     => w_chunk,
      w_new       => w_new,
      w_repeated  => w_repeated,
      w_valid     => w_valid,
      w_data      => w_data,
      w_commit    => w_commit,
      b_hold      => b_hold,
      b_index     => b_index,
      b_bit       => b_bit,
      complete    => row_complete,
      go          => go,
      m_tvalid    => m_pix_tvalid,
      m_tready    => m_pix_tready,
      m_tdata     => m_pix_tdata,
      m_tlast     => m_pix_tlast
    );

  u_scheduler : entity work.scheduler
    port map (
      clk         => clk,
      rst         => rst,
      job_we      => job_we,
      job_addr    => job_addr,
      job_data    => job_data,
      t_valid     => t_valid,
      t_address   => t_address,
      t_data      => t_data,
      staged      => staged,
      complete    => row_complete,
      tile        => tile,
      stop        => stop,
      cfg_tvalid  => m_cfg_tvalid,
      cfg_tdata   => m_cfg_tdata,
      engine_busy => engine_busy,
      map_last    => map_last,
      starved     => starved,
      lost        => lost,
      go          => go,
      running     => running,
      run_tile    => run_tile,
      failed      => failed,
      failed_tile => failed_tile,
      tile_failed => tile_failed,
      recovered   => recovered
    );

  lost    <= row_lost or map_lost;
  starved <= m_pix_tready and not row_busy;

  u_map_buffer : entity work.map_buffer
    generic map (
      G_CELL_W      => C_CELL_W,
      G_CHUNK_CELLS => C_CHUNK_CELLS,
      G_CELLS       => C_CELLS,
      G_DEPTH       => C_MAP_DEPTH
    )
    port map (
      clk         => clk,
      rst         => rst,
      s_tvalid    => map_valid,
      s_tready    => map_ready,
      s_tdata     => map_cell,
      s_tlast     => s_map_tlast,
      release_map => map_release,
      clear       => map_clear,
      fail        => tile_failed,
      recovered   => map_lost,
      keep        => map_keep,
      started     => map_started,
      busy        => map_busy,
      complete    => map_complete,
      count       => map_count,
      f_chunk     => f_chunk,
      f_ready     => f_ready,
      f_start     => f_start,
      f_valid     => f_valid,
      f_take      => f_take,
      f_data      => f_data,
      f_last      => f_last
    );

  -- The mask's other bits follow from the fields (docs/protocol.md).
  map_cell     <= s_map_tdata(s_map_tdata'high) & s_map_tdata(C_CELL_W - 2 downto 0);
  -- When the buffer has been emptied at the end of a session the engine may still offer a cell: it is not taken.
  s_map_tready <= map_ready and running;
  map_valid    <= s_map_tvalid and running;
  map_last     <= s_map_tvalid and map_ready and s_map_tlast;
  engine_wait  <= s_map_tvalid and not map_ready;

  -- The engine counts the next tile as soon as that is launched, perhaps before the host asks for this one's clocks.
  p_clocks : process (clk)
  begin
    if rising_edge(clk) then
      if map_last = '1' and running = '1' then
        done_clocks <= tile_clocks;
      end if;
      if rst = '1' then
        done_clocks <= (others => '0');
      end if;
    end if;
  end process p_clocks;

end architecture rtl;
