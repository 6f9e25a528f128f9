-- SPDX-License-Identifier: Apache-2.0
-- psweep_replay: drives the original VHDL of psweep_top with what the Verilated model was driven with, and compares
-- every output pin with what that model showed. The recording is made by chip::Recorder (tb/replay/recorder.hpp); it is
-- a list of events in the order in which they happened, one per line:
--   c N              N rising edges of clk
--   r DATA DV ER     rising edge of mii_rx_clk with these pins
--   t TXD EN S B     rising edge of mii_tx_clk; before it mii_txd, mii_tx_en, led_session, led_busy were this
--   m CRS COL, p FULL_DUPLEX SPEED_100 STRAPS, x ARST_N      levels
-- The order is all that counts: the chip has no delays. mii_txd is compared while mii_tx_en = '1'.
-- Ends with a report 'replay: N tx edges, N clk edges, N frames, N differences'; severity failure if there is a
-- difference, or nothing was compared. The first 8 differences are named with line, port and both values.
-- For simulation with GHDL, VHDL-93.
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use std.textio.all;

entity psweep_replay is
  generic (
    G_IMG_COLS    : integer;
    G_IMG_ROWS    : integer;
    G_PLANE_COLS  : integer;
    G_PLANE_ROWS  : integer;
    G_PLANES      : integer;
    G_WINDOW      : integer;
    G_PIX_W       : integer;
    G_WEIGHT_W    : integer;
    G_INTERP_F    : integer;
    G_MNCC_W      : integer;
    G_FRAC_W      : integer;
    G_LANES       : integer;
    G_RECTIFIED   : integer;
    G_CLK_KHZ     : integer;
    G_CHUNK_BYTES : integer;
    G_ROW_SLOTS   : integer;
    G_MAP_DEPTH   : integer;
    G_RX_SLOTS    : integer;
    G_SESSION_MS  : integer;
    G_UDP_PORT    : integer;
    G_MAC_HI      : integer;
    G_MAC_LO      : integer;
    G_IP_HI       : integer;
    G_IP_LO       : integer;
    G_FILE        : string
  );
end entity psweep_replay;

architecture bench of psweep_replay is

  signal clk             : std_logic := '0';
  signal arst_n          : std_logic := '0';
  signal mii_rx_clk      : std_logic := '0';
  signal mii_rxd         : std_logic_vector(3 downto 0) := "0000";
  signal mii_rx_dv       : std_logic := '0';
  signal mii_rx_er       : std_logic := '0';
  signal mii_tx_clk      : std_logic := '0';
  signal mii_txd         : std_logic_vector(3 downto 0);
  signal mii_tx_en       : std_logic;
  signal mii_crs         : std_logic := '0';
  signal mii_col         : std_logic := '0';
  signal phy_full_duplex : std_logic := '1';
  signal phy_speed_100   : std_logic := '1';
  signal straps          : std_logic_vector(7 downto 0) := x"00";
  signal led_session     : std_logic;
  signal led_busy        : std_logic;

  function bit_of (i : integer) return std_logic is
  begin
    if i = 0 then
      return '0';
    end if;
    return '1';
  end function bit_of;

