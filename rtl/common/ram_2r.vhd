-- SPDX-License-Identifier: Apache-2.0
-- ram_2r: true dual-port RAM with one clock: port a writes or reads, port b reads. Two lanes share one: while a tile is
--         swept nothing is written, so both ports of a block RAM are free to read.
--   Rate      : a: one write or read per clock; b: one read per clock
--   Latency   : 2 clocks from a_addr to a_rdata and from b_addr to b_rdata (with the output registers of the blocks)
--   Parts     : as ram_deep with latency 2: the selection lies behind these registers
--   Collision : in the clock of a write a_rdata is undefined, and so is b_rdata if b_addr is the word written ('X' in
--               simulation; synthesis sees a port that keeps its word while it writes and one that reads the old word)
--   Addresses : 0 .. G_DEPTH-1 in every clock, used or not; beyond, a simulation stops
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

  constant C_PARTS : integer := deep_parts(G_DEPTH);

  subtype t_parts is std_logic_vector(C_PARTS downto 0);

  signal a_now   : t_parts;
  signal a_part  : t_parts;
  signal b_part  : t_parts;
  signal a_words : std_logic_vector(C_PARTS * G_DATA_W - 1 downto 0);
  signal b_words : std_logic_vector(C_PARTS * G_DATA_W - 1 downto 0);
  -- A clock later.
  signal a_shown  : std_logic_vector(C_PARTS * G_DATA_W - 1 downto 0);
  signal b_shown  : std_logic_vector(C_PARTS * G_DATA_W - 1 downto 0);
  signal a_chosen : t_parts;
  signal b_chosen : t_parts;

begin

  assert G_DATA_W >= 1
    report "ram_2r: G_DATA_W"
           -- synthesis translate_off
           & "=" & integer'image(G_DATA_W)
           -- synthesis translate_on
           & " below 1"
    severity failure;
  assert G_DEPTH >= 1
    report "ram_2r: G_DEPTH"
           -- synthesis translate_off
           & "=" & integer'image(G_DEPTH)
           -- synthesis translate_on
           & " below 1"
    severity failure;

  a_now <= deep_reached(a_addr, G_DEPTH);

  g_parts : for i in 0 to C_PARTS - 1 generate
    constant C_SIZE   : integer := deep_part(G_DEPTH, i);
    constant C_PART_W : integer := clog2(C_SIZE);

    type t_memory is array (0 to C_SIZE - 1) of std_logic_vector(G_DATA_W - 1 downto 0);

    -- The start value is for simulators only: in a netlist it would be one line a word.
    signal memory : t_memory
    -- synthesis translate_off
      := (others => (others => '0'))
    -- synthesis translate_on
      ;

    attribute ram_style : string;

    attribute ram_style of memory : signal is C_RAM_BLOCK;

    signal we     : std_logic;
    signal a_low  : std_logic_vector(C_PART_W - 1 downto 0);
    signal b_low  : std_logic_vector(C_PART_W - 1 downto 0);
    signal a_word : std_logic_vector(G_DATA_W - 1 downto 0);
    signal b_word : std_logic_vector(G_DATA_W - 1 downto 0);
  begin

    we    <= a_we and a_now(i) and not a_now(i + 1);
    a_low <= a_addr(C_PART_W - 1 downto 0);
    b_low <= b_addr(C_PART_W - 1 downto 0);

    p_memory : process (clk)
    begin
      if rising_edge(clk) then
        if we = '1' then
          memory(to_integer(unsigned(a_low))) <= a_wdata;
        end if;
        -- Not an else branch of the write: GHDL 2.0 makes a read register of it whose enable is we itself.
        if we = '0' then
          a_word <= memory(to_integer(unsigned(a_low)));
        end if;
        b_word <= memory(to_integer(unsigned(b_low)));
        -- synthesis translate_off
        -- collision: kept in the Verilated models
        if we = '1' then
          a_word <= (others => 'X');
          if a_low = b_low then
            b_word <= (others => 'X');
          end if;
        end if;
        -- synthesis translate_on
      end if;
    end process p_memory;

    a_words((i + 1) * G_DATA_W - 1 downto i * G_DATA_W) <= a_word;
    b_words((i + 1) * G_DATA_W - 1 downto i * G_DATA_W) <= b_word;

  end generate g_parts;

  p_output : process (clk)
  begin
    if rising_edge(clk) then
      a_part   <= a_now;
      b_part   <= deep_reached(b_addr, G_DEPTH);
      a_shown  <= a_words;
      b_shown  <= b_words;
      a_chosen <= a_part;
      b_chosen <= b_part;
    end if;
  end process p_output;

  a_rdata <= deep_word(a_shown, a_chosen, G_DATA_W);
  b_rdata <= deep_word(b_shown, b_chosen, G_DATA_W);

  -- synthesis translate_off
  p_rules : process (clk)
  begin
    if rising_edge(clk) then
      assert to_integer(unsigned(a_addr)) < G_DEPTH and to_integer(unsigned(b_addr)) < G_DEPTH
        report "ram_2r: address beyond G_DEPTH"
        severity failure;
      assert a_we /= 'X' and (a_we /= '1' or not is_x(a_addr))
        report "ram_2r: a write with an unknown enable or address"
        severity failure;
    end if;
  end process p_rules;
  -- synthesis translate_on

end architecture rtl;
