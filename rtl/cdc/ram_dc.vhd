-- SPDX-License-Identifier: Apache-2.0
-- ram_dc: simple dual-port RAM with two clocks, written in one and read in the other.
--   Rate      : one write per w_clk, one read per r_clk
--   Latency   : 1 r_clk from raddr to rdata
--   Collision : every bit of a word that is read while it is written is undefined, which simulation does not show. The
--               reader must know, by a handshake that passed a cdc_sync after the write, that the write is over
--   Addresses : 0 .. G_DEPTH-1 in every clock, used or not; beyond, a simulation stops
--   Reset     : none; contents survive reset. Zero at the start of a VHDL simulation, random in the Verilated model
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;

entity ram_dc is
  generic (
    G_DATA_W : integer := 8;
    G_DEPTH  : integer := 512
  );
  port (
    w_clk : in  std_logic;
    we    : in  std_logic;
    waddr : in  std_logic_vector(clog2(G_DEPTH) - 1 downto 0);
    wdata : in  std_logic_vector(G_DATA_W - 1 downto 0);
    r_clk : in  std_logic;
    raddr : in  std_logic_vector(clog2(G_DEPTH) - 1 downto 0);
    rdata : out std_logic_vector(G_DATA_W - 1 downto 0)
  );
end entity ram_dc;

architecture rtl of ram_dc is

  type t_memory is array (0 to G_DEPTH - 1) of std_logic_vector(G_DATA_W - 1 downto 0);

  -- The start value is for simulators only: in a netlist it would be one line a word.
  signal memory : t_memory
  -- synthesis translate_off
    := (others => (others => '0'))
  -- synthesis translate_on
    ;

  attribute ram_style : string;

  attribute ram_style of memory : signal is C_RAM_BLOCK;

begin

  assert G_DATA_W >= 1
    report "ram_dc: G_DATA_W"
           -- synthesis translate_off
           & "=" & integer'image(G_DATA_W)
           -- synthesis translate_on
           & " below 1"
    severity failure;
  assert G_DEPTH >= 1
    report "ram_dc: G_DEPTH"
           -- synthesis translate_off
           & "=" & integer'image(G_DEPTH)
           -- synthesis translate_on
           & " below 1"
    severity failure;

  p_write : process (w_clk)
  begin
    if rising_edge(w_clk) then
      if we = '1' then
        memory(to_integer(unsigned(waddr))) <= wdata;
      end if;
    end if;
  end process p_write;

  p_read : process (r_clk)
  begin
    if rising_edge(r_clk) then
      rdata <= memory(to_integer(unsigned(raddr)));
    end if;
  end process p_read;

end architecture rtl;
