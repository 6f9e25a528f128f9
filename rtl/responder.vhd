-- SPDX-License-Identifier: Apache-2.0
-- responder: what the chip does with a message: ARP and ICMP echo replies, the session, and the protocol over UDP.
--   Protocol  : docs/protocol.md, sw/net/protocol.hpp
--   Structure : one message at a time, bytes in order, no CPU. The waiting frame is read from packet_rx's RAM byte by
--               byte through one 32-bit shift register (word): first the header (bytes 42 to 57), then the arguments.
--               Rows go on to the row buffer as they pass, one byte a clock. The reply is made byte by byte: its
--               header is the request's, read again, but for four bytes; its body is one big multiplexer.
--               A message is obeyed only after packet_rx has found the whole frame good, so nothing has to be undone
--   Map       : between messages, chunk after chunk of the READ in force, as they become available; the first one after
--               each answer goes before the next message
--   Rate      : rows and cells one byte a clock; replies one byte in 6 clocks (at 60 MHz a status in 6 us)
--   Session   : one token and one peer; silence of G_SESSION_MS aborts all and ends it. What has to be remembered of it
--               lies in a small RAM at the place that it has in a frame (lower six bits): the peer's addresses,
--               token, nonce, and the header of the READ in force. So one comparator of bytes checks all of them while
--               a message passes
--   Token     : a shift register that never stops, 8 steps a clock, into which the nonces are mixed; lowest bit 1
--   Limits    : OPEN, ARP and all else that is not authentic are answered while there is one left in their bucket
--   Upsets    : the state has a parity bit: no upset of one bit makes another state of it. From a code without a name,
--               and when a frame cannot be sent (1 ms after the session's time; without a session after that time, or
--               about 1 s if that is less), it ends the session and the frame, on both sides, and goes on
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

  -- Sizes that follow from the generics.
  constant C_CHUNK_PAIRS : integer := chunk_pairs(G_CHUNK_BYTES, G_PIX_W);
  constant C_CELL_W      : integer := cell_bits(G_PLANES, G_FRAC_W, G_MNCC_W);
  constant C_HEADER_END  : integer := C_HEADER_WORDS - 1; -- last word of a reply
  constant C_STATUS_END  : integer := C_HEADER_WORDS + C_STATUS_WORDS + bitmap_words(G_ROW_SLOTS) - 1;
  constant C_INFO_END    : integer := C_HEADER_WORDS + C_INFO_WORDS - 1;
  constant C_COUNT_END   : integer := C_HEADER_WORDS + C_EVENTS - 1;
  constant C_OUT_W       : integer := reply_bits(G_ROW_SLOTS);
  constant C_REST_W      : integer := clog2(C_CHUNK_PAIRS + 1) + 1;

  -- Capabilities. Words 14 and 15 are the address, which depends on pins.
  type t_words is array (31 downto 0) of std_logic_vector(31 downto 0);
  function info_words return t_words is
    variable v_words : t_words;
  begin
    v_words     := (others => (others => '0'));
    v_words(0)  := std_logic_vector(to_unsigned(2, 16)) & std_logic_vector(to_unsigned(32, 16));
    v_words(1)  := std_logic_vector(to_unsigned(G_IMG_COLS, 32));
    v_words(2)  := std_logic_vector(to_unsigned(G_IMG_ROWS, 32));
    v_words(3)  := std_logic_vector(to_unsigned(G_PLANE_COLS, 32));
    v_words(4)  := std_logic_vector(to_unsigned(G_PLANE_ROWS, 32));
    v_words(5)  := std_logic_vector(to_unsigned(G_PLANES, 32));
    v_words(6)  := std_logic_vector(to_unsigned(G_WINDOW, 32));
    v_words(7)  := std_logic_vector(to_unsigned(G_PIX_W, 32));
    v_words(8)  := std_logic_vector(to_unsigned(G_WEIGHT_W, 32));
    v_words(9)  := std_logic_vector(to_unsigned(G_INTERP_F, 32));
    v_words(10) := std_logic_vector(to_unsigned(G_MNCC_W, 32));
    v_words(11) := std_logic_vector(to_unsigned(G_FRAC_W, 32));
    v_words(12) := std_logic_vector(to_unsigned(G_LANES, 32));
    v_words(13) := std_logic_vector(to_unsigned(C_CELL_W, 32));
    v_words(16) := std_logic_vector(to_unsigned(G_CLK_KHZ, 32));
    v_words(17) := std_logic_vector(to_unsigned(G_CHUNK_BYTES, 32));
    v_words(18) := std_logic_vector(to_unsigned(pair_bytes(G_PIX_W), 32));
    v_words(19) := std_logic_vector(to_unsigned(C_CHUNK_PAIRS, 32));
    v_words(20) := std_logic_vector(to_unsigned(G_ROW_SLOTS, 32));
    v_words(21) := std_logic_vector(to_unsigned(cell_bytes(C_CELL_W), 32));
    v_words(22) := std_logic_vector(to_unsigned(chunk_cells(G_CHUNK_BYTES, C_CELL_W), 32));
    v_words(23) := std_logic_vector(to_unsigned(G_MAP_DEPTH, 32));
    v_words(24) := std_logic_vector(to_unsigned(G_SESSION_MS, 32));
    v_words(25) := std_logic_vector(to_unsigned(G_RX_SLOTS, 32));
    v_words(26) := std_logic_vector(to_unsigned(40, 32));
    v_words(27) := std_logic_vector(to_unsigned(G_RECTIFIED, 32));
    return v_words;
  end function info_words;
  constant C_INFO_TABLE : t_words := info_words;

  type t_info is array (127 downto 0) of std_logic_vector(7 downto 0);
  function info_bytes return t_info is
    variable v_bytes : t_info;
  begin
    for i in 0 to 127 loop
      v_bytes(i) := C_INFO_TABLE(i / 4)(31 - 8 * (i mod 4) downto 24 - 8 * (i mod 4));
    end loop;
    return v_bytes;
  end function info_bytes;
  constant C_INFO_BYTES : t_info := info_bytes;

  type t_bytes is array (63 downto 0) of std_logic_vector(7 downto 0);

  signal state : std_logic_vector(4 downto 0);

  -- Reading the frame: byte place (mod 64) is on r_data while have = '1'.
  signal pos       : unsigned(10 downto 0);
  signal have      : std_logic;
  signal place      : unsigned(5 downto 0); -- of that byte, the lower bits
  signal scanning  : std_logic;
  signal word      : std_logic_vector(31 downto 0);
  signal word_next : std_logic_vector(31 downto 0); -- with the byte that is passing
  signal word_full : std_logic;                     -- that byte is the last of a word
  signal count     : unsigned(4 downto 0);          -- words of arguments so far, all ones stay

  -- The message.
  signal msg_type   : std_logic_vector(7 downto 0);
  signal magic_ok   : std_logic;
  signal version_ok : std_logic;
  signal token_ok   : std_logic;
  signal peer_ok    : std_logic;
  signal nonce_ok   : std_logic;
  signal differs    : std_logic; -- the byte that passes, from the one in its place in the session's memory
  signal authentic  : std_logic;
  signal answer     : std_logic;
  signal code       : std_logic_vector(2 downto 0);
  signal silent     : std_logic; -- no reply
  signal end_pos    : unsigned(10 downto 0); -- frame byte behind the message
  signal at_last    : std_logic; -- the byte that passes is the last one of the message
  signal words_over : std_logic;             -- the byte that passes is the last of the arguments
  signal index      : unsigned(15 downto 0); -- chunk or table word
  signal long_1     : std_logic; -- at least one word of arguments
  signal long_start : std_logic;
  signal long_write : std_logic; -- exactly a chunk of rows
  signal long_list  : std_logic; -- INFO, COUNTERS: as long as the answer

  -- Session.
  signal open_q      : std_logic;
  signal store      : std_logic; -- OPEN and READ: what the session's memory is to keep is in this frame
  signal peer_shift : unsigned(2 downto 0); -- from place to index, halved
  signal at_peer    : std_logic; -- byte place is the sender's MAC, IP or port
  signal at_head    : std_logic; -- .. of the message's header
  signal at_token   : std_logic;
  signal keep_we    : std_logic;
  signal keep_data  : std_logic_vector(7 downto 0);
  signal kept       : std_logic_vector(7 downto 0);  -- byte of the session's memory
  signal dice       : std_logic_vector(31 downto 0); -- next token, but for its lowest bit
  signal dice_next   : std_logic_vector(7 downto 0);
  signal last_tile   : unsigned(15 downto 0);         -- latest START
  signal map_tile    : unsigned(15 downto 0);
  signal table_id    : unsigned(15 downto 0);
  signal table_words : unsigned(13 downto 0);
  signal duplex_mode : std_logic_vector(1 downto 0);
  signal pixels      : std_logic_vector(23 downto 0);
  signal chunks      : std_logic_vector(15 downto 0);
  signal close_q     : std_logic; -- C_ST_ABORT ends the session, else it begins one
  signal by_timer    : std_logic; -- nobody waits for an answer
  signal known       : unsigned(15 downto 0); -- what the message's number is compared with
  signal distance    : unsigned(15 downto 0);
  signal is_next     : std_logic; -- the number is the known one + 1
  signal is_last     : std_logic;
  signal idle_chip  : std_logic; -- no tile anywhere but in the map buffer

  -- pixels / C_CHUNK_PAIRS, non-restoring, bit by bit against chunks.
  signal pixel_bits : std_logic_vector(31 downto 0);
  signal pixel_bit  : std_logic;
  signal chunk_bit  : std_logic;
  signal rest       : unsigned(C_REST_W - 1 downto 0); -- -C_CHUNK_PAIRS .. C_CHUNK_PAIRS-1
  signal rest_next  : unsigned(C_REST_W - 1 downto 0);
  signal same       : std_logic; -- chunks so far are the quotient
  signal one_more   : std_logic; -- chunks so far are the quotient + 1

  -- Answers left: the buckets pass by, ARP, OPEN, all else.
  signal turn_of   : unsigned(1 downto 0); -- whose bucket is bucket_0
  signal bucket    : unsigned(1 downto 0); -- which the message needs
  signal bucket_0  : unsigned(3 downto 0);
  signal bucket_1  : unsigned(3 downto 0);
  signal bucket_2  : unsigned(3 downto 0);
  signal refill    : std_logic_vector(2 downto 0);
  signal at_bucket : std_logic;
  signal is_open   : std_logic; -- the message is an OPEN

  -- The READ in force.
  signal read_active : std_logic;
  signal of_map      : std_logic; -- READ is for the tile in the map buffer
  signal read_tile   : unsigned(15 downto 0);
  signal read_next   : unsigned(15 downto 0);
  signal read_left   : unsigned(15 downto 0); -- not (chunks to come): counts up
  signal keep        : std_logic_vector(15 downto 0);
  signal settle      : std_logic_vector(3 downto 0); -- f_ready may be that of an earlier question
  signal map_due    : std_logic;
  signal map_turn   : std_logic; -- something was answered since the latest chunk

  -- The reply.
  signal is_map     : std_logic;
  signal is_icmp    : std_logic;
  signal out_word   : unsigned(C_OUT_W - 1 downto 0);
  signal out_byte   : unsigned(1 downto 0);
  signal out_end    : unsigned(C_OUT_W - 1 downto 0);
  signal step       : unsigned(5 downto 0); -- of C_ST_FETCH
  signal in_header  : std_logic;
  signal in_bitmap  : std_logic;
  signal lists      : std_logic; -- the message is INFO or COUNTERS
  signal is_list    : std_logic; -- and their body is due
  signal fetched    : std_logic;
  signal words      : std_logic_vector(287 downto 0);
  signal word_bytes : t_bytes;
  signal own_word   : std_logic;
  signal from_kept  : std_logic;
  signal byte_index : unsigned(5 downto 0);
  signal body_index : unsigned(5 downto 0); -- of a word in INFO and COUNTERS
  signal list_index : unsigned(6 downto 0);
  signal list_byte  : std_logic_vector(7 downto 0);
  signal head_byte  : std_logic_vector(7 downto 0);
  signal status     : std_logic_vector(15 downto 0);
  signal at_end     : std_logic;

  -- Time.
  signal ms_clock   : unsigned(clog2(G_CLK_KHZ) - 1 downto 0);
  signal ms_tick    : std_logic;
  signal quiet_ms   : unsigned(15 downto 0); -- since the session's host was heard
  signal heard      : std_logic;
  signal lapse      : std_logic; -- .. for as long as a session lasts
  signal expired    : std_logic;
  signal stuck      : std_logic;
  signal rows_wait  : unsigned(7 downto 0);
  signal map_wait   : unsigned(7 downto 0);
  signal rows_short : std_logic;

  attribute fsm_extract : string;

  attribute fsm_extract of state : signal is C_FSM_KEPT;

