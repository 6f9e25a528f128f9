-- SPDX-License-Identifier: Apache-2.0
-- control: registers, checks, pixel packets and the order of the samples of a tile (paper, section 4.2).
--   Streams  : s_cfg is always ready, s_pix while loading or draining. Nothing inside the engine stalls: a packet is
--              taken as fast as it comes, the sweep runs to its end, and unload waits for its own stream only
--   States   : idle, load (pixels), sweep (samples), flush (cells in flight to the map), unload, drain (pixels of a
--              tile that was refused or too long)
--   Sweep    : one set of G_LANES planes after the other; row after row, one sample per clock and lane; rows of
--              max(sweep_cols, C_ROW_MIN) clocks; the first sample two clocks after the last pixel; no bubble between
--              rows or sets
--   Registers: sizes are stored minus 1 and only if in range, so addresses derived from them are always legal
--   Writes   : take effect two clocks after they are on s_cfg, those of table and offsets after three
--   Priority : within a command word clear comes first, then abort, then start (abort suppresses start). While a tile
--              is in work the address of a write does not matter. A last map beat wins against an abort in the same
--              clock
--   Upsets   : the state has a parity bit, so an upset of one bit never makes another legal state. An illegal code, a
--              map that ends before or after its last beat, and a corrupted word of table or offsets drop the tile one
--              clock later (error bit 'upset'). Sets are counted to 'not below', so that no upset makes a tile longer
--              than the largest of the build
--   Counters : saturating; tiles_dropped and error_count follow their event by one clock. Clear also resets the latch
--              that counts window errors once per tile, and keeps tile_clocks
--   Reset    : idle, sizes missing, table empty, counters 0; bounds are not reset: write them before the first start
--   Golden   : sw/golden/control.hpp
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;

entity control is
  generic (
    G_IMG_COLS   : integer := 340;
    G_IMG_ROWS   : integer := 144;
    G_PLANE_COLS : integer := 256;
    G_PLANE_ROWS : integer := 130;
    G_PLANES     : integer := 301;
    G_WINDOW     : integer := 13;
    G_MNCC_W     : integer := 13;
    G_LANES      : integer := 1;
    G_LATENCY    : integer := 60
  );
  port (
    clk : in  std_logic;
    rst : in  std_logic;

    s_cfg_tvalid : in  std_logic;
    s_cfg_tready : out std_logic;
    s_cfg_tdata  : in  std_logic_vector(47 downto 0);

    s_pix_tvalid : in  std_logic;
    s_pix_tready : out std_logic;
    s_pix_tlast  : in  std_logic;

    -- Writes to address_generator's memories.
    cfg_data    : out std_logic_vector(31 downto 0);
    cfg_parity  : out std_logic; -- '1' if cfg_data has an odd number of ones
    table_we    : out std_logic;
    table_addr  : out std_logic_vector(clog2(G_PLANES) + 2 downto 0);
    offset_we   : out std_logic;
    offset_addr : out std_logic_vector(1 downto 0);

    -- Static during a tile.
    win_last_col : out std_logic_vector(clog2(G_IMG_COLS) - 1 downto 0);
    win_last_row : out std_logic_vector(clog2(G_IMG_ROWS) - 1 downto 0);
    threshold    : out std_logic_vector(G_MNCC_W - 1 downto 0);
    left_x_lo    : out std_logic_vector(C_INT_W - 1 downto 0);
    left_x_hi    : out std_logic_vector(C_INT_W - 1 downto 0);
    left_y_lo    : out std_logic_vector(C_INT_W - 1 downto 0);
    left_y_hi    : out std_logic_vector(C_INT_W - 1 downto 0);
    right_x_lo   : out std_logic_vector(C_INT_W - 1 downto 0);
    right_x_hi   : out std_logic_vector(C_INT_W - 1 downto 0);
    right_y_lo   : out std_logic_vector(C_INT_W - 1 downto 0);
    right_y_hi   : out std_logic_vector(C_INT_W - 1 downto 0);

    -- Load, to storage; in the clock in which the pixel is on s_pix.
    load_clear   : out std_logic;
    load_valid   : out std_logic;
    load_col     : out std_logic_vector(clog2(G_IMG_COLS) - 1 downto 0);
    load_row_odd : out std_logic;
    load_row_end : out std_logic;

    -- Sweep, to address_generator.
    m_valid       : out std_logic;
    m_row_first   : out std_logic; -- i = 0, only with m_valid
    m_plane_first : out std_logic; -- j = 0, for the whole row
    m_plane_last  : out std_logic; -- last sample of the plane
    m_plane       : out std_logic_vector(clog2(plane_sets(G_PLANES, G_LANES)) - 1 downto 0); -- set
    m_lanes       : out std_logic_vector(G_LANES - 1 downto 0); -- planes set * G_LANES + lane that the tile has

    -- Updating.
    map_start  : out std_logic; -- pulse before the first sample of a tile
    map_unload : out std_logic; -- pulse: all planes are in the map
    map_abort  : out std_logic; -- pulse: forget everything on its way
    map_more   : in  std_logic; -- map beats will follow the present one
    map_valid  : in  std_logic; -- a map beat is there
    map_last   : in  std_logic; -- the last map beat is being taken

    window_error : in  std_logic_vector(G_LANES - 1 downto 0); -- of address_generator, one a sample
    word_error   : in  std_logic_vector(G_LANES - 1 downto 0); -- of address_generator: wrong parity

    state         : out std_logic_vector(2 downto 0);
    busy          : out std_logic;
    errors        : out std_logic_vector(7 downto 0);
    error_count   : out std_logic_vector(15 downto 0);
    tiles_done    : out std_logic_vector(15 downto 0);
    tiles_dropped : out std_logic_vector(15 downto 0);
    window_errors : out std_logic_vector(15 downto 0);
    tile_clocks   : out std_logic_vector(31 downto 0)
  );
