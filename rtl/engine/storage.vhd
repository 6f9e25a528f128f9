-- SPDX-License-Identifier: Apache-2.0
-- storage: holds the loaded windows of both images in four banks each, interleaved by the parities of x and y, so that
--          any 2x2 neighbourhood is read in one clock (paper, section 4.2.1, equation 2).
--   Rate     : one sample (2x2 pixels of each image) per lane and clock; writes: one pixel of each image per clock
--   Latency  : C_STORAGE_LATENCY = 4 clocks from s_* to m_*
--   Lanes    : vectors hold lane 0 in the low bits. A block RAM has two ports, and nothing is written in a sweep:
--              lanes 0 and 1 read the same banks, each through its own port, any sample at any time (ram_2r). Lanes 2
--              and 3 have a second copy. So two lanes need no more RAM than one, and no lane depends on where another
--              reads
--   Address  : (y div 2) * G_IMG_COLS/2 + x div 2, whatever was loaded; the row part comes from address_generator. With
--              several lanes, which write and read through one port, a pixel is written one clock later; the row part
--              must then be 0 and no sample may come
--   Rectified: with G_RECTIFIED = 1 samples lie on rows of pixels; two banks per image, by the parity of x, hold all
--              rows: y * G_IMG_COLS/2 + x div 2. Same RAM, half the addresses, 2:1 selection of pixels. p01, p11 are 0
--   Numbers  : pixels ufix(G_PIX_W,0), fractions ufix(0,G_WEIGHT_W), passed through
--   Unusable : a sample that is not usable in x and y reads address 0; its pixels are undefined
--   Reset    : clears the valids; memories and data have no reset
--   Golden   : sw/golden/storage.hpp
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;

entity storage is
  generic (
    G_IMG_COLS  : integer := 340;
    G_IMG_ROWS  : integer := 144;
    G_PIX_W     : integer := 8;
    G_WEIGHT_W  : integer := 8;
    G_LANES     : integer := 1;
    G_RECTIFIED : integer := 0
  );
  port (
    clk : in  std_logic;
    rst : in  std_logic;

    -- Window in raster order, left pixel in the low half. load_clear: the next pixel is the first one.
    load_clear   : in  std_logic;
    load_valid   : in  std_logic;
    load_col     : in  std_logic_vector(clog2(G_IMG_COLS) - 1 downto 0);
    load_row_odd : in  std_logic;
    load_row_end : in  std_logic;
    load_data    : in  std_logic_vector(2 * G_PIX_W - 1 downto 0);

    -- As address_generator's m_*: s_yi_*, s_fy_* and s_row_* change at most with s_row_first. Of xi only the low
    -- clog2(G_IMG_COLS) bits, of yi only bit 0 is looked at.
    s_valid          : in  std_logic_vector(G_LANES - 1 downto 0);
    s_row_first      : in  std_logic_vector(G_LANES - 1 downto 0);
    s_plane_first    : in  std_logic_vector(G_LANES - 1 downto 0);
    s_plane_last     : in  std_logic_vector(G_LANES - 1 downto 0);
    s_usable_x       : in  std_logic_vector(G_LANES - 1 downto 0);
    s_usable_y       : in  std_logic_vector(G_LANES - 1 downto 0);
    s_xi_left        : in  std_logic_vector(G_LANES * C_INT_W - 1 downto 0);
    s_yi_left        : in  std_logic_vector(G_LANES * C_INT_W - 1 downto 0);
    s_fx_left        : in  std_logic_vector(G_LANES * G_WEIGHT_W - 1 downto 0);
    s_fy_left        : in  std_logic_vector(G_LANES * G_WEIGHT_W - 1 downto 0);
    s_xi_right       : in  std_logic_vector(G_LANES * C_INT_W - 1 downto 0);
    s_yi_right       : in  std_logic_vector(G_LANES * C_INT_W - 1 downto 0);
    s_fx_right       : in  std_logic_vector(G_LANES * G_WEIGHT_W - 1 downto 0);
    s_fy_right       : in  std_logic_vector(G_LANES * G_WEIGHT_W - 1 downto 0);
    s_row_even_left  : in  std_logic_vector(G_LANES * bank_bits(G_IMG_COLS, G_IMG_ROWS, G_RECTIFIED) - 1 downto 0);
    s_row_odd_left   : in  std_logic_vector(G_LANES * bank_bits(G_IMG_COLS, G_IMG_ROWS, G_RECTIFIED) - 1 downto 0);
    s_row_even_right : in  std_logic_vector(G_LANES * bank_bits(G_IMG_COLS, G_IMG_ROWS, G_RECTIFIED) - 1 downto 0);
    s_row_odd_right  : in  std_logic_vector(G_LANES * bank_bits(G_IMG_COLS, G_IMG_ROWS, G_RECTIFIED) - 1 downto 0);

    -- p10 is the right neighbour of p00, p01 the one below. m_fy_* hold for a row, like s_fy_*.
    m_valid       : out std_logic_vector(G_LANES - 1 downto 0);
    m_row_first   : out std_logic_vector(G_LANES - 1 downto 0);
    m_plane_first : out std_logic_vector(G_LANES - 1 downto 0);
    m_plane_last  : out std_logic_vector(G_LANES - 1 downto 0);
    m_usable_x    : out std_logic_vector(G_LANES - 1 downto 0);
    m_usable_y    : out std_logic_vector(G_LANES - 1 downto 0);
    m_fx_left     : out std_logic_vector(G_LANES * G_WEIGHT_W - 1 downto 0);
    m_fy_left     : out std_logic_vector(G_LANES * G_WEIGHT_W - 1 downto 0);
    m_fx_right    : out std_logic_vector(G_LANES * G_WEIGHT_W - 1 downto 0);
    m_fy_right    : out std_logic_vector(G_LANES * G_WEIGHT_W - 1 downto 0);
    m_p00_left    : out std_logic_vector(G_LANES * G_PIX_W - 1 downto 0);
    m_p10_left    : out std_logic_vector(G_LANES * G_PIX_W - 1 downto 0);
    m_p01_left    : out std_logic_vector(G_LANES * G_PIX_W - 1 downto 0);
    m_p11_left    : out std_logic_vector(G_LANES * G_PIX_W - 1 downto 0);
    m_p00_right   : out std_logic_vector(G_LANES * G_PIX_W - 1 downto 0);
    m_p10_right   : out std_logic_vector(G_LANES * G_PIX_W - 1 downto 0);
    m_p01_right   : out std_logic_vector(G_LANES * G_PIX_W - 1 downto 0);
    m_p11_right   : out std_logic_vector(G_LANES * G_PIX_W - 1 downto 0)
  );
