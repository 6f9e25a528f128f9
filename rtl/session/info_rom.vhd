-- SPDX-License-Identifier: Apache-2.0
-- info_rom: the capabilities that INFO answers with (docs/protocol.md): a ROM of what follows from the generics, and
--           the own MAC address, which depends on pins.
--   Latency : none
--   Golden  : sw/golden/info_rom.hpp
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;
  use work.link_pkg.all;

entity info_rom is
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
    G_CHUNK_BYTES : integer := 1408;
    G_ROW_SLOTS   : integer := 70;
    G_MAP_DEPTH   : integer := 33280;
    G_RX_SLOTS    : integer := 2;
    G_SESSION_MS  : integer := 10000
  );
  port (
    own_mac : in  std_logic_vector(47 downto 0);
    index   : in  std_logic_vector(6 downto 0); -- byte of INFO's words, big endian
    data    : out std_logic_vector(7 downto 0)
  );
end entity info_rom;

architecture rtl of info_rom is

  constant C_CELL_W : integer := cell_bits(G_PLANES, G_FRAC_W, G_MNCC_W);

  -- Capabilities. Words 14 and 15 are the address, which depends on pins.
  type t_words is array (C_INFO_WORDS - 1 downto 0) of std_logic_vector(31 downto 0);
  function info_words return t_words is
    variable v_words : t_words;
  begin
    v_words     := (others => (others => '0'));
    v_words(0)  := x"00" & C_VERSION & std_logic_vector(to_unsigned(C_INFO_WORDS, 16));
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
    v_words(19) := std_logic_vector(to_unsigned(chunk_pairs(G_CHUNK_BYTES, G_PIX_W), 32));
    v_words(20) := std_logic_vector(to_unsigned(G_ROW_SLOTS, 32));
    v_words(21) := std_logic_vector(to_unsigned(cell_bytes(C_CELL_W), 32));
    v_words(22) := std_logic_vector(to_unsigned(chunk_cells(G_CHUNK_BYTES, C_CELL_W), 32));
    v_words(23) := std_logic_vector(to_unsigned(G_MAP_DEPTH, 32));
    v_words(24) := std_logic_vector(to_unsigned(G_SESSION_MS, 32));
    v_words(25) := std_logic_vector(to_unsigned(G_RX_SLOTS, 32));
    v_words(26) := std_logic_vector(to_unsigned(C_EVENTS, 32));
    v_words(27) := std_logic_vector(to_unsigned(G_RECTIFIED, 32));
    return v_words;
  end function info_words;
  constant C_INFO_TABLE : t_words := info_words;

  type t_info is array (4 * C_INFO_WORDS - 1 downto 0) of std_logic_vector(7 downto 0);
  function info_bytes return t_info is
    variable v_bytes : t_info;
  begin
    for i in 0 to 4 * C_INFO_WORDS - 1 loop
      v_bytes(i) := C_INFO_TABLE(i / 4)(31 - 8 * (i mod 4) downto 24 - 8 * (i mod 4));
    end loop;
    return v_bytes;
  end function info_bytes;
  constant C_INFO_BYTES : t_info := info_bytes;

  signal word : unsigned(4 downto 0);

begin

  assert G_RX_SLOTS = 2 or G_RX_SLOTS = 4
    report "info_rom: G_RX_SLOTS"
           -- synthesis translate_off
           & "=" & integer'image(G_RX_SLOTS)
           -- synthesis translate_on
           & " is neither 2 nor 4"
    severity failure;

  word <= unsigned(index(6 downto 2));
  data <= mac_byte_of(own_mac, not word(0) & unsigned(index(1 downto 0)))
               when (word = 14 and index(1) = '1') or word = 15
          else C_INFO_BYTES(to_integer(unsigned(index)));

end architecture rtl;
