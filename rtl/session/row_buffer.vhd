-- SPDX-License-Identifier: Apache-2.0
-- row_buffer: collects the pixel pairs of one tile, written in chunks of any order, read in raster order
--             (docs/protocol.md, 'Data').
--   Window   : chunks base .. base+G_SLOTS-1 have a place; chunk c lies in slot c mod G_SLOTS. A chunk is freed when
--              its last pair is read. With G_SLOTS >= open_chunks nothing is ever overwritten
--   Layout   : pair p of slot s at word p * G_SLOTS + s. So a chunk's address starts with its slot number and grows
--              by G_SLOTS: no product anywhere, for any G_SLOTS and G_CHUNK_PAIRS
--   Bits     : one per chunk ("is there"), number c mod 2^clog2(G_SLOTS), in a RAM of three copies, one for each
--              reader: the check of a new chunk, the status bitmap, the output. Zero outside the window
--   Writing  : w_check (not in the clock of a w_commit) is answered two clocks later, until the next w_check (clear and
--              open_tile withdraw w_new). Then follow G_CHUNK_PAIRS * C_PAIR_BYTES bytes, {left, right} big endian, and
--              w_commit. w_repeated is also true for consumed chunks of a finished tile
--   Bitmap   : b_bit shows b_index two clocks later, index 0 being the base. While b_hold no chunk ends, so that base,
--              received and all bits read meanwhile are of one moment (the output waits at the end of its chunk).
--              Without it a bit that changes in between is old or new ('X' in simulation in the clock of its reading)
--   Output   : one pair per clock while chunks are there; one clock late if the last pair of a chunk is due in the
--              clock of a w_check or w_commit. m_tdata has left in the low half. First pair 3 clocks after go
--   busy     : from open_tile until the last pair is taken and all bits are zero again (2^clog2(G_SLOTS) clocks after
--              it was read); after clear and after reset the same number of clocks
--   complete : before go: all chunks of the tile or all slots are full. After go it has no meaning
--   clear    : obeyed in every clock; a pair on m_* vanishes
--   fail     : the launched tile has failed in the engine: if its rows, or its last pair, are still here, as clear.
--              Rows of the next tile stay
--   staged   : from the clock after open_tile until go
--   Upsets   : idle, clearing, staged and running differ in two bits. Any other code, and a chunk whose last pair was
--              not read from the slot of base, act as clear and set recovered for one clock. A tile inside is lost
--   Golden   : sw/golden/row_buffer.hpp
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;
  use work.link_pkg.all;

entity row_buffer is
  generic (
    G_PIX_W       : integer := 8;
    G_CHUNK_PAIRS : integer := 704;
    G_SLOTS       : integer := 70
  );
  port (
    clk : in  std_logic;
    rst : in  std_logic;

    clear       : in  std_logic;
    open_tile   : in  std_logic;
    open_pixels : in  std_logic_vector(23 downto 0);
    open_chunks : in  std_logic_vector(15 downto 0);
    fail        : in  std_logic;
    recovered   : out std_logic;
    busy        : out std_logic;
    staged      : out std_logic;
    base        : out std_logic_vector(15 downto 0); -- chunks consumed
    received    : out std_logic_vector(15 downto 0); -- chunks stored, consumed ones included

    w_check    : in  std_logic;
    w_chunk    : in  std_logic_vector(15 downto 0);
    w_new      : out std_logic;
    w_repeated : out std_logic;
    w_valid    : in  std_logic;
    w_data     : in  std_logic_vector(7 downto 0);
    w_commit   : in  std_logic;

    b_hold  : in  std_logic;
    b_index : in  std_logic_vector(9 downto 0);
    b_bit   : out std_logic;

    complete : out std_logic;
    go       : in  std_logic;
    m_tvalid : out std_logic;
    m_tready : in  std_logic;
    m_tdata  : out std_logic_vector(2 * G_PIX_W - 1 downto 0);
    m_tlast  : out std_logic
  );
end entity row_buffer;

