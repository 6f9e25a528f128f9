-- SPDX-License-Identifier: Apache-2.0
-- map_buffer: stores the map of one tile as the engine unloads it, and gives it back in chunks as bytes
--             (docs/protocol.md, 'Data').
--   Whole    : G_DEPTH >= G_CELLS: cell n at word n, always room; keep has no meaning
--   Ring     : G_DEPTH < G_CELLS, a multiple of G_CHUNK_CELLS: cell n at word n mod G_DEPTH. A chunk is begun when all
--              chunks that lie G_DEPTH cells or more before it are below keep. keep belongs to the map inside: 0 in the
--              clock after started, larger when the host asks; a keep that falls is ignored until the next map. It must
--              not pass a chunk that is being sent
--   Write    : one cell per clock. complete after s_tlast, then not ready until release_map or clear
--   Read     : f_ready = '1' from three clocks after the latest change of f_chunk or keep on means that chunk f_chunk
--              may be started. From f_start on the start address walks from chunk 0, one chunk per clock, so that
--              nothing of an earlier chunk affects it. f_chunk has to hold until the first byte
--   Bytes    : ceil(G_CELL_W/8) per cell, big endian, zeros above the cell, and one idle clock after each cell. f_valid
--              and f_data hold until f_take
--   RAM      : ram_deep with columns of nine bits: 31 bits of 32760 cells in 28 blocks
--   Forget   : release_map or clear, in any clock, also while cells come or bytes go; clear also wins on f_valid
--   fail     : the launched tile has failed in the engine: an incomplete map is forgotten; a chunk that is being sent
--              continues to its end
--   Upsets   : the states of either side differ in two bits; any other code acts as clear and sets recovered for one
--              clock. The map is then lost, and a reader that waits for bytes never gets them
--   Golden   : sw/golden/map_buffer.hpp
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;
  use work.link_pkg.all;

entity map_buffer is
  generic (
    G_CELL_W      : integer := 31;
    G_CHUNK_CELLS : integer := 352;
    G_CELLS       : integer := 32760;
    G_DEPTH       : integer := 32760
  );
  port (
    clk : in  std_logic;
    rst : in  std_logic;

    s_tvalid : in  std_logic;
    s_tready : out std_logic;
    s_tdata  : in  std_logic_vector(G_CELL_W - 1 downto 0);
    s_tlast  : in  std_logic;

    release_map : in  std_logic;
    clear       : in  std_logic;
    fail        : in  std_logic;
    recovered   : out std_logic;
    keep        : in  std_logic_vector(15 downto 0);
    started     : out std_logic; -- in the clock in which the first cell is taken
    busy        : out std_logic;
    complete    : out std_logic;
    count       : out std_logic_vector(23 downto 0);

    f_chunk : in  std_logic_vector(15 downto 0);
    f_ready : out std_logic;
    f_start : in  std_logic;
    f_valid : out std_logic;
    f_take  : in  std_logic;
    f_data  : out std_logic_vector(7 downto 0);
    f_last  : out std_logic
  );
end entity map_buffer;

