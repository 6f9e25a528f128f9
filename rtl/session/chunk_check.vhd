-- SPDX-License-Identifier: Apache-2.0
-- chunk_check: are `chunks` the chunks of G_CHUNK_PAIRS pairs that `pixels` pairs fill, the last one perhaps in part?
--   Structure : non-restoring division bit by bit, 24 clocks. Its quotient is compared with chunks as it appears, and
--               with one less than them; which of both is due, the remainder says. No quotient is kept
--   Control   : clear; then step 8 to 31 with run = '1', pixels and chunks still. fits is valid behind that
--   Reset     : none, clear is one
--   Golden    : sw/golden/chunk_check.hpp
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;

entity chunk_check is
  generic (
    G_CHUNK_PAIRS : integer := 704 -- 1 .. 1440
  );
  port (
    clk : in  std_logic;

    clear  : in  std_logic;
    run    : in  std_logic;
    step   : in  std_logic_vector(4 downto 0);
    pixels : in  std_logic_vector(23 downto 0);
    chunks : in  std_logic_vector(15 downto 0);
    fits   : out std_logic
  );
end entity chunk_check;

architecture rtl of chunk_check is

  constant C_REST_W : integer := clog2(G_CHUNK_PAIRS + 1) + 1;

  signal pixel_bits : std_logic_vector(31 downto 0);
  signal pixel_bit  : std_logic;
  signal chunk_bit  : std_logic;
  signal rest       : unsigned(C_REST_W - 1 downto 0); -- -G_CHUNK_PAIRS .. G_CHUNK_PAIRS-1
  signal rest_next  : unsigned(C_REST_W - 1 downto 0);
  signal same       : std_logic; -- chunks so far are the quotient
  signal one_more   : std_logic; -- chunks so far are the quotient + 1

begin

  assert G_CHUNK_PAIRS >= 1 and G_CHUNK_PAIRS <= 1440
    report "chunk_check: G_CHUNK_PAIRS"
           -- synthesis translate_off
           & "=" & integer'image(G_CHUNK_PAIRS)
           -- synthesis translate_on
           & " outside 1..1440"
    severity failure;

  pixel_bits <= x"00" & pixels;
  pixel_bit  <= pixel_bits(to_integer(not unsigned(step)));
  chunk_bit  <= step(4) and chunks(to_integer(not unsigned(step(3 downto 0))));
  rest_next  <= (rest(C_REST_W - 2 downto 0) & pixel_bit) - G_CHUNK_PAIRS when rest(C_REST_W - 1) = '0'
                else (rest(C_REST_W - 2 downto 0) & pixel_bit) + G_CHUNK_PAIRS;

  fits <= (same and to_sl(rest = 0 or rest = 2 ** C_REST_W - G_CHUNK_PAIRS)) or
          (one_more and to_sl(rest /= 0 and rest /= 2 ** C_REST_W - G_CHUNK_PAIRS));

  p_divide : process (clk)
  begin
    if rising_edge(clk) then
      if run = '1' then
        rest     <= rest_next;
        same     <= same and (chunk_bit xor rest_next(C_REST_W - 1));
        one_more <= (same and chunk_bit and rest_next(C_REST_W - 1))
                    or (one_more and not chunk_bit and not rest_next(C_REST_W - 1));
      end if;
      if clear = '1' then
        rest     <= (others => '0');
        same     <= '1';
        one_more <= '0';
      end if;
    end if;
  end process p_divide;

end architecture rtl;
