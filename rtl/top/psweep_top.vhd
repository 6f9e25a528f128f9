-- SPDX-License-Identifier: Apache-2.0
-- psweep_top: the chip: plane-sweep engine, Ethernet front end, resets; the pins of an MII PHY.
--   Clocks : clk for the engine and the stack, from 30 MHz on; mii_rx_clk and mii_tx_clk from the PHY, 25 or 2.5 MHz.
--            The three are independent (constraints/)
--   Reset  : arst_n, asynchronous, passes a filter: a pulse that covers at most 15 edges of clk is ignored
--            (reset_filter). The reset of clk makes those of the PHY's clocks, which end in step with them. So the
--            engine and the stack work without the clocks of the PHY, which may come, stop and return at any time
--   clock_missing: bit 0 mii_rx_clk, bit 1 mii_tx_clk: has been missing for 1 to 2 ms or longer
--   Address: generics; straps are XORed into the last byte of MAC and IP address
--   dbg_*  : for waves and tests; leave open
--   Golden : sw/golden/arbiter.hpp and sw/golden/psweep.hpp
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;

entity psweep_top is
  generic (
    G_IMG_COLS    : integer := 340;
    G_IMG_ROWS    : integer := 144;
    G_PLANE_COLS  : integer := 256;
    G_PLANE_ROWS  : integer := 130;
    G_PLANES      : integer := 301;
    G_WINDOW      : integer := 13;
    G_PIX_W       : integer := 8;
    G_WEIGHT_W    : integer := 8;
    G_INTERP_F    : integer := 2;
    G_MNCC_W      : integer := 13;
    G_FRAC_W      : integer := 8;
    G_LANES       : integer := 1;
    G_RECTIFIED   : integer := 0;
    G_DIVIDER     : integer := 0;
    G_SPLIT       : integer := 0;
    G_CLK_KHZ     : integer := 166000;
    G_CHUNK_BYTES : integer := 1408; -- 16 .. 1440
    G_ROW_SLOTS   : integer := 0; -- chunks; 0: as many as the largest window needs
    G_MAP_DEPTH   : integer := 0; -- cells, rounded up to chunks; 0: the largest tile
    G_RX_SLOTS    : integer := 2; -- 2 or 4
    G_SESSION_MS  : integer := 10000; -- 1 .. 65535
    G_UDP_PORT    : integer := 20563;
    G_MAC_HI      : integer := 131152; -- upper 24 bits; locally administered 02:00:50:53:57:01
    G_MAC_LO      : integer := 5461761;
    G_IP_HI       : integer := 2565; -- upper 16 bits; 10.5.0.2
    G_IP_LO       : integer := 2
  );
  port (
    clk    : in  std_logic;
    arst_n : in  std_logic;

    mii_rx_clk : in  std_logic;
    mii_rxd    : in  std_logic_vector(3 downto 0);
    mii_rx_dv  : in  std_logic;
    mii_rx_er  : in  std_logic;
    mii_tx_clk : in  std_logic;
    mii_txd    : out std_logic_vector(3 downto 0);
    mii_tx_en  : out std_logic;
    mii_crs    : in  std_logic;
    mii_col    : in  std_logic;

    phy_full_duplex : in  std_logic;
    phy_speed_100   : in  std_logic;
    straps          : in  std_logic_vector(7 downto 0);
    led_session     : out std_logic;
    led_busy        : out std_logic;
    clock_missing   : out std_logic_vector(1 downto 0);

    -- The engine's streams and state.
    dbg_cfg_tvalid    : out std_logic;
    dbg_cfg_tdata     : out std_logic_vector(47 downto 0);
    dbg_pix_tvalid    : out std_logic;
    dbg_pix_tready    : out std_logic;
    dbg_pix_tdata     : out std_logic_vector(2 * G_PIX_W - 1 downto 0);
    dbg_pix_tlast     : out std_logic;
    dbg_map_tvalid    : out std_logic;
    dbg_map_tready    : out std_logic;
    dbg_map_tdata     : out std_logic_vector(4 + clog2(G_PLANES) + G_FRAC_W + G_MNCC_W - 1 downto 0);
    dbg_map_tlast     : out std_logic;
    dbg_state         : out std_logic_vector(2 downto 0);
    dbg_errors        : out std_logic_vector(7 downto 0);
    dbg_tiles_done    : out std_logic_vector(15 downto 0);
    dbg_tiles_dropped : out std_logic_vector(15 downto 0);
    dbg_tile_clocks   : out std_logic_vector(31 downto 0)
  );
