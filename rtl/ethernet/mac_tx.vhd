-- SPDX-License-Identifier: Apache-2.0
-- mac_tx: sends frames from two slots of a RAM as nibbles of MII, full or half duplex (IEEE 802.3: MAC clause 4.2.8,
--         MII clause 22.2; CSMA/CD as in 4.2.3.2).
--   Frame    : 15 nibbles 5 and one D, the bytes with the low nibble first, zeros up to 60 bytes, FCS
--   Gap      : full duplex: tx_en is low for exactly 24 nibbles if a frame waits. Half duplex: 24 clocks from the end
--              of tx_en or crs (for crs two clocks of synchronisation and two of output are added). crs in the first 15
--              restarts the gap, later it does not; a frame that waits when the gap ends is sent whatever crs says then
--              (4.2.3.2.1, where the first part is up to 2/3 of the gap).
--   Deferral : a frame that has waited for the gap for 2**14 nibbles (up to 16 fewer) in a row, 65,536 bit times, is
--              given up. The standard's maxDeferTime, two frames of the largest size (24,288 bit times), ends nothing
--              there, it is only counted; on a busy medium other stations may rightfully send for longer than that
--   Collision: col in nibble 0 .. 127 of a transmission (preamble included): preamble and SFD are completed, 8 nibbles
--              of jam (all 5) follow, and the frame is sent again after 0 .. 2**min(n, 10) - 1 slots of 128 nibbles
--              from the end of the jam and a gap, n = number of its collisions; it is given up at the 16th. From nibble
--              128 on: jam, and the frame is not sent again. Collisions in the last four nibbles of a frame, which are
--              late, are not seen.
--   Random   : free-running LFSR of 17 bits (x**17 + x**14 + 1) from G_SEED, stirred by the RAM's output; the preamble
--              reads bytes 8 .. 15 for that. So stations of the same seed that run in step separate at the first
--              collision if their source addresses differ in the last 4 bytes: a byte's two nibbles enter at every
--              fourth bit, hence at different bits, and cannot cancel.
--   Slots    : served 0, 1, 0, 1 ..; while f_request(s) /= f_done(s) a frame waits, and f_length_s (14 .. 1514 bytes
--              without FCS) and its bytes stand still. f_done(s) flips when the frame is over; f_result_s (from the
--              same clock on) is 0 sent, 1 given up after 16 collisions, 2 late collision, 3 given up after too long a
--              deferral. collisions flips at each collision.
--   Upsets   : if more than one state is set, all are cleared, the frame is sent again from its beginning, and
--              recovered flips. If only the slot whose turn it is not waits, it gets the turn, and resynchronised
--              flips: that happens only after an upset of one of the two counts of turns, as requests arrive in the
--              order in which they are made. f_done(s) becomes f_request(s), not the complement of itself, so that no
--              upset of either outlasts a frame. tick flips while there is a clock.
--   Latency  : 2 clocks from a state to the pins; r_data is used one clock after r_addr
--   Crossings: full_duplex, mii_crs, mii_col and f_request are synchronised here (one clock of doubt). full_duplex may
--              change at any time: it only decides whether crs and col are used.
--   Structure: one counter of nibbles for all states; its upper bits count the slots of the backoff and are compared
--              with as many bits of the LFSR (which stands still meanwhile) as there are ones in the shift register of
--              attempts. One-hot states. The CRC's index nibble also makes txd: nibble = index xor crc.
--   Sending  : mii_tx_en one clock earlier, for mac_rx
--   Reset    : nothing is sent, a frame in transmission is cut off; f_done = f_request = 0 is the empty state
--   Golden   : sw/golden/mac_tx.hpp
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;
  use work.eth_pkg.all;

entity mac_tx is
  generic (
    G_SEED : integer := 1
  );
  port (
    clk         : in  std_logic;
    rst         : in  std_logic;
    full_duplex : in  std_logic;
    mii_crs     : in  std_logic;
    mii_col     : in  std_logic;
    mii_txd     : out std_logic_vector(3 downto 0);
    mii_tx_en   : out std_logic;
    sending     : out std_logic;
    f_request   : in  std_logic_vector(1 downto 0);
    f_length_0  : in  std_logic_vector(10 downto 0);
    f_length_1  : in  std_logic_vector(10 downto 0);
    f_done      : out std_logic_vector(1 downto 0);
    f_result_0  : out std_logic_vector(1 downto 0);
    f_result_1  : out std_logic_vector(1 downto 0);
    collisions  : out std_logic;
    r_addr      : out std_logic_vector(11 downto 0);
    r_data      : in  std_logic_vector(7 downto 0);

    recovered      : out std_logic;
    resynchronised : out std_logic;
    tick           : out std_logic
  );
end entity mac_tx;

