-- SPDX-License-Identifier: Apache-2.0
-- psweep: the plane-sweep stereo engine (paper, section 4.2, figure 4): a tile of pixels in, a tile of depth cells out.
--   Streams   : s_cfg registers and plane table, s_pix the window of both images, m_map the cells (docs/registers.md)
--   Rate      : one plane cell per clock and lane through the whole sweep, no bubble between rows or planes
--   Clocks    : from the start command to the last map beat (port tile_clocks), without stalls outside,
--                 win_cols * win_rows + tile_cols * tile_rows
--               + ceil(planes / G_LANES) * (tile_rows + G_WINDOW - 1) * max(tile_cols + G_WINDOW - 1, 8)
--               - max(0, 8 - (tile_cols + G_WINDOW - 1)) + 48 + G_LANES + G_MNCC_W + G_FRAC_W - 3 G_RECTIFIED
--               = engine_clocks() of sw/golden/control.hpp; the bench checks it. The fill is paid once per tile
--   Numbers   : docs/numeric_contract.md
--   Lanes     : G_LANES planes (1, 2 or 4) are swept at once over one image buffer and one map, with the same results
--               bit by bit. Each lane has its own address_generator, interpolation and similarity; vectors hold lane 0
--               in the low bits. Lane n sweeps planes n, n + G_LANES, n + 2 G_LANES ..; its part of the plane table
--               holds just those. Lanes beyond the last plane rest
--   Rectified : G_RECTIFIED = 1 is a smaller build for pairs whose rows correspond: no interpolation between rows, two
--               banks per image instead of four. Same results if all samples lie on rows of pixels; a sample between
--               rows counts as not loaded (window error)
--   Divider   : G_DIVIDER = 1 divides in three products per lane: less logic, same results and clocks (similarity)
--   Split     : G_SPLIT = 1 for multipliers of 18 x 18 bits: a higher clock there, same results and clocks (similarity)
--   Reset     : synchronous, in any state; back to idle, table empty, sizes missing
--   dbg_*     : outputs of the stages for waves and tests; leave open
--   Golden    : sw/golden/psweep.hpp
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;

