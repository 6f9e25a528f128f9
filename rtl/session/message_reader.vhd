-- SPDX-License-Identifier: Apache-2.0
-- message_reader: reads a frame byte by byte from packet_rx's RAM and takes a message's header and arguments apart.
--   Order     : in C_ST_HEADER, C_ST_WORDS, C_ST_ROWS and C_ST_PEER one byte a clock; byte_place is the lower bits of
--               its number in the frame. In all other states the number stands still, at the byte that is needed next
--   Words     : the bytes pass through one shift register; word_full says that the byte on r_data is the last of a word
--   Lengths   : long_* compare the length of the message with what its type needs
--   Bitmap    : while a byte of a reply is fetched, b_bit is shifted into the lower byte of word instead
--   Reset     : nothing is read
--   Golden    : sw/golden/message_reader.hpp
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;
  use work.link_pkg.all;

entity message_reader is
  generic (
    G_PIX_W       : integer := 8;
    G_CHUNK_BYTES : integer := 1408 -- 16 .. 1440
  );
  port (
    clk : in  std_logic;
    rst : in  std_logic;

    state      : in  std_logic_vector(4 downto 0);
    idle_chunk : in  std_logic; -- the map's next chunk is sent: its header comes from the session's memory
    session_io : in  std_logic; -- the message's addresses and arguments are kept
    words_end  : in  std_logic; -- the arguments end with this word
    reply_step : in  std_logic; -- packet_tx has taken a byte
    recover    : in  std_logic;

    -- packet_rx
    m_kind   : in  std_logic_vector(1 downto 0);
    m_length : in  std_logic_vector(10 downto 0);
    r_addr   : out std_logic_vector(10 downto 0);
    r_data   : in  std_logic_vector(7 downto 0);
    b_bit    : in  std_logic;

    -- The byte on r_data.
    byte_valid : out std_logic;
    byte_place : out std_logic_vector(5 downto 0);
    word_full  : out std_logic;
    word_next  : out std_logic_vector(31 downto 0); -- word with that byte
    word       : out std_logic_vector(31 downto 0);
    word_count : out std_logic_vector(4 downto 0);  -- words of arguments so far, all ones stay
    header_end : out std_logic;                     -- it is the last one that the state needs
    rows_end   : out std_logic;
    peer_end   : out std_logic;

    -- The message.
    msg_type     : out std_logic_vector(7 downto 0);
    magic_ok     : out std_logic;
    version_ok   : out std_logic;
    ask_answer   : out std_logic;
    at_last      : out std_logic; -- the byte on r_data is its last one
    reply_last   : out std_logic; -- ICMP: the byte behind the one that is shown is the last one
    reply_zeros  : out std_logic; -- port unreachable: bytes 10 to 13 of the frame are replaced by zeros
    long_header  : out std_logic; -- a header, at least
    long_word    : out std_logic; -- and a word of arguments
    long_start   : out std_logic;
    long_write   : out std_logic; -- exactly a chunk of rows
    long_list    : out std_logic; -- INFO, COUNTERS: as long as the answer
    whole_words  : out std_logic
  );
end entity message_reader;

architecture rtl of message_reader is

  signal pos      : unsigned(10 downto 0); -- one ahead of the byte on r_data
  signal scanning : std_logic;
  signal have     : std_logic;
  signal place    : unsigned(5 downto 0);
  signal data     : std_logic_vector(31 downto 0);
  signal shifted  : std_logic_vector(31 downto 0);
  signal full     : std_logic;
  signal count    : unsigned(4 downto 0);
  signal kind     : std_logic_vector(7 downto 0);
  signal end_pos  : unsigned(10 downto 0); -- frame byte behind the message
  signal last     : std_logic;
  signal leave    : std_logic;             -- the state that reads ends with this byte
  signal of_head  : std_logic;
  signal of_rows  : std_logic;
  signal of_peer  : std_logic;