architecture rtl of mac_tx is

  constant C_TRIES : integer := 15; -- collisions after which a frame is tried once more

  signal pins         : std_logic_vector(4 downto 0);
  signal synchronised : std_logic_vector(4 downto 0);
  signal request      : std_logic_vector(1 downto 0);
  signal half         : std_logic;
  signal crs          : std_logic;
  signal col          : std_logic;

  -- States; none: a frame may begin.
  signal preamble : std_logic;
  signal data     : std_logic; -- padding included
  signal fcs      : std_logic;
  signal jam      : std_logic;
  signal backoff  : std_logic;

  signal on_air   : std_logic;
  signal illegal  : std_logic; -- more than one state
  signal start    : std_logic;
  signal expired  : std_logic; -- deferred for too long
  signal restart  : std_logic;
  signal pos      : unsigned(16 downto 0); -- nibbles of the state; backoff: slots from bit 7 on
  signal last_7   : std_logic;
  signal last_8   : std_logic;
  signal last_16  : std_logic;
  signal length   : std_logic_vector(10 downto 0);
  signal at_end   : std_logic; -- the slot's bytes are through
  signal padding  : std_logic; -- the same, before this nibble
  signal at_60    : std_logic; -- 60 bytes are through
  signal minimum  : std_logic;
  signal at_late  : std_logic; -- a collision seen from now on is late
  signal late     : std_logic;
  signal all_up   : std_logic;
  signal collided : std_logic; -- in the preamble
  signal hit      : std_logic;
  signal tried    : std_logic_vector(C_TRIES - 1 downto 0); -- as many ones as collisions
  signal random   : std_logic_vector(16 downto 0);
  signal slots    : std_logic_vector(9 downto 0); -- where the slots so far and the random number differ
  signal waited   : std_logic;
  signal gap      : unsigned(4 downto 0); -- from 1 to 24
  signal gap_over : std_logic;
  signal slot     : std_logic;
  signal waits    : std_logic_vector(1 downto 0);
  signal waiting  : std_logic; -- in slot
  signal follow   : std_logic; -- only in the other one
  signal rest     : std_logic; -- no state, nothing waits
  signal finish   : std_logic;
  signal done     : std_logic_vector(1 downto 0);
  signal result   : std_logic_vector(1 downto 0);
  signal flip     : std_logic;
  signal repaired : std_logic;
  signal followed : std_logic;

  -- One clock later, beside r_data.
  signal p_on    : std_logic;
  signal p_frame : std_logic; -- bytes or FCS
  signal p_fcs   : std_logic;
  signal p_zero  : std_logic; -- padding
  signal p_high  : std_logic;
  signal p_sfd   : std_logic;
  signal nibble  : std_logic_vector(3 downto 0);
  signal index   : std_logic_vector(3 downto 0);
  signal crc     : std_logic_vector(31 downto 0);
  signal txd     : std_logic_vector(3 downto 0);

  attribute iob : string;

  attribute iob of txd : signal is C_PAD;