entity psweep is
  generic (
    G_IMG_COLS   : integer := 340;
    G_IMG_ROWS   : integer := 144;
    G_PLANE_COLS : integer := 256;
    G_PLANE_ROWS : integer := 130;
    G_PLANES     : integer := 301;
    G_WINDOW     : integer := 13;
    G_PIX_W      : integer := 8;
    G_WEIGHT_W   : integer := 8;
    G_INTERP_F   : integer := 2;
    G_MNCC_W     : integer := 13;
    G_FRAC_W     : integer := 8;
    G_LANES      : integer := 1;
    G_RECTIFIED  : integer := 0;
    G_DIVIDER    : integer := 0;
    G_SPLIT      : integer := 0
  );
  port (
    clk : in  std_logic;
    rst : in  std_logic;

    s_cfg_tvalid : in  std_logic;
    s_cfg_tready : out std_logic;
    s_cfg_tdata  : in  std_logic_vector(47 downto 0);

    s_pix_tvalid : in  std_logic;
    s_pix_tready : out std_logic;
    s_pix_tdata  : in  std_logic_vector(2 * G_PIX_W - 1 downto 0);
    s_pix_tlast  : in  std_logic;

    m_map_tvalid : out std_logic;
    m_map_tready : in  std_logic;
    m_map_tdata  : out std_logic_vector(4 + clog2(G_PLANES) + G_FRAC_W + G_MNCC_W - 1 downto 0);
    m_map_tlast  : out std_logic;

    busy          : out std_logic;
    state         : out std_logic_vector(2 downto 0);
    errors        : out std_logic_vector(7 downto 0);
    error_count   : out std_logic_vector(15 downto 0);
    tiles_done    : out std_logic_vector(15 downto 0);
    tiles_dropped : out std_logic_vector(15 downto 0);
    window_errors : out std_logic_vector(15 downto 0);
    tile_clocks   : out std_logic_vector(31 downto 0);

    -- Positions, pixels, samples, similarities: lane 0 in the low bits.
    dbg_sample_valid     : out std_logic_vector(G_LANES - 1 downto 0);
    dbg_xi_left          : out std_logic_vector(G_LANES * C_INT_W - 1 downto 0);
    dbg_yi_left          : out std_logic_vector(G_LANES * C_INT_W - 1 downto 0);
    dbg_fx_left          : out std_logic_vector(G_LANES * G_WEIGHT_W - 1 downto 0);
    dbg_fy_left          : out std_logic_vector(G_LANES * G_WEIGHT_W - 1 downto 0);
    dbg_xi_right         : out std_logic_vector(G_LANES * C_INT_W - 1 downto 0);
    dbg_yi_right         : out std_logic_vector(G_LANES * C_INT_W - 1 downto 0);
    dbg_fx_right         : out std_logic_vector(G_LANES * G_WEIGHT_W - 1 downto 0);
    dbg_fy_right         : out std_logic_vector(G_LANES * G_WEIGHT_W - 1 downto 0);
    dbg_usable_x         : out std_logic_vector(G_LANES - 1 downto 0);
    dbg_usable_y         : out std_logic_vector(G_LANES - 1 downto 0);
    dbg_window_error     : out std_logic_vector(G_LANES - 1 downto 0);
    dbg_quad_valid       : out std_logic_vector(G_LANES - 1 downto 0);
    dbg_p00_left         : out std_logic_vector(G_LANES * G_PIX_W - 1 downto 0);
    dbg_p10_left         : out std_logic_vector(G_LANES * G_PIX_W - 1 downto 0);
    dbg_p01_left         : out std_logic_vector(G_LANES * G_PIX_W - 1 downto 0);
    dbg_p11_left         : out std_logic_vector(G_LANES * G_PIX_W - 1 downto 0);
    dbg_p00_right        : out std_logic_vector(G_LANES * G_PIX_W - 1 downto 0);
    dbg_p10_right        : out std_logic_vector(G_LANES * G_PIX_W - 1 downto 0);
    dbg_p01_right        : out std_logic_vector(G_LANES * G_PIX_W - 1 downto 0);
    dbg_p11_right        : out std_logic_vector(G_LANES * G_PIX_W - 1 downto 0);
    dbg_interp_valid     : out std_logic_vector(G_LANES - 1 downto 0);
    dbg_l                : out std_logic_vector(G_LANES * (G_PIX_W + G_INTERP_F) - 1 downto 0);
    dbg_r                : out std_logic_vector(G_LANES * (G_PIX_W + G_INTERP_F) - 1 downto 0);
    dbg_sim_valid        : out std_logic_vector(G_LANES - 1 downto 0);
    dbg_sim_last         : out std_logic_vector(G_LANES - 1 downto 0);
    dbg_sim_inside       : out std_logic_vector(G_LANES - 1 downto 0);
    dbg_sim_textured     : out std_logic_vector(G_LANES - 1 downto 0);
    dbg_sim_v            : out std_logic_vector(G_LANES * G_MNCC_W - 1 downto 0);
    -- Write port of the map.
    dbg_map_we           : out std_logic;
    dbg_map_addr         : out std_logic_vector(clog2(G_PLANE_COLS * G_PLANE_ROWS) - 1 downto 0);
    dbg_map_best         : out std_logic_vector(G_MNCC_W - 1 downto 0);
    dbg_map_prev         : out std_logic_vector(G_MNCC_W - 1 downto 0);
    dbg_map_plane        : out std_logic_vector(clog2(G_PLANES) - 1 downto 0);
    dbg_map_frac         : out std_logic_vector(G_FRAC_W - 1 downto 0);
    dbg_map_local_max    : out std_logic;
    dbg_map_prev_valid   : out std_logic
  );
end entity psweep;

