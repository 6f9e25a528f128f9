-- SPDX-License-Identifier: Apache-2.0
-- responder: what the chip does with a message: ARP and ICMP echo replies, the session, and the protocol over UDP.
--   Protocol  : docs/protocol.md, sw/contract/protocol.hpp
--   Structure : one message at a time, bytes in order, no CPU. message_sequencer says what is done, message_reader
--               brings the frame's bytes, message_rules decides, reply_builder answers; session_memory and
--               session_timer know the session, map_sender the READ in force. The reply's header is the request's, read
--               again. A message is obeyed only after packet_rx has found the whole frame good, so nothing has to be
--               undone
--   Rate      : rows and cells one byte a clock; replies one byte in 5 clocks, of the bitmap in 11
--   Session   : one token and one peer; silence of G_SESSION_MS aborts all and ends it
--   Limits    : OPEN, ARP and all else that is not authentic are answered while there is one left in their bucket
--   Upsets    : message_sequencer ends the session and goes on (1 ms after the session's time; without a session after
--               that time, or about 1 s if that is less)
--   Counters  : events(n) is counter n of the protocol
--   Reset     : no session, no READ, duplex by pin, full buckets
--   Golden    : sw/golden/arbiter.hpp
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;
  use work.link_pkg.all;

entity responder is
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
    G_CLK_KHZ     : integer := 166000; -- 1000 .. 1000000
    G_CHUNK_BYTES : integer := 1408;   -- 16 .. 1440
    G_ROW_SLOTS   : integer := 70;     -- 2 .. 1024
    G_MAP_DEPTH   : integer := 33280;  -- only told to the host
    G_RX_SLOTS    : integer := 2;      -- likewise
    G_SESSION_MS  : integer := 10000   -- 1 .. 65535
  );
  port (
    clk : in  std_logic;
    rst : in  std_logic;

    own_mac         : in  std_logic_vector(47 downto 0);
    pin_full_duplex : in  std_logic;
    pin_speed_100   : in  std_logic;
    full_duplex     : out std_logic;
    session         : out std_logic;
    events          : out std_logic_vector(39 downto 0);
    tick_ms         : out std_logic; -- pulse each millisecond of clk

    -- packet_rx
    m_valid  : in  std_logic;
    m_kind   : in  std_logic_vector(1 downto 0);
    m_length : in  std_logic_vector(10 downto 0);
    m_done   : out std_logic;
    r_addr   : out std_logic_vector(10 downto 0);
    r_data   : in  std_logic_vector(7 downto 0);

    -- packet_tx
    s_ready    : in  std_logic;
    s_start    : out std_logic;
    s_kind     : out std_logic_vector(1 downto 0);
    s_bank     : out std_logic;
    tx_abort   : out std_logic; -- pulse: the frame that is being built is given up
    p_valid    : out std_logic;
    p_ready    : in  std_logic;
    p_data     : out std_logic_vector(7 downto 0);
    p_last     : out std_logic;
    peer_we    : out std_logic;
    peer_bank  : out std_logic;
    peer_index : out std_logic_vector(3 downto 0);
    peer_data  : out std_logic_vector(7 downto 0);

    -- row_buffer
    row_clear    : out std_logic;
    row_open     : out std_logic;
    row_pixels   : out std_logic_vector(23 downto 0);
    row_chunks   : out std_logic_vector(15 downto 0);
    row_busy     : in  std_logic;
    row_base     : in  std_logic_vector(15 downto 0);
    row_received : in  std_logic_vector(15 downto 0);
    w_check      : out std_logic;
    w_chunk      : out std_logic_vector(15 downto 0);
    w_new        : in  std_logic;
    w_repeated   : in  std_logic;
    w_valid      : out std_logic;
    w_data       : out std_logic_vector(7 downto 0);
    w_commit     : out std_logic;
    b_hold       : out std_logic; -- a status block is read: base, received and bitmap must be of one moment
    b_index      : out std_logic_vector(9 downto 0);
    b_bit        : in  std_logic;

    -- map_buffer
    map_release  : out std_logic;
    map_clear    : out std_logic;
    map_keep     : out std_logic_vector(15 downto 0);
    map_started  : in  std_logic;
    map_busy     : in  std_logic;
    map_complete : in  std_logic;
    map_count    : in  std_logic_vector(23 downto 0);
    f_chunk      : out std_logic_vector(15 downto 0);
    f_ready      : in  std_logic;
    f_start      : out std_logic;
    f_valid      : in  std_logic;
    f_take       : out std_logic;
    f_data       : in  std_logic_vector(7 downto 0);
    f_last       : in  std_logic;

    -- counters
    c_index : out std_logic_vector(5 downto 0);
    c_valid : in  std_logic;
    c_data  : in  std_logic_vector(31 downto 0);

    -- scheduler
    job_we      : out std_logic;
    job_addr    : out std_logic_vector(4 downto 0);
    job_data    : out std_logic_vector(31 downto 0);
    t_valid     : out std_logic;
    t_address   : out std_logic_vector(15 downto 0);
    t_data      : out std_logic_vector(31 downto 0);
    staged      : in  std_logic; -- a tile is in the row buffer and not launched
    tile        : out std_logic_vector(15 downto 0);
    stop        : out std_logic;
    running     : in  std_logic;
    run_tile    : in  std_logic_vector(15 downto 0);
    failed      : in  std_logic;
    failed_tile : in  std_logic_vector(15 downto 0);

    -- engine
    engine_state  : in  std_logic_vector(2 downto 0);
    engine_wait   : in  std_logic; -- it has a cell that nobody takes
    errors        : in  std_logic_vector(7 downto 0);
    error_count   : in  std_logic_vector(15 downto 0);
    tiles_done    : in  std_logic_vector(15 downto 0);
    tiles_dropped : in  std_logic_vector(15 downto 0);
    window_errors : in  std_logic_vector(15 downto 0);
    tile_clocks   : in  std_logic_vector(31 downto 0)
  );