end entity storage;

architecture rtl of storage is

  constant C_PITCH  : integer := G_IMG_COLS / 2;
  constant C_DEPTH  : integer := bank_depth(G_IMG_COLS, G_IMG_ROWS, G_RECTIFIED);
  constant C_BANK_W : integer := bank_bits(G_IMG_COLS, G_IMG_ROWS, G_RECTIFIED);
  constant C_COL_W  : integer := clog2(G_IMG_COLS);
  constant C_COPIES : integer := G_LANES / 2; -- of the banks, where two lanes share a bank
  constant C_BANKS  : integer := 4 - 2 * G_RECTIFIED;

  constant C_RECTIFIED : std_logic := to_sl(G_RECTIFIED = 1);

  -- Load.
  signal write_row  : unsigned(C_BANK_W - 1 downto 0); -- address of column 0 of the row (pair) being loaded
  signal write_next : std_logic_vector(C_BANK_W - 1 downto 0);
  signal write_addr : std_logic_vector(C_BANK_W - 1 downto 0);
  signal write_data : std_logic_vector(2 * G_PIX_W - 1 downto 0);
  signal write_bank : std_logic_vector(3 downto 0); -- one-hot: 2 * (y mod 2) + x mod 2
  -- With several lanes, a clock behind: the address takes its way through a reader.
  signal write_any  : std_logic;                    -- write_bank is not 0
  signal pair_data  : std_logic_vector(2 * G_PIX_W - 1 downto 0);
  signal pair_bank  : std_logic_vector(3 downto 0);
  signal load_lower : std_logic; -- into banks 2 and 3

  -- Both images behind each other, all lanes of the left one in the low half, so that one generate serves both.
  signal s0_xi       : std_logic_vector(2 * G_LANES * C_INT_W - 1 downto 0);
  signal s0_yi       : std_logic_vector(2 * G_LANES * C_INT_W - 1 downto 0);
  signal s0_row_even : std_logic_vector(2 * G_LANES * C_BANK_W - 1 downto 0);
  signal s0_row_odd  : std_logic_vector(2 * G_LANES * C_BANK_W - 1 downto 0);
  signal s0_unusable : std_logic_vector(G_LANES - 1 downto 0);
  -- s1: address for each reader (image and lane) and bank, bank b of reader n at 4 * n + b; s2, s3: inside the RAMs;
  -- s3: their words; s4: the quads.
  type t_addresses is array (0 to 8 * G_LANES - 1) of std_logic_vector(C_BANK_W - 1 downto 0);
  type t_words is array (0 to 8 * G_LANES - 1) of std_logic_vector(G_PIX_W - 1 downto 0);
  signal s1_addr : t_addresses;
  signal s3_word : t_words;
  signal s4_p00    : std_logic_vector(2 * G_LANES * G_PIX_W - 1 downto 0);
  signal s4_p10    : std_logic_vector(2 * G_LANES * G_PIX_W - 1 downto 0);
  signal s4_p01    : std_logic_vector(2 * G_LANES * G_PIX_W - 1 downto 0);
  signal s4_p11    : std_logic_vector(2 * G_LANES * G_PIX_W - 1 downto 0);

  -- Address of the even (round_up = xi mod 2) or odd (round_up = 0) one of columns xi, xi+1. The increment enters as a
  -- carry, from a bit that is cut off again, so this is one adder.
  function bank_address (row_part : std_logic_vector; column : std_logic_vector; round_up : std_logic)
    return std_logic_vector is
    variable v_sum : unsigned(C_BANK_W downto 0);
  begin
    v_sum := unsigned(row_part & '1') + unsigned(column & round_up);
    return std_logic_vector(v_sum(C_BANK_W downto 1));
  end function bank_address;

  -- The word of the bank whose y and x parities are given.
  function pick (word_0, word_1, word_2, word_3 : std_logic_vector; y_odd, x_odd : std_logic)
    return std_logic_vector is
  begin
    if y_odd = '0' and x_odd = '0' then
      return word_0;
    elsif y_odd = '0' then
      return word_1;
    elsif x_odd = '0' then
      return word_2;
    else
      return word_3;
    end if;
  end function pick;