architecture rtl of psweep is

  constant C_LANE_W   : integer := G_LANES / 2; -- bits of a lane's number: 0, 1 or 2
  constant C_SETS     : integer := plane_sets(G_PLANES, G_LANES);
  constant C_SET_W    : integer := clog2(C_SETS);
  constant C_BANK_W   : integer := bank_bits(G_IMG_COLS, G_IMG_ROWS, G_RECTIFIED);
  constant C_SAMPLE_W : integer := G_PIX_W + G_INTERP_F;
  -- From a sample's strobe to the write of the cell that it completes.
  constant C_LATENCY  : integer := C_ADDRESS_LATENCY + C_STORAGE_LATENCY + interpolation_latency(G_RECTIFIED)
                                   + similarity_latency(G_MNCC_W) + updating_latency(G_FRAC_W, G_LANES);

  signal pipe_rst : std_logic; -- also an abort clears what is on its way

  -- Registers and table writes.
  signal cfg_data     : std_logic_vector(31 downto 0);
  signal cfg_parity   : std_logic;
  signal table_we     : std_logic;
  signal table_addr   : std_logic_vector(clog2(G_PLANES) + 2 downto 0);
  -- Lane and word of a table write: plane n * G_LANES + lane is entry n of the lane.
  signal table_wide   : unsigned(clog2(G_PLANES) + C_SET_W + 5 downto 0); -- table_addr, wide enough for any slice
  signal lane_addr    : std_logic_vector(C_SET_W + 2 downto 0);
  signal offset_we    : std_logic;
  signal offset_addr  : std_logic_vector(1 downto 0);
  signal win_last_col : std_logic_vector(clog2(G_IMG_COLS) - 1 downto 0);
  signal win_last_row : std_logic_vector(clog2(G_IMG_ROWS) - 1 downto 0);
  signal threshold    : std_logic_vector(G_MNCC_W - 1 downto 0);
  signal left_x_lo    : std_logic_vector(C_INT_W - 1 downto 0);
  signal left_x_hi    : std_logic_vector(C_INT_W - 1 downto 0);
  signal left_y_lo    : std_logic_vector(C_INT_W - 1 downto 0);
  signal left_y_hi    : std_logic_vector(C_INT_W - 1 downto 0);
  signal right_x_lo   : std_logic_vector(C_INT_W - 1 downto 0);
  signal right_x_hi   : std_logic_vector(C_INT_W - 1 downto 0);
  signal right_y_lo   : std_logic_vector(C_INT_W - 1 downto 0);
  signal right_y_hi   : std_logic_vector(C_INT_W - 1 downto 0);

  -- Sequence.
  signal load_clear        : std_logic;
  signal load_valid        : std_logic;
  signal load_col          : std_logic_vector(clog2(G_IMG_COLS) - 1 downto 0);
  signal load_row_odd      : std_logic;
  signal load_row_end      : std_logic;
  signal sweep_valid       : std_logic;
  signal sweep_row_first   : std_logic;
  signal sweep_plane_first : std_logic;
  signal sweep_plane_last  : std_logic;
  signal sweep_set         : std_logic_vector(C_SET_W - 1 downto 0);
  signal sweep_lanes       : std_logic_vector(G_LANES - 1 downto 0);
  signal map_start         : std_logic;
  signal map_unload        : std_logic;
  signal map_abort         : std_logic;
  signal map_more          : std_logic;
  signal map_valid         : std_logic;
  signal unload_done       : std_logic;
  -- address_generator to storage.
  signal address_valid          : std_logic_vector(G_LANES - 1 downto 0);
  signal address_row_first      : std_logic_vector(G_LANES - 1 downto 0);
  signal address_plane_first    : std_logic_vector(G_LANES - 1 downto 0);
  signal address_plane_last     : std_logic_vector(G_LANES - 1 downto 0);
  signal address_xi_left        : std_logic_vector(G_LANES * C_INT_W - 1 downto 0);
  signal address_yi_left        : std_logic_vector(G_LANES * C_INT_W - 1 downto 0);
  signal address_fx_left        : std_logic_vector(G_LANES * G_WEIGHT_W - 1 downto 0);
  signal address_fy_left        : std_logic_vector(G_LANES * G_WEIGHT_W - 1 downto 0);
  signal address_xi_right       : std_logic_vector(G_LANES * C_INT_W - 1 downto 0);
  signal address_yi_right       : std_logic_vector(G_LANES * C_INT_W - 1 downto 0);
  signal address_fx_right       : std_logic_vector(G_LANES * G_WEIGHT_W - 1 downto 0);
  signal address_fy_right       : std_logic_vector(G_LANES * G_WEIGHT_W - 1 downto 0);
  signal address_row_even_left  : std_logic_vector(G_LANES * C_BANK_W - 1 downto 0);
  signal address_row_odd_left   : std_logic_vector(G_LANES * C_BANK_W - 1 downto 0);
  signal address_row_even_right : std_logic_vector(G_LANES * C_BANK_W - 1 downto 0);
  signal address_row_odd_right  : std_logic_vector(G_LANES * C_BANK_W - 1 downto 0);
  signal address_usable_x       : std_logic_vector(G_LANES - 1 downto 0);
  signal address_usable_y       : std_logic_vector(G_LANES - 1 downto 0);
  signal address_window_error   : std_logic_vector(G_LANES - 1 downto 0);
  signal address_word_error     : std_logic_vector(G_LANES - 1 downto 0);

  -- storage to interpolation.
  signal quad_valid       : std_logic_vector(G_LANES - 1 downto 0);
  signal quad_row_first   : std_logic_vector(G_LANES - 1 downto 0);
  signal quad_plane_first : std_logic_vector(G_LANES - 1 downto 0);
  signal quad_plane_last  : std_logic_vector(G_LANES - 1 downto 0);
  signal quad_usable_x    : std_logic_vector(G_LANES - 1 downto 0);
  signal quad_usable_y    : std_logic_vector(G_LANES - 1 downto 0);
  signal quad_fx_left     : std_logic_vector(G_LANES * G_WEIGHT_W - 1 downto 0);
  signal quad_fy_left     : std_logic_vector(G_LANES * G_WEIGHT_W - 1 downto 0);
  signal quad_fx_right    : std_logic_vector(G_LANES * G_WEIGHT_W - 1 downto 0);
  signal quad_fy_right    : std_logic_vector(G_LANES * G_WEIGHT_W - 1 downto 0);
  signal quad_p00_left    : std_logic_vector(G_LANES * G_PIX_W - 1 downto 0);
  signal quad_p10_left    : std_logic_vector(G_LANES * G_PIX_W - 1 downto 0);
  signal quad_p01_left    : std_logic_vector(G_LANES * G_PIX_W - 1 downto 0);
  signal quad_p11_left    : std_logic_vector(G_LANES * G_PIX_W - 1 downto 0);
  signal quad_p00_right   : std_logic_vector(G_LANES * G_PIX_W - 1 downto 0);
  signal quad_p10_right   : std_logic_vector(G_LANES * G_PIX_W - 1 downto 0);
  signal quad_p01_right   : std_logic_vector(G_LANES * G_PIX_W - 1 downto 0);
  signal quad_p11_right   : std_logic_vector(G_LANES * G_PIX_W - 1 downto 0);

  -- interpolation to similarity.
  signal sample_valid       : std_logic_vector(G_LANES - 1 downto 0);
  signal sample_row_first   : std_logic_vector(G_LANES - 1 downto 0);
  signal sample_plane_first : std_logic_vector(G_LANES - 1 downto 0);
  signal sample_plane_last  : std_logic_vector(G_LANES - 1 downto 0);
  signal sample_usable_x    : std_logic_vector(G_LANES - 1 downto 0);
  signal sample_usable_y    : std_logic_vector(G_LANES - 1 downto 0);
  signal sample_l           : std_logic_vector(G_LANES * C_SAMPLE_W - 1 downto 0);
  signal sample_r           : std_logic_vector(G_LANES * C_SAMPLE_W - 1 downto 0);

  -- similarity to updating.
  signal cell_valid    : std_logic_vector(G_LANES - 1 downto 0);
  signal cell_last     : std_logic_vector(G_LANES - 1 downto 0);
  signal cell_inside   : std_logic_vector(G_LANES - 1 downto 0);
  signal cell_textured : std_logic_vector(G_LANES - 1 downto 0);
  signal cell_v        : std_logic_vector(G_LANES * G_MNCC_W - 1 downto 0);

  attribute max_fanout : string;

  attribute max_fanout of pipe_rst, sweep_valid, sweep_row_first : signal is C_FANOUT;