end entity psweep_top;

architecture rtl of psweep_top is

  signal rst           : std_logic;
  signal rx_rst        : std_logic;
  signal tx_rst        : std_logic;
  signal own_mac       : std_logic_vector(47 downto 0);
  signal own_ip        : std_logic_vector(31 downto 0);
  signal cfg_tvalid    : std_logic;
  signal cfg_tready    : std_logic;
  signal cfg_tdata     : std_logic_vector(47 downto 0);
  signal pix_tvalid    : std_logic;
  signal pix_tready    : std_logic;
  signal pix_tdata     : std_logic_vector(2 * G_PIX_W - 1 downto 0);
  signal pix_tlast     : std_logic;
  signal map_tvalid    : std_logic;
  signal map_tready    : std_logic;
  signal map_tdata     : std_logic_vector(4 + clog2(G_PLANES) + G_FRAC_W + G_MNCC_W - 1 downto 0);
  signal map_tlast     : std_logic;
  signal busy          : std_logic;
  signal state         : std_logic_vector(2 downto 0);
  signal errors        : std_logic_vector(7 downto 0);
  signal error_count   : std_logic_vector(15 downto 0);
  signal tiles_done    : std_logic_vector(15 downto 0);
  signal tiles_dropped : std_logic_vector(15 downto 0);
  signal window_errors : std_logic_vector(15 downto 0);
  signal tile_clocks   : std_logic_vector(31 downto 0);

