-- SPDX-License-Identifier: Apache-2.0
-- reply_builder: the bytes of a reply, one after the other, for packet_tx.
--   Header    : the request's bytes, but version, type, result and a zero, and OPEN's token; that of a map packet is
--               its READ's, with the chunk. From the frame, or from the session's memory
--   Body      : status block and bitmap, capabilities, counters, or cells of the map, which pass by
--   ICMP      : words 0 and 1, whose first and last bytes are the frame's, and the zero of the header
--   Rate      : a byte in 5 clocks (of the bitmap 11): its number goes out in C_ST_FETCH, it is shown in C_ST_SHOW;
--               cells one a clock
--   Reset     : none; every reply begins in C_ST_IDLE
--   Golden    : sw/golden/reply_builder.hpp
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;
  use work.link_pkg.all;

entity reply_builder is
  generic (
    G_ROW_SLOTS : integer := 70
  );
  port (
    clk : in  std_logic;

    -- message_sequencer
    state      : in  std_logic_vector(4 downto 0);
    step       : in  std_logic_vector(5 downto 0); -- clocks in C_ST_FETCH
    is_map     : in  std_logic;
    is_icmp    : in  std_logic;                    -- and port unreachable
    session_io : in  std_logic;
    peer_end   : in  std_logic;                    -- the reply begins
    fetched    : out std_logic;                    -- the byte is there
    body_cells : out std_logic;                    -- with the byte that is taken the header of a map packet is over
    reply_end  : out std_logic;                    -- .. the reply is

    -- message_rules
    only_header : in  std_logic; -- with C_ST_DECIDE: how long the reply is
    of_list     : in  std_logic;
    long_list   : in  std_logic;
    result      : in  std_logic_vector(2 downto 0);

    -- message_reader, session_memory
    m_kind      : in  std_logic_vector(1 downto 0);
    msg_type    : in  std_logic_vector(7 downto 0);
    reply_last  : in  std_logic;
    reply_zeros : in  std_logic;
    r_data      : in  std_logic_vector(7 downto 0);
    memory_byte : in  std_logic_vector(7 downto 0);
    bits        : in  std_logic_vector(7 downto 0); -- of the bitmap

    -- Bodies.
    status_words : in  std_logic_vector(32 * C_STATUS_WORDS - 1 downto 0);
    map_chunk    : in  std_logic_vector(15 downto 0);
    info_index   : out std_logic_vector(6 downto 0);
    info_byte    : in  std_logic_vector(7 downto 0);
    c_index      : out std_logic_vector(5 downto 0);
    c_valid      : in  std_logic;
    c_data       : in  std_logic_vector(31 downto 0);
    b_hold       : out std_logic; -- a status block is read: base, received and bitmap must be of one moment
    b_index      : out std_logic_vector(9 downto 0);
    f_valid      : in  std_logic;
    f_take       : out std_logic;
    f_data       : in  std_logic_vector(7 downto 0);
    f_last       : in  std_logic;

    -- packet_tx
    p_valid : out std_logic;
    p_ready : in  std_logic;
    p_data  : out std_logic_vector(7 downto 0);
    p_last  : out std_logic
  );
end entity reply_builder;

architecture rtl of reply_builder is

  -- Last words of a reply.
  constant C_HEADER_END : integer := C_HEADER_WORDS - 1;
  constant C_STATUS_END : integer := C_HEADER_WORDS + C_STATUS_WORDS + bitmap_words(G_ROW_SLOTS) - 1;
  constant C_INFO_END   : integer := C_HEADER_WORDS + C_INFO_WORDS - 1;
  constant C_COUNT_END  : integer := C_HEADER_WORDS + C_EVENTS - 1;
  constant C_OUT_W      : integer := reply_bits(G_ROW_SLOTS);
  constant C_BITMAP     : integer := C_HEADER_WORDS + C_STATUS_WORDS; -- its first word

  type t_bytes is array (63 downto 0) of std_logic_vector(7 downto 0);

  signal out_word   : unsigned(C_OUT_W - 1 downto 0);
  signal out_byte   : unsigned(1 downto 0);
  signal out_end    : unsigned(C_OUT_W - 1 downto 0);
  signal lists      : std_logic; -- the message is INFO or COUNTERS
  signal is_list    : std_logic; -- and their body is due
  signal in_header  : std_logic;
  signal in_bitmap  : std_logic;
  signal at_end     : std_logic;
  signal word_bytes : t_bytes;
  signal own_word   : std_logic; -- the chunk in the header of a map packet
  signal of_memory  : std_logic;
  signal byte_index : unsigned(5 downto 0);
  signal body_index : unsigned(5 downto 0); -- of a word in INFO and COUNTERS
  signal list_byte  : std_logic_vector(7 downto 0);
  signal head_byte  : std_logic_vector(7 downto 0);

