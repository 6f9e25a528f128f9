-- SPDX-License-Identifier: Apache-2.0
-- async_fifo: carries 2**G_DEPTH_LOG2 words between two clocks of any ratio.
--   Rate     : one word per clock of the slower side, from a depth of 8 on
--   Latency  : a word shows at the second r_clk edge after the w_clk edge that took it (at the third if the first came
--              too close); a place is free again at the second or third w_clk edge after its word was taken
--   Contract : r_valid never waits for r_ready; a word shown holds until it is taken (or a reset). First word falls
--              through: r_data is valid while r_valid = '1', straight from the array (constraints/crossings.md).
--   Pointers : gray counters with one bit more than the address, without a binary copy: both sides address the array in
--              gray order, and the next code of up to 5 bits is one LUT6 per bit
--   Reset    : w_rst and r_rst are synchronous to their clocks and last at least one clock (the first one after
--              power-on at least 3 clocks, on both sides). Either one empties the FIFO and stops both sides (w_ready =
--              r_valid = '0') until both have seen it. As a pointer jumps only while the other side stands still,
--              resets of one side or of both in any order neither invent words nor keep any. A reset is over at most 8
--              w_clk plus 8 r_clk after it has ended; both clocks must run for that. One that begins before the last
--              one of its side is over counts as part of it.
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;

entity async_fifo is
  generic (
    G_DATA_W     : integer := 9;
    G_DEPTH_LOG2 : integer := 2
  );
  port (
    w_clk   : in  std_logic;
    w_rst   : in  std_logic;
    w_valid : in  std_logic;
    w_ready : out std_logic;
    w_data  : in  std_logic_vector(G_DATA_W - 1 downto 0);
    r_clk   : in  std_logic;
    r_rst   : in  std_logic;
    r_valid : out std_logic;
    r_ready : in  std_logic;
    r_data  : out std_logic_vector(G_DATA_W - 1 downto 0)
  );
end entity async_fifo;