architecture rtl of map_buffer is

  function smaller (a, b : integer) return integer is
  begin
    if a < b then
      return a;
    end if;
    return b;
  end function smaller;

  constant C_WHOLE      : boolean := G_DEPTH >= G_CELLS;
  constant C_DEPTH      : integer := imax(2, smaller(G_DEPTH, G_CELLS));
  constant C_ADDR_W     : integer := clog2(C_DEPTH);
  constant C_CHUNK      : integer := imax(G_CHUNK_CELLS, 1); -- 0 is refused below
  constant C_RING       : integer := G_DEPTH / C_CHUNK;      -- chunks
  constant C_TURN       : integer := imax(0, C_DEPTH - G_CHUNK_CELLS); -- where the ring's last chunk starts
  constant C_INDEX_W    : integer := clog2(G_CHUNK_CELLS);
  constant C_COUNT_W    : integer := clog2(G_CELLS + 1);
  constant C_CHUNK_W    : integer := clog2((G_CELLS + C_CHUNK - 1) / C_CHUNK + 1);
  constant C_CELL_BYTES : integer := cell_bytes(G_CELL_W);

  -- Read: off; the start address walks; cells leave. The codes differ in two bits.
  constant C_OFF  : std_logic_vector(2 downto 0) := "000";
  constant C_WALK : std_logic_vector(2 downto 0) := "011";
  constant C_SEND : std_logic_vector(2 downto 0) := "101";

  -- Write. Empty: none of busy_q, filling, complete_q; else busy_q and one of the others.
  signal illegal    : std_logic;
  signal forget     : std_logic;
  signal drop       : std_logic; -- the map
  signal fire       : std_logic;
  signal room       : std_logic;
  signal busy_q     : std_logic;
  signal filling    : std_logic;
  signal complete_q : std_logic;
  signal count_q    : unsigned(C_COUNT_W - 1 downto 0);
  signal w_addr     : std_logic_vector(C_ADDR_W - 1 downto 0);
  signal w_index    : unsigned(C_INDEX_W - 1 downto 0); -- in the chunk; stays at the last cell of a complete map
  signal finished   : unsigned(C_CHUNK_W - 1 downto 0); -- chunks, the short last one included
  signal kept       : unsigned(15 downto 0);            -- the largest keep of this map

  -- Read. In walk number and r_addr go together: a chunk and where it starts. In send r_addr is the cell and number the
  -- next chunk.
  signal read_state : std_logic_vector(2 downto 0);
  signal exists     : std_logic;
  signal ready_q    : std_logic;
  signal number     : unsigned(C_CHUNK_W - 1 downto 0);
  signal r_addr     : unsigned(C_ADDR_W - 1 downto 0);
  signal number_ok  : std_logic;
  signal r_index    : unsigned(C_INDEX_W - 1 downto 0);
  signal last_chunk : std_logic;
  signal last_cell  : std_logic;
  signal cell_valid : std_logic;                        -- cell_word is that of r_addr
  signal cell_word  : std_logic_vector(G_CELL_W - 1 downto 0);
  signal padded     : std_logic_vector(8 * C_CELL_BYTES - 1 downto 0);
  signal byte_n     : unsigned(2 downto 0);
  signal last_byte  : std_logic;
  signal load       : std_logic;
  signal picked     : std_logic_vector(7 downto 0);
  signal valid_q    : std_logic;