begin

  assert G_IMG_COLS >= 4 and G_IMG_COLS <= 4096 and G_IMG_COLS mod 2 = 0
    report "storage: G_IMG_COLS"
           -- synthesis translate_off
           & "=" & integer'image(G_IMG_COLS)
           -- synthesis translate_on
           & " outside 4..4096 or odd"
    severity failure;
  assert G_IMG_ROWS >= 4 and G_IMG_ROWS <= 4096 and G_IMG_ROWS mod 2 = 0
    report "storage: G_IMG_ROWS"
           -- synthesis translate_off
           & "=" & integer'image(G_IMG_ROWS)
           -- synthesis translate_on
           & " outside 4..4096 or odd"
    severity failure;
  assert G_PIX_W >= 1 and G_PIX_W <= 12
    report "storage: G_PIX_W"
           -- synthesis translate_off
           & "=" & integer'image(G_PIX_W)
           -- synthesis translate_on
           & " outside 1..12"
    severity failure;
  assert G_WEIGHT_W >= 1 and G_WEIGHT_W <= 12
    report "storage: G_WEIGHT_W"
           -- synthesis translate_off
           & "=" & integer'image(G_WEIGHT_W)
           -- synthesis translate_on
           & " outside 1..12"
    severity failure;
  assert G_LANES = 1 or G_LANES = 2 or G_LANES = 4
    report "storage: G_LANES"
           -- synthesis translate_off
           & "=" & integer'image(G_LANES)
           -- synthesis translate_on
           & " is not 1, 2 or 4"
    severity failure;
  assert G_RECTIFIED = 0 or G_RECTIFIED = 1
    report "storage: G_RECTIFIED"
           -- synthesis translate_off
           & "=" & integer'image(G_RECTIFIED)
           -- synthesis translate_on
           & " is neither 0 nor 1"
    severity failure;

  load_lower <= load_row_odd and not C_RECTIFIED;
  write_next <= std_logic_vector(write_row + resize(unsigned(load_col(C_COL_W - 1 downto 1)), C_BANK_W));

  p_load : process (clk)
  begin
    if rising_edge(clk) then
      write_addr    <= write_next;
      write_data    <= load_data;
      write_bank(0) <= load_valid and not load_lower and not load_col(0);
      write_bank(1) <= load_valid and not load_lower and load_col(0);
      write_bank(2) <= load_valid and load_lower and not load_col(0);
      write_bank(3) <= load_valid and load_lower and load_col(0);
      if load_clear = '1' then
        write_row <= (others => '0');
      elsif load_valid = '1' and load_row_end = '1' and (load_row_odd = '1' or G_RECTIFIED = 1) then
        write_row <= write_row + C_PITCH;
      end if;
      write_any <= load_valid;
      pair_data <= write_data;
      pair_bank <= write_bank;
      if rst = '1' then
        write_bank <= (others => '0');
        write_any  <= '0';
        pair_bank  <= (others => '0');
      end if;
    end if;
  end process p_load;

  s0_xi       <= s_xi_right & s_xi_left;
  s0_yi       <= s_yi_right & s_yi_left;
  s0_row_even <= s_row_even_right & s_row_even_left;
  s0_row_odd  <= s_row_odd_right & s_row_odd_left;
  s0_unusable <= not (s_usable_x and s_usable_y);

  -- One of image and lane: addresses, and the choice among the words.
  g_reader : for n in 0 to 2 * G_LANES - 1 generate
    signal row_even : std_logic_vector(C_BANK_W - 1 downto 0);
    signal row_odd  : std_logic_vector(C_BANK_W - 1 downto 0);
    signal xi       : std_logic_vector(C_COL_W - 1 downto 0);
    signal x_odd    : std_logic_vector(3 downto 1);
    signal y_odd    : std_logic_vector(3 downto 1);
    signal addr_0   : std_logic_vector(C_BANK_W - 1 downto 0);
    signal addr_1   : std_logic_vector(C_BANK_W - 1 downto 0);
    signal addr_2   : std_logic_vector(C_BANK_W - 1 downto 0);
    signal addr_3   : std_logic_vector(C_BANK_W - 1 downto 0);
    signal word_0   : std_logic_vector(G_PIX_W - 1 downto 0);
    signal word_1   : std_logic_vector(G_PIX_W - 1 downto 0);
    signal word_2   : std_logic_vector(G_PIX_W - 1 downto 0);
    signal word_3   : std_logic_vector(G_PIX_W - 1 downto 0);
    signal p00      : std_logic_vector(G_PIX_W - 1 downto 0);
    signal p10      : std_logic_vector(G_PIX_W - 1 downto 0);
    signal p01      : std_logic_vector(G_PIX_W - 1 downto 0);
    signal p11      : std_logic_vector(G_PIX_W - 1 downto 0);
    -- The port of an even lane writes the pixels: their address takes the column's place, the row's is 0.
    signal writes   : std_logic;
    signal column   : std_logic_vector(C_BANK_W - 1 downto 0);
    signal round_up : std_logic;
  begin

    row_even <= s0_row_even((n + 1) * C_BANK_W - 1 downto n * C_BANK_W);
    row_odd  <= s0_row_odd((n + 1) * C_BANK_W - 1 downto n * C_BANK_W);
    xi       <= s0_xi(n * C_INT_W + C_COL_W - 1 downto n * C_INT_W);
    writes   <= write_any and to_sl(G_LANES > 1 and n mod 2 = 0);
    column   <= write_addr when writes = '1'
                else std_logic_vector(resize(unsigned(xi(C_COL_W - 1 downto 1)), C_BANK_W));
    round_up <= xi(0) and not writes;

    p_read : process (clk)
    begin
      if rising_edge(clk) then
        addr_0 <= bank_address(row_even, column, round_up);
        addr_1 <= bank_address(row_even, column, '0');
        addr_2 <= bank_address(row_odd, column, round_up);
        addr_3 <= bank_address(row_odd, column, '0');
        if writes = '0' and s0_unusable(n mod G_LANES) = '1' then -- keeps addresses legal
          addr_0 <= (others => '0');
          addr_1 <= (others => '0');
          addr_2 <= (others => '0');
          addr_3 <= (others => '0');
        end if;
        x_odd <= x_odd(2 downto 1) & xi(0);
        y_odd <= y_odd(2 downto 1) & (s0_yi(n * C_INT_W) and not C_RECTIFIED);
        p00   <= pick(word_0, word_1, word_2, word_3, y_odd(3), x_odd(3));
        p10   <= pick(word_0, word_1, word_2, word_3, y_odd(3), not x_odd(3));
        p01   <= pick(word_0, word_1, word_2, word_3, not y_odd(3), x_odd(3));
        p11   <= pick(word_0, word_1, word_2, word_3, not y_odd(3), not x_odd(3));
      end if;
    end process p_read;

    s1_addr(4 * n)     <= addr_0;
    s1_addr(4 * n + 1) <= addr_1;
    s1_addr(4 * n + 2) <= addr_2;
    s1_addr(4 * n + 3) <= addr_3;

    word_0 <= s3_word(4 * n);
    word_1 <= s3_word(4 * n + 1);
    word_2 <= s3_word(4 * n + 2);
    word_3 <= s3_word(4 * n + 3);

    s4_p00((n + 1) * G_PIX_W - 1 downto n * G_PIX_W) <= p00;
    s4_p10((n + 1) * G_PIX_W - 1 downto n * G_PIX_W) <= p10;
    s4_p01((n + 1) * G_PIX_W - 1 downto n * G_PIX_W) <= p01;
    s4_p11((n + 1) * G_PIX_W - 1 downto n * G_PIX_W) <= p11;

  end generate g_reader;

  g_image : for image in 0 to 1 generate
    signal write_pixel : std_logic_vector(G_PIX_W - 1 downto 0);
    signal pair_pixel  : std_logic_vector(G_PIX_W - 1 downto 0);
  begin

    write_pixel <= write_data((image + 1) * G_PIX_W - 1 downto image * G_PIX_W);
    pair_pixel  <= pair_data((image + 1) * G_PIX_W - 1 downto image * G_PIX_W);

    g_bank : for b in 0 to C_BANKS - 1 generate

      g_one : if G_LANES = 1 generate

        u_bank : entity work.ram_deep
          generic map (G_DATA_W => G_PIX_W, G_DEPTH => C_DEPTH, G_LATENCY => 2)
          port map (
            clk   => clk,
            we    => write_bank(b),
            waddr => write_addr,
            wdata => write_pixel,
            raddr => s1_addr(4 * image + b),
            rdata => s3_word(4 * image + b)
          );

      end generate g_one;

      g_pair : for copy in 0 to C_COPIES - 1 generate
        constant C_A : integer := 4 * (image * G_LANES + 2 * copy) + b;
        constant C_B : integer := C_A + 4;
      begin

        u_bank : entity work.ram_2r
          generic map (G_DATA_W => G_PIX_W, G_DEPTH => C_DEPTH)
          port map (
            clk     => clk,
            a_we    => pair_bank(b),
            a_addr  => s1_addr(C_A),
            a_wdata => pair_pixel,
            a_rdata => s3_word(C_A),
            b_addr  => s1_addr(C_B),
            b_rdata => s3_word(C_B)
          );

      end generate g_pair;

    end generate g_bank;

  end generate g_image;

  g_no_lower : if G_RECTIFIED = 1 generate

    g_zero : for n in 0 to 2 * G_LANES - 1 generate
      s3_word(4 * n + 2) <= (others => '0');
      s3_word(4 * n + 3) <= (others => '0');
    end generate g_zero;

  end generate g_no_lower;

  m_p00_left  <= s4_p00(G_LANES * G_PIX_W - 1 downto 0);
  m_p10_left  <= s4_p10(G_LANES * G_PIX_W - 1 downto 0);
  m_p01_left  <= s4_p01(G_LANES * G_PIX_W - 1 downto 0);
  m_p11_left  <= s4_p11(G_LANES * G_PIX_W - 1 downto 0);
  m_p00_right <= s4_p00(2 * G_LANES * G_PIX_W - 1 downto G_LANES * G_PIX_W);
  m_p10_right <= s4_p10(2 * G_LANES * G_PIX_W - 1 downto G_LANES * G_PIX_W);
  m_p01_right <= s4_p01(2 * G_LANES * G_PIX_W - 1 downto G_LANES * G_PIX_W);
  m_p11_right <= s4_p11(2 * G_LANES * G_PIX_W - 1 downto G_LANES * G_PIX_W);

  g_sideband : for n in 0 to G_LANES - 1 generate
    constant C_LO : integer := n * G_WEIGHT_W;
    constant C_HI : integer := C_LO + G_WEIGHT_W - 1;
    -- Way of the strobes and of what belongs to a sample; index or prefix = stage.
    signal valid       : std_logic_vector(4 downto 1);
    signal row_first   : std_logic_vector(4 downto 1);
    signal plane_first : std_logic_vector(4 downto 1);
    signal plane_last  : std_logic_vector(4 downto 1);
    signal usable_x    : std_logic_vector(4 downto 1);
    signal usable_y    : std_logic_vector(4 downto 1);
    signal s1_fx_left  : std_logic_vector(G_WEIGHT_W - 1 downto 0);
    signal s2_fx_left  : std_logic_vector(G_WEIGHT_W - 1 downto 0);
    signal s3_fx_left  : std_logic_vector(G_WEIGHT_W - 1 downto 0);
    signal s1_fx_right : std_logic_vector(G_WEIGHT_W - 1 downto 0);
    signal s2_fx_right : std_logic_vector(G_WEIGHT_W - 1 downto 0);
    signal s3_fx_right : std_logic_vector(G_WEIGHT_W - 1 downto 0);
  begin

    m_valid(n)       <= valid(4);
    m_row_first(n)   <= row_first(4);
    m_plane_first(n) <= plane_first(4);
    m_plane_last(n)  <= plane_last(4);
    m_usable_x(n)    <= usable_x(4);
    m_usable_y(n)    <= usable_y(4);

    p_sideband : process (clk)
    begin
      if rising_edge(clk) then
        valid       <= valid(3 downto 1) & s_valid(n);
        row_first   <= row_first(3 downto 1) & s_row_first(n);
        plane_first <= plane_first(3 downto 1) & s_plane_first(n);
        plane_last  <= plane_last(3 downto 1) & s_plane_last(n);
        usable_x    <= usable_x(3 downto 1) & s_usable_x(n);
        usable_y    <= usable_y(3 downto 1) & s_usable_y(n);
        s1_fx_left  <= s_fx_left(C_HI downto C_LO);
        s2_fx_left  <= s1_fx_left;
        s3_fx_left  <= s2_fx_left;
        s1_fx_right <= s_fx_right(C_HI downto C_LO);
        s2_fx_right <= s1_fx_right;
        s3_fx_right <= s2_fx_right;
        m_fx_left(C_HI downto C_LO)  <= s3_fx_left;
        m_fx_right(C_HI downto C_LO) <= s3_fx_right;
        -- Constant over a row of at least C_ROW_MIN clocks: one register instead of a delay line.
        if row_first(3) = '1' then
          m_fy_left(C_HI downto C_LO)  <= s_fy_left(C_HI downto C_LO);
          m_fy_right(C_HI downto C_LO) <= s_fy_right(C_HI downto C_LO);
        end if;
        if rst = '1' then
          valid <= (others => '0');
        end if;
      end if;
    end process p_sideband;

    -- synthesis translate_off
    -- Rules, in simulators. Where memories start unknown (the replay bench), a pixel that was never loaded shows.
    p_rules : process (clk)
    begin
      if rising_edge(clk) then
        assert (load_valid or (write_any and to_sl(G_LANES > 1))) /= '1' or s_valid(n) /= '1'
          report "storage: a pixel is written while samples are read"
          severity failure;
        assert write_any /= '1' or G_LANES = 1 or n mod 2 = 1
               or unsigned(s_row_even_left((n + 1) * C_BANK_W - 1 downto n * C_BANK_W)
                           or s_row_odd_left((n + 1) * C_BANK_W - 1 downto n * C_BANK_W)
                           or s_row_even_right((n + 1) * C_BANK_W - 1 downto n * C_BANK_W)
                           or s_row_odd_right((n + 1) * C_BANK_W - 1 downto n * C_BANK_W)) = 0
          report "storage: a row part that is not 0 while a pixel is written"
          severity failure;
        if valid(4) = '1' and usable_x(4) = '1' and usable_y(4) = '1' then
          for k in 0 to 1 loop
            assert not is_x(s4_p00((k * G_LANES + n + 1) * G_PIX_W - 1 downto (k * G_LANES + n) * G_PIX_W))
                   and not is_x(s4_p10((k * G_LANES + n + 1) * G_PIX_W - 1 downto (k * G_LANES + n) * G_PIX_W))
                   and not is_x(s4_p01((k * G_LANES + n + 1) * G_PIX_W - 1 downto (k * G_LANES + n) * G_PIX_W))
                   and not is_x(s4_p11((k * G_LANES + n + 1) * G_PIX_W - 1 downto (k * G_LANES + n) * G_PIX_W))
              report "storage: a pixel of a usable sample was never loaded"
              severity failure;
          end loop;
        end if;
      end if;
    end process p_rules;
    -- synthesis translate_on

  end generate g_sideband;

end architecture rtl;