architecture rtl of async_fifo is

  constant C_TOP : integer := G_DEPTH_LOG2; -- highest bit of a pointer: the lap

  subtype t_pointer is std_logic_vector(C_TOP downto 0);

  type t_memory is array (natural range 0 to 2 ** G_DEPTH_LOG2 - 1) of std_logic_vector(G_DATA_W - 1 downto 0);

  -- The start value is for simulators only: in a netlist it would be one line a word.
  signal memory : t_memory
  -- synthesis translate_off
    := (others => (others => '0'))
  -- synthesis translate_on
    ;

  -- Pointers: of the next word to write and to read, and as the other side sees them.
  signal w_gray      : t_pointer;
  signal r_gray      : t_pointer;
  signal w_gray_at_r : t_pointer;
  signal r_gray_at_w : t_pointer;

  -- Reset handshakes, one begun by each side: request, its copy at the other side, the answer back here.
  signal w_request      : std_logic;
  signal w_request_at_r : std_logic;
  signal w_answer       : std_logic;
  signal r_request      : std_logic;
  signal r_request_at_w : std_logic;
  signal r_answer       : std_logic;

  signal w_clear   : std_logic;
  signal r_clear   : std_logic;
  signal w_hold    : std_logic;
  signal r_hold    : std_logic;
  signal w_zero    : std_logic;
  signal r_zero    : std_logic;
  signal w_full    : std_logic;
  signal r_empty   : std_logic;
  signal w_take    : std_logic;
  signal r_take    : std_logic;
  signal w_address : unsigned(G_DEPTH_LOG2 - 1 downto 0);
  signal r_address : unsigned(G_DEPTH_LOG2 - 1 downto 0);

  -- Everything that crosses, before and after: pointer, request, answer.
  signal to_r : std_logic_vector(C_TOP + 2 downto 0);
  signal at_r : std_logic_vector(C_TOP + 2 downto 0);
  signal to_w : std_logic_vector(C_TOP + 2 downto 0);
  signal at_w : std_logic_vector(C_TOP + 2 downto 0);

  function gray_next (gray : t_pointer) return t_pointer is
    variable v_count : unsigned(C_TOP downto 0);
  begin
    v_count        := (others => '0'); -- else the netlist begins with unknown bits, on which Verilator stops
    v_count(C_TOP) := gray(C_TOP);
    for i in C_TOP - 1 downto 0 loop
      v_count(i) := v_count(i + 1) xor gray(i);
    end loop;
    v_count := v_count + 1;
    return std_logic_vector(v_count xor ('0' & v_count(C_TOP downto 1)));
  end function gray_next;

  -- The codes of the second lap are those of the first mirrored; folding the two upper bits makes both alike.
  function address_of (gray : t_pointer) return unsigned is
  begin
    return unsigned(std_logic_vector'((gray(C_TOP) xor gray(C_TOP - 1)) & gray(C_TOP - 2 downto 0)));
  end function address_of;

begin

  assert G_DATA_W >= 1
    report "async_fifo: G_DATA_W"
           -- synthesis translate_off
           & "=" & integer'image(G_DATA_W)
           -- synthesis translate_on
           & " below 1"
    severity failure;
  assert G_DEPTH_LOG2 >= 2 and G_DEPTH_LOG2 <= 6
    report "async_fifo: G_DEPTH_LOG2"
           -- synthesis translate_off
           & "=" & integer'image(G_DEPTH_LOG2)
           -- synthesis translate_on
           & " outside 2..6"
    severity failure;

  -- Crossings.
  to_r <= w_gray & w_request & r_request_at_w;
  to_w <= r_gray & r_request & w_request_at_r;

  u_to_r : entity work.cdc_sync
    generic map (
      G_WIDTH  => C_TOP + 3,
      G_STAGES => 2
    )
    port map (
      clk => r_clk,
      d   => to_r,
      q   => at_r
    );

  u_to_w : entity work.cdc_sync
    generic map (
      G_WIDTH  => C_TOP + 3,
      G_STAGES => 2
    )
    port map (
      clk => w_clk,
      d   => to_w,
      q   => at_w
    );

  w_gray_at_r    <= at_r(C_TOP + 2 downto 2);
  w_request_at_r <= at_r(1);
  r_answer       <= at_r(0);
  r_gray_at_w    <= at_w(C_TOP + 2 downto 2);
  r_request_at_w <= at_w(1);
  w_answer       <= at_w(0);

  -- A side stands still while a reset begun by either side goes on; its pointer jumps to zero when it knows that the
  -- other one stands still.
  w_hold  <= w_rst or w_request or w_answer or r_request_at_w;
  w_clear <= w_answer or r_request_at_w;
  w_zero  <= to_sl(unsigned(w_gray) = 0);
  r_hold  <= r_rst or r_request or r_answer or w_request_at_r;
  r_clear <= r_answer or w_request_at_r;
  r_zero  <= to_sl(unsigned(r_gray) = 0);

  -- Full: same place, other lap.
  w_full <= to_sl(w_gray(C_TOP downto C_TOP - 1) = not r_gray_at_w(C_TOP downto C_TOP - 1)
                   and w_gray(C_TOP - 2 downto 0) = r_gray_at_w(C_TOP - 2 downto 0));
  r_empty <= to_sl(r_gray = w_gray_at_r);

  w_ready   <= not w_full and not w_hold;
  w_take    <= w_valid and not w_full and not w_hold;
  w_address <= address_of(w_gray);
  r_valid   <= not r_empty and not r_hold;
  r_take    <= r_ready and not r_empty and not r_hold;
  r_address <= address_of(r_gray);
  r_data    <= memory(to_integer(r_address));

  p_write : process (w_clk)
  begin
    if rising_edge(w_clk) then
      if w_take = '1' then
        memory(to_integer(w_address)) <= w_data;
        w_gray                        <= gray_next(w_gray);
      end if;
      if w_clear = '1' then
        w_gray <= (others => '0');
      end if;
      -- The request ends after the pointer's jump, so that the reader cannot see them the other way round; and the
      -- next one begins when the last answer is gone, else that would end it at once.
      if w_rst = '1' and w_answer /= '1' then
        w_request <= '1';
      elsif w_rst = '0' and w_answer = '1' and w_zero = '1' then
        w_request <= '0';
      end if;
    end if;
  end process p_write;

  p_read : process (r_clk)
  begin
    if rising_edge(r_clk) then
      if r_take = '1' then
        r_gray <= gray_next(r_gray);
      end if;
      if r_clear = '1' then
        r_gray <= (others => '0');
      end if;
      if r_rst = '1' and r_answer /= '1' then
        r_request <= '1';
      elsif r_rst = '0' and r_answer = '1' and r_zero = '1' then
        r_request <= '0';
      end if;
    end if;
  end process p_read;

end architecture rtl;
