-- SPDX-License-Identifier: Apache-2.0
-- similarity: MNCC of the left and right samples over G_WINDOW x G_WINDOW windows (paper, section 4.2.2, equation 1).
--   Method  : p = l + r, q = l - r, n = M*M, A = n S(p^2) - (S p)^2, B = n S(q^2) - (S q)^2, V = (A - B) / (A + B).
--             Per column the four sums over the last M rows are kept in one RAM; a new sample changes them by
--             d = new - old and d * (new + old) = new^2 - old^2, so one product serves each of p and q. The window sums
--             follow from the column sums likewise, as running sums. Nothing grows with M but RAM depth.
--   Rate    : one sample per clock; cells leave in raster order
--   Latency : similarity_latency(G_MNCC_W) clocks from the last sample of a window to its cell (psweep_pkg)
--   Numbers : samples ufix(G_SAMPLE_W,0); sums, A, B exact; operands of the division truncated to G_MNCC_W+3 bits with
--             the denominator's leading one on top; V ufix(0,G_MNCC_W) truncated, 0 where A <= B, A + B = 0 or outside
--   Rows    : any length from G_WINDOW to G_MAX_COLS, the same for all rows of a plane; a row takes at least C_ROW_MIN
--             clocks, which is what the loop through the column sums needs
--   State   : a plane begins with s_plane_first; nothing is carried over from the plane before
--   Reset   : clears the valids; sums, delays and memories have no reset
--   Golden  : sw/golden/similarity.hpp
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;

entity similarity is
  generic (
    G_WINDOW   : integer := 13;
    G_SAMPLE_W : integer := 10;
    G_MNCC_W   : integer := 13;
    G_MAX_COLS : integer := 268
  );
  port (
    clk : in  std_logic;
    rst : in  std_logic;

    s_valid       : in  std_logic;
    s_row_first   : in  std_logic; -- i = 0, only with s_valid
    s_plane_first : in  std_logic; -- j = 0, for the whole row
    s_plane_last  : in  std_logic; -- last sample of the plane
    s_usable_x    : in  std_logic; -- the column is usable
    s_usable_y    : in  std_logic; -- the row is usable; constant over a row
    s_l           : in  std_logic_vector(G_SAMPLE_W - 1 downto 0);
    s_r           : in  std_logic_vector(G_SAMPLE_W - 1 downto 0);

    m_valid    : out std_logic;
    m_last     : out std_logic; -- last cell of the plane
    m_inside   : out std_logic; -- all M*M samples are usable
    m_textured : out std_logic; -- inside, and A + B > 0
    m_v        : out std_logic_vector(G_MNCC_W - 1 downto 0)
  );
end entity similarity;