begin

  assert G_CLK_KHZ >= 1000 and G_CLK_KHZ <= 1000000
    report "responder: G_CLK_KHZ"
           -- synthesis translate_off
           & "=" & integer'image(G_CLK_KHZ)
           -- synthesis translate_on
           & " outside 1000..1000000"
    severity failure;
  assert G_CHUNK_BYTES >= 16 and G_CHUNK_BYTES <= 1440
    report "responder: G_CHUNK_BYTES"
           -- synthesis translate_off
           & "=" & integer'image(G_CHUNK_BYTES)
           -- synthesis translate_on
           & " outside 16..1440"
    severity failure;
  assert G_ROW_SLOTS >= 2 and G_ROW_SLOTS <= 1024
    report "responder: G_ROW_SLOTS"
           -- synthesis translate_off
           & "=" & integer'image(G_ROW_SLOTS)
           -- synthesis translate_on
           & " outside 2..1024"
    severity failure;
  assert G_SESSION_MS >= 1 and G_SESSION_MS <= 65535
    report "responder: G_SESSION_MS"
           -- synthesis translate_off
           & "=" & integer'image(G_SESSION_MS)
           -- synthesis translate_on
           & " outside 1..65535"
    severity failure;

  -- Reading ----------------------------------------------------------------------------------------------------------
  scanning  <= to_sl(state = C_ST_HEADER or state = C_ST_WORDS or state = C_ST_ROWS or state = C_ST_PEER);
  r_addr    <= std_logic_vector(pos);
  word_next <= word(23 downto 0) & r_data;
  word_full <= have and to_sl(place(1 downto 0) = 1); -- words begin at byte 6, 10, .., 42, .., 58, ..

  long_1     <= to_sl(end_pos >= C_AT_ARGUMENTS + 4);
  long_start <= to_sl(end_pos >= C_AT_ARGUMENTS + 4 * (C_START_FIELDS + C_JOB_WORDS));
  long_write <= to_sl(end_pos = C_AT_ARGUMENTS + write_bytes(G_CHUNK_BYTES, G_PIX_W));
  long_list  <= to_sl(end_pos >= C_AT_ARGUMENTS + 4 * 40) or (to_sl(end_pos >= C_AT_ARGUMENTS + 4 * 32) and msg_type(0));

  -- pos is one ahead.
  at_last    <= to_sl(pos = end_pos);
  words_over <= at_last when msg_type = C_MSG_TABLE
                else to_sl(count = 20) when msg_type = C_MSG_START
                else '1';

  -- One subtraction for all numbers that have to be in order.
  known    <= last_tile when msg_type = C_MSG_START or msg_type = C_MSG_WRITE
              else table_id when msg_type = C_MSG_TABLE
              else map_tile;
  distance <= unsigned(word(31 downto 16)) - known;
  is_last  <= to_sl(distance = 0);
  is_next  <= to_sl(distance = 1);
  idle_chip <= not row_busy and not staged and not running and to_sl(engine_state = C_STATE_IDLE);

  w_valid    <= have and to_sl(state = C_ST_ROWS);
  w_data     <= r_data;
  w_chunk    <= std_logic_vector(index);
  job_addr   <= std_logic_vector(count + 29); -- the first three words are no registers
  job_data   <= word_next;
  job_we     <= word_full and to_sl(state = C_ST_WORDS and msg_type = C_MSG_START and count >= 3);
  t_valid    <= word_full and to_sl(state = C_ST_WORDS and msg_type = C_MSG_TABLE);
  t_address  <= '1' & std_logic_vector(index(14 downto 0));
  t_data     <= word_next;
  row_pixels <= pixels;
  row_chunks <= chunks;
  tile       <= std_logic_vector(last_tile);

  -- Sender's MAC, IP and port: bytes 6-11, 26-29, 34-35 of the frame, in ARP 22-27, 28-31; places 0-5, 6-9, 10-11.
  at_peer    <= to_sl((place >= 6 and place < 12) or (place >= 26 and place < 30) or place = 34 or place = 35);
  peer_data  <= r_data;
  peer_bank  <= store;
  peer_we    <= have and to_sl(state = C_ST_PEER) and at_peer when m_kind /= C_FRAME_ARP
                else have and to_sl(state = C_ST_PEER and place >= 22 and place < 32);
  -- place - 6 in ARP and for MAC, place - 20 for IP, place - 24 for the port; modulo 16.
  peer_shift <= "101" when m_kind = C_FRAME_ARP or place(5 downto 4) = 0
                else "100" when place(5) = '1'
                else "110";
  peer_index <= std_logic_vector(place(3 downto 1) + peer_shift) & place(0);

  -- The session's memory ---------------------------------------------------------------------------------------------
  -- OPEN writes addresses and nonce, and the new token in place of its own header's; READ writes its header, and the
  -- rest as it is. OPEN is read up to its nonce, everything else up to the end of the header.
  at_head   <= to_sl(place >= 42 and place < 58);
  at_token  <= to_sl(place >= 46 and place < 50);
  keep_we   <= have and to_sl(state = C_ST_PEER) and store and (not at_head or not close_q or msg_type(3));
  keep_data <= dice(7 downto 1) & (dice(0) or (not place(1) and place(0))) when at_token = '1' and msg_type(3) = '0'
               else r_data;
  dice_next <= dice(31 downto 24) xor dice(30 downto 23) xor dice(29 downto 22) xor dice(9 downto 2);
  differs   <= to_sl(r_data /= kept);
  authentic <= open_q and version_ok and token_ok and peer_ok;

  u_kept : entity work.ram_sdp
    generic map (G_DATA_W => 8, G_DEPTH => 64, G_LATENCY => 1)
    port map (
      clk   => clk,
      we    => keep_we,
      waddr => std_logic_vector(place),
      wdata => keep_data,
      raddr => std_logic_vector(pos(5 downto 0)),
      rdata => kept
    );

  -- Chunks of a START ------------------------------------------------------------------------------------------------
  pixel_bits <= x"00" & pixels;
  pixel_bit  <= pixel_bits(to_integer(not step(4 downto 0)));
  chunk_bit  <= step(4) and chunks(to_integer(not step(3 downto 0)));
  rest_next  <= (rest(C_REST_W - 2 downto 0) & pixel_bit) - C_CHUNK_PAIRS when rest(C_REST_W - 1) = '0'
                else (rest(C_REST_W - 2 downto 0) & pixel_bit) + C_CHUNK_PAIRS;

  -- Limits -----------------------------------------------------------------------------------------------------------
  is_open   <= to_sl(m_kind = C_FRAME_UDP and msg_type = C_MSG_OPEN);
  bucket(0) <= is_open;
  bucket(1) <= not is_open and to_sl(m_kind /= C_FRAME_ARP);
  at_bucket <= to_sl(state = C_ST_LIMIT and turn_of = bucket);

  -- Map --------------------------------------------------------------------------------------------------------------
  f_chunk  <= std_logic_vector(read_next);
  map_keep <= keep;
  map_due  <= read_active and map_busy and f_ready and not settle(0) and to_sl(read_tile = map_tile);
  f_take   <= p_ready and to_sl(state = C_ST_CELLS);

  -- Reply ------------------------------------------------------------------------------------------------------------
  s_kind    <= C_FRAME_UDP when is_map = '1' else m_kind;
  s_bank     <= store;
  in_header <= to_sl(out_word < 4);
  in_bitmap <= to_sl(out_word >= 13) and not is_list and not is_map;
  is_list   <= lists and not in_header and not is_map;
  at_end    <= to_sl(out_word = out_end and out_byte = 3);
  body_index <= resize(out_word, 6) - 4;
  c_index   <= std_logic_vector(body_index);
  -- From the first word of a status block to the last.
  b_hold    <= not in_header and not lists and not is_map;
  b_index   <= std_logic_vector(resize(out_word - 13, 5) & out_byte & step(2 downto 0));

  status <= "00000" & engine_state & pin_speed_100 & (duplex_mode(1) or (pin_full_duplex and not duplex_mode(0)))
            & failed & map_complete & map_busy & running & row_busy & open_q;

  -- Bytes of the status block (words 4 to 12).
  words <= std_logic_vector(last_tile) & status
           & run_tile & std_logic_vector(map_tile)
           & row_base & row_received
           & std_logic_vector(table_id) & "00" & std_logic_vector(table_words)
           & x"00" & map_count
           & x"00" & errors & error_count
           & tiles_done & tiles_dropped
           & tile_clocks
           & window_errors & failed_tile;

  g_bytes : for i in 0 to 35 generate
    word_bytes(16 + i) <= words(287 - 8 * i downto 280 - 8 * i);
  end generate g_bytes;

  -- In the header of a map packet, where the request has its first chunk.
  word_bytes(14) <= std_logic_vector(read_next(15 downto 8));
  word_bytes(15) <= std_logic_vector(read_next(7 downto 0));

  g_low : for i in 0 to 13 generate
    word_bytes(i) <= (others => '-');
  end generate g_low;

  g_high : for i in 52 to 63 generate
    word_bytes(i) <= (others => '-');
  end generate g_high;

  own_word   <= to_sl(out_word(0) = '1' and out_word(1) = '1' and out_byte(1) = '1') and is_map;
  byte_index <= out_word(3 downto 0) & out_byte;
  list_index <= body_index(4 downto 0) & out_byte;

  p_data <= f_data when state = C_ST_CELLS
            else head_byte when in_header = '1' and own_word = '0'
            else list_byte when is_list = '1'
            else word(7 downto 0) when in_bitmap = '1'
            else word_bytes(to_integer(byte_index));

  -- Header of a reply: the request's bytes, but version, type, code and a zero, and OPEN's token. Header of a map
  -- packet: that of its READ, likewise. ICMP: words 0 and 1, whose first and last bytes are the frame's, and that zero.
  from_kept <= is_map or (store and to_sl(out_word(1 downto 0) = 1));

  p_head : process (out_word, out_byte, r_data, kept, from_kept, msg_type, code)
  begin
    head_byte <= r_data;
    if from_kept = '1' then
      head_byte <= kept;
    end if;
    if out_word(1 downto 0) = 0 and out_byte = 2 then
      head_byte <= C_VERSION;
    elsif out_word(1 downto 0) = 0 and out_byte = 3 then
      head_byte <= msg_type or C_MSG_REPLY;
    elsif out_word(1 downto 0) = 2 and out_byte = 2 then
      head_byte <= "00000" & code;
    elsif out_word(1 downto 0) = 2 and out_byte = 3 then
      head_byte <= x"00";
    end if;
  end process p_head;

  list_byte <= word_byte(c_data, out_byte) when msg_type(2) = '1'
               else mac_byte_of(own_mac, not body_index(0) & out_byte)
                    when (body_index = 14 and out_byte(1) = '1') or body_index = 15
               else C_INFO_BYTES(to_integer(list_index));

  p_valid <= f_valid when state = C_ST_CELLS else to_sl(state = C_ST_SHOW);
  p_last  <= f_last when state = C_ST_CELLS else at_end and not is_map;

  -- A byte is there three clocks after its number (later if a counter takes longer), one of the bitmap after its bits.
  fetched <= to_sl(step = 9) when in_bitmap = '1'
             else to_sl(step >= 3) and (c_valid or not is_list or not msg_type(2));

  -- The one process of the sequence ----------------------------------------------------------------------------------
  p_sequence : process (clk)
    variable v_go      : std_logic;
    variable v_bad     : std_logic; -- counted, code 3
    variable v_recover : std_logic;
    -- A register that is loaded or counted: what goes into its adder, and 1 if it counts.
    variable v_pos        : unsigned(10 downto 0);
    variable v_pos_inc    : unsigned(0 downto 0);
    variable v_index      : unsigned(15 downto 0);
    variable v_index_inc  : unsigned(0 downto 0);
    variable v_next       : unsigned(15 downto 0);
    variable v_left       : unsigned(15 downto 0);
    variable v_packet_inc : unsigned(0 downto 0);
  begin
    if rising_edge(clk) then
      s_start     <= '0';
      m_done      <= '0';
      row_clear   <= '0';
      row_open    <= '0';
      w_check     <= '0';
      w_commit    <= '0';
      map_release <= '0';
      map_clear   <= '0';
      f_start     <= '0';
      stop        <= '0';
      events(C_EV_BAD_MESSAGE) <= '0';
      events(C_EV_FOREIGN) <= '0';
      events(C_EV_SESSION) <= '0';
      events(C_EV_TIMEOUT) <= '0';
      events(C_EV_CHUNK_REPEATED) <= '0';
      events(C_EV_CHUNK_REFUSED) <= '0';
      events(C_EV_MAP_PACKET) <= '0';
      events(C_EV_LIMITED) <= '0';
      events(C_EV_ANSWER) <= '0';
      events(C_EV_UNREACHABLE) <= '0';
      events(C_EV_RECOVERED) <= '0';
      tx_abort    <= '0';
      v_recover   := '0';
      v_bad       := '0';
      v_pos       := pos;
      v_pos_inc(0) := scanning;
      v_index     := index;
      v_index_inc := "0";
      v_next      := read_next;
      v_left      := read_left;
      v_packet_inc := "0";

      have <= scanning;
      place <= pos(5 downto 0);
      settle <= '0' & settle(3 downto 1);
      if map_started = '1' then
        map_tile <= unsigned(run_tile);
        settle   <= (others => '1');
      end if;
      if ms_tick = '1' then
        quiet_ms <= quiet_ms + 1;
      end if;
      if lapse = '1' then
        quiet_ms <= (others => '0');
        expired  <= '1';
      end if;
      heard <= '0';
      if differs = '1' and have = '1' then
        if at_peer = '1' then
          peer_ok <= '0';
        end if;
        if at_token = '1' then
          token_ok <= '0';
        end if;
        if state = C_ST_WORDS then
          nonce_ok <= '0';
        end if;
      end if;

      if have = '1' then
        word <= word_next;
      elsif state = C_ST_FETCH then
        word(7 downto 0) <= word(6 downto 0) & b_bit; -- the first ones fall out again
      end if;

      if state = C_ST_IDLE then
        is_map     <= '0';
        is_icmp    <= '0';
        lists      <= '0';
        store      <= '0';
        silent     <= '0';
        by_timer   <= '0';
        close_q    <= '1';
        peer_ok    <= '1';
        token_ok   <= '1';
        nonce_ok   <= '1';
        same       <= '1';
        one_more   <= '0';
        rest       <= (others => '0');
        heard      <= not open_q; -- without a session the time is that of a message
        code       <= C_RESULT_OK;
        count      <= (others => '0');
        out_word   <= (others => '0');
        out_byte   <= (others => '0');
        out_end    <= to_unsigned(C_STATUS_END, C_OUT_W);
        step       <= (others => '0');
        have       <= '0';
        v_pos      := to_unsigned(6, 11);
        end_pos    <= unsigned(m_length) + C_AT_MESSAGE;
        if open_q = '1' and expired = '1' then
          events(C_EV_TIMEOUT) <= '1';
          by_timer   <= '1';
          state      <= C_ST_ABORT;
        elsif m_valid = '1' and (map_turn = '0' or map_due = '0') then
          if m_kind = C_FRAME_UDP then
            state <= C_ST_HEADER;
          else
            is_icmp <= m_kind(0);
            state   <= C_ST_LIMIT;
          end if;
        elsif map_due = '1' and s_ready = '1' then
          is_map     <= '1';
          store      <= '1';
          map_turn   <= '0';
          msg_type   <= C_MSG_MAP;
          v_pos      := to_unsigned(C_AT_MESSAGE, 11);
          f_start    <= '1';
          s_start    <= '1';
          events(C_EV_MAP_PACKET) <= '1';
          state      <= C_ST_FETCH;
        end if;

      elsif state = C_ST_HEADER then
        if have = '1' then
          if place = C_AT_MESSAGE + 3 then
            msg_type   <= r_data;
            magic_ok   <= to_sl(word_next(31 downto 16) = C_MAGIC);
            version_ok <= to_sl(word_next(15 downto 8) = C_VERSION);
          elsif place = C_AT_MESSAGE + 10 then
            answer <= r_data(0);
          elsif place = C_AT_MESSAGE + 15 then
            have  <= '0';
            state <= C_ST_DECIDE;
          end if;
        end if;

      elsif state = C_ST_DECIDE then
        v_index   := unsigned(word(15 downto 0));
        of_map    <= is_last;
        v_pos     := to_unsigned(C_AT_ARGUMENTS, 11);
        state     <= C_ST_WAIT;
        v_go      := '0';
        heard     <= authentic;
        if authentic = '0' then
          out_end <= to_unsigned(C_HEADER_END, C_OUT_W);
          state   <= C_ST_LIMIT;
        end if;
        if magic_ok = '0' or end_pos < C_AT_ARGUMENTS then
          v_bad := '1';
          heard <= '0';
          state <= C_ST_DONE;
        elsif msg_type(7) = '1' then
          events(C_EV_ANSWER) <= '1';
          heard      <= '0';
          state      <= C_ST_DONE;
        elsif msg_type = C_MSG_OPEN then
          v_bad   := not version_ok or not long_1;
          out_end <= to_unsigned(C_HEADER_END, C_OUT_W);
          state   <= C_ST_LIMIT;
        elsif version_ok = '0' or msg_type = x"00" or unsigned(msg_type) > unsigned(C_MSG_SET) then
          v_bad := '1';
        elsif msg_type = C_MSG_INFO or msg_type = C_MSG_COUNTERS then
          lists <= long_list;
          v_bad := not long_list;
          if long_list = '0' then
            out_end <= to_unsigned(C_HEADER_END, C_OUT_W);
          elsif msg_type(2) = '1' then
            out_end <= to_unsigned(C_COUNT_END, C_OUT_W);
          else
            out_end <= to_unsigned(C_INFO_END, C_OUT_W);
          end if;
        elsif open_q = '0' then
          if msg_type /= C_MSG_CLOSE then
            code <= C_RESULT_NO_SESSION;
          end if;
        elsif authentic = '0' then
          events(C_EV_FOREIGN) <= '1';
          code       <= C_RESULT_BUSY;
        else
          v_go := '1';
        end if;
        if v_go = '1' then
          if msg_type = C_MSG_CLOSE then
            state <= C_ST_ABORT;
          elsif msg_type = C_MSG_READ or msg_type = C_MSG_SET then
            if long_1 = '1' then
              state <= C_ST_WORDS;
            else
              v_bad := '1';
            end if;
            if msg_type = C_MSG_READ and long_1 = '1' then
              read_active <= '0';
              read_tile   <= unsigned(word(31 downto 16));
              v_next      := unsigned(word(15 downto 0));
              store       <= '1';
            end if;
          elsif msg_type = C_MSG_TABLE then
            -- Frame byte 42 is 2 mod 4.
            if long_1 = '0' or end_pos(1 downto 0) /= 2 then
              v_bad := '1';
            elsif is_last = '1' then
              if unsigned(word(15 downto 0)) > table_words or table_id = 0 then
                code <= C_RESULT_ORDER;
              elsif idle_chip = '0' then
                code <= C_RESULT_NOT_READY;
              else
                state <= C_ST_WORDS;
              end if;
            elsif is_next = '1' and unsigned(word(15 downto 0)) = 0 then
              if idle_chip = '0' then
                code <= C_RESULT_NOT_READY;
              else
                table_words <= (others => '0');
                table_id    <= unsigned(word(31 downto 16)); -- + 1
                state       <= C_ST_WORDS;
              end if;
            else
              code <= C_RESULT_ORDER;
            end if;
          elsif msg_type = C_MSG_START then
            if long_start = '0' then
              v_bad := '1';
            elsif is_next = '1' then
              if row_busy = '1' or staged = '1' then
                code <= C_RESULT_NOT_READY;
              else
                state <= C_ST_WORDS;
              end if;
            elsif is_last = '0' then
              code <= C_RESULT_ORDER;
            end if;
          elsif msg_type = C_MSG_WRITE then
            silent <= not answer;
            if long_write = '0' then
              v_bad := '1';
            elsif is_last = '0' then
              code <= C_RESULT_ORDER;
            elsif row_busy = '1' then
              w_check <= '1';
              state   <= C_ST_CHECK;
            end if;
          elsif msg_type = C_MSG_RELEASE then
            if is_last = '0' then
              code <= C_RESULT_ORDER;
            elsif map_busy = '1' and map_complete = '0' then
              code <= C_RESULT_NOT_READY;
            else
              map_release <= '1';
            end if;
          end if;
        end if;

      elsif state = C_ST_LIMIT then
        if at_bucket = '1' then
          state <= C_ST_WAIT;
          if bucket_0 = 0 then
            events(C_EV_LIMITED) <= '1';
            state      <= C_ST_DONE;
          elsif is_open = '1' and code = C_RESULT_OK then
            state <= C_ST_WORDS;
          end if;
        end if;

      elsif state = C_ST_WORDS then
        if word_full = '1' then
          if count /= 31 then
            count <= count + 1;
          end if;
          if words_over = '1' then
            have  <= '0';
            state <= C_ST_WAIT;
          end if;
          if msg_type = C_MSG_OPEN then
            if open_q = '0' then
              store   <= '1';
              close_q <= '0';
              state   <= C_ST_ABORT;
            elsif nonce_ok = '1' and differs = '0' and (peer_ok = '1' or token_ok = '1') then
              store <= '1';
              heard <= '1';
            else
              events(C_EV_FOREIGN) <= '1';
              code       <= C_RESULT_BUSY;
            end if;
          elsif msg_type = C_MSG_READ then
            v_left      := not unsigned(word_next(31 downto 16));
            read_active <= to_sl(unsigned(word_next(31 downto 16)) /= 0);
            settle      <= (others => '1');
            if of_map = '1' then
              keep <= word_next(15 downto 0);
            end if;
          elsif msg_type = C_MSG_SET then
            if index = 0 and unsigned(word_next(31 downto 2)) = 0 and word_next(1 downto 0) /= "11" then
              duplex_mode <= word_next(1 downto 0);
            else
              v_bad := '1';
            end if;
          elsif msg_type = C_MSG_TABLE then
            v_index_inc := "1";
            if index = table_words and table_words(13) = '0' then
              table_words <= table_words + 1;
            end if;
          else
            -- START: the table it needs, pixels, chunks, registers (the fifth of them is PLANES).
            if count = 0 and unsigned(word_next(31 downto 16)) /= table_id then
              code  <= C_RESULT_ORDER;
              have  <= '0';
              state <= C_ST_WAIT;
            elsif (count = 1 and (unsigned(word_next) = 0 or unsigned(word_next(31 downto 24)) /= 0))
                  or (count = 2 and (unsigned(word_next) = 0 or unsigned(word_next(31 downto 16)) /= 0)) then
              v_bad := '1';
              have  <= '0';
              state <= C_ST_WAIT;
            elsif count = 7 and unsigned(word_next(10 downto 0)) > table_words(13 downto 3) then
              code  <= C_RESULT_ORDER;
              have  <= '0';
              state <= C_ST_WAIT;
            elsif words_over = '1' then
              step  <= to_unsigned(8, 6);
              state <= C_ST_DIVIDE;
            end if;
            if count = 1 then
              pixels <= word_next(23 downto 0);
            elsif count = 2 then
              chunks <= word_next(15 downto 0);
            end if;
          end if;
        end if;

      elsif state = C_ST_DIVIDE then
        -- Bits 23 to 0.
        step <= step + 1;
        if step(5) = '0' then
          rest     <= rest_next;
          same     <= same and (chunk_bit xor rest_next(C_REST_W - 1));
          one_more <= (same and chunk_bit and rest_next(C_REST_W - 1))
                      or (one_more and not chunk_bit and not rest_next(C_REST_W - 1));
        else
          state <= C_ST_WAIT;
          if (same = '1' and (rest = 0 or rest = 2 ** C_REST_W - C_CHUNK_PAIRS))
             or (one_more = '1' and rest /= 0 and rest /= 2 ** C_REST_W - C_CHUNK_PAIRS) then
            row_open  <= '1';
            last_tile <= last_tile + 1;
          else
            v_bad := '1';
          end if;
        end if;

      elsif state = C_ST_CHECK then
        -- Three clocks after w_check.
        step <= step + 1;
        if step = 3 then
          step <= (others => '0');
          if w_new = '1' then
            state <= C_ST_ROWS;
          else
            state      <= C_ST_WAIT;
            events(C_EV_CHUNK_REPEATED) <= w_repeated;
            events(C_EV_CHUNK_REFUSED) <= not w_repeated;
            if w_repeated = '0' then
              code <= C_RESULT_NOT_READY;
            end if;
          end if;
        end if;

      elsif state = C_ST_ROWS then
        if have = '1' and at_last = '1' then
          have     <= '0';
          w_commit <= '1';
          state    <= C_ST_WAIT;
        end if;

      elsif state = C_ST_WAIT then
        v_pos := to_unsigned(6, 11);
        if silent = '1' then
          state <= C_ST_DONE;
        elsif s_ready = '1' then
          state <= C_ST_PEER;
        end if;

      elsif state = C_ST_PEER then
        if have = '1' and (place = 61 or (place = 57 and (store = '0' or msg_type(3) = '1'))) then
          have       <= '0';
          s_start    <= '1';
          map_turn   <= '1';
          v_pos      := to_unsigned(C_AT_MESSAGE, 11);
          v_pos_inc  := "0";
          step       <= (others => '0');
          state      <= C_ST_FETCH;
          events(C_EV_UNREACHABLE) <= m_kind(1) and m_kind(0);
          if m_kind = C_FRAME_ARP then
            state <= C_ST_DONE;
          elsif m_kind = C_FRAME_ICMP then
            v_pos   := to_unsigned(38, 11);
            end_pos <= unsigned(m_length) + 34;
          elsif m_kind = C_FRAME_CLOSED then -- four zeros in place of bytes 10 to 13
            v_pos    := to_unsigned(10, 11);
            end_pos  <= to_unsigned(42, 11);
            out_word <= to_unsigned(2, C_OUT_W);
            out_byte <= "11";
          end if;
        end if;

      elsif state = C_ST_FETCH then
        step <= step + 1;
        if fetched = '1' then
          step  <= (others => '0');
          state <= C_ST_SHOW;
        end if;

      elsif state = C_ST_SHOW then
        if p_ready = '1' then
          v_pos_inc := "1";
          out_byte  <= out_byte + 1;
          if out_byte = 3 then
            out_word <= out_word + 1;
          end if;
          state <= C_ST_FETCH;
          if is_icmp = '1' then
            out_word <= (others => '0');
            out_byte <= "00";
            if pos + 2 = end_pos then -- the byte after this one is the last
              out_end  <= to_unsigned(1, C_OUT_W);
              out_word <= to_unsigned(1, C_OUT_W);
              out_byte <= "11";
            elsif at_end = '1' then
              state <= C_ST_DONE;
            elsif m_kind(1) = '1' and pos < 13 then
              out_word <= to_unsigned(2, C_OUT_W);
              out_byte <= "11";
            end if;
          elsif is_map = '1' and out_word = 3 and out_byte = 3 then
            state <= C_ST_CELLS;
          elsif at_end = '1' and is_map = '0' then
            state <= C_ST_DONE;
          end if;
        end if;

      elsif state = C_ST_CELLS then
        if f_valid = '1' and p_ready = '1' and f_last = '1' then
          v_packet_inc := "1";
          settle    <= (others => '1');
          if read_left = 16#fffe# then
            read_active <= '0';
          end if;
          state <= C_ST_IDLE;
        end if;

      elsif state = C_ST_DONE then
        m_done <= m_valid and not is_map;
        -- One clock for m_valid to fall.
        step   <= step + 1;
        if step /= 0 then
          m_done <= '0';
          if step = 3 then
            state <= C_ST_IDLE;
          end if;
        end if;

      elsif state = C_ST_ABORT then
        stop        <= '1';
        row_clear   <= '1';
        map_clear   <= '1';
        open_q      <= not close_q;
        heard       <= '1';
        events(C_EV_SESSION) <= not close_q;
        state       <= C_ST_WAIT;
        if by_timer = '1' then
          state <= C_ST_IDLE;
        end if;

      else
        v_recover := '1';
      end if;

      if v_bad = '1' then
        events(C_EV_BAD_MESSAGE) <= '1';
        code       <= C_RESULT_BAD_MESSAGE;
      end if;
      if stuck = '1' and heard = '0' and state /= C_ST_IDLE then
        v_recover := '1';
      end if;
      if v_recover = '1' then
        events(C_EV_RECOVERED) <= '1';
        tx_abort   <= '1';
        silent     <= '1';
        by_timer   <= '0';
        close_q    <= '1';
        heard      <= '1';
        have       <= '0';
        state      <= C_ST_ABORT;
      end if;

      pos       <= v_pos + v_pos_inc;
      index     <= v_index + v_index_inc;
      read_next <= v_next + v_packet_inc;
      read_left <= v_left + v_packet_inc;

      -- Written last, and alone, so that they become resets of the flip-flops.
      if map_started = '1' then
        keep <= (others => '0');
      end if;
      if heard = '1' then
        quiet_ms <= (others => '0');
        expired  <= '0';
      end if;
      if rst = '1' or state = C_ST_ABORT then
        read_active <= '0';
        duplex_mode <= "00";
        last_tile   <= (others => '1');
        map_tile    <= (others => '1');
        table_id    <= (others => '0');
        table_words <= (others => '0');
      end if;
      if rst = '1' then
        state       <= C_ST_IDLE;
        open_q      <= '0';
        have        <= '0';
        map_turn    <= '0';
      end if;
    end if;
  end process p_sequence;

  -- Tokens and time --------------------------------------------------------------------------------------------------
  p_time : process (clk)
  begin
    if rising_edge(clk) then
      -- x^32 + x^22 + x^2 + x + 1, maximal, 8 steps at once. Arguments are mixed in, the nonces of OPEN among them; and
      -- the milliseconds, so that it does not stay at zero. Which token comes depends on all that and on the time.
      dice <= dice(23 downto 0) & dice_next;
      if have = '1' and state = C_ST_WORDS then
        dice(7 downto 0) <= dice_next xor r_data;
      elsif ms_tick = '1' then
        dice(0) <= not dice_next(0);
      end if;

      turn_of  <= turn_of + 1;
      bucket_0 <= bucket_1;
      bucket_1 <= bucket_2;
      bucket_2 <= bucket_0;
      refill   <= refill(1 downto 0) & ms_tick;
      if turn_of = 2 then
        turn_of <= (others => '0');
      end if;
      if at_bucket = '1' and bucket_0 /= 0 then
        if refill = "000" then
          bucket_2 <= bucket_0 - 1;
        end if;
      elsif refill /= "000" and bucket_0 /= 15 then
        bucket_2 <= bucket_0 + 1;
      end if;

      ms_tick  <= to_sl(ms_clock = G_CLK_KHZ - 1);
      ms_clock <= ms_clock + 1;

      rows_short <= row_busy and not running;
      events(C_EV_WAIT_ROWS) <= '0';
      events(C_EV_WAIT_MAP) <= '0';
      if rows_short = '1' then
        rows_wait  <= rows_wait + 1;
        events(C_EV_WAIT_ROWS) <= to_sl(rows_wait = 255);
      end if;
      if engine_wait = '1' then
        map_wait   <= map_wait + 1;
        events(C_EV_WAIT_MAP) <= to_sl(map_wait = 255);
      end if;

      if rst = '1' then
        dice      <= x"5eed1234";
        turn_of   <= (others => '0');
        bucket_0  <= (others => '1');
        bucket_1  <= (others => '1');
        bucket_2  <= (others => '1');
        refill    <= (others => '0');
        rows_wait <= (others => '0');
        map_wait  <= (others => '0');
        events(C_EV_WAIT_ROWS) <= '0';
        events(C_EV_WAIT_MAP) <= '0';
      end if;
      if rst = '1' or ms_clock = G_CLK_KHZ - 1 then
        ms_clock <= (others => '0');
      end if;
    end if;
  end process p_time;

  lapse       <= ms_tick and to_sl(quiet_ms = G_SESSION_MS - 1);
  stuck       <= (expired and ms_tick) or (not open_q and (lapse or quiet_ms(10)));
  full_duplex <= duplex_mode(1) or (pin_full_duplex and not duplex_mode(0));
  session     <= open_q;

  events(15 downto 0)  <= (others => '0');
  events(21 downto 18) <= (others => '0');
  tick_ms              <= ms_tick;
  events(C_EV_BAD_SOURCE) <= '0';
  events(33 downto 32) <= (others => '0');
  events(39 downto 36) <= (others => '0');

  -- synthesis translate_off
  p_rules : process (clk)
  begin
    if rising_edge(clk) then
      assert rst = '1' or not is_x(state)
        report "responder: an unknown state"
        severity failure;
    end if;
  end process p_rules;
  -- synthesis translate_on

end architecture rtl;
