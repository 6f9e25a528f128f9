-- SPDX-License-Identifier: Apache-2.0
-- ram_2r: true dual-port RAM, one port that writes or reads and one that reads, one clock. What two lanes share: while
--         a tile is swept nobody writes, so both ports of one block RAM are free to read.
--   Rate      : a: one write or read per clock; b: one read per clock
--   Latency   : 2 clocks from a_addr to a_rdata and from b_addr to b_rdata (with the RAM's output register)
--   Collision : in the clock of a write a_rdata is undefined, and so is b_rdata if b_addr is the word written ('X' in
--               simulation)
--   Addresses : 0 .. G_DEPTH-1 in every clock, whether or not the data are used; beyond, a simulation stops
--   Reset     : none; contents survive reset. Zero at the start of a VHDL simulation, random in the Verilated model
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;

entity ram_2r is
  generic (
    G_DATA_W : integer := 8;
    G_DEPTH  : integer := 512
  );
  port (
    clk     : in  std_logic;
    a_we    : in  std_logic;
    a_addr  : in  std_logic_vector(clog2(G_DEPTH) - 1 downto 0);
    a_wdata : in  std_logic_vector(G_DATA_W - 1 downto 0);
    a_rdata : out std_logic_vector(G_DATA_W - 1 downto 0);
    b_addr  : in  std_logic_vector(clog2(G_DEPTH) - 1 downto 0);
    b_rdata : out std_logic_vector(G_DATA_W - 1 downto 0)
  );
end entity ram_2r;

architecture rtl of ram_2r is

  type t_memory is array (0 to G_DEPTH - 1) of std_logic_vector(G_DATA_W - 1 downto 0);

  -- The start value is for simulators only: in a netlist it would be one line a word.
  signal memory : t_memory
  -- synthesis translate_off
    := (others => (others => '0'))
  -- synthesis translate_on
    ;

  signal a_word : std_logic_vector(G_DATA_W - 1 downto 0);
  signal b_word : std_logic_vector(G_DATA_W - 1 downto 0);

begin

  assert G_DATA_W >= 1
    report "ram_2r: G_DATA_W=" & integer'image(G_DATA_W) & " below 1"
    severity failure;
  assert G_DEPTH >= 1
    report "ram_2r: G_DEPTH=" & integer'image(G_DEPTH) & " below 1"
    severity failure;

  p_memory : process (clk)
  begin
    if rising_edge(clk) then
      if a_we = '1' then
        memory(to_integer(unsigned(a_addr))) <= a_wdata;
        a_word <= (others => 'X');
      else
        a_word <= memory(to_integer(unsigned(a_addr)));
      end if;
      if a_we = '1' and a_addr = b_addr then
        b_word <= (others => 'X');
      else
        b_word <= memory(to_integer(unsigned(b_addr)));
      end if;
      a_rdata <= a_word;
      b_rdata <= b_word;
    end if;
  end process p_memory;

  -- synthesis translate_off
  p_rules : process (clk)
  begin
    if rising_edge(clk) then
      assert a_we /= 'X' and (a_we /= '1' or not is_x(a_addr))
        report "ram_2r: a write with an unknown enable or address"
        severity failure;
    end if;
  end process p_rules;
  -- synthesis translate_on

end architecture rtl;