architecture rtl of row_buffer is

  constant C_PAIR_W     : integer := 2 * G_PIX_W;
  constant C_PAIR_BYTES : integer := pair_bytes(G_PIX_W);
  constant C_DEPTH      : integer := G_SLOTS * G_CHUNK_PAIRS;
  constant C_ADDR_W     : integer := clog2(C_DEPTH);
  constant C_SLOT_W     : integer := clog2(G_SLOTS);
  constant C_BITS       : integer := 2 ** C_SLOT_W;
  constant C_LAST       : integer := (G_CHUNK_PAIRS - 1) * G_SLOTS; -- address of the last pair in slot 0

  -- State of the tile: none of the four (idle), or busy_q and one of the others. active: staged or running, from
  -- open_tile until its last pair has been read.
  signal busy_q    : std_logic;
  signal staged_q  : std_logic;
  signal running   : std_logic;
  signal clearing  : std_logic;
  signal active    : std_logic;
  signal illegal   : std_logic;
  signal wipe      : std_logic;
  signal strayed   : std_logic; -- the chunk that has just ended did so in another slot
  signal chunks    : unsigned(15 downto 0);
  signal base_q    : unsigned(15 downto 0);
  signal base_slot : unsigned(C_SLOT_W - 1 downto 0); -- base mod G_SLOTS
  signal next_slot : unsigned(C_SLOT_W - 1 downto 0);
  signal stored    : unsigned(15 downto 0);
  -- Pairs not read yet. While clearing, its low bits are the number of the bit: 0, then downwards to 1; both ways into
  -- clearing leave a zero here.
  signal left      : unsigned(23 downto 0);
  signal left_one  : std_logic;
  signal clear_end : std_logic;

  -- Check of a chunk.
  signal distance   : unsigned(16 downto 0); -- from base
  signal check_q    : std_logic;
  signal below_q    : std_logic;
  signal window_q   : std_logic;
  signal distance_q : unsigned(C_SLOT_W - 1 downto 0);
  signal slot_sum   : unsigned(C_SLOT_W downto 0);
  signal slot       : unsigned(C_SLOT_W downto 0);
  signal new_q      : std_logic;
  signal repeated_q : std_logic;
  signal commit     : std_logic;

  -- Write.
  signal index_q   : std_logic_vector(C_SLOT_W - 1 downto 0); -- bit of the chunk being written
  signal w_addr    : unsigned(C_ADDR_W - 1 downto 0);
  signal byte_n    : unsigned(1 downto 0);
  signal pair_full : std_logic;
  signal pair      : std_logic_vector(C_PAIR_W - 1 downto 0);

  -- Bits.
  signal bit_we    : std_logic;
  signal bit_waddr : std_logic_vector(C_SLOT_W - 1 downto 0);
  signal bit_wdata : std_logic_vector(0 downto 0);
  signal look      : std_logic_vector(C_SLOT_W - 1 downto 0); -- of the output: base, or the one after if base is there
  signal b_addr    : std_logic_vector(C_SLOT_W - 1 downto 0);
  signal w_bit     : std_logic_vector(0 downto 0);
  signal look_bit  : std_logic_vector(0 downto 0);
  signal read_bit  : std_logic_vector(0 downto 0);
  signal b_outside : std_logic;
  signal wrote     : std_logic;                               -- the latest look may have met the write of its bit

  -- Output. here: chunk base is there.
  signal here       : std_logic;
  signal ahead      : unsigned(0 downto 0);
  signal r_addr     : unsigned(C_ADDR_W - 1 downto 0);
  signal chunk_last : std_logic;
  signal issue      : std_logic;
  signal chunk_end  : std_logic;
  signal r_valid    : std_logic;                               -- read_pair is the next pair
  signal r_last     : std_logic;
  signal read_pair  : std_logic_vector(C_PAIR_W - 1 downto 0);
  signal hold_valid : std_logic;                               -- it was not taken: kept here, read_pair changes
  signal hold_last  : std_logic;
  signal hold_pair  : std_logic_vector(C_PAIR_W - 1 downto 0);
  signal out_valid  : std_logic;
  signal out_pair   : std_logic_vector(C_PAIR_W - 1 downto 0);

