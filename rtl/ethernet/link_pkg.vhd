-- SPDX-License-Identifier: Apache-2.0
-- link_pkg: numbers of the protocol (docs/protocol.md), sizes that follow from a chip's generics, and the arithmetic
--           that the entities of the Ethernet side share.
--   Golden : sw/net/protocol.hpp (numbers), sw/golden/ethernet.hpp (checksum)
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;

package link_pkg is

  -- What packet_rx shows and packet_tx sends.
  constant C_FRAME_ARP    : std_logic_vector(1 downto 0) := "00";
  constant C_FRAME_ICMP   : std_logic_vector(1 downto 0) := "01";
  constant C_FRAME_UDP    : std_logic_vector(1 downto 0) := "10";
  constant C_FRAME_CLOSED : std_logic_vector(1 downto 0) := "11"; -- UDP to a closed port; its reply

  -- Header of a message.
  constant C_MAGIC   : std_logic_vector(15 downto 0) := x"5053";
  constant C_VERSION : std_logic_vector(7 downto 0)  := x"02";

  constant C_MSG_OPEN     : std_logic_vector(7 downto 0) := x"01";
  constant C_MSG_CLOSE    : std_logic_vector(7 downto 0) := x"02";
  constant C_MSG_INFO     : std_logic_vector(7 downto 0) := x"03";
  constant C_MSG_COUNTERS : std_logic_vector(7 downto 0) := x"04";
  constant C_MSG_TABLE    : std_logic_vector(7 downto 0) := x"06";
  constant C_MSG_START    : std_logic_vector(7 downto 0) := x"07";
  constant C_MSG_WRITE    : std_logic_vector(7 downto 0) := x"08";
  constant C_MSG_READ     : std_logic_vector(7 downto 0) := x"09";
  constant C_MSG_RELEASE  : std_logic_vector(7 downto 0) := x"0a";
  constant C_MSG_SET      : std_logic_vector(7 downto 0) := x"0b"; -- the last one that a host sends
  constant C_MSG_MAP      : std_logic_vector(7 downto 0) := x"8c";
  constant C_MSG_REPLY    : std_logic_vector(7 downto 0) := x"80"; -- is set in every reply

  constant C_RESULT_OK          : std_logic_vector(2 downto 0) := "000";
  constant C_RESULT_BUSY        : std_logic_vector(2 downto 0) := "001";
  constant C_RESULT_NO_SESSION  : std_logic_vector(2 downto 0) := "010";
  constant C_RESULT_BAD_MESSAGE : std_logic_vector(2 downto 0) := "011";
  constant C_RESULT_ORDER       : std_logic_vector(2 downto 0) := "100";
  constant C_RESULT_NOT_READY   : std_logic_vector(2 downto 0) := "101";

  -- Counters: events(n) is counter n. Those of packet_rx are 0 to 15 in their order.
  constant C_EVENTS             : positive := 40;
  constant C_EV_BAD_MESSAGE     : natural  := 16;
  constant C_EV_FOREIGN         : natural  := 17;
  constant C_EV_SENT            : natural  := 18;
  constant C_EV_COLLISION       : natural  := 19;
  constant C_EV_LATE            : natural  := 20;
  constant C_EV_EXCESSIVE       : natural  := 21;
  constant C_EV_SESSION         : natural  := 22;
  constant C_EV_TIMEOUT         : natural  := 23;
  constant C_EV_WAIT_ROWS       : natural  := 24;
  constant C_EV_WAIT_MAP        : natural  := 25;
  constant C_EV_CHUNK_REPEATED  : natural  := 26;
  constant C_EV_CHUNK_REFUSED   : natural  := 27;
  constant C_EV_MAP_PACKET      : natural  := 28;
  constant C_EV_BAD_SOURCE      : natural  := 29;
  constant C_EV_LIMITED         : natural  := 30;
  constant C_EV_ANSWER          : natural  := 31;
  constant C_EV_RX_FRAGMENT     : natural  := 32;
  constant C_EV_DEFERRED        : natural  := 33;
  constant C_EV_UNREACHABLE     : natural  := 34;
  constant C_EV_RECOVERED       : natural  := 35;
  constant C_EV_RESYNCHRONISED  : natural  := 36;
  constant C_EV_RX_CLOCK_LOST   : natural  := 37;
  constant C_EV_TX_CLOCK_LOST   : natural  := 38;
  constant C_EV_TILE_FAILED     : natural  := 39;

  -- Bytes of a frame: sender's MAC; message; its arguments.
  constant C_AT_SENDER    : natural := 6;
  constant C_AT_MESSAGE   : natural := 42;
  constant C_AT_ARGUMENTS : natural := C_AT_MESSAGE + 16;

  -- Words of messages and replies.
  constant C_HEADER_WORDS : positive := 4;
  constant C_INFO_WORDS   : positive := 32;
  constant C_STATUS_WORDS : positive := 9;  -- without the bitmap
  constant C_JOB_WORDS    : positive := 18; -- registers of the engine in START
  constant C_START_FIELDS : positive := 3;  -- in front of them: table, pixels, chunks

  -- States of message_sequencer, which all parts of the responder see. Even parity: no upset of one bit makes another
  -- state of one.
  constant C_ST_IDLE   : std_logic_vector(4 downto 0) := "00000"; -- the next message, or the next chunk of the map
  constant C_ST_HEADER : std_logic_vector(4 downto 0) := "00011"; -- bytes 6 to 57 pass
  constant C_ST_DECIDE : std_logic_vector(4 downto 0) := "00101"; -- word = number and index
  constant C_ST_LIMIT  : std_logic_vector(4 downto 0) := "00110"; -- takes an answer from its bucket
  constant C_ST_WORDS  : std_logic_vector(4 downto 0) := "01001"; -- arguments pass
  constant C_ST_DIVIDE : std_logic_vector(4 downto 0) := "01010"; -- are these the chunks of so many pixels?
  constant C_ST_CHECK  : std_logic_vector(4 downto 0) := "01100"; -- the row buffer looks at the chunk
  constant C_ST_ROWS   : std_logic_vector(4 downto 0) := "01111"; -- pixels pass
  constant C_ST_WAIT   : std_logic_vector(4 downto 0) := "10001"; -- for packet_tx
  constant C_ST_PEER   : std_logic_vector(4 downto 0) := "10010"; -- the sender's addresses go to packet_tx
  constant C_ST_FETCH  : std_logic_vector(4 downto 0) := "10100"; -- one byte of the reply: address out ..
  constant C_ST_SHOW   : std_logic_vector(4 downto 0) := "10111"; -- .. and byte to packet_tx
  constant C_ST_CELLS  : std_logic_vector(4 downto 0) := "11000"; -- bytes of the map to packet_tx
  constant C_ST_DONE   : std_logic_vector(4 downto 0) := "11011"; -- the frame's slot is free
  constant C_ST_ABORT  : std_logic_vector(4 downto 0) := "11101"; -- engine, buffers and session
  constant C_ST_UNUSED : std_logic_vector(4 downto 0) := "11110"; -- the one code of even parity that is no state

  -- Bytes of a pair of pixels; pairs and bytes of a full WRITE.
  function pair_bytes (pix_w : integer) return integer;
  function chunk_pairs (chunk_bytes, pix_w : integer) return integer;
  function write_bytes (chunk_bytes, pix_w : integer) return integer;

  -- Bits and bytes of a cell: mask, plane, fraction, similarity; cells of a full MAP.
  function cell_bits (planes, frac_w, mncc_w : integer) return integer;
  function cell_bytes (cell_w : integer) return integer;
  function chunk_cells (chunk_bytes, cell_w : integer) return integer;

  -- Words of the bitmap in a status block, and bits of the number of a word of a reply.
  function bitmap_words (row_slots : integer) return integer;
  function reply_bits (row_slots : integer) return positive;

  -- Byte n of a word, big endian. Of a MAC address: bytes 0 and 1 are numbers 6 and 7, bytes 2 to 5 numbers 0 to 3.
  function word_byte (word : std_logic_vector(31 downto 0); n : unsigned(1 downto 0)) return std_logic_vector;
  function mac_byte_of (mac : std_logic_vector(47 downto 0); n : unsigned(2 downto 0)) return std_logic_vector;

  -- One byte into a ones' complement sum of 16 bits. The halves take turns: the upper one is added to, and becomes the
  -- lower one. Bit 16 is the carry, which waits for the next byte.
  function checksum_add (sum : unsigned(16 downto 0); data : std_logic_vector(7 downto 0)) return unsigned;