end entity responder;

architecture rtl of responder is

  signal state        : std_logic_vector(4 downto 0);
  signal step         : std_logic_vector(5 downto 0);
  signal open_session : std_logic;
  signal alive        : std_logic;
  signal is_map       : std_logic;
  signal is_icmp      : std_logic;
  signal session_io   : std_logic;
  signal renewed      : std_logic;
  signal idle_chunk   : std_logic;
  signal recover      : std_logic;
  signal checked      : std_logic;
  signal expired      : std_logic;
  signal stuck        : std_logic;
  signal due          : std_logic;
  signal first        : std_logic;
  signal request      : std_logic;
  signal bucket       : std_logic_vector(1 downto 0);
  signal grant        : std_logic;
  signal refuse       : std_logic;
  signal msg_type     : std_logic_vector(7 downto 0);
  signal ask_answer   : std_logic;
  signal word_full    : std_logic;
  signal header_end   : std_logic;
  signal rows_end     : std_logic;
  signal peer_end     : std_logic;
  signal head_state   : std_logic_vector(4 downto 0);
  signal word_state   : std_logic_vector(4 downto 0);
  signal head_alive   : std_logic;
  signal admitted     : std_logic;
  signal long_word    : std_logic;
  signal open_new     : std_logic;
  signal open_again   : std_logic;
  signal result       : std_logic_vector(2 downto 0);
  signal read_head    : std_logic;
  signal read_tail    : std_logic;
  signal fetched      : std_logic;
  signal body_cells   : std_logic;
  signal reply_end    : std_logic;
  signal cells_end    : std_logic;
  signal words_end    : std_logic;
  signal reply_step   : std_logic;
  signal read_addr    : std_logic_vector(10 downto 0);
  signal byte_valid   : std_logic;
  signal byte_place   : std_logic_vector(5 downto 0);
  signal word_next    : std_logic_vector(31 downto 0);
  signal word         : std_logic_vector(31 downto 0);
  signal word_count   : std_logic_vector(4 downto 0);
  signal magic_ok     : std_logic;
  signal version_ok   : std_logic;
  signal at_last      : std_logic;
  signal reply_last   : std_logic;
  signal reply_zeros  : std_logic;
  signal long_header  : std_logic;
  signal long_start   : std_logic;
  signal long_write   : std_logic;
  signal long_list    : std_logic;
  signal whole_words  : std_logic;
  signal only_header  : std_logic;
  signal of_list      : std_logic;
  signal peer_ok      : std_logic;
  signal token_ok     : std_logic;
  signal nonce_ok     : std_logic;
  signal engine_idle  : std_logic;
  signal map_tile     : std_logic_vector(15 downto 0);
  signal chunks_fit   : std_logic;
  signal number_ok    : std_logic;
  signal last_tile    : std_logic_vector(15 downto 0);
  signal table_id     : std_logic_vector(15 downto 0);
  signal table_words  : std_logic_vector(13 downto 0);
  signal index        : std_logic_vector(15 downto 0);
  signal pixels       : std_logic_vector(23 downto 0);
  signal chunks       : std_logic_vector(15 downto 0);
  signal duplex_mode  : std_logic_vector(1 downto 0);
  signal ms_tick      : std_logic;
  signal memory_byte  : std_logic_vector(7 downto 0);
  signal no_rows      : std_logic;
  signal idle         : std_logic;
  signal dividing     : std_logic;
  signal aborting     : std_logic;
  signal deciding     : std_logic;
  signal map_chunk    : std_logic_vector(15 downto 0);
  signal info_index   : std_logic_vector(6 downto 0);
  signal info_byte    : std_logic_vector(7 downto 0);
  signal status_words : std_logic_vector(32 * C_STATUS_WORDS - 1 downto 0);
  signal duplex       : std_logic;
  signal status       : std_logic_vector(15 downto 0);