begin

  assert G_PIX_W >= 1 and G_PIX_W <= 12
    report "row_buffer: G_PIX_W"
           -- synthesis translate_off
           & "=" & integer'image(G_PIX_W)
           -- synthesis translate_on
           & " outside 1..12"
    severity failure;
  -- With 1 there would be no clock to look ahead for the next chunk.
  assert G_CHUNK_PAIRS >= 2 and G_CHUNK_PAIRS <= 2048
    report "row_buffer: G_CHUNK_PAIRS"
           -- synthesis translate_off
           & "=" & integer'image(G_CHUNK_PAIRS)
           -- synthesis translate_on
           & " outside 2..2048"
    severity failure;
  assert G_SLOTS >= 2 and G_SLOTS <= 1024
    report "row_buffer: G_SLOTS"
           -- synthesis translate_off
           & "=" & integer'image(G_SLOTS)
           -- synthesis translate_on
           & " outside 2..1024"
    severity failure;

  -- Tile -------------------------------------------------------------------------------------------------------------
  busy      <= busy_q or out_valid;
  staged    <= staged_q;
  active    <= staged_q or running;
  illegal   <= (busy_q xor staged_q xor running xor clearing) or (not busy_q and (staged_q or running or clearing));
  recovered <= (illegal or strayed) and not rst;
  -- Without the row of its last pair the tile is over, but that pair would become the first of the next one.
  wipe      <= clear or illegal or strayed or (fail and (running or (out_valid and not staged_q)));
  base      <= std_logic_vector(base_q);
  received  <= std_logic_vector(stored);
  left_one  <= to_sl(left = 1);
  clear_end <= to_sl(left(C_SLOT_W - 1 downto 0) = 1);
  next_slot <= (others => '0') when base_slot = G_SLOTS - 1 else base_slot + 1;

  p_tile : process (clk)
  begin
    if rising_edge(clk) then
      -- Of a full chunk: r_addr and base_slot go through a tile apart. The low bits tell slots apart.
      strayed  <= chunk_end and not left_one and not rst
                  and to_sl(r_addr(C_SLOT_W - 1 downto 0) /= base_slot + (C_LAST mod 2 ** C_SLOT_W));
      complete <= active and (to_sl(stored = chunks) or to_sl(stored = G_SLOTS));
      if go = '1' and staged_q = '1' then
        staged_q <= '0';
        running  <= '1';
      end if;
      if commit = '1' then
        stored <= stored + 1;
      end if;
      if chunk_end = '1' then
        base_q    <= base_q + 1;
        base_slot <= next_slot;
      end if;
      if issue = '1' or clearing = '1' then
        left <= left - 1;
      end if;
      if clearing = '1' and clear_end = '1' then
        clearing <= '0';
        busy_q   <= '0';
      end if;
      if issue = '1' and left_one = '1' then
        running  <= '0';
        clearing <= '1';
      end if;
      if open_tile = '1' then
        staged_q <= '1';
        busy_q   <= '1';
        chunks   <= unsigned(open_chunks);
        left     <= unsigned(open_pixels);
      end if;
      if open_tile = '1' or wipe = '1' then
        base_q    <= (others => '0');
        base_slot <= (others => '0');
        stored    <= (others => '0');
      end if;
      if wipe = '1' or rst = '1' then
        staged_q <= '0';
        running  <= '0';
        clearing <= '1';
        busy_q   <= '1';
        complete <= '0';
        left     <= (others => '0');
      end if;
      if rst = '1' then
        base_q    <= (others => '0');
        base_slot <= (others => '0');
        stored    <= (others => '0');
      end if;
    end if;
  end process p_tile;

  -- Check and write --------------------------------------------------------------------------------------------------
  distance   <= ('0' & unsigned(w_chunk)) - ('0' & base_q);
  slot_sum   <= ('0' & base_slot) + ('0' & distance_q);
  slot       <= slot_sum - G_SLOTS when slot_sum >= G_SLOTS else slot_sum;
  w_new      <= new_q;
  w_repeated <= repeated_q;
  commit     <= w_commit and new_q and active;
  pair_full  <= w_valid and to_sl(byte_n = C_PAIR_BYTES - 1);

  p_write : process (clk)
  begin
    if rising_edge(clk) then
      check_q <= w_check;
      if w_check = '1' then
        index_q    <= w_chunk(C_SLOT_W - 1 downto 0);
        distance_q <= distance(C_SLOT_W - 1 downto 0);
        below_q    <= distance(16);
        window_q   <= active and to_sl(distance < G_SLOTS) and to_sl(unsigned(w_chunk) < chunks);
      end if;
      -- base_slot still belongs to the base of the clock before: no chunk ends in the clock of w_check.
      if check_q = '1' then
        new_q      <= window_q and not w_bit(0);
        repeated_q <= below_q or (window_q and w_bit(0));
        w_addr     <= resize(slot, C_ADDR_W);
        byte_n     <= (others => '0');
      elsif pair_full = '1' then
        w_addr <= w_addr + G_SLOTS;
        byte_n <= (others => '0');
      elsif w_valid = '1' then
        byte_n <= byte_n + 1;
      end if;
      if rst = '1' or wipe = '1' or open_tile = '1' then
        check_q <= '0';
        new_q   <= '0';
      end if;
      if rst = '1' then
        repeated_q <= '0';
      end if;
    end if;
  end process p_write;

  g_one_byte : if C_PAIR_BYTES = 1 generate
    pair <= w_data(C_PAIR_W - 1 downto 0);
  end generate g_one_byte;

  g_bytes : if C_PAIR_BYTES > 1 generate
    signal held : std_logic_vector(C_PAIR_W - 9 downto 0); -- bytes of the pair so far
  begin
    pair <= held & w_data;

    p_held : process (clk)
    begin
      if rising_edge(clk) then
        if w_valid = '1' then
          held <= pair(C_PAIR_W - 9 downto 0);
        end if;
      end if;
    end process p_held;

  end generate g_bytes;

  u_pairs : entity work.ram_deep
    generic map (G_DATA_W => C_PAIR_W, G_DEPTH => C_DEPTH, G_NINES => 0)
    port map (
      clk   => clk,
      we    => pair_full,
      waddr => std_logic_vector(w_addr),
      wdata => pair,
      raddr => std_logic_vector(r_addr),
      rdata => read_pair
    );

  -- Bits -------------------------------------------------------------------------------------------------------------
  bit_we       <= clearing or chunk_end or commit;
  bit_wdata(0) <= not (clearing or chunk_end);
  bit_waddr    <= std_logic_vector(left(C_SLOT_W - 1 downto 0)) when clearing = '1'
                  else std_logic_vector(base_q(C_SLOT_W - 1 downto 0)) when chunk_end = '1'
                  else index_q;
  look         <= std_logic_vector(base_q(C_SLOT_W - 1 downto 0) + ahead);
  ahead(0)     <= here;
  b_addr       <= std_logic_vector(base_q(C_SLOT_W - 1 downto 0) + unsigned(b_index(C_SLOT_W - 1 downto 0)));

  u_bits_check : entity work.ram_sdp
    generic map (G_DATA_W => 1, G_DEPTH => C_BITS, G_LATENCY => 1)
    port map (
      clk   => clk,
      we    => bit_we,
      waddr => bit_waddr,
      wdata => bit_wdata,
      raddr => w_chunk(C_SLOT_W - 1 downto 0),
      rdata => w_bit
    );

  u_bits_output : entity work.ram_sdp
    generic map (G_DATA_W => 1, G_DEPTH => C_BITS, G_LATENCY => 1)
    port map (
      clk   => clk,
      we    => bit_we,
      waddr => bit_waddr,
      wdata => bit_wdata,
      raddr => look,
      rdata => look_bit
    );

  u_bits_status : entity work.ram_sdp
    generic map (G_DATA_W => 1, G_DEPTH => C_BITS, G_LATENCY => 1)
    port map (
      clk   => clk,
      we    => bit_we,
      waddr => bit_waddr,
      wdata => bit_wdata,
      raddr => b_addr,
      rdata => read_bit
    );

  p_status : process (clk)
  begin
    if rising_edge(clk) then
      b_outside <= not active or to_sl(unsigned('0' & b_index) >= C_BITS);
      b_bit     <= read_bit(0) and not b_outside;
    end if;
  end process p_status;

  -- Output -----------------------------------------------------------------------------------------------------------
  chunk_last <= to_sl(r_addr >= C_LAST) or left_one;
  -- The bits have one write port, no check may meet a change, and the bitmap is one picture.
  issue      <= running and here and (m_tready or not out_valid)
                and not (chunk_last and (w_check or w_commit or b_hold));
  chunk_end  <= issue and chunk_last;
  out_valid  <= r_valid or hold_valid;
  out_pair   <= hold_pair when hold_valid = '1' else read_pair;
  m_tvalid   <= out_valid;
  m_tdata    <= out_pair(G_PIX_W - 1 downto 0) & out_pair(C_PAIR_W - 1 downto G_PIX_W);
  m_tlast    <= hold_last when hold_valid = '1' else r_last;

  p_output : process (clk)
  begin
    if rising_edge(clk) then
      wrote <= commit;
      -- Asked with look of the clock before: base if it was not there, else the next one, which base becomes now.
      if here = '0' or chunk_end = '1' then
        here <= running and look_bit(0) and not wrote;
      end if;
      if chunk_end = '1' then
        r_addr <= resize(next_slot, C_ADDR_W);
      elsif issue = '1' then
        r_addr <= r_addr + G_SLOTS;
      end if;
      r_valid <= issue;
      r_last  <= left_one;
      if r_valid = '1' then
        hold_pair <= read_pair;
        hold_last <= r_last;
      end if;
      hold_valid <= out_valid and not m_tready;
      if rst = '1' or wipe = '1' then
        r_valid    <= '0';
        hold_valid <= '0';
      end if;
      if running = '0' or rst = '1' or wipe = '1' then
        here <= '0';
      end if;
      if rst = '1' or wipe = '1' or open_tile = '1' then
        r_addr <= (others => '0');
      end if;
    end if;
  end process p_output;

end architecture rtl;
