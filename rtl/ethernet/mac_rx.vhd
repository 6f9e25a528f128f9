-- SPDX-License-Identifier: Apache-2.0
-- mac_rx: turns nibbles of MII into bytes and a verdict (IEEE 802.3: MAC clause 4.2.9, MII clause 22.2).
--   In       : mii_rxd, mii_rx_dv, mii_rx_er, in step with clk = the PHY's receive clock, 2.5 or 25 MHz
--   Out      : stream to async_fifo: the bytes after the SFD with the FCS, at most 1518, then one beat with m_last and
--              the verdict, 0 = good. Its bits: 0 FCS wrong (of the whole bytes), 1 odd nibble and FCS wrong, 2 less
--              than 64 bytes, 3 more than 1518, 4 rx_er while rx_dv, from the preamble on, 5 a byte was lost because
--              m_ready was 0. An odd nibble after a right FCS is dropped silently (4.2.4.2.1: dribble bits).
--   SFD      : the first nibble D after a 5, whatever comes before (4.2.9, PhysicalSignalDecap); without one nothing
--              comes out
--   Rate     : one byte every 2 clocks, the verdict within 1 clock of the last byte; frames may follow each other after
--              one clock
--   Latency  : 2 clocks from the second nibble of a byte to its beat, and from rx_dv = '0' to the verdict
--   Own frame: in half duplex a stretch of rx_dv in which `sending` is seen before the SFD is not received: it is the
--              station's own frame, looped back by the PHY (as those of 10BASE-T do), or a collision
--   Contract : a beat shown holds until it is taken. The next byte comes 2 clocks later and is lost if there is no
--              room. The verdict is never lost: it waits, and a frame whose rx_dv rises meanwhile is not received.
--   Crossings: full_duplex and sending are synchronised here
--   Upsets   : before_sfd, in_frame and ended have no code that lasts: whatever they are, the end of rx_dv and of the
--              verdict leads back to the start. tick flips with each clock, which shows that there is one
--   Reset    : nothing shown; what is left of a frame in progress is not received
--   Golden   : sw/golden/mac_rx.hpp
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;
  use work.eth_pkg.all;

entity mac_rx is
  port (
    clk         : in  std_logic;
    rst         : in  std_logic;
    full_duplex : in  std_logic;
    sending     : in  std_logic; -- of mac_tx
    mii_rxd     : in  std_logic_vector(3 downto 0);
    mii_rx_dv   : in  std_logic;
    mii_rx_er   : in  std_logic;
    m_valid     : out std_logic;
    m_ready     : in  std_logic;
    m_last      : out std_logic;
    m_data      : out std_logic_vector(7 downto 0);
    tick        : out std_logic
  );
end entity mac_rx;

architecture rtl of mac_rx is

  constant C_MAX : unsigned(10 downto 0) := to_unsigned(1518, 11);

  signal levels       : std_logic_vector(1 downto 0);
  signal synchronised : std_logic_vector(1 downto 0);
  signal own          : std_logic; -- the station itself sends, in half duplex
  signal ticked       : std_logic;

  -- Pins, registered at the edge of the device.
  signal nibble : std_logic_vector(3 downto 0);
  signal dv     : std_logic;
  signal er     : std_logic;

  signal before_sfd : std_logic; -- rx_dv was 0, and no SFD since
  signal after_5    : std_logic;
  signal in_frame   : std_logic; -- from the SFD until the verdict is on its way
  signal ended      : std_logic; -- rx_dv was 0 in the frame, the verdict waits
  signal stop     : std_logic;
  signal high     : std_logic; -- the low nibble of a byte is in `low`
  signal low      : std_logic_vector(3 downto 0);
  signal crc      : std_logic_vector(31 downto 0);
  signal crc_good : std_logic;
  signal was_good : std_logic; -- crc_good of the whole bytes, while high
  signal wrong    : std_logic;
  signal count    : unsigned(10 downto 0); -- bytes, up to C_MAX
  signal full     : std_logic;
  signal long     : std_logic;
  signal error    : std_logic;
  signal lost     : std_logic;
  signal verdict  : std_logic_vector(5 downto 0);

  signal byte_end : std_logic;
  signal room     : std_logic;
  signal valid    : std_logic;

  attribute iob : string;

  attribute iob of nibble, dv, er : signal is C_PAD;

begin

  levels <= full_duplex & sending;

  u_levels : entity work.cdc_sync
    generic map (
      G_WIDTH  => 2,
      G_STAGES => 2
    )
    port map (
      clk => clk,
      d   => levels,
      q   => synchronised
    );

  own  <= synchronised(0) and not synchronised(1);
  tick <= ticked;

  m_valid  <= valid;
  room     <= not valid or m_ready;
  stop     <= in_frame and (ended or not dv);
  byte_end <= in_frame and not stop and high;
  full     <= to_sl(count = C_MAX);
  crc_good <= to_sl(crc = C_CRC_RESIDUE);

  -- The register has seen an odd nibble too, so what it said before that one was kept.
  wrong   <= not crc_good when high = '0' else not was_good;
  verdict <= lost & error & long & to_sl(count(10 downto 6) = 0) & (high and wrong) & wrong;

  p_frame : process (clk)
  begin
    if rising_edge(clk) then
      ticked <= not ticked;
      nibble <= mii_rxd;
      dv     <= mii_rx_dv;
      er     <= mii_rx_er;

      if m_ready = '1' then
        valid <= '0';
      end if;

      after_5 <= dv and to_sl(nibble = "0101");
      if before_sfd = '1' and dv = '1' and (own = '1' or (after_5 = '1' and nibble = "1101")) then
        before_sfd <= '0';
        in_frame   <= not own;
      end if;
      if dv = '1' and er = '1' and ended = '0' then
        error <= '1';
      end if;
      if dv = '0' and (in_frame = '0' or room = '1') then
        before_sfd <= '1';
        error      <= '0';
      end if;

      -- In front of a frame: start values.
      if in_frame = '0' then
        high  <= '0';
        crc   <= (others => '1');
        count <= (others => '0');
        long  <= '0';
        lost  <= '0';
        ended <= '0';
      elsif stop = '0' then
        high <= not high;
        low  <= nibble;
        crc  <= crc32_nibble(crc, nibble);
        if high = '0' then
          was_good <= crc_good;
        end if;
        if byte_end = '1' and full = '0' then
          count <= count + 1;
        end if;
        if byte_end = '1' and full = '1' then
          long <= '1';
        end if;
        if byte_end = '1' and full = '0' and room = '0' then
          lost <= '1';
        end if;
      else
        ended    <= not room;
        in_frame <= not room;
      end if;

      -- Beats.
      if room = '1' then
        m_last <= stop;
        if stop = '1' then
          m_data <= "00" & verdict;
        else
          m_data <= nibble & low;
        end if;
        valid <= stop or (byte_end and not full);
      end if;

      if rst = '1' then
        valid      <= '0';
        before_sfd <= '0';
        in_frame   <= '0';
        ticked     <= '0';
      end if;
    end if;
  end process p_frame;

end architecture rtl;
