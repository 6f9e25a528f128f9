// SPDX-License-Identifier: Apache-2.0
// control with windows of up to 6 x 4 pixels, tiles of up to 2 x 2 cells, 3 planes and 3 x 3 cells a window: whatever
// comes on its streams, resets at any time, for ever after the first one:
//   - a tile begins only with sizes in range and a table that was written; else it is refused and drained
//   - it takes as many pixels as its window has, sweeps its samples in order, G_LANES planes at once, and rows start
//     8 clocks apart or more; the map is unloaded when what was swept has had time to reach it
//   - every start that finds the engine idle ends in one tile done or one tile dropped, never in both
//   - the state is one of six, so the error 'upset' comes behind a word with wrong parity in a sweep and else never; it
//     drops the tile
// `LANES and `LATENCY are the entity's generics. Sizes are followed here from the writes on s_cfg alone. tile_done and
// tile_drop are brought out by scripts/formal.sh.
// Assumed of updating: the last beat of a map comes once, while unloading but not in its first clock, and until then a
// beat is there or follows.
module proof(input clk, rst, s_cfg_tvalid, s_pix_tvalid, s_pix_tlast, map_more, map_valid, map_last,
             input [`LANES - 1:0] window_error, word_error, input [47:0] s_cfg_tdata);
  wire s_pix_tready, load_valid, load_row_end, m_valid, m_row_first, m_plane_first, m_plane_last;
  wire map_unload, map_start, map_abort, tile_done, tile_drop;
  wire [2:0] load_col, state;
  wire [`LANES == 1:0] m_plane;
  wire [`LANES - 1:0] m_lanes;
  wire [7:0] errors;
  control dut(.clk(clk), .rst(rst), .s_cfg_tvalid(s_cfg_tvalid), .s_cfg_tdata(s_cfg_tdata),
              .s_pix_tvalid(s_pix_tvalid), .s_pix_tready(s_pix_tready), .s_pix_tlast(s_pix_tlast),
              .load_valid(load_valid), .load_col(load_col), .load_row_end(load_row_end),
              .m_valid(m_valid), .m_row_first(m_row_first), .m_plane_first(m_plane_first),
              .m_plane_last(m_plane_last), .m_plane(m_plane), .m_lanes(m_lanes),
              .map_start(map_start), .map_unload(map_unload), .map_abort(map_abort),
              .map_more(map_more), .map_valid(map_valid), .map_last(map_last), .window_error(window_error), .word_error(word_error),
              .state(state), .errors(errors), .tile_done(tile_done), .tile_drop(tile_drop));

  localparam IDLE = 0, LOAD = 1, SWEEP = 2, FLUSH = 3, UNLOAD = 4, DRAIN = 5;

  // What the words on s_cfg say.
  reg cfg = 0;                                      // a word a clock ago
  reg [47:0] cfg_word = 0;
  wire [15:0] address = cfg_word[47:32];
  wire [31:0] value = cfg_word[31:0];
  wire write = cfg && state == IDLE;
  wire command = cfg && address == 0;
  reg upset = 0, upset_seen = 0;                    // a word with wrong parity a clock ago; any
  wire abort = upset || command && value[1];
  wire start = command && value[0] && !value[1] && state == IDLE;
  reg [4:0] known = 0;
  reg [2:0] tile_cols = 1, tile_rows = 1, win_cols = 1, win_rows = 1, planes = 1;
  reg threshold_ok = 1;
  reg [4:0] words = 0;
  wire good = &known && threshold_ok && words >= 8 * planes;

  // The tile in work.
  reg begun = 0, open = 0;                          // a tile is in work
  reg [2:0] col = 0, row = 0;                       // pixel to come
  reg [3:0] i = 0;                                  // sample of the row, then clocks up to 8
  reg [2:0] j = 0;                                  // row of samples
  reg [1:0] set = 0;
  reg sample = 0, sample_row = 0, sample_plane = 0, sample_last = 0;
  reg [1:0] sample_set = 0;
  reg was_unload = 0;
  reg [3:0] quiet = 0;                              // clocks since the last sample
  wire [3:0] row_clocks = tile_cols + 2 < 8 ? 8 : tile_cols + 2;
  wire last_pixel = col == win_cols - 1 && row == win_rows - 1;
  wire last_clock = i == row_clocks - 1 && j == tile_rows + 1;
  wire last_set = (set + 1) * `LANES >= planes;
  wire taken = s_pix_tvalid && state == LOAD;

  always @($global_clock) if (clk) begin
    cfg <= s_cfg_tvalid && !rst;
    cfg_word <= s_cfg_tdata;
    upset <= !rst && !abort && (state == SWEEP || state == FLUSH) && word_error != 0;
    upset_seen <= !rst && (upset || upset_seen);
    was_unload <= state == UNLOAD;
    if (rst) begin
      begun <= 1;
      known <= 0;
      threshold_ok <= 1;
      words <= 0;
    end else if (write && address >= 1 && address <= 6) begin
      if (address == 1) begin
        known[0] <= value >= 1 && value <= 2;
        if (value >= 1 && value <= 2) tile_cols <= value;
      end
      if (address == 2) begin
        known[1] <= value >= 1 && value <= 2;
        if (value >= 1 && value <= 2) tile_rows <= value;
      end
      if (address == 3) begin
        known[2] <= value >= 1 && value <= 6;
        if (value >= 1 && value <= 6) win_cols <= value;
      end
      if (address == 4) begin
        known[3] <= value >= 1 && value <= 4;
        if (value >= 1 && value <= 4) win_rows <= value;
      end
      if (address == 5) begin
        known[4] <= value >= 1 && value <= 3;
        if (value >= 1 && value <= 3) planes <= value;
      end
      if (address == 6) threshold_ok <= value < 16;
    end else if (write && address[15] && address[14:0] == words && words < 24) words <= words + 1;

    open <= !rst && !abort && (open || start) && !tile_done && !tile_drop;
    if (rst || state != LOAD) {col, row} <= 0;
    else if (taken) begin
      col <= col == win_cols - 1 ? 0 : col + 1;
      if (col == win_cols - 1) row <= row + 1;
    end
    if (rst || state != SWEEP) {i, j, set} <= 0;
    else begin
      i <= i == row_clocks - 1 ? 0 : i + 1;
      if (i == row_clocks - 1) j <= j == tile_rows + 1 ? 0 : j + 1;
      if (last_clock) set <= set + 1;
    end
    // Strobes come out of registers.
    sample <= !rst && !abort && state == SWEEP && i < tile_cols + 2;
    sample_row <= !rst && !abort && state == SWEEP && i == 0;
    sample_plane <= j == 0;
    sample_last <= i == tile_cols + 1 && j == tile_rows + 1;
    sample_set <= set;
    quiet <= m_valid ? 1 : quiet == 15 ? 15 : quiet + 1;
  end

  always @* begin
    assume (!map_last || state == UNLOAD && was_unload && map_valid && !map_more);
    assume (state != UNLOAD || map_more || map_valid);
    if (begun) begin
      assert (state <= DRAIN && (!errors[7] || upset_seen));
      if (upset) assert (tile_drop);
      assert (s_pix_tready == (state == LOAD || state == DRAIN));
      assert (open == (state == LOAD || state == SWEEP || state == FLUSH || state == UNLOAD));
      assert (!(tile_done && tile_drop) && (!(tile_done || tile_drop) || open || start));
      // Load.
      assert (load_valid == taken);
      if (taken) assert (load_col == col && load_row_end == (col == win_cols - 1));
      // Sweep.
      assert (m_valid == sample && m_row_first == sample_row);
      if (m_valid) begin
        assert (m_plane_first == sample_plane && m_plane_last == sample_last);
        assert (m_plane == sample_set && sample_set * `LANES < planes && m_lanes[0]);
        if (`LANES > 1) assert (m_lanes[`LANES - 1] == (sample_set * `LANES + `LANES - 1 < planes));
      end
      if (map_unload) assert (state == FLUSH && quiet > `LATENCY);
      if (tile_done) assert (map_last);
    end
  end

  // From state to state.
  reg [2:0] next_state = 0;
  always @($global_clock) if (clk)
    next_state <= rst || abort ? IDLE
                  : state == IDLE ? (start ? (good ? LOAD : DRAIN) : IDLE)
                  : state == LOAD && taken ? (last_pixel ? (s_pix_tlast ? SWEEP : DRAIN) : s_pix_tlast ? IDLE : LOAD)
                  : state == SWEEP && last_clock && last_set ? FLUSH
                  : state == FLUSH && map_unload ? UNLOAD
                  : state == UNLOAD && map_last ? IDLE
                  : state == DRAIN && s_pix_tvalid && s_pix_tlast ? IDLE : state;
  always @* if (begun) assert (state == next_state);
endmodule