architecture rtl of similarity is

  constant C_N     : integer := G_WINDOW * G_WINDOW;
  constant C_GROW  : integer := clog2(G_WINDOW); -- bits that a sum of M values adds
  constant C_NGROW : integer := clog2(C_N);      -- likewise of M*M values
  constant C_NORM  : integer := G_MNCC_W + 3;
  constant C_SAT_W : integer := clog2(G_WINDOW + 1);

  -- Widths: p, |q| and their squares; column sums; window sums; A, B, A + B <= n^2 (2^G_SAMPLE_W - 1)^2.
  constant C_P_W   : integer := G_SAMPLE_W + 1;
  constant C_P2_W  : integer := 2 * G_SAMPLE_W + 2;
  constant C_Q2_W  : integer := 2 * G_SAMPLE_W;
  constant C_CP_W  : integer := C_P_W + C_GROW;
  constant C_CP2_W : integer := C_P2_W + C_GROW;
  constant C_CQ_W  : integer := C_P_W + C_GROW;
  constant C_CQ2_W : integer := C_Q2_W + C_GROW;
  constant C_C_W   : integer := C_CP_W + C_CP2_W + C_CQ_W + C_CQ2_W;
  constant C_SP_W  : integer := C_P_W + C_NGROW;
  constant C_SP2_W : integer := C_P2_W + C_NGROW;
  constant C_SQ_W  : integer := C_P_W + C_NGROW;
  constant C_SQ2_W : integer := C_Q2_W + C_NGROW;
  constant C_DEN_W : integer := 2 * G_SAMPLE_W + clog2(C_N * C_N);

  -- Delay of M rows: one circular buffer, begun anew when M rows have been written, so that it fits any row length.
  constant C_LINE_DEPTH : integer := G_WINDOW * G_MAX_COLS;

  -- s1: counters; each describes the sample in s1
  signal s1_valid       : std_logic;
  signal s1_row_first   : std_logic;
  signal s1_plane_first : std_logic;
  signal s1_plane_last  : std_logic;
  signal s1_l           : std_logic_vector(G_SAMPLE_W - 1 downto 0);
  signal s1_r           : std_logic_vector(G_SAMPLE_W - 1 downto 0);
  signal s1_col         : unsigned(clog2(G_MAX_COLS) - 1 downto 0);
  signal s1_line        : unsigned(clog2(C_LINE_DEPTH) - 1 downto 0); -- address in the delay of M rows
  signal s1_slot        : unsigned(C_SAT_W - 1 downto 0);             -- j mod M
  signal s1_warm        : std_logic;                                  -- j >= M: there is a sample M rows above
  signal s1_before      : unsigned(C_SAT_W - 1 downto 0);             -- samples before this one in its row, at most M
  signal s1_run_x       : unsigned(C_SAT_W - 1 downto 0);             -- usable columns up to here, at most M
  signal s1_run_y       : unsigned(C_SAT_W - 1 downto 0);             -- usable rows up to here, at most M
  signal s1_wide        : std_logic;                                  -- i >= M
  signal s1_cell        : std_logic;                                  -- the window is complete
  signal s1_inside      : std_logic;

  -- s2: the sample M rows above comes out of the delay
  signal s2_valid : std_logic;
  signal s2_warm  : std_logic;
  signal s2_l     : std_logic_vector(G_SAMPLE_W - 1 downto 0);
  signal s2_r     : std_logic_vector(G_SAMPLE_W - 1 downto 0);
  signal s2_line  : std_logic_vector(clog2(C_LINE_DEPTH) - 1 downto 0);
  signal s2_write : std_logic_vector(2 * G_SAMPLE_W - 1 downto 0);
  signal s2_old   : std_logic_vector(2 * G_SAMPLE_W - 1 downto 0);

  -- s3: sum and difference, new and old
  signal s3_valid : std_logic;
  signal s3_col   : std_logic_vector(clog2(G_MAX_COLS) - 1 downto 0);
  signal s3_p     : unsigned(C_P_W - 1 downto 0);
  signal s3_q     : signed(C_P_W - 1 downto 0);
  signal s3_p_old : unsigned(C_P_W - 1 downto 0);
  signal s3_q_old : signed(C_P_W - 1 downto 0);

  -- s4: new -/+ old; the column sums come out of their RAM
  signal s4_valid  : std_logic;
  signal s4_first  : std_logic; -- j = 0
  signal s4_dp     : signed(C_P_W downto 0);
  signal s4_sp     : signed(C_P_W + 1 downto 0);
  signal s4_dq     : signed(C_P_W downto 0);
  signal s4_sq     : signed(C_P_W downto 0);
  signal s4_column : std_logic_vector(C_C_W - 1 downto 0);

  -- s5: new^2 - old^2; the column sums, 0 in the first row
  signal s5_valid : std_logic;
  signal s5_dp    : signed(C_P_W downto 0);
  signal s5_dq    : signed(C_P_W downto 0);
  signal s5_dp2   : signed(2 * C_P_W + 2 downto 0);
  signal s5_dq2   : signed(2 * C_P_W + 1 downto 0);
  signal s5_cp    : unsigned(C_CP_W - 1 downto 0);
  signal s5_cp2   : unsigned(C_CP2_W - 1 downto 0);
  signal s5_cq    : unsigned(C_CQ_W - 1 downto 0);
  signal s5_cq2   : unsigned(C_CQ2_W - 1 downto 0);

  -- s6: column sums with the new sample; all sums modulo their width, so the sign of q needs no care
  signal s6_valid  : std_logic;
  signal s6_wide   : std_logic;
  signal s6_col    : std_logic_vector(clog2(G_MAX_COLS) - 1 downto 0);
  signal s6_cp     : unsigned(C_CP_W - 1 downto 0);
  signal s6_cp2    : unsigned(C_CP2_W - 1 downto 0);
  signal s6_cq     : unsigned(C_CQ_W - 1 downto 0);
  signal s6_cq2    : unsigned(C_CQ2_W - 1 downto 0);
  signal s6_column : std_logic_vector(C_C_W - 1 downto 0);
  signal s6_left   : std_logic_vector(C_C_W - 1 downto 0); -- of the column that leaves the window, M columns back

  -- s7: new column - column that leaves
  signal s7_valid     : std_logic;
  signal s7_row_first : std_logic;
  signal s7_dp        : signed(C_CP_W downto 0);
  signal s7_dp2       : signed(C_CP2_W downto 0);
  signal s7_dq        : signed(C_CQ_W downto 0);
  signal s7_dq2       : signed(C_CQ2_W downto 0);

  -- s8: window sums
  signal s8_valid : std_logic;
  signal s8_cell  : std_logic;
  signal s8_sp    : signed(C_SP_W downto 0);
  signal s8_sp2   : unsigned(C_SP2_W - 1 downto 0);
  signal s8_sq    : signed(C_SQ_W - 1 downto 0);
  signal s8_sq2   : unsigned(C_SQ2_W - 1 downto 0);

  -- s9, s10: products (two stages, for the registers inside DSP slices)
  signal s9_valid  : std_logic;
  signal s9_n_sp2  : unsigned(C_DEN_W - 1 downto 0);
  signal s9_sp_2   : unsigned(C_DEN_W - 1 downto 0);
  signal s9_n_sq2  : unsigned(C_DEN_W - 1 downto 0);
  signal s9_sq_2   : unsigned(C_DEN_W - 1 downto 0);
  signal s10_valid : std_logic;
  signal s10_n_sp2 : unsigned(C_DEN_W - 1 downto 0);
  signal s10_sp_2  : unsigned(C_DEN_W - 1 downto 0);
  signal s10_n_sq2 : unsigned(C_DEN_W - 1 downto 0);
  signal s10_sq_2  : unsigned(C_DEN_W - 1 downto 0);

  -- s11: A and B; s12: A + B and A - B
  signal s11_valid : std_logic;
  signal s11_a     : unsigned(C_DEN_W - 1 downto 0);
  signal s11_b     : unsigned(C_DEN_W - 1 downto 0);
  signal s12_valid : std_logic;
  signal s12_inside : std_logic;
  signal s12_num   : unsigned(C_DEN_W downto 0); -- A - B, two's complement
  signal s12_den   : unsigned(C_DEN_W - 1 downto 0);

  -- s13, s14, s15: shifted left by a multiple of 16, of 4, of 1, until the leading one of den is on top
  signal s13_valid    : std_logic;
  signal s13_num      : unsigned(C_NORM + 14 downto 0);
  signal s13_den      : unsigned(C_NORM + 14 downto 0);
  signal s13_textured : std_logic_vector(0 downto 0);
  signal s14_valid    : std_logic;
  signal s14_num      : unsigned(C_NORM + 2 downto 0);
  signal s14_den      : unsigned(C_NORM + 2 downto 0);
  signal s15_valid    : std_logic;
  signal s15_num      : unsigned(C_NORM - 1 downto 0);
  signal s15_den      : unsigned(C_NORM - 1 downto 0);

  -- Division and what waits for it.
  signal div_valid    : std_logic_vector(G_MNCC_W downto 0);
  signal div_num      : std_logic_vector(C_NORM downto 0);
  signal div_quot     : std_logic_vector(G_MNCC_W - 1 downto 0);
  signal div_textured : std_logic_vector(0 downto 0);
  signal flags_out    : std_logic_vector(1 downto 0);
  signal s7_flags     : std_logic_vector(1 downto 0);

  -- One usable flag more: the run goes on up to M, or breaks.
  function next_run (run : unsigned; usable : std_logic; restart : std_logic) return unsigned is
    variable v_run : unsigned(run'length - 1 downto 0);
  begin
    v_run := run;
    if usable = '0' then
      v_run := (others => '0');
    elsif restart = '1' then
      v_run := to_unsigned(1, run'length);
    elsif run /= G_WINDOW then
      v_run := run + 1;
    end if;
    return v_run;
  end function next_run;

  -- `high` with as many zeros below as make it `width` bits.
  function fill_low (high : unsigned; width : positive) return unsigned is
    variable v_all : unsigned(width - 1 downto 0);
  begin
    v_all := (others => '0');
    v_all(width - 1 downto width - high'length) := high;
    return v_all;
  end function fill_low;

begin

  assert G_WINDOW >= 3 and G_WINDOW <= 21 and G_WINDOW mod 2 = 1
    report "similarity: G_WINDOW=" & integer'image(G_WINDOW) & " outside 3..21 or even"
    severity failure;
  assert G_SAMPLE_W >= 1 and G_SAMPLE_W <= 20
    report "similarity: G_SAMPLE_W=" & integer'image(G_SAMPLE_W) & " outside 1..20"
    severity failure;
  assert G_MNCC_W >= 4 and G_MNCC_W <= 16
    report "similarity: G_MNCC_W=" & integer'image(G_MNCC_W) & " outside 4..16"
    severity failure;
  assert G_MAX_COLS >= G_WINDOW and G_MAX_COLS <= 4096
    report "similarity: G_MAX_COLS=" & integer'image(G_MAX_COLS) & " outside G_WINDOW..4096"
    severity failure;

  -- s1 ---------------------------------------------------------------------------------------------------------------
  p_count : process (clk)
  begin
    if rising_edge(clk) then
      s1_valid       <= s_valid;
      s1_row_first   <= s_row_first;
      s1_plane_first <= s_plane_first;
      s1_plane_last  <= s_plane_last;
      s1_l           <= s_l;
      s1_r           <= s_r;
      if s_valid = '1' then
        s1_run_x <= next_run(s1_run_x, s_usable_x, s_row_first);
        if s_row_first = '1' then
          s1_col    <= (others => '0');
          s1_before <= (others => '0');
          s1_run_y  <= next_run(s1_run_y, s_usable_y, s_plane_first);
          if s_plane_first = '1' then
            s1_slot <= (others => '0');
            s1_line <= (others => '0');
            s1_warm <= '0';
          elsif s1_slot = G_WINDOW - 1 then
            s1_slot <= (others => '0');
            s1_line <= (others => '0');
            s1_warm <= '1';
          else
            s1_slot <= s1_slot + 1;
            s1_line <= s1_line + 1;
          end if;
        else
          s1_col  <= s1_col + 1;
          s1_line <= s1_line + 1;
          if s1_wide = '0' then
            s1_before <= s1_before + 1;
          end if;
        end if;
      end if;
      if rst = '1' then
        s1_valid <= '0';
        -- Addresses must be legal from the first clock on.
        s1_col   <= (others => '0');
        s1_line  <= (others => '0');
      end if;
    end if;
  end process p_count;

  s1_wide   <= to_bit(s1_before = G_WINDOW);
  s1_cell   <= s1_valid and to_bit(s1_before >= G_WINDOW - 1) and (s1_warm or to_bit(s1_slot = G_WINDOW - 1));
  s1_inside <= to_bit(s1_run_x = G_WINDOW) and to_bit(s1_run_y = G_WINDOW);

  -- Bits that wait for the stage which needs them.

  u_first : entity work.delay_line
    generic map (
      G_DATA_W => 1,
      G_DELAY  => 3
    )
    port map (
      clk       => clk,
      ce        => '1',
      s_data(0) => s1_plane_first,
      m_data(0) => s4_first
    );

  u_wide : entity work.delay_line
    generic map (
      G_DATA_W => 1,
      G_DELAY  => 5
    )
    port map (
      clk       => clk,
      ce        => '1',
      s_data(0) => s1_wide,
      m_data(0) => s6_wide
    );

  u_row_first : entity work.delay_line
    generic map (
      G_DATA_W => 2,
      G_DELAY  => 6
    )
    port map (
      clk       => clk,
      ce        => '1',
      s_data(1) => s1_cell,
      s_data(0) => s1_row_first,
      m_data    => s7_flags
    );

  u_inside : entity work.delay_line
    generic map (
      G_DATA_W => 1,
      G_DELAY  => 11
    )
    port map (
      clk       => clk,
      ce        => '1',
      s_data(0) => s1_inside,
      m_data(0) => s12_inside
    );

  u_out : entity work.delay_line
    generic map (
      G_DATA_W => 2,
      G_DELAY  => G_MNCC_W + 14
    )
    port map (
      clk       => clk,
      ce        => '1',
      s_data(1) => s1_inside,
      s_data(0) => s1_plane_last,
      m_data    => flags_out
    );

  s7_row_first <= s7_flags(0);

  -- s2: delay of M rows ----------------------------------------------------------------------------------------------
  -- A word is read one clock before it is replaced: the buffer holds exactly M rows.
  s2_write <= s2_r & s2_l;

  u_lines : entity work.ram_sdp
    generic map (
      G_DATA_W  => 2 * G_SAMPLE_W,
      G_DEPTH   => C_LINE_DEPTH,
      G_LATENCY => 1
    )
    port map (
      clk   => clk,
      we    => s2_valid,
      waddr => s2_line,
      wdata => s2_write,
      raddr => std_logic_vector(s1_line),
      rdata => s2_old
    );

  p_s2 : process (clk)
  begin
    if rising_edge(clk) then
      s2_valid <= s1_valid;
      s2_warm  <= s1_warm;
      s2_l     <= s1_l;
      s2_r     <= s1_r;
      s2_line  <= std_logic_vector(s1_line);
      if rst = '1' then
        s2_valid <= '0';
      end if;
    end if;
  end process p_s2;

  -- s3 - s6: column sums ---------------------------------------------------------------------------------------------
  u_col_s3 : entity work.delay_line
    generic map (
      G_DATA_W => clog2(G_MAX_COLS),
      G_DELAY  => 2
    )
    port map (
      clk    => clk,
      ce     => '1',
      s_data => std_logic_vector(s1_col),
      m_data => s3_col
    );

  u_col_s6 : entity work.delay_line
    generic map (
      G_DATA_W => clog2(G_MAX_COLS),
      G_DELAY  => 3
    )
    port map (
      clk    => clk,
      ce     => '1',
      s_data => s3_col,
      m_data => s6_col
    );

  u_columns : entity work.ram_sdp
    generic map (
      G_DATA_W  => C_C_W,
      G_DEPTH   => G_MAX_COLS,
      G_LATENCY => 1
    )
    port map (
      clk   => clk,
      we    => s6_valid,
      waddr => s6_col,
      wdata => s6_column,
      raddr => s3_col,
      rdata => s4_column
    );

  p_columns : process (clk)
  begin
    if rising_edge(clk) then
      -- s3
      s3_valid <= s2_valid;
      s3_p     <= resize(unsigned(s2_l), C_P_W) + resize(unsigned(s2_r), C_P_W);
      s3_q     <= signed('0' & s2_l) - signed('0' & s2_r);
      s3_p_old <= resize(unsigned(s2_old(G_SAMPLE_W - 1 downto 0)), C_P_W)
                  + resize(unsigned(s2_old(2 * G_SAMPLE_W - 1 downto G_SAMPLE_W)), C_P_W);
      s3_q_old <= signed('0' & s2_old(G_SAMPLE_W - 1 downto 0))
                  - signed('0' & s2_old(2 * G_SAMPLE_W - 1 downto G_SAMPLE_W));
      if s2_warm = '0' then
        s3_p_old <= (others => '0');
        s3_q_old <= (others => '0');
      end if;
      -- s4
      s4_valid <= s3_valid;
      s4_dp    <= signed('0' & s3_p) - signed('0' & s3_p_old);
      s4_sp    <= signed("00" & s3_p) + signed("00" & s3_p_old);
      s4_dq    <= resize(s3_q, C_P_W + 1) - resize(s3_q_old, C_P_W + 1);
      s4_sq    <= resize(s3_q, C_P_W + 1) + resize(s3_q_old, C_P_W + 1);
      -- s5
      s5_valid <= s4_valid;
      s5_dp    <= s4_dp;
      s5_dq    <= s4_dq;
      s5_dp2   <= s4_dp * s4_sp;
      s5_dq2   <= s4_dq * s4_sq;
      s5_cp    <= unsigned(s4_column(C_CP_W - 1 downto 0));
      s5_cp2   <= unsigned(s4_column(C_CP_W + C_CP2_W - 1 downto C_CP_W));
      s5_cq    <= unsigned(s4_column(C_CP_W + C_CP2_W + C_CQ_W - 1 downto C_CP_W + C_CP2_W));
      s5_cq2   <= unsigned(s4_column(C_C_W - 1 downto C_CP_W + C_CP2_W + C_CQ_W));
      if s4_first = '1' then
        s5_cp  <= (others => '0');
        s5_cp2 <= (others => '0');
        s5_cq  <= (others => '0');
        s5_cq2 <= (others => '0');
      end if;
      -- s6: |new^2 - old^2| is less than 2^(2 C_P_W) and 2^C_Q2_W; the bits above repeat the sign
      s6_valid <= s5_valid;
      s6_cp    <= s5_cp + unsigned(resize(s5_dp, C_CP_W));
      s6_cp2   <= s5_cp2 + unsigned(resize(s5_dp2(2 * C_P_W downto 0), C_CP2_W));
      s6_cq    <= s5_cq + unsigned(resize(s5_dq, C_CQ_W));
      s6_cq2   <= s5_cq2 + unsigned(resize(s5_dq2(C_Q2_W downto 0), C_CQ2_W));
      if rst = '1' then
        s3_valid <= '0';
        s4_valid <= '0';
        s5_valid <= '0';
        s6_valid <= '0';
      end if;
    end if;
  end process p_columns;

  s6_column <= std_logic_vector(s6_cq2) & std_logic_vector(s6_cq) & std_logic_vector(s6_cp2) & std_logic_vector(s6_cp);

  -- s7, s8: window sums ----------------------------------------------------------------------------------------------
  u_leaving : entity work.delay_line
    generic map (
      G_DATA_W => C_C_W,
      G_DELAY  => G_WINDOW
    )
    port map (
      clk    => clk,
      ce     => s6_valid,
      s_data => s6_column,
      m_data => s6_left
    );

  p_window : process (clk)
    variable v_left : std_logic_vector(C_C_W - 1 downto 0);
  begin
    if rising_edge(clk) then
      -- s7: q's column sum is signed, the other three are not
      s7_valid <= s6_valid;
      v_left   := s6_left;
      if s6_wide = '0' then
        v_left := (others => '0');
      end if;
      s7_dp  <= signed('0' & s6_cp) - signed('0' & v_left(C_CP_W - 1 downto 0));
      s7_dp2 <= signed('0' & s6_cp2) - signed('0' & v_left(C_CP_W + C_CP2_W - 1 downto C_CP_W));
      s7_dq  <= resize(signed(s6_cq), C_CQ_W + 1)
                - resize(signed(v_left(C_CP_W + C_CP2_W + C_CQ_W - 1 downto C_CP_W + C_CP2_W)), C_CQ_W + 1);
      s7_dq2 <= signed('0' & s6_cq2) - signed('0' & v_left(C_C_W - 1 downto C_CP_W + C_CP2_W + C_CQ_W));
      -- s8: sp has a leading 0, so that it multiplies as a signed number
      s8_valid <= s7_valid;
      s8_cell  <= s7_flags(1);
      if s7_valid = '1' then
        if s7_row_first = '1' then
          s8_sp  <= resize(s7_dp, C_SP_W + 1);
          s8_sp2 <= unsigned(resize(s7_dp2, C_SP2_W));
          s8_sq  <= resize(s7_dq, C_SQ_W);
          s8_sq2 <= unsigned(resize(s7_dq2, C_SQ2_W));
        else
          s8_sp  <= s8_sp + resize(s7_dp, C_SP_W + 1);
          s8_sp2 <= s8_sp2 + unsigned(resize(s7_dp2, C_SP2_W));
          s8_sq  <= s8_sq + resize(s7_dq, C_SQ_W);
          s8_sq2 <= s8_sq2 + unsigned(resize(s7_dq2, C_SQ2_W));
        end if;
      end if;
      if rst = '1' then
        s7_valid <= '0';
        s8_valid <= '0';
      end if;
    end if;
  end process p_window;

  -- s9 - s12: numerator and denominator ------------------------------------------------------------------------------
  -- A, B and A + B fit C_DEN_W bits, so their parts are needed modulo 2^C_DEN_W only.
  p_fraction : process (clk)
    variable v_n_sp2 : unsigned(C_SP2_W + C_NGROW - 1 downto 0);
    variable v_n_sq2 : unsigned(C_SQ2_W + C_NGROW - 1 downto 0);
    variable v_sp_2  : signed(2 * C_SP_W + 1 downto 0);
    variable v_sq_2  : signed(2 * C_SQ_W - 1 downto 0);
  begin
    if rising_edge(clk) then
      -- s9
      s9_valid <= s8_valid and s8_cell;
      v_n_sp2  := s8_sp2 * to_unsigned(C_N, C_NGROW);
      v_n_sq2  := s8_sq2 * to_unsigned(C_N, C_NGROW);
      v_sp_2   := s8_sp * s8_sp;
      v_sq_2   := s8_sq * s8_sq;
      s9_n_sp2 <= resize(v_n_sp2, C_DEN_W);
      s9_n_sq2 <= resize(v_n_sq2, C_DEN_W);
      s9_sp_2  <= resize(unsigned(v_sp_2), C_DEN_W);
      s9_sq_2  <= resize(unsigned(v_sq_2), C_DEN_W);
      -- s10
      s10_valid <= s9_valid;
      s10_n_sp2 <= s9_n_sp2;
      s10_n_sq2 <= s9_n_sq2;
      s10_sp_2  <= s9_sp_2;
      s10_sq_2  <= s9_sq_2;
      -- s11
      s11_valid <= s10_valid;
      s11_a     <= s10_n_sp2 - s10_sp_2;
      s11_b     <= s10_n_sq2 - s10_sq_2;
      -- s12
      s12_valid <= s11_valid;
      s12_num   <= resize(s11_a, C_DEN_W + 1) - resize(s11_b, C_DEN_W + 1);
      s12_den   <= s11_a + s11_b;
      if rst = '1' then
        s9_valid  <= '0';
        s10_valid <= '0';
        s11_valid <= '0';
        s12_valid <= '0';
      end if;
    end if;
  end process p_fraction;

  -- s13 - s15: normalisation -----------------------------------------------------------------------------------------
  p_normalise : process (clk)
    variable v_num     : unsigned(63 downto 0);
    variable v_den     : unsigned(63 downto 0);
    variable v_low_num : unsigned(63 downto 0); -- the low half, and zeros that a shift by 48 moves in
    variable v_low_den : unsigned(63 downto 0);
  begin
    if rising_edge(clk) then
      -- s13
      s13_valid       <= s12_valid;
      s13_textured(0) <= s12_inside and to_bit(s12_den /= 0);
      v_num           := fill_low(s12_num(C_DEN_W - 1 downto 0), 64);
      v_den           := fill_low(s12_den, 64);
      v_low_num       := v_num(31 downto 0) & to_unsigned(0, 32);
      v_low_den       := v_den(31 downto 0) & to_unsigned(0, 32);
      if v_den(63 downto 48) /= 0 then
        s13_num <= v_num(63 downto 49 - C_NORM);
        s13_den <= v_den(63 downto 49 - C_NORM);
      elsif v_den(47 downto 32) /= 0 then
        s13_num <= v_num(47 downto 33 - C_NORM);
        s13_den <= v_den(47 downto 33 - C_NORM);
      elsif v_den(31 downto 16) /= 0 then
        s13_num <= v_low_num(63 downto 49 - C_NORM);
        s13_den <= v_low_den(63 downto 49 - C_NORM);
      else
        s13_num <= v_low_num(47 downto 33 - C_NORM);
        s13_den <= v_low_den(47 downto 33 - C_NORM);
      end if;
      if s12_num(C_DEN_W) = '1' then
        s13_num <= (others => '0');
      end if;
      -- s14
      s14_valid <= s13_valid;
      if s13_den(C_NORM + 14 downto C_NORM + 11) /= 0 then
        s14_num <= s13_num(C_NORM + 14 downto 12);
        s14_den <= s13_den(C_NORM + 14 downto 12);
      elsif s13_den(C_NORM + 10 downto C_NORM + 7) /= 0 then
        s14_num <= s13_num(C_NORM + 10 downto 8);
        s14_den <= s13_den(C_NORM + 10 downto 8);
      elsif s13_den(C_NORM + 6 downto C_NORM + 3) /= 0 then
        s14_num <= s13_num(C_NORM + 6 downto 4);
        s14_den <= s13_den(C_NORM + 6 downto 4);
      else
        s14_num <= s13_num(C_NORM + 2 downto 0);
        s14_den <= s13_den(C_NORM + 2 downto 0);
      end if;
      -- s15
      s15_valid <= s14_valid;
      if s14_den(C_NORM + 2) = '1' then
        s15_num <= s14_num(C_NORM + 2 downto 3);
        s15_den <= s14_den(C_NORM + 2 downto 3);
      elsif s14_den(C_NORM + 1) = '1' then
        s15_num <= s14_num(C_NORM + 1 downto 2);
        s15_den <= s14_den(C_NORM + 1 downto 2);
      elsif s14_den(C_NORM) = '1' then
        s15_num <= s14_num(C_NORM downto 1);
        s15_den <= s14_den(C_NORM downto 1);
      else
        s15_num <= s14_num(C_NORM - 1 downto 0);
        s15_den <= s14_den(C_NORM - 1 downto 0);
      end if;
      if rst = '1' then
        s13_valid <= '0';
        s14_valid <= '0';
        s15_valid <= '0';
      end if;
    end if;
  end process p_normalise;

  -- Division ---------------------------------------------------------------------------------------------------------
  div_num <= '0' & std_logic_vector(s15_num);

  u_divider : entity work.divider
    generic map (
      G_NUM_W  => C_NORM,
      G_QUOT_W => G_MNCC_W
    )
    port map (
      clk    => clk,
      s_num  => div_num,
      s_den  => std_logic_vector(s15_den),
      m_quot => div_quot
    );

  u_textured : entity work.delay_line
    generic map (
      G_DATA_W => 1,
      G_DELAY  => G_MNCC_W + 2
    )
    port map (
      clk    => clk,
      ce     => '1',
      s_data => s13_textured,
      m_data => div_textured
    );

  p_out : process (clk)
  begin
    if rising_edge(clk) then
      div_valid  <= div_valid(G_MNCC_W - 1 downto 0) & s15_valid;
      m_last     <= flags_out(0);
      m_inside   <= flags_out(1);
      m_textured <= div_textured(0);
      m_v        <= div_quot;
      if div_textured(0) = '0' then
        m_v <= (others => '0');
      end if;
      if rst = '1' then
        div_valid <= (others => '0');
      end if;
    end if;
  end process p_out;

  m_valid <= div_valid(G_MNCC_W);

  -- synthesis translate_off
  -- Rules, in simulators.
  p_rules : process (clk)
    variable v_gap : natural := C_ROW_MIN; -- clocks since the strobe of a row, at most C_ROW_MIN
  begin
    if rising_edge(clk) then
      if s_valid = '1' and s_row_first = '1' then
        assert v_gap >= C_ROW_MIN
          report "similarity: a row too close to the one before"
          severity failure;
        v_gap := 0;
      end if;
      if v_gap < C_ROW_MIN then
        v_gap := v_gap + 1;
      end if;
      assert s2_valid /= '1' or s2_warm = '0' or not is_x(s2_old)
        report "similarity: the sample M rows above is unknown: never written, or read in the clock of its write"
        severity failure;
      assert s4_valid /= '1' or s4_first = '1' or not is_x(s4_column)
        report "similarity: the sums of a column are unknown: never written, or read in the clock of their write"
        severity failure;
      if s8_valid = '1' and s8_cell = '1' then
        assert s8_sp >= 0 and s8_sp <= C_N * (2 ** C_P_W - 2)
          report "similarity: the sum of p is out of range"
          severity failure;
        assert s8_sq >= -C_N * (2 ** G_SAMPLE_W - 1) and s8_sq <= C_N * (2 ** G_SAMPLE_W - 1)
          report "similarity: the sum of q is out of range"
          severity failure;
      end if;
      if s11_valid = '1' then
        -- Sums are kept modulo their width: a carry here would be one that is lost.
        assert ('0' & s11_a) + ('0' & s11_b) = '0' & (s11_a + s11_b)
          report "similarity: A + B overflows"
          severity failure;
      end if;
      if s15_valid = '1' then
        assert s15_num <= s15_den and (s15_den = 0 or s15_den(C_NORM - 1) = '1')
          report "similarity: the quotient's operands are not normalised, or A - B > A + B"
          severity failure;
      end if;
    end if;
  end process p_rules;
  -- synthesis translate_on

end architecture rtl;