begin

  assert G_CHUNK_BYTES >= 16 and G_CHUNK_BYTES <= 1440
    report "message_reader: G_CHUNK_BYTES"
           -- synthesis translate_off
           & "=" & integer'image(G_CHUNK_BYTES)
           -- synthesis translate_on
           & " outside 16..1440"
    severity failure;

  scanning <= to_sl(state = C_ST_HEADER or state = C_ST_WORDS or state = C_ST_ROWS or state = C_ST_PEER);
  shifted  <= data(23 downto 0) & r_data;
  full     <= have and to_sl(place(1 downto 0) = 1); -- words begin at byte 6, 10, .., 42, .., 58, ..
  last     <= to_sl(pos = end_pos);

  -- Who sent the message is read once more behind it: MAC, IP, port, and of OPEN and READ the bytes to keep.
  of_head <= have and to_sl(state = C_ST_HEADER and place = C_AT_MESSAGE + 15);
  of_rows <= have and last and to_sl(state = C_ST_ROWS);
  of_peer <= have and to_sl(state = C_ST_PEER and
                            (place = 61 or (place = 57 and (session_io = '0' or kind(3) = '1'))));
  leave   <= of_head or of_rows or of_peer or (words_end and to_sl(state = C_ST_WORDS));

  -- Place in the frame ------------------------------------------------------------------------------------------------
  p_place : process (clk)
    -- What goes into the adder, and 1 if it counts.
    variable v_pos : unsigned(10 downto 0);
    variable v_inc : unsigned(0 downto 0);
  begin
    if rising_edge(clk) then
      v_pos    := pos;
      v_inc(0) := scanning;
      if state = C_ST_IDLE then
        v_pos   := to_unsigned(C_AT_SENDER, 11);
        end_pos <= unsigned(m_length) + C_AT_MESSAGE;
        if idle_chunk = '1' then
          v_pos := to_unsigned(C_AT_MESSAGE, 11);
        end if;
      elsif state = C_ST_DECIDE then
        v_pos := to_unsigned(C_AT_ARGUMENTS, 11);
      elsif state = C_ST_WAIT then
        v_pos := to_unsigned(C_AT_SENDER, 11);
      elsif of_peer = '1' then
        v_pos := to_unsigned(C_AT_MESSAGE, 11);
        v_inc := "0";
        if m_kind = C_FRAME_ICMP then
          v_pos   := to_unsigned(38, 11);
          end_pos <= unsigned(m_length) + 34;
        elsif m_kind = C_FRAME_CLOSED then -- four zeros in place of bytes 10 to 13
          v_pos   := to_unsigned(10, 11);
          end_pos <= to_unsigned(42, 11);
        end if;
      elsif reply_step = '1' then
        v_inc := "1";
      end if;
      pos   <= v_pos + v_inc;
      place <= pos(5 downto 0);
      have  <= scanning and not leave;
      if rst = '1' or recover = '1' then
        have <= '0';
      end if;
    end if;
  end process p_place;

  -- Words -------------------------------------------------------------------------------------------------------------
  p_words : process (clk)
  begin
    if rising_edge(clk) then
      if have = '1' then
        data <= shifted;
      elsif state = C_ST_FETCH then
        data(7 downto 0) <= data(6 downto 0) & b_bit; -- the first ones fall out again
      end if;
      if state = C_ST_IDLE then
        count <= (others => '0');
      elsif state = C_ST_WORDS and full = '1' and count /= 31 then
        count <= count + 1;
      end if;
    end if;
  end process p_words;

  -- Header ------------------------------------------------------------------------------------------------------------
  p_header : process (clk)
  begin
    if rising_edge(clk) then
      if idle_chunk = '1' then
        kind <= C_MSG_MAP;
      elsif state = C_ST_HEADER and have = '1' then
        if place = C_AT_MESSAGE + 3 then
          kind       <= r_data;
          magic_ok   <= to_sl(shifted(31 downto 16) = C_MAGIC);
          version_ok <= to_sl(shifted(15 downto 8) = C_VERSION);
        elsif place = C_AT_MESSAGE + 10 then
          ask_answer <= r_data(0);
        end if;
      end if;
    end if;
  end process p_header;

  long_header <= to_sl(end_pos >= C_AT_ARGUMENTS);
  long_word   <= to_sl(end_pos >= C_AT_ARGUMENTS + 4);
  long_start  <= to_sl(end_pos >= C_AT_ARGUMENTS + 4 * (C_START_FIELDS + C_JOB_WORDS));
  long_write  <= to_sl(end_pos = C_AT_ARGUMENTS + write_bytes(G_CHUNK_BYTES, G_PIX_W));
  long_list   <= to_sl(end_pos >= C_AT_ARGUMENTS + 4 * C_EVENTS) or
                 (to_sl(end_pos >= C_AT_ARGUMENTS + 4 * C_INFO_WORDS) and kind(0));
  whole_words <= to_sl(end_pos(1 downto 0) = 2); -- byte 42 is 2 mod 4

  reply_last  <= to_sl(pos + 2 = end_pos);
  reply_zeros <= to_sl(pos < 13) and m_kind(1);

  r_addr     <= std_logic_vector(pos);
  byte_valid <= have;
  byte_place <= std_logic_vector(place);
  word_full  <= full;
  word_next  <= shifted;
  word       <= data;
  word_count <= std_logic_vector(count);
  header_end <= of_head;
  rows_end   <= of_rows;
  peer_end   <= of_peer;
  msg_type   <= kind;
  at_last    <= last;

end architecture rtl;