end entity control;

architecture rtl of control is

  constant C_SWEEP_COLS : integer := G_PLANE_COLS + G_WINDOW - 1;
  constant C_SWEEP_ROWS : integer := G_PLANE_ROWS + G_WINDOW - 1;
  -- One counter of columns and one of rows serve load and sweep.
  constant C_COL_W       : integer := clog2(imax(imax(G_IMG_COLS, C_SWEEP_COLS), C_ROW_MIN));
  constant C_ROW_W       : integer := clog2(imax(G_IMG_ROWS, C_SWEEP_ROWS));
  constant C_PLANE_W     : integer := clog2(G_PLANES);
  constant C_LANE_W      : integer := G_LANES / 2; -- bits of a lane's number: 0, 1 or 2
  constant C_SETS        : integer := plane_sets(G_PLANES, G_LANES);
  constant C_SET_W       : integer := clog2(C_SETS);
  constant C_TABLE_W     : integer := C_PLANE_W + 3;
  constant C_TABLE_WORDS : integer := 8 * G_PLANES;
  -- The last cell is in the map so many clocks after the last sample. (A count of planes on their way would wait for
  -- ever, were one of its bits upset.)
  constant C_FLUSH       : integer := G_LATENCY + 2;
  constant C_FLUSH_W     : integer := 7;

  -- The state with even parity: whichever bit is upset, the code is none of these.
  constant C_IDLE     : std_logic_vector(3 downto 0) := C_STATE_IDLE & '0';
  constant C_LOAD     : std_logic_vector(3 downto 0) := C_STATE_LOAD & '1';
  constant C_SWEEP    : std_logic_vector(3 downto 0) := C_STATE_SWEEP & '1';
  constant C_FLUSHING : std_logic_vector(3 downto 0) := C_STATE_FLUSH & '0';
  constant C_UNLOAD   : std_logic_vector(3 downto 0) := C_STATE_UNLOAD & '1';
  constant C_DRAIN    : std_logic_vector(3 downto 0) := C_STATE_DRAIN & '0';

  -- Registers.
  constant C_COMMAND   : integer := 16#00#;
  constant C_TILE_COLS : integer := 16#01#;
  constant C_TILE_ROWS : integer := 16#02#;
  constant C_WIN_COLS  : integer := 16#03#;
  constant C_WIN_ROWS  : integer := 16#04#;
  constant C_PLANES    : integer := 16#05#;
  constant C_THRESHOLD : integer := 16#06#;
  constant C_OFFSETS   : integer := 16#08#; -- four of them
  constant C_LEFT      : integer := 16#10#; -- x_lo, x_hi, y_lo, y_hi
  constant C_RIGHT     : integer := 16#14#;

  signal state_q    : std_logic_vector(3 downto 0);
  signal is_idle    : std_logic;
  signal is_load    : std_logic;
  signal is_sweep   : std_logic;
  signal is_flush   : std_logic;
  signal is_unload  : std_logic;
  signal is_drain   : std_logic;

  -- Decoded write, a clock after s_cfg.
  signal cfg_word     : std_logic_vector(47 downto 0);
  signal cfg_command  : std_logic;             -- any write to COMMAND
  signal cfg_low      : std_logic;             -- to 0x0001 .. 0x001F
  signal cfg_middle   : std_logic;             -- to 0x0020 .. 0x7FFF, where nothing is
  signal cfg_high     : std_logic;             -- to 0x8000 and up
  signal cfg_in_table : std_logic;             -- the low bits are an address of the table
  signal cfg_fits     : std_logic;             -- the value has no more than 16 bits
  signal cfg_some     : std_logic;             -- .. of which one is '1'
  signal cfg_value    : unsigned(15 downto 0);
  signal cfg_limit    : unsigned(15 downto 0); -- largest value of the register
  signal cfg_in_range : std_logic;             -- size or threshold
  signal cfg_less_1   : unsigned(11 downto 0); -- of the low 12 bits
  signal cfg_register : std_logic;             -- any write to 0x0001 .. 0x001F, while idle
  signal cfg_index    : unsigned(4 downto 0);
  signal cfg_table    : std_logic;             -- any write to 0x8000 and up, while idle
  signal table_ok     : std_logic;
  signal table_next   : std_logic;             -- the word is the first unwritten one
  signal command_start : std_logic;
  signal command_abort : std_logic;
  signal command_clear : std_logic;

  -- Registers, sizes less 1.
  signal range_ok       : std_logic_vector(C_THRESHOLD downto C_TILE_COLS); -- which of them hold what they may
  signal tile_last_col  : unsigned(clog2(G_PLANE_COLS) - 1 downto 0);
  signal tile_last_row  : unsigned(clog2(G_PLANE_ROWS) - 1 downto 0);
  signal win_last_col_q : unsigned(clog2(G_IMG_COLS) - 1 downto 0);
  signal win_last_row_q : unsigned(clog2(G_IMG_ROWS) - 1 downto 0);
  signal last_plane     : unsigned(C_PLANE_W - 1 downto 0);
  signal table_words    : unsigned(C_TABLE_W downto 0); -- written so far, 0 .. 8 * G_PLANES

  -- Limits of the counters; static during a tile, so their way here may be long.
  signal sweep_last_col : unsigned(C_COL_W - 1 downto 0); -- last sample of a row
  signal sweep_last_row : unsigned(C_ROW_W - 1 downto 0);
  signal row_last_col   : unsigned(C_COL_W - 1 downto 0); -- last clock of a row

  signal col         : unsigned(C_COL_W - 1 downto 0);
  signal row         : unsigned(C_ROW_W - 1 downto 0);
  signal plane_set   : unsigned(C_SET_W - 1 downto 0);
  signal last_wide   : unsigned(C_SET_W + C_PLANE_W + 1 downto 0); -- last_plane, wide enough for any slice
  signal last_set    : unsigned(C_SET_W - 1 downto 0);
  signal at_set_end   : std_logic; -- in the last set
  signal at_set_end_q : std_logic;
  signal lanes        : std_logic_vector(G_LANES - 1 downto 0); -- m_lanes, a clock ahead
  signal next_last_col   : unsigned(C_COL_W - 1 downto 0); -- of load (in idle), then of the sweep
  signal next_last_row   : unsigned(C_ROW_W - 1 downto 0);
  signal last_col_less_1 : unsigned(C_COL_W - 1 downto 0); -- of load or sweep
  signal last_row_less_1 : unsigned(C_ROW_W - 1 downto 0);
  signal one_col     : std_logic; -- rows of one pixel
  signal at_col_end  : std_logic;
  signal at_row_end  : std_logic;
  signal at_row_last : std_logic; -- last sample of a row, in a sweep
  signal at_last     : std_logic; -- last pixel of the window, or last clock of the plane
  signal at_tile_end : std_logic;
  signal step        : std_logic;
  signal active      : std_logic; -- a sample (no padding) is emitted
  signal row_first   : std_logic;
  signal plane_first : std_logic;
  signal sample_last : std_logic;

  signal pix_ready   : std_logic;
  signal pix_fire    : std_logic;
  signal load_done   : std_logic;
  signal since_last  : unsigned(C_FLUSH_W - 1 downto 0); -- clocks since the last sample of a plane, up to C_FLUSH
  signal flushed     : std_logic;
  signal abort_q     : std_logic;
  signal start_q     : std_logic;

  signal start_ok    : std_logic;
  signal tile_done   : std_logic;
  signal tile_drop   : std_logic;
  signal drop_q      : std_logic;
  signal halt        : std_logic; -- idle comes next, whatever the state
  signal move        : std_logic; -- the state is over
  signal config_bad  : std_logic;
  signal table_bad   : std_logic;
  signal window_seen : std_logic; -- in this tile

  -- Error events. One of the first four comes from s_cfg, the others from the tile count as one: at most two a clock.
  signal event_config  : std_logic;
  signal event_table   : std_logic;
  signal event_address : std_logic;
  signal event_busy    : std_logic;
  signal event_short   : std_logic;
  signal event_long    : std_logic;
  signal event_window  : std_logic;
  signal upset_now     : std_logic;
  signal event_upset   : std_logic; -- a clock later
  signal cfg_event     : std_logic;
  signal tile_event    : std_logic;
  signal new_events    : unsigned(1 downto 0);
  signal samples_lost  : unsigned(2 downto 0); -- not loaded, over all lanes
  signal sample_lost   : std_logic;

  signal error_bits          : std_logic_vector(7 downto 0);
  signal error_count_q       : unsigned(15 downto 0);
  signal error_count_next    : unsigned(16 downto 0);
  signal tiles_done_q        : unsigned(15 downto 0);
  signal tiles_dropped_q     : unsigned(15 downto 0);
  signal window_errors_q     : unsigned(15 downto 0);
  signal window_errors_next  : unsigned(16 downto 0);
  signal tile_clocks_q       : unsigned(31 downto 0);

  attribute fsm_extract : string;

  attribute fsm_extract of state_q : signal is C_FSM_KEPT;

  -- value + 1, all ones stay.
  function plus_1_saturated (value : unsigned(15 downto 0)) return unsigned is
  begin
    if value = 65535 then
      return value;
    end if;
    return value + 1;
  end function plus_1_saturated;