begin

  -- Place in the reply ------------------------------------------------------------------------------------------------
  in_header  <= to_sl(out_word < C_HEADER_WORDS);
  in_bitmap  <= to_sl(out_word >= C_BITMAP) and not is_list and not is_map;
  is_list    <= lists and not in_header and not is_map;
  at_end     <= to_sl(out_word = out_end and out_byte = 3);
  body_cells <= is_map and not is_icmp and to_sl(out_word = C_HEADER_END and out_byte = 3);
  reply_end  <= at_end and not reply_last when is_icmp = '1' else
                at_end and not is_map;

  p_place : process (clk)
  begin
    if rising_edge(clk) then
      if state = C_ST_IDLE then
        lists    <= '0';
        out_word <= (others => '0');
        out_byte <= (others => '0');
        out_end  <= to_unsigned(C_STATUS_END, C_OUT_W);
      elsif state = C_ST_DECIDE then
        if of_list = '1' then
          lists <= long_list;
        end if;
        if only_header = '1' then
          out_end <= to_unsigned(C_HEADER_END, C_OUT_W);
        elsif of_list = '1' then
          out_end <= to_unsigned(C_INFO_END, C_OUT_W);
          if msg_type(2) = '1' then
            out_end <= to_unsigned(C_COUNT_END, C_OUT_W);
          end if;
        end if;
      elsif peer_end = '1' and m_kind = C_FRAME_CLOSED then
        out_word <= to_unsigned(2, C_OUT_W);
        out_byte <= "11";
      elsif state = C_ST_SHOW and p_ready = '1' then
        out_byte <= out_byte + 1;
        if out_byte = 3 then
          out_word <= out_word + 1;
        end if;
        if is_icmp = '1' then
          out_word <= (others => '0');
          out_byte <= "00";
          if reply_last = '1' then
            out_end  <= to_unsigned(1, C_OUT_W);
            out_word <= to_unsigned(1, C_OUT_W);
            out_byte <= "11";
          elsif at_end = '0' and reply_zeros = '1' then
            out_word <= to_unsigned(2, C_OUT_W);
            out_byte <= "11";
          end if;
        end if;
      end if;
    end if;
  end process p_place;

  -- Header ------------------------------------------------------------------------------------------------------------
  of_memory <= is_map or (session_io and to_sl(out_word(1 downto 0) = 1));

  p_head : process (out_word, out_byte, r_data, memory_byte, of_memory, msg_type, result)
  begin
    head_byte <= r_data;
    if of_memory = '1' then
      head_byte <= memory_byte;
    end if;
    if out_word(1 downto 0) = 0 and out_byte = 2 then
      head_byte <= C_VERSION;
    elsif out_word(1 downto 0) = 0 and out_byte = 3 then
      head_byte <= msg_type or C_MSG_REPLY;
    elsif out_word(1 downto 0) = 2 and out_byte = 2 then
      head_byte <= "00000" & result;
    elsif out_word(1 downto 0) = 2 and out_byte = 3 then
      head_byte <= x"00";
    end if;
  end process p_head;

  -- Bodies ------------------------------------------------------------------------------------------------------------
  body_index <= resize(out_word, 6) - C_HEADER_WORDS;
  c_index    <= std_logic_vector(body_index);
  info_index <= std_logic_vector(body_index(4 downto 0) & out_byte);
  list_byte  <= word_byte(c_data, out_byte) when msg_type(2) = '1' else
                info_byte;

  -- From the first word of a status block to the last.
  b_hold  <= not in_header and not lists and not is_map;
  b_index <= std_logic_vector(resize(out_word - C_BITMAP, 5) & out_byte & unsigned(step(2 downto 0)));

  -- Words 4 to 12; in word 3 the chunk of a map packet, where the request has its first one.
  g_status : for i in 0 to 4 * C_STATUS_WORDS - 1 generate
    word_bytes(4 * C_HEADER_WORDS + i) <= status_words(status_words'high - 8 * i downto status_words'high - 7 - 8 * i);
  end generate g_status;

  word_bytes(14) <= map_chunk(15 downto 8);
  word_bytes(15) <= map_chunk(7 downto 0);

  g_below : for i in 0 to 13 generate
    word_bytes(i) <= (others => '-');
  end generate g_below;

  g_above : for i in 4 * C_BITMAP to 63 generate
    word_bytes(i) <= (others => '-');
  end generate g_above;

  own_word   <= to_sl(out_word(0) = '1' and out_word(1) = '1' and out_byte(1) = '1') and is_map;
  byte_index <= out_word(3 downto 0) & out_byte;

  p_data <= f_data when state = C_ST_CELLS
            else head_byte when in_header = '1' and own_word = '0'
            else list_byte when is_list = '1'
            else bits when in_bitmap = '1'
            else word_bytes(to_integer(byte_index));

  p_valid <= f_valid when state = C_ST_CELLS else to_sl(state = C_ST_SHOW);
  p_last  <= f_last when state = C_ST_CELLS else at_end and not is_map;
  f_take  <= p_ready and to_sl(state = C_ST_CELLS);

  -- A byte is there three clocks after its number (later if a counter takes longer), one of the bitmap after its bits.
  fetched <= to_sl(unsigned(step) = 9) when in_bitmap = '1'
             else to_sl(unsigned(step) >= 3) and (c_valid or not is_list or not msg_type(2));

end architecture rtl;