begin

  assert G_CELL_W >= 9 and G_CELL_W <= 48
    report "map_buffer: G_CELL_W"
           -- synthesis translate_off
           & "=" & integer'image(G_CELL_W)
           -- synthesis translate_on
           & " outside 9..48"
    severity failure;
  assert G_CHUNK_CELLS >= 2 and G_CHUNK_CELLS <= 2048
    report "map_buffer: G_CHUNK_CELLS"
           -- synthesis translate_off
           & "=" & integer'image(G_CHUNK_CELLS)
           -- synthesis translate_on
           & " outside 2..2048"
    severity failure;
  -- Numbers of chunks have 16 bits.
  assert G_CELLS >= 1 and G_CELLS < 2 ** 24 and G_CELLS / C_CHUNK < 65535
    report "map_buffer: G_CELLS"
           -- synthesis translate_off
           & "=" & integer'image(G_CELLS)
           -- synthesis translate_on
           & " outside 1..16777215 or over 65535 chunks"
    severity failure;
  assert G_DEPTH >= G_CELLS or (G_DEPTH >= G_CHUNK_CELLS and G_DEPTH mod C_CHUNK = 0)
    report "map_buffer: G_DEPTH"
           -- synthesis translate_off
           & "=" & integer'image(G_DEPTH)
           -- synthesis translate_on
           & " is neither G_CELLS nor one or more chunks"
    severity failure;

  -- Write ------------------------------------------------------------------------------------------------------------
  illegal   <= (busy_q xor filling xor complete_q) or (filling and complete_q)
               or not to_sl(read_state = C_OFF or read_state = C_WALK or read_state = C_SEND);
  recovered <= illegal and not rst;
  forget    <= release_map or clear or illegal;
  drop      <= forget or (fail and filling);
  s_tready  <= room and not complete_q;
  fire      <= s_tvalid and room and not complete_q;
  started   <= fire and not busy_q;
  busy      <= busy_q;
  complete  <= complete_q;
  count     <= std_logic_vector(resize(count_q, 24));

  p_write : process (clk)
  begin
    if rising_edge(clk) then
      if fire = '1' then
        busy_q  <= '1';
        filling <= not s_tlast;
        count_q <= count_q + 1;
        if s_tlast = '1' then
          complete_q <= '1';
        elsif w_index = G_CHUNK_CELLS - 1 then
          w_index <= (others => '0');
        else
          w_index <= w_index + 1;
        end if;
        if s_tlast = '1' or w_index = G_CHUNK_CELLS - 1 then
          finished <= finished + 1;
        end if;
      end if;
      if rst = '1' or drop = '1' then
        busy_q     <= '0';
        filling    <= '0';
        complete_q <= '0';
        count_q    <= (others => '0');
        w_index    <= (others => '0');
        finished   <= (others => '0');
      end if;
    end if;
  end process p_write;

  g_whole : if C_WHOLE generate
    room   <= '1';
    kept   <= (others => '0');
    w_addr <= std_logic_vector(count_q(C_ADDR_W - 1 downto 0));
    exists <= to_sl(unsigned(f_chunk) < finished);
  end generate g_whole;

  g_ring : if not C_WHOLE generate
    signal addr : unsigned(C_ADDR_W - 1 downto 0);
    signal used : unsigned(16 downto 0); -- finished chunks that are kept; negative if keep is ahead
  begin
    used   <= ('0' & finished) - ('0' & kept);
    room   <= used(16) or to_sl(used(15 downto 0) < C_RING);
    w_addr <= std_logic_vector(addr);
    exists <= to_sl(unsigned(f_chunk) < finished) and to_sl(unsigned(f_chunk) >= kept);

    p_ring : process (clk)
    begin
      if rising_edge(clk) then
        if fire = '1' then
          addr <= addr + 1;
          if addr = C_DEPTH - 1 then
            addr <= (others => '0');
          end if;
        end if;
        if unsigned(keep) > kept and busy_q = '1' then
          kept <= unsigned(keep);
        end if;
        if rst = '1' or drop = '1' then
          addr <= (others => '0');
          kept <= (others => '0');
        end if;
      end if;
    end process p_ring;

  end generate g_ring;

  u_cells : entity work.ram_deep
    generic map (G_DATA_W => G_CELL_W, G_DEPTH => C_DEPTH, G_NINES => G_CELL_W / 9 * 9)
    port map (
      clk   => clk,
      we    => fire,
      waddr => w_addr,
      wdata => s_tdata,
      raddr => std_logic_vector(r_addr),
      rdata => cell_word
    );

  -- Read -------------------------------------------------------------------------------------------------------------
  number_ok  <= to_sl(unsigned(f_chunk(C_CHUNK_W - 1 downto 0)) = number); -- it exists, so its number is no longer
  last_chunk <= complete_q and to_sl(number = finished);
  last_cell  <= to_sl(r_index = G_CHUNK_CELLS - 1) or (last_chunk and to_sl(r_index = w_index));
  last_byte  <= to_sl(byte_n = C_CELL_BYTES - 1);
  load       <= cell_valid and (f_take or not valid_q);
  padded     <= std_logic_vector(resize(unsigned(cell_word), 8 * C_CELL_BYTES));
  f_ready    <= ready_q;
  f_valid    <= valid_q;

  p_pick : process (padded, byte_n)
  begin
    picked <= padded(7 downto 0);
    for i in 0 to C_CELL_BYTES - 2 loop
      if byte_n = i then
        picked <= padded(8 * (C_CELL_BYTES - i) - 1 downto 8 * (C_CELL_BYTES - i - 1));
      end if;
    end loop;
  end process p_pick;

  p_read : process (clk)
  begin
    if rising_edge(clk) then
      ready_q    <= exists and to_sl(read_state = C_OFF) and not f_start;
      cell_valid <= to_sl(read_state = C_SEND);

      if load = '1' and last_byte = '1' then
        cell_valid <= '0';
        r_index    <= r_index + 1;
        r_addr     <= r_addr + 1;
        if r_addr = C_DEPTH - 1 then
          r_addr <= (others => '0');
        end if;
        if last_cell = '1' then
          read_state <= C_OFF;
        end if;
      end if;

      if read_state = C_WALK then
        number <= number + 1;
        if number_ok = '1' then
          read_state <= C_SEND;
          cell_valid <= '1';
        elsif not C_WHOLE and r_addr = C_TURN then
          r_addr <= (others => '0');
        else
          r_addr <= r_addr + G_CHUNK_CELLS;
        end if;
      end if;

      if load = '1' then
        valid_q <= '1';
        f_data  <= picked;
        f_last  <= last_byte and last_cell;
        byte_n  <= byte_n + 1;
        if last_byte = '1' then
          byte_n <= (others => '0');
        end if;
      elsif f_take = '1' then
        valid_q <= '0';
      end if;

      if f_start = '1' then
        read_state <= C_WALK;
        number     <= (others => '0');
        r_addr     <= (others => '0');
        r_index    <= (others => '0');
        byte_n     <= (others => '0');
        valid_q    <= '0';
      end if;

      if rst = '1' or forget = '1' then
        ready_q    <= '0';
        read_state <= C_OFF;
        cell_valid <= '0';
        valid_q    <= '0';
      end if;
    end if;
  end process p_read;

end architecture rtl;