begin

  assert G_IMG_COLS >= 4 and G_IMG_COLS <= 4096 and G_IMG_COLS mod 2 = 0
    report "control: G_IMG_COLS"
           -- synthesis translate_off
           & "=" & integer'image(G_IMG_COLS)
           -- synthesis translate_on
           & " outside 4..4096 or odd"
    severity failure;
  assert G_IMG_ROWS >= 4 and G_IMG_ROWS <= 4096 and G_IMG_ROWS mod 2 = 0
    report "control: G_IMG_ROWS"
           -- synthesis translate_off
           & "=" & integer'image(G_IMG_ROWS)
           -- synthesis translate_on
           & " outside 4..4096 or odd"
    severity failure;
  assert G_PLANE_COLS >= 1 and G_PLANE_COLS <= 4096
    report "control: G_PLANE_COLS"
           -- synthesis translate_off
           & "=" & integer'image(G_PLANE_COLS)
           -- synthesis translate_on
           & " outside 1..4096"
    severity failure;
  assert G_PLANE_ROWS >= 1 and G_PLANE_ROWS <= 4096
    report "control: G_PLANE_ROWS"
           -- synthesis translate_off
           & "=" & integer'image(G_PLANE_ROWS)
           -- synthesis translate_on
           & " outside 1..4096"
    severity failure;
  assert G_PLANES >= 1 and G_PLANES <= 1024
    report "control: G_PLANES"
           -- synthesis translate_off
           & "=" & integer'image(G_PLANES)
           -- synthesis translate_on
           & " outside 1..1024"
    severity failure;
  assert G_WINDOW >= 3 and G_WINDOW <= 21 and G_WINDOW mod 2 = 1
    report "control: G_WINDOW"
           -- synthesis translate_off
           & "=" & integer'image(G_WINDOW)
           -- synthesis translate_on
           & " outside 3..21 or even"
    severity failure;
  assert G_MNCC_W >= 4 and G_MNCC_W <= 16
    report "control: G_MNCC_W"
           -- synthesis translate_off
           & "=" & integer'image(G_MNCC_W)
           -- synthesis translate_on
           & " outside 4..16"
    severity failure;
  assert G_LANES = 1 or G_LANES = 2 or G_LANES = 4
    report "control: G_LANES"
           -- synthesis translate_off
           & "=" & integer'image(G_LANES)
           -- synthesis translate_on
           & " is not 1, 2 or 4"
    severity failure;
  assert G_LATENCY >= 1 and G_LATENCY <= 125
    report "control: G_LATENCY"
           -- synthesis translate_off
           & "=" & integer'image(G_LATENCY)
           -- synthesis translate_on
           & " outside 1..125"
    severity failure;

  is_idle   <= to_sl(state_q = C_IDLE);
  is_load   <= to_sl(state_q = C_LOAD);
  is_sweep  <= to_sl(state_q = C_SWEEP);
  is_flush  <= to_sl(state_q = C_FLUSHING);
  is_unload <= to_sl(state_q = C_UNLOAD);
  is_drain  <= to_sl(state_q = C_DRAIN);

  -- Register writes --------------------------------------------------------------------------------------------------
  -- In a register first, with what the address alone tells: checks and state come behind it.
  s_cfg_tready <= '1';

  p_cfg : process (clk)
  begin
    if rising_edge(clk) then
      cfg_word     <= s_cfg_tdata;
      if s_cfg_tvalid = '0' then
        cfg_word(2 downto 0) <= "000"; -- an upset alone, of these or of cfg_command, commands nothing
      end if;
      cfg_command  <= s_cfg_tvalid and to_sl(unsigned(s_cfg_tdata(47 downto 32)) = C_COMMAND);
      cfg_low      <= s_cfg_tvalid and to_sl(unsigned(s_cfg_tdata(47 downto 37)) = 0)
                      and to_sl(unsigned(s_cfg_tdata(36 downto 32)) /= C_COMMAND);
      cfg_middle   <= s_cfg_tvalid and not s_cfg_tdata(47) and to_sl(unsigned(s_cfg_tdata(46 downto 37)) /= 0);
      cfg_high     <= s_cfg_tvalid and s_cfg_tdata(47);
      cfg_in_table <= to_sl(unsigned(s_cfg_tdata(46 downto 32)) < C_TABLE_WORDS);
      cfg_fits     <= to_sl(unsigned(s_cfg_tdata(31 downto 16)) = 0);
      cfg_some     <= to_sl(unsigned(s_cfg_tdata(15 downto 0)) /= 0);
      if rst = '1' then
        cfg_command <= '0';
        cfg_low     <= '0';
        cfg_middle  <= '0';
        cfg_high    <= '0';
      end if;
    end if;
  end process p_cfg;

  cfg_value     <= unsigned(cfg_word(15 downto 0));
  cfg_less_1    <= unsigned(cfg_word(11 downto 0)) - 1;
  cfg_index     <= unsigned(cfg_word(36 downto 32));
  cfg_register  <= cfg_low and is_idle;
  cfg_table     <= cfg_high and is_idle;
  -- One comparison for all of them; of index 6, the threshold, 0 is in range, too.
  cfg_limit     <= to_unsigned(G_PLANE_COLS, 16) when cfg_index(2 downto 0) = C_TILE_COLS
                   else to_unsigned(G_PLANE_ROWS, 16) when cfg_index(2 downto 0) = C_TILE_ROWS
                   else to_unsigned(G_IMG_COLS, 16) when cfg_index(2 downto 0) = C_WIN_COLS
                   else to_unsigned(G_IMG_ROWS, 16) when cfg_index(2 downto 0) = C_WIN_ROWS
                   else to_unsigned(G_PLANES, 16) when cfg_index(2 downto 0) = C_PLANES
                   else to_unsigned(2 ** G_MNCC_W - 1, 16);
  cfg_in_range  <= cfg_fits and (cfg_some or to_sl(cfg_index(2 downto 0) = C_THRESHOLD))
                   and to_sl(cfg_value <= cfg_limit);
  command_clear <= cfg_command and cfg_word(2);
  command_abort <= cfg_command and cfg_word(1);
  command_start <= cfg_command and cfg_word(0) and not cfg_word(1);

  table_next  <= to_sl(resize(unsigned(cfg_word(46 downto 32)), C_TABLE_W + 1) = table_words);
  table_ok    <= cfg_in_table
                 and to_sl(resize(unsigned(cfg_word(46 downto 32)), C_TABLE_W + 1) <= table_words);

  -- A register more, as the table's blocks lie far apart. The first row is read long after the last write.
  p_table : process (clk)
    variable v_odd : std_logic;
  begin
    if rising_edge(clk) then
      v_odd := '0';
      for k in 0 to 31 loop
        v_odd := v_odd xor cfg_word(k);
      end loop;
      cfg_data    <= cfg_word(31 downto 0);
      cfg_parity  <= v_odd;
      table_we    <= cfg_table and table_ok;
      table_addr  <= cfg_word(C_TABLE_W + 31 downto 32);
      offset_we   <= cfg_register and to_sl(cfg_index(4 downto 2) = C_OFFSETS / 4);
      offset_addr <= cfg_word(33 downto 32);
      if rst = '1' then
        table_we  <= '0';
        offset_we <= '0';
      end if;
    end if;
  end process p_table;

  event_busy    <= not is_idle and (cfg_low or cfg_middle or cfg_high or command_start);
  event_address <= (cfg_table and not table_ok)
                   or (cfg_register and to_sl(cfg_index = 7))
                   or (cfg_register and to_sl(cfg_index >= 12 and cfg_index < C_LEFT))
                   or (cfg_register and to_sl(cfg_index >= C_RIGHT + 4))
                   or (cfg_middle and is_idle);

  config_bad   <= to_sl(unsigned(not range_ok) /= 0);
  table_bad    <= to_sl(resize(last_plane, C_PLANE_W + 1) >= table_words(C_TABLE_W downto 3));
  event_config <= command_start and is_idle and config_bad;
  event_table  <= command_start and is_idle and not config_bad and table_bad;
  start_ok     <= command_start and is_idle and not config_bad and not table_bad;

  p_registers : process (clk)
  begin
    if rising_edge(clk) then
      if cfg_register = '1' then
        for k in range_ok'range loop
          if cfg_index = k then
            range_ok(k) <= cfg_in_range;
          end if;
        end loop;
        if cfg_index = C_TILE_COLS and cfg_in_range = '1' then
          tile_last_col <= cfg_less_1(tile_last_col'range);
        elsif cfg_index = C_TILE_ROWS and cfg_in_range = '1' then
          tile_last_row <= cfg_less_1(tile_last_row'range);
        elsif cfg_index = C_WIN_COLS and cfg_in_range = '1' then
          win_last_col_q <= cfg_less_1(win_last_col_q'range);
        elsif cfg_index = C_WIN_ROWS and cfg_in_range = '1' then
          win_last_row_q <= cfg_less_1(win_last_row_q'range);
        elsif cfg_index = C_PLANES and cfg_in_range = '1' then
          last_plane <= cfg_less_1(last_plane'range);
        elsif cfg_index = C_THRESHOLD then
          threshold <= cfg_word(G_MNCC_W - 1 downto 0);
        elsif cfg_index = C_LEFT then
          left_x_lo <= cfg_word(C_INT_W - 1 downto 0);
        elsif cfg_index = C_LEFT + 1 then
          left_x_hi <= cfg_word(C_INT_W - 1 downto 0);
        elsif cfg_index = C_LEFT + 2 then
          left_y_lo <= cfg_word(C_INT_W - 1 downto 0);
        elsif cfg_index = C_LEFT + 3 then
          left_y_hi <= cfg_word(C_INT_W - 1 downto 0);
        elsif cfg_index = C_RIGHT then
          right_x_lo <= cfg_word(C_INT_W - 1 downto 0);
        elsif cfg_index = C_RIGHT + 1 then
          right_x_hi <= cfg_word(C_INT_W - 1 downto 0);
        elsif cfg_index = C_RIGHT + 2 then
          right_y_lo <= cfg_word(C_INT_W - 1 downto 0);
        elsif cfg_index = C_RIGHT + 3 then
          right_y_hi <= cfg_word(C_INT_W - 1 downto 0);
        end if;
      end if;
      if cfg_table = '1' and table_ok = '1' and table_next = '1' then
        table_words <= table_words + 1;
      end if;
      sweep_last_col <= resize(tile_last_col, C_COL_W) + (G_WINDOW - 1);
      sweep_last_row <= resize(tile_last_row, C_ROW_W) + (G_WINDOW - 1);
      if rst = '1' then
        range_ok              <= (others => '0');
        range_ok(C_THRESHOLD) <= '1';
        threshold      <= (others => '0');
        win_last_col_q <= (others => '0'); -- nothing is loaded
        win_last_row_q <= (others => '0');
        table_words    <= (others => '0');
      end if;
    end if;
  end process p_registers;

  lanes(0) <= '1';

  g_mask : for n in 1 to G_LANES - 1 generate
    lanes(n) <= not at_set_end or to_sl(last_wide(1 downto 0) >= n) when G_LANES = 4
                else not at_set_end or last_wide(0);
  end generate g_mask;

  -- Only windows below C_ROW_MIN can have rows that need padding.
  g_padding : if G_WINDOW < C_ROW_MIN generate
    row_last_col <= sweep_last_col when sweep_last_col >= C_ROW_MIN - 1 else to_unsigned(C_ROW_MIN - 1, C_COL_W);
    at_row_last <= to_sl(col = sweep_last_col);
  end generate g_padding;

  g_no_padding : if G_WINDOW >= C_ROW_MIN generate
    row_last_col <= sweep_last_col;
    at_row_last <= at_col_end;
  end generate g_no_padding;

  -- Sequence ---------------------------------------------------------------------------------------------------------
  pix_ready <= is_load or is_drain;
  pix_fire  <= s_pix_tvalid and is_load;

  next_last_col <= resize(win_last_col_q, C_COL_W) when is_idle = '1' else row_last_col;
  next_last_row <= resize(win_last_row_q, C_ROW_W) when is_idle = '1' else sweep_last_row;

  at_last     <= at_col_end and at_row_end;
  last_wide   <= resize(last_plane, C_SET_W + C_PLANE_W + 2);
  last_set    <= last_wide(C_SET_W + C_LANE_W - 1 downto C_LANE_W);
  -- 'Not below' and the second comparison are for an upset bit: no tile sweeps more sets than the table has.
  at_set_end  <= to_sl(plane_set >= last_set or plane_set = C_SETS - 1);
  at_tile_end <= is_sweep and at_last and at_set_end_q;
  step        <= pix_fire or is_sweep;
  load_done   <= pix_fire and at_last and s_pix_tlast;
  event_short <= pix_fire and s_pix_tlast and not at_last;
  event_long  <= pix_fire and at_last and not s_pix_tlast;
  sample_last <= active and at_row_end and at_row_last;
  flushed     <= is_flush and to_sl(since_last = C_FLUSH);
  tile_done   <= is_unload and map_last and not map_more;
  -- What cannot be unless a bit was upset: a state without a name, a map that ends before or after its last beat, or a
  -- word of table or offsets with wrong parity (beside a sweep, one of a tile that was dropped).
  upset_now   <= not (is_idle or is_load or is_sweep or is_flush or is_unload or is_drain)
                 or (is_unload and not map_more and not map_valid)
                 or (map_last and map_more and not abort_q) -- (a beat that an abort takes away is none)
                 or ((is_sweep or is_flush) and to_sl(unsigned(word_error) /= 0));
  halt        <= command_abort or event_upset;
  -- Apart from where to, so that no chain of states lies before the register's enable.
  move        <= (is_idle and command_start)
                 or (is_load and s_pix_tvalid and (at_last or s_pix_tlast))
                 or at_tile_end or flushed or tile_done
                 or (is_drain and s_pix_tvalid and s_pix_tlast);
  -- A drained tile was counted when it was refused.
  tile_drop   <= event_config or event_table or event_short or event_long or event_upset
                 or (command_abort and not is_idle and not is_drain and not tile_done and not event_short
                     and not event_long);

  p_sequence : process (clk)
  begin
    if rising_edge(clk) then
      start_q <= load_done and not command_abort;
      abort_q <= halt;

      if move = '1' then
        if is_idle = '1' then
          if config_bad = '1' or table_bad = '1' then
            state_q <= C_DRAIN;
          else
            state_q <= C_LOAD;
          end if;
        elsif is_load = '1' then
          if at_last = '0' then
            state_q <= C_IDLE;
          elsif s_pix_tlast = '1' then
            state_q <= C_SWEEP;
          else
            state_q <= C_DRAIN;
          end if;
        elsif is_sweep = '1' then
          state_q <= C_FLUSHING;
        elsif is_flush = '1' then
          state_q <= C_UNLOAD;
        else
          state_q <= C_IDLE;
        end if;
      end if;
      event_upset <= upset_now;
      if rst = '1' or halt = '1' then
        event_upset <= '0';
        state_q     <= C_IDLE;
      end if;

      -- Flags of the sample to come, so that no decoding lies before the table's address.
      row_first <= load_done or (is_sweep and at_col_end and not at_tile_end);
      if load_done = '1' or (is_sweep = '1' and at_last = '1') then
        plane_first <= '1';
      elsif is_sweep = '1' and at_col_end = '1' then
        plane_first <= '0';
      end if;
      if load_done = '1' then
        active <= '1';
      elsif is_sweep = '1' and at_col_end = '1' then
        active <= not at_tile_end;
      elsif at_row_last = '1' then
        active <= '0';
      end if;

      if sample_last = '1' then
        since_last <= (others => '0');
      elsif since_last /= C_FLUSH then
        since_last <= since_last + 1;
      end if;

      if rst = '1' or halt = '1' then
        row_first <= '0';
        active    <= '0';
        start_q   <= '0';
      end if;
      if rst = '1' then
        abort_q    <= '0';
        since_last <= (others => '0');
      end if;
    end if;
  end process p_sequence;

  p_counters : process (clk)
  begin
    if rising_edge(clk) then
      -- Counters come back to 0 by themselves at the end of load and of every plane. Whether they are at their ends is
      -- known with them, from registers, since all states and checks hang on it.
      if step = '1' then
        if at_col_end = '1' then
          col        <= (others => '0');
          at_col_end <= one_col and not at_row_end;
          if at_row_end = '1' then
            row        <= (others => '0');
            at_row_end <= '0'; -- of a plane to come: it has at least three rows
          else
            row        <= row + 1;
            at_row_end <= to_sl(row = last_row_less_1);
          end if;
        else
          col        <= col + 1;
          at_col_end <= to_sl(col = last_col_less_1);
        end if;
      end if;
      -- Limits of load are set up in idle, those of the sweep, which has at least three rows, when load is over.
      if is_idle = '1' or load_done = '1' then
        last_col_less_1 <= next_last_col - 1;
        last_row_less_1 <= next_last_row - 1;
      end if;
      if is_idle = '1' then
        one_col    <= to_sl(win_last_col_q = 0);
        at_col_end <= to_sl(win_last_col_q = 0);
        at_row_end <= to_sl(win_last_row_q = 0);
      elsif load_done = '1' then
        one_col    <= '0';
      end if;
      at_set_end_q <= at_set_end; -- a set takes many clocks
      if is_sweep = '1' and at_last = '1' then
        plane_set <= plane_set + 1;
      end if;
      if rst = '1' or is_idle = '1' then
        col       <= (others => '0');
        row       <= (others => '0');
        plane_set <= (others => '0');
      elsif at_tile_end = '1' then
        plane_set <= (others => '0'); -- a legal table address
      end if;
    end if;
  end process p_counters;

  s_pix_tready  <= pix_ready;
  win_last_col  <= std_logic_vector(win_last_col_q);
  win_last_row  <= std_logic_vector(win_last_row_q);
  load_clear    <= is_idle;
  load_valid    <= pix_fire;
  load_col      <= std_logic_vector(col(clog2(G_IMG_COLS) - 1 downto 0));
  load_row_odd  <= row(0);
  load_row_end  <= at_col_end;
  map_start     <= start_q;
  map_unload    <= flushed;
  map_abort     <= abort_q;

  -- The strobes go far, to as many tables as there are lanes.
  p_strobes : process (clk)
  begin
    if rising_edge(clk) then
      m_valid       <= active;
      m_row_first   <= row_first;
      m_plane_first <= plane_first;
      m_plane_last  <= sample_last;
      m_plane       <= std_logic_vector(plane_set);
      m_lanes       <= lanes;
      if rst = '1' or halt = '1' then
        m_valid     <= '0';
        m_row_first <= '0';
      end if;
    end if;
  end process p_strobes;

  -- Status -----------------------------------------------------------------------------------------------------------
  -- Counted a clock later: the address generator's tests lie before them. In the clock after an abort it still shows a
  -- sample of the tile.
  p_window : process (clk)
    -- Of the lanes: an odd number, one at least, two at least, four.
    variable v_odd  : std_logic;
    variable v_one  : std_logic;
    variable v_two  : std_logic;
    variable v_four : std_logic;
  begin
    if rising_edge(clk) then
      v_odd  := '0';
      v_one  := '0';
      v_two  := '0';
      v_four := to_sl(G_LANES = 4);
      for n in 0 to G_LANES - 1 loop
        v_odd  := v_odd xor window_error(n);
        v_two  := v_two or (v_one and window_error(n));
        v_one  := v_one or window_error(n);
        v_four := v_four and window_error(n);
      end loop;
      samples_lost <= v_four & (v_two and not v_four) & v_odd;
      if rst = '1' or abort_q = '1' then
        samples_lost <= (others => '0');
      end if;
    end if;
  end process p_window;

  sample_lost        <= to_sl(samples_lost /= 0);
  window_errors_next <= ('0' & window_errors_q) + samples_lost;
  event_window     <= sample_lost and not window_seen;
  cfg_event        <= event_config or event_table or event_address or event_busy;
  tile_event       <= event_short or event_long or event_window or event_upset;
  error_count_next <= ('0' & error_count_q) + new_events;

  p_status : process (clk)
  begin
    if rising_edge(clk) then
      error_bits(C_ERROR_CONFIG)  <= error_bits(C_ERROR_CONFIG) or event_config;
      error_bits(C_ERROR_TABLE)   <= error_bits(C_ERROR_TABLE) or event_table;
      error_bits(C_ERROR_SHORT)   <= error_bits(C_ERROR_SHORT) or event_short;
      error_bits(C_ERROR_LONG)    <= error_bits(C_ERROR_LONG) or event_long;
      error_bits(C_ERROR_WINDOW)  <= error_bits(C_ERROR_WINDOW) or event_window;
      error_bits(C_ERROR_ADDRESS) <= error_bits(C_ERROR_ADDRESS) or event_address;
      error_bits(C_ERROR_BUSY)    <= error_bits(C_ERROR_BUSY) or event_busy;
      error_bits(C_ERROR_UPSET)   <= error_bits(C_ERROR_UPSET) or event_upset;
      -- Counted a clock later: the way through the table's checks is long enough.
      new_events <= (cfg_event and tile_event) & (cfg_event xor tile_event);
      if error_count_next(16) = '0' then
        error_count_q <= error_count_next(15 downto 0);
      else
        error_count_q <= (others => '1');
      end if;
      if tile_done = '1' then
        tiles_done_q <= plus_1_saturated(tiles_done_q);
      end if;
      drop_q <= tile_drop; -- counted a clock later, as many events lead to it
      if drop_q = '1' then
        tiles_dropped_q <= plus_1_saturated(tiles_dropped_q);
      end if;
      if G_LANES = 1 then -- the smaller circuit
        if sample_lost = '1' then
          window_errors_q <= plus_1_saturated(window_errors_q);
        end if;
      elsif window_errors_next(16) = '0' then
        window_errors_q <= window_errors_next(15 downto 0);
      else
        window_errors_q <= (others => '1');
      end if;
      if event_window = '1' then
        window_seen <= '1';
      end if;
      if start_ok = '1' then
        window_seen <= '0';
      end if;
      -- Clear goes first: what happens in its own clock counts.
      if command_clear = '1' then
        error_bits                   <= (others => '0');
        error_bits(C_ERROR_CONFIG)   <= event_config;
        error_bits(C_ERROR_TABLE)    <= event_table;
        error_bits(C_ERROR_SHORT)    <= event_short;
        error_bits(C_ERROR_LONG)     <= event_long;
        error_bits(C_ERROR_WINDOW)   <= event_window;
        error_bits(C_ERROR_BUSY)     <= event_busy;
        error_bits(C_ERROR_UPSET)    <= event_upset;
        error_count_q                <= (others => '0');
        tiles_done_q(15 downto 1)    <= (others => '0');
        tiles_done_q(0)              <= tile_done;
        tiles_dropped_q              <= (others => '0');
        window_errors_q              <= resize(samples_lost, 16);
        window_seen                  <= event_window;
      end if;
      if start_ok = '1' then
        tile_clocks_q <= to_unsigned(2, 32); -- it was on s_cfg a clock ago
      elsif is_idle = '0' and is_drain = '0' and tile_done = '0' then
        tile_clocks_q <= tile_clocks_q + 1;
      end if;
      if rst = '1' then
        error_bits      <= (others => '0');
        new_events      <= (others => '0');
        drop_q          <= '0';
        error_count_q   <= (others => '0');
        tiles_done_q    <= (others => '0');
        tiles_dropped_q <= (others => '0');
        window_errors_q <= (others => '0');
        window_seen     <= '0';
        tile_clocks_q   <= (others => '0');
      end if;
    end if;
  end process p_status;

  state         <= state_q(3 downto 1);
  busy          <= not is_idle;
  errors        <= error_bits;
  error_count   <= std_logic_vector(error_count_q);
  tiles_done    <= std_logic_vector(tiles_done_q);
  tiles_dropped <= std_logic_vector(tiles_dropped_q);
  window_errors <= std_logic_vector(window_errors_q);
  tile_clocks   <= std_logic_vector(tile_clocks_q);

  -- synthesis translate_off
  -- Rules, in simulators.
  p_rules : process (clk)
    variable v_waits : boolean := false; -- a pixel was there and not taken
    variable v_last  : std_logic;
    variable v_abort : boolean := false; -- since the latest pixel: a sender may forget its tile then
  begin
    if rising_edge(clk) then
      if rst = '0' then
        assert event_upset = '0'
          report "control: a state that cannot be, an end of the map that cannot be, or a word with wrong parity"
          severity failure;
        assert not is_x(error_bits) and not is_x(std_logic_vector(error_count_q)) and not is_x(state_q)
          report "control: an unknown state, error bit or counter"
          severity failure;
        assert not v_waits or (s_pix_tvalid = '1' and s_pix_tlast = v_last)
          report "control: a pixel that waited at s_pix_* was withdrawn or changed"
          severity failure;
        assert is_load = '0' or (col <= win_last_col_q and row <= win_last_row_q)
          report "control: a pixel beyond the window"
          severity failure;
        assert is_sweep = '0' or (col <= row_last_col and row <= sweep_last_row and plane_set < C_SETS)
          report "control: a sample beyond the tile"
          severity failure;
      end if;
      v_abort := (s_cfg_tvalid = '1' and unsigned(s_cfg_tdata(47 downto 32)) = C_COMMAND and s_cfg_tdata(1) = '1')
                 or command_abort = '1' or (v_abort and (s_pix_tvalid and pix_ready) = '0');
      v_waits := rst = '0' and s_pix_tvalid = '1' and pix_ready = '0' and not v_abort;
      v_last  := s_pix_tlast;
    end if;
  end process p_rules;
  -- synthesis translate_on

end architecture rtl;
