-- SPDX-License-Identifier: Apache-2.0
-- ram_wide: ram_sdp for a depth just above a few blocks of 2048 words of 18 bits. The low bits, in multiples of 18, lie
--           in such blocks and the words beyond the last block in LUT RAM, with a multiplexer over all; the bits above
--           lie in a RAM of the whole depth. 14352 words of 20 bits are 7 blocks, 16 words beside them and one block of
--           16384 * 2 bits; blocks of 16384 * 2 bits alone would be 10.
--   Otherwise : where that saves no block, more than 32 words lie beyond or the multiplexer has more than eight inputs,
--               just a ram_sdp
--   Latency   : G_LATENCY = 1 or 2 clocks; the multiplexer is behind the blocks, in front of the second register. The
--               bits above use the output register of their blocks (ram_sdp)
--   Others    : collision, addresses and reset as ram_sdp
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;

entity ram_wide is
  generic (
    G_DATA_W  : integer := 20;
    G_DEPTH   : integer := 14352;
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
end entity ram_wide;

architecture rtl of ram_wide is

  constant C_BLOCK : integer := 2048;                   -- words of a block
  constant C_LOW_W : integer := G_DATA_W / 18 * 18;
  constant C_TOP_W : integer := G_DATA_W - C_LOW_W;
  constant C_REST  : integer := G_DEPTH mod C_BLOCK;    -- words behind the blocks
  constant C_PARTS : integer := (G_DEPTH + C_BLOCK - 1) / C_BLOCK;

  -- Blocks of 36 kbit: 1024 words of 36 bits, 2048 of 18, 4096 of 9, 8192 of 4, 16384 of 2 or 32768 of 1.
  function blocks (width, depth : integer) return integer is
    variable v_bits  : integer := 36;
    variable v_words : integer := 1024;
    variable v_count : integer;
    variable v_least : integer;
  begin
    v_least := width * ((depth + 32767) / 32768);
    for i in 1 to 5 loop
      v_count := (width + v_bits - 1) / v_bits * ((depth + v_words - 1) / v_words);
      if v_count < v_least then
        v_least := v_count;
      end if;
      v_bits  := v_bits / 2;
      v_words := v_words * 2;
    end loop;
    return v_least;
  end function blocks;

  constant C_SPLIT : boolean := C_PARTS > 1 and C_PARTS <= 8 and C_REST <= 32
                                and C_LOW_W / 18 * (G_DEPTH / C_BLOCK) + blocks(C_TOP_W, G_DEPTH)
                                    < blocks(G_DATA_W, G_DEPTH);

begin

  assert G_DATA_W >= 1
    report "ram_wide: G_DATA_W"
           -- synthesis translate_off
           & "=" & integer'image(G_DATA_W)
           -- synthesis translate_on
           & " below 1"
    severity failure;
  assert G_DEPTH >= 2
    report "ram_wide: G_DEPTH"
           -- synthesis translate_off
           & "=" & integer'image(G_DEPTH)
           -- synthesis translate_on
           & " below 2"
    severity failure;
  assert G_LATENCY >= 1 and G_LATENCY <= 2
    report "ram_wide: G_LATENCY"
           -- synthesis translate_off
           & "=" & integer'image(G_LATENCY)
           -- synthesis translate_on
           & " outside 1..2"
    severity failure;

  g_one : if not C_SPLIT generate

    u_ram : entity work.ram_sdp
      generic map (G_DATA_W => G_DATA_W, G_DEPTH => G_DEPTH, G_LATENCY => G_LATENCY)
      port map (clk => clk, we => we, waddr => waddr, wdata => wdata, raddr => raddr, rdata => rdata);

  end generate g_one;

  g_split : if C_SPLIT generate
    constant C_BLOCK_W : integer := clog2(C_BLOCK);
    constant C_PICK_W  : integer := clog2(C_PARTS);
    constant C_WAYS    : integer := 2 ** C_PICK_W;        -- inputs of the multiplexer
    signal r_part : std_logic_vector(C_PICK_W - 1 downto 0);
    signal words  : std_logic_vector(C_WAYS * C_LOW_W - 1 downto 0);
    signal word   : std_logic_vector(C_LOW_W - 1 downto 0);
  begin

    g_parts : for i in 0 to C_WAYS - 1 generate
      signal we_part : std_logic;
    begin

      g_none : if i >= C_PARTS generate
        words((i + 1) * C_LOW_W - 1 downto i * C_LOW_W) <= (others => '0');
      end generate g_none;

      g_part : if i < C_PARTS generate
        -- A last part smaller than a block is rounded up, so that no address of the others lies beyond it.
        constant C_SHORT  : boolean := i = C_PARTS - 1 and C_REST > 0;
        constant C_PART_W : integer := clog2(C_REST) * boolean'pos(C_SHORT) + C_BLOCK_W * boolean'pos(not C_SHORT);
      begin

        we_part <= we and to_sl(unsigned(waddr(waddr'high downto C_BLOCK_W)) = i);

        u_part : entity work.ram_sdp
          generic map (G_DATA_W => C_LOW_W, G_DEPTH => 2 ** C_PART_W, G_LATENCY => 1)
          port map (
            clk   => clk,
            we    => we_part,
            waddr => waddr(C_PART_W - 1 downto 0),
            wdata => wdata(C_LOW_W - 1 downto 0),
            raddr => raddr(C_PART_W - 1 downto 0),
            rdata => words((i + 1) * C_LOW_W - 1 downto i * C_LOW_W)
          );

      end generate g_part;

    end generate g_parts;

    g_top : if C_TOP_W > 0 generate

      u_top : entity work.ram_sdp
        generic map (G_DATA_W => C_TOP_W, G_DEPTH => G_DEPTH, G_LATENCY => G_LATENCY)
        port map (
          clk   => clk,
          we    => we,
          waddr => waddr,
          wdata => wdata(G_DATA_W - 1 downto C_LOW_W),
          raddr => raddr,
          rdata => rdata(G_DATA_W - 1 downto C_LOW_W)
        );

    end generate g_top;

    p_part : process (clk)
    begin
      if rising_edge(clk) then
        r_part <= raddr(raddr'high downto C_BLOCK_W);
      end if;
    end process p_part;

    -- A tree, which becomes one LUT6 for four parts.
    p_pick : process (words, r_part)
      variable v_words : std_logic_vector(C_WAYS * C_LOW_W - 1 downto 0);
    begin
      v_words := words;
      for level in 0 to C_PICK_W - 1 loop
        for i in 0 to C_WAYS / 2 ** (level + 1) - 1 loop
          if r_part(level) = '1' then
            v_words((i + 1) * C_LOW_W - 1 downto i * C_LOW_W)
              := v_words((2 * i + 2) * C_LOW_W - 1 downto (2 * i + 1) * C_LOW_W);
          else
            v_words((i + 1) * C_LOW_W - 1 downto i * C_LOW_W)
              := v_words((2 * i + 1) * C_LOW_W - 1 downto 2 * i * C_LOW_W);
          end if;
        end loop;
      end loop;
      word <= v_words(C_LOW_W - 1 downto 0);
    end process p_pick;

    g_direct : if G_LATENCY = 1 generate
      rdata(C_LOW_W - 1 downto 0) <= word;
    end generate g_direct;

    g_output_register : if G_LATENCY /= 1 generate

      p_output : process (clk)
      begin
        if rising_edge(clk) then
          rdata(C_LOW_W - 1 downto 0) <= word;
        end if;
      end process p_output;

    end generate g_output_register;

    -- synthesis translate_off
    p_check : process (clk)
    begin
      if rising_edge(clk) then
        assert to_integer(unsigned(raddr)) < G_DEPTH and (we /= '1' or to_integer(unsigned(waddr)) < G_DEPTH)
          report "ram_wide: address beyond G_DEPTH"
          severity failure;
      end if;
    end process p_check;
    -- synthesis translate_on

  end generate g_split;

end architecture rtl;
