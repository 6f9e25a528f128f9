-- SPDX-License-Identifier: Apache-2.0
-- crc_step: eth_pkg as ports, for tb/formal/crc_step.sv. No circuit of its own.
library ieee;
  use ieee.std_logic_1164.all;
  use work.eth_pkg.all;

entity crc_step is
  port (
    crc      : in  std_logic_vector(31 downto 0);
    nibble   : in  std_logic_vector(3 downto 0);
    crc_next : out std_logic_vector(31 downto 0);
    residue  : out std_logic_vector(31 downto 0)
  );
end entity crc_step;

architecture rtl of crc_step is

begin

  crc_next <= crc32_nibble(crc, nibble);
  residue  <= C_CRC_RESIDUE;

end architecture rtl;
