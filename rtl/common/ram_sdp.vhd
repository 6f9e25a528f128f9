-- SPDX-License-Identifier: Apache-2.0
-- ram_sdp: simple dual-port RAM, one write and one read port, one clock. All memories of the engine are behind this
--          entity or ram_2r, so that a device's own RAM macro needs one change only.
--   Rate      : one write and one read per clock
--   Latency   : G_LATENCY = 1 or 2 clocks from raddr to rdata (2: with the RAM's output register)
--   Collision : a word read in the clock in which it is written is undefined ('X' in simulation; synthesis sees a read
--               of the old word, the vendors' template). It must not be used: devices without read-first ports show
--               something else, or would pay with a bypass
--   Style     : block RAM; up to C_LUT_WORDS words LUT RAM (psweep_pkg)
--   Addresses : 0 .. G_DEPTH-1 in every clock, used or not; beyond, a simulation stops
--   Reset     : none; contents survive reset. Zero at the start of a VHDL simulation, random in the Verilated model
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;

entity ram_sdp is
  generic (
    G_DATA_W  : integer := 8;
    G_DEPTH   : integer := 512;
    G_LATENCY : integer := 1
  );
  port (
    clk   : in  std_logic;
    we    : in  std_logic;
    waddr : in  std_logic_vector(clog2(G_DEPTH) - 1 downto 0);
    wdata : in  std_logic_vector(G_DATA_W - 1 downto 0);
    raddr : in  std_logic_vector(clog2(G_DEPTH) - 1 downto 0);
    rdata : out std_logic_vector(G_DATA_W - 1 downto 0)
  );
end entity ram_sdp;

architecture rtl of ram_sdp is

  type t_memory is array (0 to G_DEPTH - 1) of std_logic_vector(G_DATA_W - 1 downto 0);

  signal read_word : std_logic_vector(G_DATA_W - 1 downto 0);

begin

  assert G_DATA_W >= 1
    report "ram_sdp: G_DATA_W"
           -- synthesis translate_off
           & "=" & integer'image(G_DATA_W)
           -- synthesis translate_on
           & " below 1"
    severity failure;
  assert G_DEPTH >= 1
    report "ram_sdp: G_DEPTH"
           -- synthesis translate_off
           & "=" & integer'image(G_DEPTH)
           -- synthesis translate_on
           & " below 1"
    severity failure;
  assert G_LATENCY >= 1 and G_LATENCY <= 2
    report "ram_sdp: G_LATENCY"
           -- synthesis translate_off
           & "=" & integer'image(G_LATENCY)
           -- synthesis translate_on
           & " outside 1..2"
    severity failure;

  -- The same twice: XST takes the style of a RAM as a literal.
  g_blocks : if G_DEPTH > C_LUT_WORDS generate
    -- The start value is for simulators only: in a netlist it would be one line a word.
    signal memory : t_memory
    -- synthesis translate_off
      := (others => (others => '0'))
    -- synthesis translate_on
      ;

    attribute ram_style : string;

    attribute ram_style of memory : signal is C_RAM_BLOCK;
  begin

    p_memory : process (clk)
    begin
      if rising_edge(clk) then
        if we = '1' then
          memory(to_integer(unsigned(waddr))) <= wdata;
        end if;
        read_word <= memory(to_integer(unsigned(raddr)));
        -- synthesis translate_off
        -- collision: kept in the Verilated models
        if we = '1' and waddr = raddr then
          read_word <= (others => 'X');
        end if;
        -- synthesis translate_on
      end if;
    end process p_memory;

  end generate g_blocks;

  g_luts : if G_DEPTH <= C_LUT_WORDS generate
    -- The start value is for simulators only: in a netlist it would be one line a word.
    signal memory : t_memory
    -- synthesis translate_off
      := (others => (others => '0'))
    -- synthesis translate_on
      ;

    attribute ram_style : string;

    attribute ram_style of memory : signal is C_RAM_LUT;
  begin

    p_memory : process (clk)
    begin
      if rising_edge(clk) then
        if we = '1' then
          memory(to_integer(unsigned(waddr))) <= wdata;
        end if;
        read_word <= memory(to_integer(unsigned(raddr)));
        -- synthesis translate_off
        -- collision: kept in the Verilated models
        if we = '1' and waddr = raddr then
          read_word <= (others => 'X');
        end if;
        -- synthesis translate_on
      end if;
    end process p_memory;

  end generate g_luts;

  g_direct : if G_LATENCY = 1 generate
    rdata <= read_word;
  end generate g_direct;

  g_output_register : if G_LATENCY /= 1 generate

    p_output : process (clk)
    begin
      if rising_edge(clk) then
        rdata <= read_word;
      end if;
    end process p_output;

  end generate g_output_register;

  -- synthesis translate_off
  p_rules : process (clk)
  begin
    if rising_edge(clk) then
      assert we /= 'X' and (we /= '1' or not is_x(waddr))
        report "ram_sdp: a write with an unknown enable or address"
        severity failure;
    end if;
  end process p_rules;
  -- synthesis translate_on

end architecture rtl;