begin

  assert G_MAC_HI >= 0 and G_MAC_HI <= 16777215
    report "psweep_top: G_MAC_HI"
           -- synthesis translate_off
           & "=" & integer'image(G_MAC_HI)
           -- synthesis translate_on
           & " outside 0..16777215"
    severity failure;
  assert G_MAC_LO >= 0 and G_MAC_LO <= 16777215
    report "psweep_top: G_MAC_LO"
           -- synthesis translate_off
           & "=" & integer'image(G_MAC_LO)
           -- synthesis translate_on
           & " outside 0..16777215"
    severity failure;
  assert G_IP_HI >= 0 and G_IP_HI <= 65535
    report "psweep_top: G_IP_HI"
           -- synthesis translate_off
           & "=" & integer'image(G_IP_HI)
           -- synthesis translate_on
           & " outside 0..65535"
    severity failure;
  assert G_IP_LO >= 0 and G_IP_LO <= 65535
    report "psweep_top: G_IP_LO"
           -- synthesis translate_off
           & "=" & integer'image(G_IP_LO)
           -- synthesis translate_on
           & " outside 0..65535"
    severity failure;

  own_mac <= std_logic_vector(to_unsigned(G_MAC_HI, 24))
             & (std_logic_vector(to_unsigned(G_MAC_LO, 24)) xor (x"0000" & straps));
  own_ip  <= std_logic_vector(to_unsigned(G_IP_HI, 16))
             & (std_logic_vector(to_unsigned(G_IP_LO, 16)) xor (x"00" & straps));

  u_reset : entity work.reset_filter
    port map (
      clk    => clk,
      arst_n => arst_n,
      rst    => rst
    );

  u_reset_rx : entity work.reset_sync
    port map (
      clk  => mii_rx_clk,
      arst => rst,
      rst  => rx_rst
    );

  u_reset_tx : entity work.reset_sync
    port map (
      clk  => mii_tx_clk,
      arst => rst,
      rst  => tx_rst
    );

  u_arbiter : entity work.arbiter
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
      G_SEED        => G_MAC_LO mod 131071 + 1
    )
    port map (
      clk             => clk,
      rst             => rst,
      rx_clk          => mii_rx_clk,
      rx_rst          => rx_rst,
      tx_clk          => mii_tx_clk,
      tx_rst          => tx_rst,
      mii_rxd         => mii_rxd,
      mii_rx_dv       => mii_rx_dv,
      mii_rx_er       => mii_rx_er,
      mii_txd         => mii_txd,
      mii_tx_en       => mii_tx_en,
      mii_crs         => mii_crs,
      mii_col         => mii_col,
      own_mac         => own_mac,
      own_ip          => own_ip,
      pin_full_duplex => phy_full_duplex,
      pin_speed_100   => phy_speed_100,
      session         => led_session,
      clock_missing   => clock_missing,
      m_cfg_tvalid    => cfg_tvalid,
      m_cfg_tdata     => cfg_tdata,
      m_pix_tvalid    => pix_tvalid,
      m_pix_tready    => pix_tready,
      m_pix_tdata     => pix_tdata,
      m_pix_tlast     => pix_tlast,
      s_map_tvalid    => map_tvalid,
      s_map_tready    => map_tready,
      s_map_tdata     => map_tdata,
      s_map_tlast     => map_tlast,
      engine_busy     => busy,
      engine_state    => state,
      errors          => errors,
      error_count     => error_count,
      tiles_done      => tiles_done,
      tiles_dropped   => tiles_dropped,
      window_errors   => window_errors,
      tile_clocks     => tile_clocks
    );

  u_engine : entity work.psweep
    generic map (
      G_IMG_COLS   => G_IMG_COLS,
      G_IMG_ROWS   => G_IMG_ROWS,
      G_PLANE_COLS => G_PLANE_COLS,
      G_PLANE_ROWS => G_PLANE_ROWS,
      G_PLANES     => G_PLANES,
      G_WINDOW     => G_WINDOW,
      G_PIX_W      => G_PIX_W,
      G_WEIGHT_W   => G_WEIGHT_W,
      G_INTERP_F   => G_INTERP_F,
      G_MNCC_W     => G_MNCC_W,
      G_FRAC_W     => G_FRAC_W,
      G_LANES      => G_LANES,
      G_RECTIFIED  => G_RECTIFIED,
      G_DIVIDER    => G_DIVIDER,
      G_SPLIT      => G_SPLIT
    )
    port map (
      clk           => clk,
      rst           => rst,
      s_cfg_tvalid  => cfg_tvalid,
      s_cfg_tready  => cfg_tready,
      s_cfg_tdata   => cfg_tdata,
      s_pix_tvalid  => pix_tvalid,
      s_pix_tready  => pix_tready,
      s_pix_tdata   => pix_tdata,
      s_pix_tlast   => pix_tlast,
      m_map_tvalid  => map_tvalid,
      m_map_tready  => map_tready,
      m_map_tdata   => map_tdata,
      m_map_tlast   => map_tlast,
      busy          => busy,
      state         => state,
      errors        => errors,
      error_count   => error_count,
      tiles_done    => tiles_done,
      tiles_dropped => tiles_dropped,
      window_errors => window_errors,
      tile_clocks   => tile_clocks
    );

  led_busy <= busy;

  dbg_cfg_tvalid    <= cfg_tvalid;
  dbg_cfg_tdata     <= cfg_tdata;
  dbg_pix_tvalid    <= pix_tvalid;
  dbg_pix_tready    <= pix_tready;
  dbg_pix_tdata     <= pix_tdata;
  dbg_pix_tlast     <= pix_tlast;
  dbg_map_tvalid    <= map_tvalid;
  dbg_map_tready    <= map_tready;
  dbg_map_tdata     <= map_tdata;
  dbg_map_tlast     <= map_tlast;
  dbg_state         <= state;
  dbg_errors        <= errors;
  dbg_tiles_done    <= tiles_done;
  dbg_tiles_dropped <= tiles_dropped;
  dbg_tile_clocks   <= tile_clocks;

end architecture rtl;