begin

  -- Ranges of the other generics are checked by the entities that use them.
  assert G_LANES = 1 or G_LANES = 2 or G_LANES = 4
    report "psweep: G_LANES"
           -- synthesis translate_off
           & "=" & integer'image(G_LANES)
           -- synthesis translate_on
           & " is not 1, 2 or 4"
    severity failure;

  pipe_rst <= rst or map_abort;

  u_control : entity work.control
    generic map (
      G_IMG_COLS   => G_IMG_COLS,
      G_IMG_ROWS   => G_IMG_ROWS,
      G_PLANE_COLS => G_PLANE_COLS,
      G_PLANE_ROWS => G_PLANE_ROWS,
      G_PLANES     => G_PLANES,
      G_WINDOW     => G_WINDOW,
      G_MNCC_W     => G_MNCC_W,
      G_LANES      => G_LANES,
      G_LATENCY    => C_LATENCY
    )
    port map (
      clk           => clk,
      rst           => rst,
      s_cfg_tvalid  => s_cfg_tvalid,
      s_cfg_tready  => s_cfg_tready,
      s_cfg_tdata   => s_cfg_tdata,
      s_pix_tvalid  => s_pix_tvalid,
      s_pix_tready  => s_pix_tready,
      s_pix_tlast   => s_pix_tlast,
      cfg_data      => cfg_data,
      cfg_parity    => cfg_parity,
      table_we      => table_we,
      table_addr    => table_addr,
      offset_we     => offset_we,
      offset_addr   => offset_addr,
      win_last_col  => win_last_col,
      win_last_row  => win_last_row,
      threshold     => threshold,
      left_x_lo     => left_x_lo,
      left_x_hi     => left_x_hi,
      left_y_lo     => left_y_lo,
      left_y_hi     => left_y_hi,
      right_x_lo    => right_x_lo,
      right_x_hi    => right_x_hi,
      right_y_lo    => right_y_lo,
      right_y_hi    => right_y_hi,
      load_clear    => load_clear,
      load_valid    => load_valid,
      load_col      => load_col,
      load_row_odd  => load_row_odd,
      load_row_end  => load_row_end,
      m_valid       => sweep_valid,
      m_row_first   => sweep_row_first,
      m_plane_first => sweep_plane_first,
      m_plane_last  => sweep_plane_last,
      m_plane       => sweep_set,
      m_lanes       => sweep_lanes,
      map_start     => map_start,
      map_unload    => map_unload,
      map_abort     => map_abort,
      map_more      => map_more,
      map_valid     => map_valid,
      map_last      => unload_done,
      window_error  => address_window_error,
      word_error    => address_word_error,
      state         => state,
      busy          => busy,
      errors        => errors,
      error_count   => error_count,
      tiles_done    => tiles_done,
      tiles_dropped => tiles_dropped,
      window_errors => window_errors,
      tile_clocks   => tile_clocks
    );

  table_wide <= resize(unsigned(table_addr), table_wide'length);
  lane_addr  <= std_logic_vector(table_wide(C_SET_W + C_LANE_W + 2 downto C_LANE_W + 3) & table_wide(2 downto 0));

  g_address : for lane in 0 to G_LANES - 1 generate
    signal lane_we        : std_logic;
    signal lane_valid     : std_logic;
    signal lane_row_first : std_logic;
  begin

    lane_we        <= table_we and to_sl(table_wide(4 downto 3) mod G_LANES = lane);
    lane_valid     <= sweep_valid and sweep_lanes(lane);
    lane_row_first <= sweep_row_first and sweep_lanes(lane);

    u_address_generator : entity work.address_generator
      generic map (
        G_PLANES    => C_SETS,
        G_IMG_COLS  => G_IMG_COLS,
        G_IMG_ROWS  => G_IMG_ROWS,
        G_WEIGHT_W  => G_WEIGHT_W,
        G_RECTIFIED => G_RECTIFIED
      )
      port map (
        clk              => clk,
        rst              => pipe_rst,
        table_we         => lane_we,
        table_addr       => lane_addr,
        offset_we        => offset_we,
        offset_addr      => offset_addr,
        cfg_data         => cfg_data,
        cfg_parity       => cfg_parity,
        win_last_col     => win_last_col,
        win_last_row     => win_last_row,
        left_x_lo        => left_x_lo,
        left_x_hi        => left_x_hi,
        left_y_lo        => left_y_lo,
        left_y_hi        => left_y_hi,
        right_x_lo       => right_x_lo,
        right_x_hi       => right_x_hi,
        right_y_lo       => right_y_lo,
        right_y_hi       => right_y_hi,
        s_valid          => lane_valid,
        s_row_first      => lane_row_first,
        s_plane_first    => sweep_plane_first,
        s_plane_last     => sweep_plane_last,
        s_plane          => sweep_set,
        m_valid          => address_valid(lane),
        m_row_first      => address_row_first(lane),
        m_plane_first    => address_plane_first(lane),
        m_plane_last     => address_plane_last(lane),
        m_xi_left        => address_xi_left((lane + 1) * C_INT_W - 1 downto lane * C_INT_W),
        m_yi_left        => address_yi_left((lane + 1) * C_INT_W - 1 downto lane * C_INT_W),
        m_fx_left        => address_fx_left((lane + 1) * G_WEIGHT_W - 1 downto lane * G_WEIGHT_W),
        m_fy_left        => address_fy_left((lane + 1) * G_WEIGHT_W - 1 downto lane * G_WEIGHT_W),
        m_xi_right       => address_xi_right((lane + 1) * C_INT_W - 1 downto lane * C_INT_W),
        m_yi_right       => address_yi_right((lane + 1) * C_INT_W - 1 downto lane * C_INT_W),
        m_fx_right       => address_fx_right((lane + 1) * G_WEIGHT_W - 1 downto lane * G_WEIGHT_W),
        m_fy_right       => address_fy_right((lane + 1) * G_WEIGHT_W - 1 downto lane * G_WEIGHT_W),
        m_row_even_left  => address_row_even_left((lane + 1) * C_BANK_W - 1 downto lane * C_BANK_W),
        m_row_odd_left   => address_row_odd_left((lane + 1) * C_BANK_W - 1 downto lane * C_BANK_W),
        m_row_even_right => address_row_even_right((lane + 1) * C_BANK_W - 1 downto lane * C_BANK_W),
        m_row_odd_right  => address_row_odd_right((lane + 1) * C_BANK_W - 1 downto lane * C_BANK_W),
        m_usable_x       => address_usable_x(lane),
        m_usable_y       => address_usable_y(lane),
        m_window_error   => address_window_error(lane),
        m_word_error     => address_word_error(lane)
      );

  end generate g_address;

  u_storage : entity work.storage
    generic map (
      G_IMG_COLS  => G_IMG_COLS,
      G_IMG_ROWS  => G_IMG_ROWS,
      G_PIX_W     => G_PIX_W,
      G_WEIGHT_W  => G_WEIGHT_W,
      G_LANES     => G_LANES,
      G_RECTIFIED => G_RECTIFIED
    )
    port map (
      clk              => clk,
      rst              => pipe_rst,
      load_clear       => load_clear,
      load_valid       => load_valid,
      load_col         => load_col,
      load_row_odd     => load_row_odd,
      load_row_end     => load_row_end,
      load_data        => s_pix_tdata,
      s_valid          => address_valid,
      s_row_first      => address_row_first,
      s_plane_first    => address_plane_first,
      s_plane_last     => address_plane_last,
      s_usable_x       => address_usable_x,
      s_usable_y       => address_usable_y,
      s_xi_left        => address_xi_left,
      s_yi_left        => address_yi_left,
      s_fx_left        => address_fx_left,
      s_fy_left        => address_fy_left,
      s_xi_right       => address_xi_right,
      s_yi_right       => address_yi_right,
      s_fx_right       => address_fx_right,
      s_fy_right       => address_fy_right,
      s_row_even_left  => address_row_even_left,
      s_row_odd_left   => address_row_odd_left,
      s_row_even_right => address_row_even_right,
      s_row_odd_right  => address_row_odd_right,
      m_valid          => quad_valid,
      m_row_first      => quad_row_first,
      m_plane_first    => quad_plane_first,
      m_plane_last     => quad_plane_last,
      m_usable_x       => quad_usable_x,
      m_usable_y       => quad_usable_y,
      m_fx_left        => quad_fx_left,
      m_fy_left        => quad_fy_left,
      m_fx_right       => quad_fx_right,
      m_fy_right       => quad_fy_right,
      m_p00_left       => quad_p00_left,
      m_p10_left       => quad_p10_left,
      m_p01_left       => quad_p01_left,
      m_p11_left       => quad_p11_left,
      m_p00_right      => quad_p00_right,
      m_p10_right      => quad_p10_right,
      m_p01_right      => quad_p01_right,
      m_p11_right      => quad_p11_right
    );

  g_similarity : for lane in 0 to G_LANES - 1 generate

    u_interpolation : entity work.interpolation
      generic map (
        G_PIX_W     => G_PIX_W,
        G_WEIGHT_W  => G_WEIGHT_W,
        G_INTERP_F  => G_INTERP_F,
        G_RECTIFIED => G_RECTIFIED
      )
      port map (
        clk           => clk,
        rst           => pipe_rst,
        s_valid       => quad_valid(lane),
        s_row_first   => quad_row_first(lane),
        s_plane_first => quad_plane_first(lane),
        s_plane_last  => quad_plane_last(lane),
        s_usable_x    => quad_usable_x(lane),
        s_usable_y    => quad_usable_y(lane),
        s_fx_left     => quad_fx_left((lane + 1) * G_WEIGHT_W - 1 downto lane * G_WEIGHT_W),
        s_fy_left     => quad_fy_left((lane + 1) * G_WEIGHT_W - 1 downto lane * G_WEIGHT_W),
        s_fx_right    => quad_fx_right((lane + 1) * G_WEIGHT_W - 1 downto lane * G_WEIGHT_W),
        s_fy_right    => quad_fy_right((lane + 1) * G_WEIGHT_W - 1 downto lane * G_WEIGHT_W),
        s_p00_left    => quad_p00_left((lane + 1) * G_PIX_W - 1 downto lane * G_PIX_W),
        s_p10_left    => quad_p10_left((lane + 1) * G_PIX_W - 1 downto lane * G_PIX_W),
        s_p01_left    => quad_p01_left((lane + 1) * G_PIX_W - 1 downto lane * G_PIX_W),
        s_p11_left    => quad_p11_left((lane + 1) * G_PIX_W - 1 downto lane * G_PIX_W),
        s_p00_right   => quad_p00_right((lane + 1) * G_PIX_W - 1 downto lane * G_PIX_W),
        s_p10_right   => quad_p10_right((lane + 1) * G_PIX_W - 1 downto lane * G_PIX_W),
        s_p01_right   => quad_p01_right((lane + 1) * G_PIX_W - 1 downto lane * G_PIX_W),
        s_p11_right   => quad_p11_right((lane + 1) * G_PIX_W - 1 downto lane * G_PIX_W),
        m_valid       => sample_valid(lane),
        m_row_first   => sample_row_first(lane),
        m_plane_first => sample_plane_first(lane),
        m_plane_last  => sample_plane_last(lane),
        m_usable_x    => sample_usable_x(lane),
        m_usable_y    => sample_usable_y(lane),
        m_l           => sample_l((lane + 1) * C_SAMPLE_W - 1 downto lane * C_SAMPLE_W),
        m_r           => sample_r((lane + 1) * C_SAMPLE_W - 1 downto lane * C_SAMPLE_W)
      );

    u_similarity : entity work.similarity
      generic map (
        G_WINDOW   => G_WINDOW,
        G_SAMPLE_W => C_SAMPLE_W,
        G_MNCC_W   => G_MNCC_W,
        G_MAX_COLS => G_PLANE_COLS + G_WINDOW - 1,
        G_DIVIDER  => G_DIVIDER,
        G_SPLIT    => G_SPLIT
      )
      port map (
        clk           => clk,
        rst           => pipe_rst,
        s_valid       => sample_valid(lane),
        s_row_first   => sample_row_first(lane),
        s_plane_first => sample_plane_first(lane),
        s_plane_last  => sample_plane_last(lane),
        s_usable_x    => sample_usable_x(lane),
        s_usable_y    => sample_usable_y(lane),
        s_l           => sample_l((lane + 1) * C_SAMPLE_W - 1 downto lane * C_SAMPLE_W),
        s_r           => sample_r((lane + 1) * C_SAMPLE_W - 1 downto lane * C_SAMPLE_W),
        m_valid       => cell_valid(lane),
        m_last        => cell_last(lane),
        m_inside      => cell_inside(lane),
        m_textured    => cell_textured(lane),
        m_v           => cell_v((lane + 1) * G_MNCC_W - 1 downto lane * G_MNCC_W)
      );

  end generate g_similarity;

  u_updating : entity work.updating
    generic map (
      G_CELLS  => G_PLANE_COLS * G_PLANE_ROWS,
      G_PLANES => G_PLANES,
      G_MNCC_W => G_MNCC_W,
      G_FRAC_W => G_FRAC_W,
      G_LANES  => G_LANES
    )
    port map (
      clk                => clk,
      rst                => rst,
      start              => map_start,
      cancel             => map_abort,
      s_valid            => cell_valid,
      s_last             => cell_last(0),
      s_inside           => cell_inside,
      s_textured         => cell_textured,
      s_v                => cell_v,
      threshold          => threshold,
      unload             => map_unload,
      unload_more        => map_more,
      unload_done        => unload_done,
      m_tvalid           => map_valid,
      m_tready           => m_map_tready,
      m_tdata            => m_map_tdata,
      m_tlast            => m_map_tlast,
      dbg_map_we         => dbg_map_we,
      dbg_map_addr       => dbg_map_addr,
      dbg_map_best       => dbg_map_best,
      dbg_map_prev       => dbg_map_prev,
      dbg_map_plane      => dbg_map_plane,
      dbg_map_frac       => dbg_map_frac,
      dbg_map_local_max  => dbg_map_local_max,
      dbg_map_prev_valid => dbg_map_prev_valid
    );

  -- In the clock of map_abort updating still shows a beat, and forgets it.
  m_map_tvalid <= map_valid and not map_abort;

  dbg_sample_valid <= address_valid;
  dbg_xi_left      <= address_xi_left;
  dbg_yi_left      <= address_yi_left;
  dbg_fx_left      <= address_fx_left;
  dbg_fy_left      <= address_fy_left;
  dbg_xi_right     <= address_xi_right;
  dbg_yi_right     <= address_yi_right;
  dbg_fx_right     <= address_fx_right;
  dbg_fy_right     <= address_fy_right;
  dbg_usable_x     <= address_usable_x;
  dbg_usable_y     <= address_usable_y;
  dbg_window_error <= address_window_error;
  dbg_quad_valid   <= quad_valid;
  dbg_p00_left     <= quad_p00_left;
  dbg_p10_left     <= quad_p10_left;
  dbg_p01_left     <= quad_p01_left;
  dbg_p11_left     <= quad_p11_left;
  dbg_p00_right    <= quad_p00_right;
  dbg_p10_right    <= quad_p10_right;
  dbg_p01_right    <= quad_p01_right;
  dbg_p11_right    <= quad_p11_right;
  dbg_interp_valid <= sample_valid;
  dbg_l            <= sample_l;
  dbg_r            <= sample_r;
  dbg_sim_valid    <= cell_valid;
  dbg_sim_last     <= cell_last;
  dbg_sim_inside   <= cell_inside;
  dbg_sim_textured <= cell_textured;
  dbg_sim_v        <= cell_v;

end architecture rtl;