begin

  assert G_SEED >= 1 and G_SEED <= 131071
    report "mac_tx: G_SEED"
           -- synthesis translate_off
           & "=" & integer'image(G_SEED)
           -- synthesis translate_on
           & " outside 1..131071"
    severity failure;

  pins <= f_request & full_duplex & mii_crs & mii_col;

  u_pins : entity work.cdc_sync
    generic map (
      G_WIDTH  => 5,
      G_STAGES => 2
    )
    port map (
      clk => clk,
      d   => pins,
      q   => synchronised
    );

  request <= synchronised(4 downto 3);
  half    <= not synchronised(2);
  crs     <= synchronised(1) and half;
  col     <= synchronised(0) and half;

  -- Deference.
  on_air   <= preamble or data or fcs or jam;
  illegal  <= (preamble and (data or fcs or jam or backoff)) or (data and (fcs or jam or backoff)) or
              (fcs and (jam or backoff)) or (jam and backoff);
  gap_over <= gap(4) and gap(3);
  waits    <= request xor done;
  waiting  <= waits(0) when slot = '0' else waits(1);
  follow   <= not on_air and not backoff and not waiting and (waits(0) or waits(1));
  rest     <= not on_air and not backoff and not waiting;
  start    <= waiting and gap_over and not on_air and not backoff;
  expired  <= waiting and not gap_over and not on_air and not backoff and pos(14);

  p_gap : process (clk)
  begin
    if rising_edge(clk) then
      if rst = '1' or on_air = '1' or (crs = '1' and (gap(4) = '0' or gap(3) = '1')) then
        gap <= to_unsigned(1, 5);
      elsif gap_over = '0' then
        gap <= gap + 1;
      end if;
    end if;
  end process p_gap;

  -- Ends of the states. The limits of 60 bytes and of the slot time are reached by counting up, so that the ones among
  -- their bits tell them. A collision is seen 4 nibbles after its own: 116 = 128 - 16 + 4.
  last_7   <= to_sl(pos(2 downto 0) = 6);
  last_8   <= to_sl(pos(2 downto 0) = 7);
  last_16  <= last_8 and pos(3);
  length   <= f_length_0 when slot = '0' else f_length_1;
  at_end   <= padding or to_sl(std_logic_vector(pos(11 downto 1)) = length);
  at_60    <= minimum or (pos(6) and pos(5) and pos(4) and pos(3));
  at_late  <= late or (pos(6) and pos(5) and pos(4) and pos(2));
  all_up   <= data and at_end and at_60;
  hit      <= (preamble and last_16 and (collided or col)) or ((data or fcs) and col);
  slots    <= std_logic_vector(pos(16 downto 7)) xor random(9 downto 0);
  waited   <= to_sl((slots and tried(9 downto 0)) = "0000000000");
  finish   <= (fcs and last_7 and not col) or (jam and last_8 and (late or tried(C_TRIES - 1))) or expired;
  restart  <= start or (preamble and last_16) or hit or all_up or (jam and last_8) or (backoff and waited) or expired;

  -- The first nibble of the FCS leaves in the last clock of data.
  p_state : process (clk)
  begin
    if rising_edge(clk) then
      pos <= pos + 1;
      -- The lowest ones go on: they make tick.
      if rest = '1' then
        pos(16 downto 3) <= (others => '0');
      end if;
      if restart = '1' then
        pos <= (others => '0');
      end if;

      preamble <= start or (preamble and not last_16);
      data     <= (preamble and last_16 and not hit) or (data and not all_up and not hit);
      fcs      <= (all_up and not hit) or (fcs and not last_7 and not hit);
      jam      <= hit or (jam and not last_8);
      backoff  <= (jam and last_8 and not finish) or (backoff and not waited);

      collided <= preamble and (collided or col);
      padding  <= at_end and data;
      minimum  <= at_60 and not start;
      late     <= at_late and not start;

      if finish = '1' then
        tried <= (others => '0');
      elsif jam = '1' and last_8 = '1' then
        tried <= tried(C_TRIES - 2 downto 0) & '1';
      end if;

      if backoff = '0' then
        random     <= random(15 downto 0) & (random(16) xor random(13) xor nibble(0));
        random(4)  <= random(3) xor nibble(1);
        random(8)  <= random(7) xor nibble(2);
        random(12) <= random(11) xor nibble(3);
      end if;

      if rst = '1' or illegal = '1' then
        preamble <= '0';
        data     <= '0';
        fcs      <= '0';
        jam      <= '0';
        backoff  <= '0';
      end if;
      if rst = '1' then
        pos      <= (others => '0');
        tried    <= (others => '0');
        random   <= std_logic_vector(to_unsigned(G_SEED, 17));
      end if;
    end if;
  end process p_state;

  -- Answers.
  result         <= (expired or (jam and late)) & (expired or (jam and not late));
  f_done         <= done;
  collisions     <= flip;
  recovered      <= repaired;
  resynchronised <= followed;
  tick           <= pos(2);

  p_answer : process (clk)
  begin
    if rising_edge(clk) then
      if jam = '1' and last_8 = '1' then
        flip <= not flip;
      end if;
      if illegal = '1' then
        repaired <= not repaired;
      end if;
      if follow = '1' then
        followed <= not followed;
      end if;
      if finish = '1' or follow = '1' then
        slot <= not slot;
      end if;
      if finish = '1' and slot = '0' then
        done(0)    <= request(0);
        f_result_0 <= result;
      end if;
      if finish = '1' and slot = '1' then
        done(1)    <= request(1);
        f_result_1 <= result;
      end if;
      if rst = '1' then
        slot     <= '0';
        done     <= "00";
        flip     <= '0';
        repaired <= '0';
        followed <= '0';
      end if;
    end if;
  end process p_answer;

  -- Nibbles. In the FCS index 0 shifts the register out.
  r_addr <= slot & std_logic_vector(pos(11 downto 5)) & (pos(4) or preamble) & std_logic_vector(pos(3 downto 1));
  nibble <= "0000" when p_zero = '1' else r_data(7 downto 4) when p_high = '1' else r_data(3 downto 0);
  index  <= "0000" when p_fcs = '1' else crc(3 downto 0) xor nibble;

  mii_txd <= txd;
  sending <= p_on;

  p_nibble : process (clk)
  begin
    if rising_edge(clk) then
      p_on    <= on_air;
      p_frame <= data or fcs;
      p_fcs   <= fcs or all_up;
      p_zero  <= at_end;
      p_high  <= pos(0);
      p_sfd   <= preamble and last_16;

      if p_frame = '0' then
        crc <= (others => '1');
      else
        crc <= crc32_index(crc, index);
      end if;

      mii_tx_en <= p_on;
      if p_frame = '1' then
        txd <= crc(3 downto 0) xor index xor (p_fcs & p_fcs & p_fcs & p_fcs);
      else
        txd <= p_sfd & p_on & '0' & p_on;
      end if;
      if rst = '1' then
        p_on      <= '0';
        p_frame   <= '0';
        p_sfd     <= '0';
        mii_tx_en <= '0';
        txd       <= "0000";
      end if;
    end if;
  end process p_nibble;

end architecture rtl;
