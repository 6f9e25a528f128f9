-- SPDX-License-Identifier: Apache-2.0
-- ram_deep: ram_sdp for many words, in parts of 2**k words. Block RAMs are 2**k words deep (32768 of 1 bit, 16384 of 2
--           bits, ..), so a part needs no multiplexer. Of any other depth, synthesis stacks short and wide blocks, with
--           a multiplexer over all of them.
--   Parts     : at most four, the largest power of two that fits first, up to 16384 if that is enough: 49280 words are
--               3 * 16384 + 512. A remainder that is less than 2048 words below a power of two is rounded up to it:
--               16000 words are 16384 (deep_part)
--   G_NINES   : number of low bits (a multiple of 9; 0: none) that parts from 8192 words on keep in a RAM of their own,
--               which fits into blocks of 4096 * 9 bits: 8 blocks for 9 bits of 32768 words instead of 9, and a
--               multiplexer
--   Latency   : G_LATENCY = 1 or 2 clocks from raddr to rdata. With 2 each part's block has its output register, and
--               the selection lies behind it, so that no logic waits for a block
--   Others    : collision, addresses and reset as ram_sdp
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;

entity ram_deep is
  generic (
    G_DATA_W  : integer := 16;
    G_DEPTH   : integer := 49280;
    G_NINES   : integer := 0;
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
end entity ram_deep;

architecture rtl of ram_deep is

  constant C_PARTS : integer := deep_parts(G_DEPTH);

  subtype t_parts is std_logic_vector(C_PARTS downto 0);

  signal w_reached : t_parts;
  signal r_reached : t_parts;
  -- What the parts show, with latency 2 from their output registers.
  signal words     : std_logic_vector(C_PARTS * G_DATA_W - 1 downto 0);
  signal chosen    : t_parts;

begin

  assert G_DATA_W >= 1
    report "ram_deep: G_DATA_W"
           -- synthesis translate_off
           & "=" & integer'image(G_DATA_W)
           -- synthesis translate_on
           & " below 1"
    severity failure;
  assert G_DEPTH >= 2
    report "ram_deep: G_DEPTH"
           -- synthesis translate_off
           & "=" & integer'image(G_DEPTH)
           -- synthesis translate_on
           & " below 2"
    severity failure;
  assert G_NINES >= 0 and G_NINES <= G_DATA_W and G_NINES mod 9 = 0
    report "ram_deep: G_NINES"
           -- synthesis translate_off
           & "=" & integer'image(G_NINES)
           -- synthesis translate_on
           & " is no multiple of 9 up to G_DATA_W"
    severity failure;
  assert G_LATENCY >= 1 and G_LATENCY <= 2
    report "ram_deep: G_LATENCY"
           -- synthesis translate_off
           & "=" & integer'image(G_LATENCY)
           -- synthesis translate_on
           & " outside 1..2"
    severity failure;

  w_reached <= deep_reached(waddr, G_DEPTH);

  g_parts : for i in 0 to C_PARTS - 1 generate
    constant C_SIZE   : integer := deep_part(G_DEPTH, i);
    constant C_PART_W : integer := clog2(C_SIZE);
    constant C_SPLIT  : boolean := G_NINES > 0 and G_NINES < G_DATA_W and C_SIZE >= 8192;
    signal we_part : std_logic;
  begin

    we_part <= we and w_reached(i) and not w_reached(i + 1);

    g_one : if not C_SPLIT generate

      u_part : entity work.ram_sdp
        generic map (G_DATA_W => G_DATA_W, G_DEPTH => C_SIZE, G_LATENCY => G_LATENCY)
        port map (
          clk   => clk,
          we    => we_part,
          waddr => waddr(C_PART_W - 1 downto 0),
          wdata => wdata,
          raddr => raddr(C_PART_W - 1 downto 0),
          rdata => words((i + 1) * G_DATA_W - 1 downto i * G_DATA_W)
        );

    end generate g_one;

    g_two : if C_SPLIT generate

      u_nines : entity work.ram_sdp
        generic map (G_DATA_W => G_NINES, G_DEPTH => C_SIZE, G_LATENCY => G_LATENCY)
        port map (
          clk   => clk,
          we    => we_part,
          waddr => waddr(C_PART_W - 1 downto 0),
          wdata => wdata(G_NINES - 1 downto 0),
          raddr => raddr(C_PART_W - 1 downto 0),
          rdata => words(i * G_DATA_W + G_NINES - 1 downto i * G_DATA_W)
        );

      u_rest : entity work.ram_sdp
        generic map (G_DATA_W => G_DATA_W - G_NINES, G_DEPTH => C_SIZE, G_LATENCY => G_LATENCY)
        port map (
          clk   => clk,
          we    => we_part,
          waddr => waddr(C_PART_W - 1 downto 0),
          wdata => wdata(G_DATA_W - 1 downto G_NINES),
          raddr => raddr(C_PART_W - 1 downto 0),
          rdata => words((i + 1) * G_DATA_W - 1 downto i * G_DATA_W + G_NINES)
        );

    end generate g_two;

  end generate g_parts;

  -- synthesis translate_off
  p_check : process (clk)
  begin
    if rising_edge(clk) then
      assert to_integer(unsigned(raddr)) < G_DEPTH and (we /= '1' or to_integer(unsigned(waddr)) < G_DEPTH)
        report "ram_deep: address beyond G_DEPTH"
        severity failure;
    end if;
  end process p_check;
  -- synthesis translate_on

  p_part : process (clk)
  begin
    if rising_edge(clk) then
      r_reached <= deep_reached(raddr, G_DEPTH);
    end if;
  end process p_part;

  g_direct : if G_LATENCY = 1 generate
    chosen <= r_reached;
  end generate g_direct;

  g_output_register : if G_LATENCY /= 1 generate

    p_chosen : process (clk)
    begin
      if rising_edge(clk) then
        chosen <= r_reached;
      end if;
    end process p_chosen;

  end generate g_output_register;

  rdata <= deep_word(words, chosen, G_DATA_W);

end architecture rtl;