begin

  assert G_ROW_SLOTS >= 2 and G_ROW_SLOTS <= 1024
    report "responder: G_ROW_SLOTS"
           -- synthesis translate_off
           & "=" & integer'image(G_ROW_SLOTS)
           -- synthesis translate_on
           & " outside 2..1024"
    severity failure;
  idle        <= to_sl(state = C_ST_IDLE);
  deciding    <= to_sl(state = C_ST_DECIDE);
  dividing    <= to_sl(state = C_ST_DIVIDE) and not step(5);
  aborting    <= to_sl(state = C_ST_ABORT);
  reply_step  <= p_ready and to_sl(state = C_ST_SHOW);
  cells_end   <= f_valid and p_ready and f_last and to_sl(state = C_ST_CELLS);
  engine_idle <= to_sl(engine_state = C_STATE_IDLE);
  no_rows     <= row_busy and not running;

  -- To packet_rx, packet_tx, map_buffer.
  r_addr    <= read_addr;
  s_kind    <= C_FRAME_UDP when is_map = '1' else m_kind;
  s_bank    <= session_io;
  peer_bank <= session_io;
  peer_data <= r_data;
  f_chunk   <= map_chunk;

  -- To row_buffer and scheduler: pixels, registers and table as they pass.
  w_valid    <= byte_valid and to_sl(state = C_ST_ROWS);
  w_data     <= r_data;
  w_chunk    <= index;
  row_pixels <= pixels;
  row_chunks <= chunks;
  tile       <= last_tile;
  job_we     <= word_full and to_sl(state = C_ST_WORDS and msg_type = C_MSG_START and
                                    unsigned(word_count) >= C_START_FIELDS);
  job_addr   <= std_logic_vector(unsigned(word_count) - C_START_FIELDS);
  job_data   <= word_next;
  t_valid    <= word_full and to_sl(state = C_ST_WORDS and msg_type = C_MSG_TABLE);
  t_address  <= '1' & index(14 downto 0);
  t_data     <= word_next;

  -- To the pins, mac_tx and the counters.
  session     <= open_session;
  tick_ms     <= ms_tick;
  duplex      <= duplex_mode(1) or (pin_full_duplex and not duplex_mode(0));
  full_duplex <= duplex;

  events(C_EV_BAD_MESSAGE - 1 downto 0)            <= (others => '0');
  events(C_EV_EXCESSIVE downto C_EV_SENT)          <= (others => '0');
  events(C_EV_BAD_SOURCE)                          <= '0';
  events(C_EV_DEFERRED downto C_EV_RX_FRAGMENT)    <= (others => '0');
  events(C_EVENTS - 1 downto C_EV_RESYNCHRONISED)  <= (others => '0');

  status       <= "00000" & engine_state & pin_speed_100 & duplex & failed & map_complete & map_busy & running
                  & row_busy & open_session;
  status_words <= last_tile & status
                  & run_tile & map_tile
                  & row_base & row_received
                  & table_id & "00" & table_words
                  & x"00" & map_count
                  & x"00" & errors & error_count
                  & tiles_done & tiles_dropped
                  & tile_clocks
                  & window_errors & failed_tile;

  -- Sequence ----------------------------------------------------------------------------------------------------------
  u_sequencer : entity work.message_sequencer
    port map (
      clk            => clk,
      rst            => rst,
      state          => state,
      step           => step,
      session        => open_session,
      alive          => alive,
      is_map         => is_map,
      is_icmp        => is_icmp,
      session_io     => session_io,
      renewed        => renewed,
      idle_chunk     => idle_chunk,
      recover        => recover,
      checked        => checked,
      expired        => expired,
      stuck          => stuck,
      due            => due,
      first          => first,
      request        => request,
      bucket         => bucket,
      grant          => grant,
      refuse         => refuse,
      msg_type       => msg_type,
      ask_answer     => ask_answer,
      word_full      => word_full,
      header_end     => header_end,
      rows_end       => rows_end,
      peer_end       => peer_end,
      head_state     => head_state,
      word_state     => word_state,
      head_alive     => head_alive,
      admitted       => admitted,
      long_word      => long_word,
      open_new       => open_new,
      open_again     => open_again,
      result         => result,
      read_head      => read_head,
      read_tail      => read_tail,
      fetched        => fetched,
      body_cells     => body_cells,
      reply_end      => reply_end,
      cells_end      => cells_end,
      m_valid        => m_valid,
      m_kind         => m_kind,
      m_done         => m_done,
      s_ready        => s_ready,
      s_start        => s_start,
      tx_abort       => tx_abort,
      p_ready        => p_ready,
      row_clear      => row_clear,
      w_check        => w_check,
      w_new          => w_new,
      w_commit       => w_commit,
      map_clear      => map_clear,
      f_start        => f_start,
      stop           => stop,
      ev_session     => events(C_EV_SESSION),
      ev_timeout     => events(C_EV_TIMEOUT),
      ev_map_packet  => events(C_EV_MAP_PACKET),
      ev_limited     => events(C_EV_LIMITED),
      ev_unreachable => events(C_EV_UNREACHABLE),
      ev_recovered   => events(C_EV_RECOVERED)
    );

  -- Message -----------------------------------------------------------------------------------------------------------
  u_reader : entity work.message_reader
    generic map (
      G_PIX_W       => G_PIX_W,
      G_CHUNK_BYTES => G_CHUNK_BYTES
    )
    port map (
      clk         => clk,
      rst         => rst,
      state       => state,
      idle_chunk  => idle_chunk,
      session_io  => session_io,
      words_end   => words_end,
      reply_step  => reply_step,
      recover     => recover,
      m_kind      => m_kind,
      m_length    => m_length,
      r_addr      => read_addr,
      r_data      => r_data,
      b_bit       => b_bit,
      byte_valid  => byte_valid,
      byte_place  => byte_place,
      word_full   => word_full,
      word_next   => word_next,
      word        => word,
      word_count  => word_count,
      header_end  => header_end,
      rows_end    => rows_end,
      peer_end    => peer_end,
      msg_type    => msg_type,
      magic_ok    => magic_ok,
      version_ok  => version_ok,
      ask_answer  => ask_answer,
      at_last     => at_last,
      reply_last  => reply_last,
      reply_zeros => reply_zeros,
      long_header => long_header,
      long_word   => long_word,
      long_start  => long_start,
      long_write  => long_write,
      long_list   => long_list,
      whole_words => whole_words
    );

  u_rules : entity work.message_rules
    port map (
      clk          => clk,
      rst          => rst,
      state        => state,
      head_state   => head_state,
      word_state   => word_state,
      checked      => checked,
      head_alive   => head_alive,
      admitted     => admitted,
      open_new     => open_new,
      open_again   => open_again,
      words_end    => words_end,
      only_header  => only_header,
      of_list      => of_list,
      result       => result,
      session      => open_session,
      msg_type     => msg_type,
      magic_ok     => magic_ok,
      version_ok   => version_ok,
      peer_ok      => peer_ok,
      token_ok     => token_ok,
      nonce_ok     => nonce_ok,
      long_header  => long_header,
      long_word    => long_word,
      long_start   => long_start,
      long_write   => long_write,
      long_list    => long_list,
      whole_words  => whole_words,
      at_last      => at_last,
      word         => word,
      word_next    => word_next,
      word_full    => word_full,
      word_count   => word_count,
      row_busy     => row_busy,
      staged       => staged,
      running      => running,
      engine_idle  => engine_idle,
      map_busy     => map_busy,
      map_complete => map_complete,
      map_tile     => map_tile,
      w_new        => w_new,
      w_repeated   => w_repeated,
      chunks_fit   => chunks_fit,
      number_ok    => number_ok,
      last_tile    => last_tile,
      table_id     => table_id,
      table_words  => table_words,
      index        => index,
      pixels       => pixels,
      chunks       => chunks,
      duplex_mode  => duplex_mode,
      row_open     => row_open,
      map_release  => map_release,
      ev_bad       => events(C_EV_BAD_MESSAGE),
      ev_foreign   => events(C_EV_FOREIGN),
      ev_answer    => events(C_EV_ANSWER),
      ev_repeated  => events(C_EV_CHUNK_REPEATED),
      ev_refused   => events(C_EV_CHUNK_REFUSED)
    );

  -- Session -----------------------------------------------------------------------------------------------------------
  u_memory : entity work.session_memory
    port map (
      clk         => clk,
      rst         => rst,
      state       => state,
      m_kind      => m_kind,
      of_read     => msg_type(3),
      session_io  => session_io,
      renewed     => renewed,
      tick_ms     => ms_tick,
      r_addr      => read_addr,
      r_data      => r_data,
      byte_valid  => byte_valid,
      byte_place  => byte_place,
      memory_byte => memory_byte,
      peer_ok     => peer_ok,
      token_ok    => token_ok,
      nonce_ok    => nonce_ok,
      peer_we     => peer_we,
      peer_index  => peer_index
    );

  u_timer : entity work.session_timer
    generic map (
      G_CLK_KHZ    => G_CLK_KHZ,
      G_SESSION_MS => G_SESSION_MS
    )
    port map (
      clk       => clk,
      rst       => rst,
      alive     => alive,
      session   => open_session,
      no_rows   => no_rows,
      no_room   => engine_wait,
      tick_ms   => ms_tick,
      expired   => expired,
      stuck     => stuck,
      wait_rows => events(C_EV_WAIT_ROWS),
      wait_map  => events(C_EV_WAIT_MAP)
    );

  u_limiter : entity work.reply_limiter
    port map (
      clk     => clk,
      rst     => rst,
      tick_ms => ms_tick,
      request => request,
      bucket  => bucket,
      grant   => grant,
      refuse  => refuse
    );

  u_chunks : entity work.chunk_check
    generic map (
      G_CHUNK_PAIRS => chunk_pairs(G_CHUNK_BYTES, G_PIX_W)
    )
    port map (
      clk    => clk,
      clear  => idle,
      run    => dividing,
      step   => step(4 downto 0),
      pixels => pixels,
      chunks => chunks,
      fits   => chunks_fit
    );

  -- Map ---------------------------------------------------------------------------------------------------------------
  u_map : entity work.map_sender
    port map (
      clk         => clk,
      rst         => rst,
      clear       => aborting,
      decide      => deciding,
      read_head   => read_head,
      read_tail   => read_tail,
      word        => word,
      word_next   => word_next,
      number_ok   => number_ok,
      answered    => peer_end,
      started     => idle_chunk,
      sent        => cells_end,
      due         => due,
      first       => first,
      map_started => map_started,
      map_busy    => map_busy,
      run_tile    => run_tile,
      f_ready     => f_ready,
      f_chunk     => map_chunk,
      map_keep    => map_keep,
      map_tile    => map_tile
    );

  -- Reply -------------------------------------------------------------------------------------------------------------
  u_info : entity work.info_rom
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
      G_ROW_SLOTS   => G_ROW_SLOTS,
      G_MAP_DEPTH   => G_MAP_DEPTH,
      G_RX_SLOTS    => G_RX_SLOTS,
      G_SESSION_MS  => G_SESSION_MS
    )
    port map (
      own_mac => own_mac,
      index   => info_index,
      data    => info_byte
    );

  u_reply : entity work.reply_builder
    generic map (
      G_ROW_SLOTS => G_ROW_SLOTS
    )
    port map (
      clk          => clk,
      state        => state,
      step         => step,
      is_map       => is_map,
      is_icmp      => is_icmp,
      session_io   => session_io,
      peer_end     => peer_end,
      fetched      => fetched,
      body_cells   => body_cells,
      reply_end    => reply_end,
      only_header  => only_header,
      of_list      => of_list,
      long_list    => long_list,
      result       => result,
      m_kind       => m_kind,
      msg_type     => msg_type,
      reply_last   => reply_last,
      reply_zeros  => reply_zeros,
      r_data       => r_data,
      memory_byte  => memory_byte,
      bits         => word(7 downto 0),
      status_words => status_words,
      map_chunk    => map_chunk,
      info_index   => info_index,
      info_byte    => info_byte,
      c_index      => c_index,
      c_valid      => c_valid,
      c_data       => c_data,
      b_hold       => b_hold,
      b_index      => b_index,
      f_valid      => f_valid,
      f_take       => f_take,
      f_data       => f_data,
      f_last       => f_last,
      p_valid      => p_valid,
      p_ready      => p_ready,
      p_data       => p_data,
      p_last       => p_last
    );

end architecture rtl;