end package link_pkg;

package body link_pkg is

  function pair_bytes (pix_w : integer) return integer is
  begin
    return (2 * pix_w + 7) / 8;
  end function pair_bytes;

  function chunk_pairs (chunk_bytes, pix_w : integer) return integer is
  begin
    return chunk_bytes / pair_bytes(pix_w);
  end function chunk_pairs;

  function write_bytes (chunk_bytes, pix_w : integer) return integer is
  begin
    return chunk_pairs(chunk_bytes, pix_w) * pair_bytes(pix_w);
  end function write_bytes;

  function cell_bits (planes, frac_w, mncc_w : integer) return integer is
  begin
    return 1 + clog2(planes) + frac_w + mncc_w;
  end function cell_bits;

  function cell_bytes (cell_w : integer) return integer is
  begin
    return (cell_w + 7) / 8;
  end function cell_bytes;

  function chunk_cells (chunk_bytes, cell_w : integer) return integer is
  begin
    return chunk_bytes / cell_bytes(cell_w);
  end function chunk_cells;

  function bitmap_words (row_slots : integer) return integer is
  begin
    return (row_slots + 31) / 32;
  end function bitmap_words;

  function reply_bits (row_slots : integer) return positive is
  begin
    return clog2(C_HEADER_WORDS + imax(C_STATUS_WORDS + bitmap_words(row_slots), C_EVENTS));
  end function reply_bits;

  function word_byte (word : std_logic_vector(31 downto 0); n : unsigned(1 downto 0)) return std_logic_vector is
    variable v_byte : std_logic_vector(7 downto 0);
  begin
    if n = 0 then
      v_byte := word(31 downto 24);
    elsif n = 1 then
      v_byte := word(23 downto 16);
    elsif n = 2 then
      v_byte := word(15 downto 8);
    else
      v_byte := word(7 downto 0);
    end if;
    return v_byte;
  end function word_byte;

  function mac_byte_of (mac : std_logic_vector(47 downto 0); n : unsigned(2 downto 0)) return std_logic_vector is
    variable v_byte : std_logic_vector(7 downto 0);
  begin
    if n = 6 then
      v_byte := mac(47 downto 40);
    elsif n = 7 then
      v_byte := mac(39 downto 32);
    else
      v_byte := word_byte(mac(31 downto 0), n(1 downto 0));
    end if;
    return v_byte;
  end function mac_byte_of;

  function checksum_add (sum : unsigned(16 downto 0); data : std_logic_vector(7 downto 0)) return unsigned is
    variable v_add : unsigned(9 downto 0); -- the lowest bit brings the carry in
  begin
    v_add := ('0' & sum(15 downto 8) & '1') + ('0' & unsigned(data) & sum(16));
    return v_add(9) & sum(7 downto 0) & v_add(8 downto 1);
  end function checksum_add;

end package body link_pkg;