begin

  u_chip : entity work.psweep_top
    generic map (
      G_IMG_COLS    => G_IMG_COLS,
      G_IMG_ROWS    => G_IMG_ROWS,
      G_PLANE_COLS  => G_PLANE_COLS,
      G_PLANE_ROWS  => G_PLANE_ROWS,
      G_PLANES      => G_PLANES,
      G_WINDOW      => G_WINDOW,
      G_PIX_W       => G_PIX_W,
      G_WEIGHT_W    => G_WEIGHT_W,
      G_INTERP_F    => G_INTERP_F,
      G_MNCC_W      => G_MNCC_W,
      G_FRAC_W      => G_FRAC_W,
      G_LANES       => G_LANES,
      G_RECTIFIED   => G_RECTIFIED,
      G_CLK_KHZ     => G_CLK_KHZ,
      G_CHUNK_BYTES => G_CHUNK_BYTES,
      G_ROW_SLOTS   => G_ROW_SLOTS,
      G_MAP_DEPTH   => G_MAP_DEPTH,
      G_RX_SLOTS    => G_RX_SLOTS,
      G_SESSION_MS  => G_SESSION_MS,
      G_UDP_PORT    => G_UDP_PORT,
      G_MAC_HI      => G_MAC_HI,
      G_MAC_LO      => G_MAC_LO,
      G_IP_HI       => G_IP_HI,
      G_IP_LO       => G_IP_LO
    )
    port map (
      clk             => clk,
      arst_n          => arst_n,
      mii_rx_clk      => mii_rx_clk,
      mii_rxd         => mii_rxd,
      mii_rx_dv       => mii_rx_dv,
      mii_rx_er       => mii_rx_er,
      mii_tx_clk      => mii_tx_clk,
      mii_txd         => mii_txd,
      mii_tx_en       => mii_tx_en,
      mii_crs         => mii_crs,
      mii_col         => mii_col,
      phy_full_duplex => phy_full_duplex,
      phy_speed_100   => phy_speed_100,
      straps          => straps,
      led_session     => led_session,
      led_busy        => led_busy
    );

  p_replay : process
    file recording       : text open read_mode is G_FILE;
    variable v_line      : line;
    variable v_kind      : character;
    variable v_a         : integer;
    variable v_b         : integer;
    variable v_c         : integer;
    variable v_d         : integer;
    variable v_number    : integer := 0;
    variable v_compared  : integer := 0;
    variable v_clocks    : integer := 0;
    variable v_frames    : integer := 0;
    variable v_sending   : boolean := false;
    variable v_different : integer := 0;
    variable v_awake     : integer := 0; -- tx edges since the reset

    procedure compare (name : string; is_bit : std_logic; should : std_logic) is
    begin
      if is_bit /= should then
        v_different := v_different + 1;
        if v_different <= 8 then
          report "mismatch line " & integer'image(v_number) & " tx edge " & integer'image(v_compared) & " clk edge "
                 & integer'image(v_clocks) & " port " & name & ": VHDL " & std_logic'image(is_bit) & " Verilated "
                 & std_logic'image(should)
            severity error;
        end if;
      end if;
    end procedure compare;

  begin
    while not endfile(recording) loop
      readline(recording, v_line);
      v_number := v_number + 1;
      read(v_line, v_kind);
      read(v_line, v_a);
      if v_kind = 'c' then
        for i in 1 to v_a loop
          clk <= '0';
          wait for 1 ns;
          clk <= '1';
          wait for 1 ns;
        end loop;
        v_clocks := v_clocks + v_a;
      elsif v_kind = 'r' then
        read(v_line, v_b);
        read(v_line, v_c);
        mii_rxd   <= std_logic_vector(to_unsigned(v_a, 4));
        mii_rx_dv <= bit_of(v_b);
        mii_rx_er <= bit_of(v_c);
        wait for 1 ns;
        mii_rx_clk <= '1';
        wait for 1 ns;
        mii_rx_clk <= '0';
      elsif v_kind = 't' then
        read(v_line, v_b);
        read(v_line, v_c);
        read(v_line, v_d);
        if v_awake > 4 then
          v_compared := v_compared + 1;
          compare("mii_tx_en", mii_tx_en, bit_of(v_b));
          compare("led_session", led_session, bit_of(v_c));
          compare("led_busy", led_busy, bit_of(v_d));
          if v_b /= 0 then
            for i in 0 to 3 loop
              compare("mii_txd(" & integer'image(i) & ")", mii_txd(i), bit_of(v_a / 2 ** i mod 2));
            end loop;
          elsif v_sending then
            v_frames := v_frames + 1;
          end if;
          v_sending := v_b /= 0;
        elsif arst_n = '1' then
          v_awake := v_awake + 1;
        end if;
        wait for 1 ns;
        mii_tx_clk <= '1';
        wait for 1 ns;
        mii_tx_clk <= '0';
      elsif v_kind = 'm' then
        read(v_line, v_b);
        mii_crs <= bit_of(v_a);
        mii_col <= bit_of(v_b);
      elsif v_kind = 'p' then
        read(v_line, v_b);
        read(v_line, v_c);
        phy_full_duplex <= bit_of(v_a);
        phy_speed_100   <= bit_of(v_b);
        straps          <= std_logic_vector(to_unsigned(v_c, 8));
      elsif v_kind = 'x' then
        arst_n  <= bit_of(v_a);
        v_awake := 0;
      else
        report "line " & integer'image(v_number) & ": unknown event " & v_kind
          severity failure;
      end if;
      deallocate(v_line);
    end loop;
    report "replay: " & integer'image(v_compared) & " tx edges, " & integer'image(v_clocks) & " clk edges, "
           & integer'image(v_frames) & " frames, " & integer'image(v_different) & " differences"
      severity note;
    assert v_different = 0 and v_frames > 0
      report "replay: the VHDL and its translation differ, or nothing was compared"
      severity failure;
    wait;
  end process p_replay;

end architecture bench;
