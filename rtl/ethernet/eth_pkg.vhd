-- SPDX-License-Identifier: Apache-2.0
-- eth_pkg: CRC-32 of Ethernet (IEEE 802.3, 3.2.9), four bits a step, as a nibble of MII brings them.
--   Format  : reflected register (bit 0 leaves first), polynomial 0xEDB88320, start all ones; FCS = not register, sent
--             bit 0 first, i.e. least significant byte and low nibble first
--   Cost    : one step is an exclusive-or of the shifted register with constants chosen by 4 index bits
library ieee;
  use ieee.std_logic_1164.all;

package eth_pkg is

  -- Register after a good frame with its FCS.
  constant C_CRC_RESIDUE : std_logic_vector(31 downto 0) := x"DEBB20E3";

  -- One step with index = crc(3:0) xor nibble. Index 0 only shifts.
  function crc32_index (crc : std_logic_vector(31 downto 0); index : std_logic_vector(3 downto 0))
    return std_logic_vector;

  function crc32_nibble (crc : std_logic_vector(31 downto 0); nibble : std_logic_vector(3 downto 0))
    return std_logic_vector;

end package eth_pkg;

package body eth_pkg is

  constant C_POLYNOMIAL : std_logic_vector(31 downto 0) := x"EDB88320";

  -- What bit n of the index adds after four steps.
  function index_term (n : natural) return std_logic_vector is
    variable v_crc : std_logic_vector(31 downto 0) := (others => '0');
    variable v_bit : std_logic;
  begin
    v_crc(n) := '1';
    for i in 0 to 3 loop
      v_bit := v_crc(0);
      v_crc := '0' & v_crc(31 downto 1);
      if v_bit = '1' then
        v_crc := v_crc xor C_POLYNOMIAL;
      end if;
    end loop;
    return v_crc;
  end function index_term;

  constant C_TERM_0 : std_logic_vector(31 downto 0) := index_term(0);
  constant C_TERM_1 : std_logic_vector(31 downto 0) := index_term(1);
  constant C_TERM_2 : std_logic_vector(31 downto 0) := index_term(2);
  constant C_TERM_3 : std_logic_vector(31 downto 0) := index_term(3);

  function crc32_index (crc : std_logic_vector(31 downto 0); index : std_logic_vector(3 downto 0))
    return std_logic_vector is
    variable v_crc : std_logic_vector(31 downto 0);
  begin
    v_crc := "0000" & crc(31 downto 4);
    for k in 0 to 31 loop
      if C_TERM_0(k) = '1' then
        v_crc(k) := v_crc(k) xor index(0);
      end if;
      if C_TERM_1(k) = '1' then
        v_crc(k) := v_crc(k) xor index(1);
      end if;
      if C_TERM_2(k) = '1' then
        v_crc(k) := v_crc(k) xor index(2);
      end if;
      if C_TERM_3(k) = '1' then
        v_crc(k) := v_crc(k) xor index(3);
      end if;
    end loop;
    return v_crc;
  end function crc32_index;

  function crc32_nibble (crc : std_logic_vector(31 downto 0); nibble : std_logic_vector(3 downto 0))
    return std_logic_vector is
  begin
    return crc32_index(crc, crc(3 downto 0) xor nibble);
  end function crc32_nibble;

end package body eth_pkg;
