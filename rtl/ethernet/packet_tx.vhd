-- SPDX-License-Identifier: Apache-2.0
-- packet_tx: builds an ARP reply (RFC 826), ICMP echo reply or port unreachable (RFC 792) or UDP packet (RFC 768) in a
--            frame slot of mac_tx.
--   Input     : s_start (pulse, only while s_ready) with s_kind 0 ARP, 1 ICMP echo, 2 UDP, 3 ICMP port unreachable, and
--               the peer's bank; then the payload, 1 .. 1472 bytes with p_last (ICMP: up to 1476, from frame byte 38
--               on; UDP: from 42 on; ARP: none), with any gaps. The peer's bytes (0-5 MAC, 6-9 IP, 10-11 UDP port)
--               stand still from s_start until s_ready
--   Abort     : s_abort forgets the frame being built and leaves requested ones alone. s_ready is valid from the next
--               clock on
--   Output    : the frame without padding and FCS, at slot & byte of ram_dc; then f_request of the slot flips. Slots
--               take turns. IPv4 (RFC 791): id 0, do not fragment, TTL 64. UDP from port G_UDP_PORT, checksum 0 sent
--               as 0xffff
--   Events    : ev_sent, ev_excessive, ev_late, ev_deferred: one pulse when f_done of a slot comes back
--   Upsets    : if more than one step of building is set, the frame is forgotten and ev_recovered pulses. f_request(s)
--               becomes the complement of f_done(s), so that no upset of either outlasts a frame. This entity chooses
--               the next slot, and mac_tx follows
--   Time      : one clock per byte of the payload, then 170 clocks (ICMP: 154)
--   Structure : the payload comes first, so that all lengths are known when the header is written. The header is walked
--               through four times: written and summed for UDP; UDP or ICMP checksum written; summed for IP; IP
--               checksum written. So there is one sum, nothing is patched, and the walk has no jumps. A byte of the
--               header comes from constants, own addresses and lengths, the peer's memory, or the sum. The lower bits
--               of the byte number address the peer's memory.
--               Sum: ones' complement, 8 bits per byte: {high, low} rotate by a byte at each step, and the carry waits
--               for the next byte. UDP sums bytes 14-23, 26-39 and, in place of the IP checksum, a constant that turns
--               the former into the pseudo header
--   Crossing  : f_done and tx_rst through cdc_sync; f_result stands still beside f_done
--   Reset     : both slots free; data registers have no reset. While tx_rst (of mac_tx) is seen, which lasts as long as
--               there is no tx_clk, no slot is free, none is requested, and f_done has no meaning
--   Golden    : sw/golden/packet_tx.hpp
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;
  use work.link_pkg.all;

entity packet_tx is
  generic (
    G_UDP_PORT : integer := 20563 -- 1 .. 65535
  );
  port (
    clk : in  std_logic;
    rst : in  std_logic;

    own_mac : in  std_logic_vector(47 downto 0); -- first byte on the wire on the left; static
    own_ip  : in  std_logic_vector(31 downto 0);

    s_ready : out std_logic;
    s_start : in  std_logic;
    s_kind  : in  std_logic_vector(1 downto 0);
    s_bank  : in  std_logic;
    s_abort : in  std_logic;

    p_valid : in  std_logic;
    p_ready : out std_logic;
    p_data  : in  std_logic_vector(7 downto 0);
    p_last  : in  std_logic;

    peer_we    : in  std_logic;
    peer_bank  : in  std_logic;
    peer_index : in  std_logic_vector(3 downto 0);
    peer_data  : in  std_logic_vector(7 downto 0);

    ram_we    : out std_logic;
    ram_waddr : out std_logic_vector(11 downto 0);
    ram_wdata : out std_logic_vector(7 downto 0);

    tx_rst     : in  std_logic; -- of tx_clk
    tx_down    : out std_logic; -- the same, as it is seen here
    f_request  : out std_logic_vector(1 downto 0);
    f_length_0 : out std_logic_vector(10 downto 0);
    f_length_1 : out std_logic_vector(10 downto 0);
    f_done     : in  std_logic_vector(1 downto 0); -- of tx_clk
    f_result_0 : in  std_logic_vector(1 downto 0);
    f_result_1 : in  std_logic_vector(1 downto 0);

    ev_sent      : out std_logic;
    ev_excessive : out std_logic;
    ev_late      : out std_logic;
    ev_deferred  : out std_logic;
    ev_recovered : out std_logic
  );
end entity packet_tx;

architecture rtl of packet_tx is

  constant C_PORT : unsigned(15 downto 0) := to_unsigned(G_UDP_PORT mod 65536, 16);
  -- UDP's sum has 0x4500, 0x4000, 0x4011 and the total length; it needs 17 and the total length - 20.
  constant C_PSEUDO : std_logic_vector(15 downto 0) := x"3aeb";

  -- What is being done, one after the other: nothing; payload; one clock; header.
  signal busy    : std_logic;
  signal illegal : std_logic; -- more than one of them
  signal paying  : std_logic;
  signal turning : std_logic;
  signal walking : std_logic;
  signal finish  : std_logic;

  signal kind : std_logic_vector(1 downto 0);
  signal arp  : std_logic;
  signal udp  : std_logic;
  signal icmp : std_logic; -- both kinds
  signal bank : std_logic;
  signal slot : std_logic;
  signal size : unsigned(10 downto 0); -- of the frame so far

  -- Walk: byte of the header, and the four times.
  signal place : unsigned(5 downto 0);
  signal round : unsigned(1 downto 0);
  signal last  : std_logic;

  -- Sources of the byte.
  signal lengths     : unsigned(10 downto 0);
  signal length_byte : std_logic_vector(7 downto 0);
  signal mac_byte    : std_logic_vector(7 downto 0);
  signal ip_place    : unsigned(1 downto 0);
  signal ip_byte     : std_logic_vector(7 downto 0);
  signal fixed_byte  : std_logic_vector(7 downto 0);
  signal peer_waddr  : std_logic_vector(4 downto 0);
  signal peer_raddr  : std_logic_vector(4 downto 0);
  signal peer_byte   : std_logic_vector(7 downto 0);

  -- One clock later: where it goes.
  signal at_checksum  : std_logic;
  signal way_step     : std_logic;
  signal way_we       : std_logic;
  signal way_place    : unsigned(5 downto 0);
  signal way_peer     : std_logic;
  signal way_checksum : std_logic;
  signal way_no_zero  : std_logic; -- a checksum that may have another zero
  signal way_byte     : std_logic_vector(7 downto 0);
  signal way_add      : std_logic;
  signal way_clear    : std_logic;
  signal data         : std_logic_vector(7 downto 0);

  signal take   : std_logic;
  signal step   : std_logic;
  signal addend : std_logic_vector(7 downto 0);
  signal sum    : unsigned(16 downto 0); -- the carry on the left

  -- Slots.
  signal levels    : std_logic_vector(2 downto 0);
  signal levels_q  : std_logic_vector(2 downto 0);
  signal down      : std_logic; -- mac_tx is in reset
  signal request   : std_logic_vector(1 downto 0);
  signal done      : std_logic_vector(1 downto 0);
  signal done_seen : std_logic_vector(1 downto 0);
  signal change    : std_logic_vector(1 downto 0);
  signal result    : std_logic_vector(1 downto 0);

begin

  assert G_UDP_PORT >= 1 and G_UDP_PORT <= 65535
    report "packet_tx: G_UDP_PORT"
           -- synthesis translate_off
           & "=" & integer'image(G_UDP_PORT)
           -- synthesis translate_on
           & " outside 1..65535"
    severity failure;

  -- Control -----------------------------------------------------------------------------------------------------------
  busy    <= paying or turning or walking;
  illegal <= (paying and (turning or walking)) or (turning and walking);
  arp     <= not kind(1) and not kind(0);
  udp     <= kind(1) and not kind(0);
  icmp    <= kind(0);
  take    <= paying and p_valid;
  p_ready <= paying;
  last    <= to_sl(place = 41) or (icmp and to_sl(place = 37)); -- the ICMP payload begins at 38
  finish  <= last and to_sl(round = 3);

  p_control : process (clk)
  begin
    if rising_edge(clk) then
      turning <= (s_start and to_sl(s_kind = C_FRAME_ARP)) or (take and p_last);
      if s_start = '1' then
        paying <= to_sl(s_kind /= C_FRAME_ARP);
        kind   <= s_kind;
        bank   <= s_bank;
        size   <= to_unsigned(42, 11);
        if s_kind(0) = '1' then
          size <= to_unsigned(38, 11);
        end if;
      elsif take = '1' then
        size   <= size + 1;
        paying <= not p_last;
      end if;

      if turning = '1' then
        walking <= '1';
      end if;
      if walking = '1' then
        place <= place + 1;
        if last = '1' then
          place <= (others => '0');
          round <= round + 1;
        end if;
        -- The latest byte was written long ago.
        if finish = '1' then
          walking <= '0';
        end if;
      else
        place <= (others => '0');
        round <= (others => '0');
      end if;

      ev_recovered <= illegal and not rst;
      if rst = '1' or s_abort = '1' or illegal = '1' then
        paying  <= '0';
        turning <= '0';
        walking <= '0';
      end if;
    end if;
  end process p_control;

  -- Sources -----------------------------------------------------------------------------------------------------------
  -- Frame byte 16: IP total length; 38: UDP length.
  lengths     <= size - 34 when place(5) = '1' else
                 size - 14;
  length_byte <= "00000" & std_logic_vector(lengths(10 downto 8)) when place(0) = '0' else
                 std_logic_vector(lengths(7 downto 0));

  -- Frame bytes 6 and, in ARP, 22.
  mac_byte <= mac_byte_of(own_mac, place(2 downto 0));

  -- Frame bytes 26 or, in ARP, 28.
  ip_place <= (place(1) xor not arp) & place(0);
  ip_byte  <= word_byte(own_ip, ip_place);

  -- Zero where nothing else is said. Type 3, code 3: port unreachable.
  p_fixed_byte : process (place, kind, arp, udp)
  begin
    fixed_byte <= (others => '0');
    if place = 12 then
      fixed_byte <= x"08";
    elsif place = 13 then
      fixed_byte <= "00000" & arp & arp & '0';
    elsif place = 14 then
      if arp = '0' then
        fixed_byte <= x"45";
      end if;
    elsif place = 15 then
      fixed_byte <= "0000000" & arp;
    elsif place = 16 then
      fixed_byte <= x"08";
    elsif place = 18 then
      fixed_byte <= "00000" & arp & arp & '0';
    elsif place = 19 then
      fixed_byte <= "00000" & arp & "00";
    elsif place = 20 then
      fixed_byte <= '0' & not arp & "000000";
    elsif place = 21 then
      fixed_byte <= "000000" & arp & '0';
    elsif place = 22 then
      fixed_byte <= x"40";
    elsif place = 23 then
      fixed_byte <= "000" & udp & "0001";
    elsif place = 24 then
      fixed_byte <= C_PSEUDO(15 downto 8);
    elsif place = 25 then
      fixed_byte <= C_PSEUDO(7 downto 0);
    elsif place = 34 then
      if udp = '1' then
        fixed_byte <= std_logic_vector(C_PORT(15 downto 8));
      elsif kind = C_FRAME_CLOSED then
        fixed_byte <= x"03";
      end if;
    elsif place = 35 then
      if udp = '1' then
        fixed_byte <= std_logic_vector(C_PORT(7 downto 0));
      elsif kind = C_FRAME_CLOSED then
        fixed_byte <= x"03";
      end if;
    elsif place >= 40 then
      fixed_byte <= x"ff";
    end if;
  end process p_fixed_byte;

  -- Peer: frame bytes 0 and, in ARP, 32 (MAC), 30 or 38 (IP): their lower bits are the index. 36 (port) would be index
  -- 12, where it is kept.
  peer_waddr <= peer_bank & peer_index(3) & (peer_index(2) or (peer_index(3) and peer_index(1))) &
                (peer_index(1) and not peer_index(3)) & peer_index(0);
  peer_raddr <= bank & (place(5) and (place(3) or not arp)) & std_logic_vector(place(2 downto 0));

  u_peers : entity work.ram_sdp
    generic map (
      G_DATA_W  => 8,
      G_DEPTH   => 32,
      G_LATENCY => 1
    )
    port map (
      clk   => clk,
      we    => peer_we,
      waddr => peer_waddr,
      wdata => peer_data,
      raddr => peer_raddr,
      rdata => peer_byte
    );

  -- Round 1 writes the checksum of UDP or ICMP, round 3 that of IP.
  at_checksum <= round(0) and not arp and
                 ((round(1) and to_sl(place(5 downto 1) = 12)) or
                  (not round(1) and ((udp and to_sl(place(5 downto 1) = 20)) or
                                     (not udp and to_sl(place(5 downto 1) = 18)))));

  p_way : process (clk)
  begin
    if rising_edge(clk) then
      way_step     <= walking and not rst;
      way_we       <= walking and not rst and (to_sl(round = 0) or at_checksum);
      way_place    <= place;
      way_checksum <= at_checksum;
      way_no_zero  <= not round(1);
      way_clear    <= walking and to_sl(round = 2 and place = 0);
      if round = 0 then
        way_add <= (udp and to_sl(place >= 14 and place <= 39)) or
                   (kind(1) and kind(0) and to_sl(place(5 downto 1) = 17));
      else
        way_add <= to_sl(round = 2 and place >= 14 and place <= 33 and place /= 24 and place /= 25);
      end if;

      if arp = '1' then
        way_peer <= to_sl(place <= 5 or place >= 32);
      else
        way_peer <= to_sl(place <= 5 or (place >= 30 and place <= 33) or place = 36 or place = 37);
      end if;
      if place(5 downto 1) = 3 or place(5 downto 2) = 2 or
         (arp = '1' and (place(5 downto 1) = 11 or place(5 downto 2) = 6)) then
        way_byte <= mac_byte;
      elsif (arp = '0' and (place(5 downto 1) = 13 or place(5 downto 1) = 14)) or
            (arp = '1' and place(5 downto 2) = 7) then
        way_byte <= ip_byte;
      elsif arp = '0' and (place(5 downto 1) = 8 or place(5 downto 1) = 19) then
        way_byte <= length_byte;
      else
        way_byte <= fixed_byte;
      end if;
    end if;
  end process p_way;

  -- Round 1 and 3 begin with zeros, so that no carry is left when the checksum is written. Where it would be zero in
  -- round 1 the fixed byte stays: 0xffff for UDP, zero for ICMP.
  data <= p_data when paying = '1' else
          peer_byte when way_peer = '1' and way_checksum = '0' else
          way_byte when way_checksum = '0' or (way_no_zero = '1' and sum(15 downto 0) = x"ffff") else
          std_logic_vector(not sum(15 downto 8));

  ram_we    <= take or way_we;
  ram_waddr <= slot & std_logic_vector(size) when paying = '1' else
               slot & "00000" & std_logic_vector(way_place);
  ram_wdata <= data;

  -- Sum ---------------------------------------------------------------------------------------------------------------
  -- After an odd number of bytes one zero more.
  step   <= take or (turning and size(0)) or way_step;
  addend <= data when paying = '1' or way_add = '1' else
            (others => '0');

  p_sum : process (clk)
  begin
    if rising_edge(clk) then
      if step = '1' then
        sum <= checksum_add(sum, addend);
      end if;
      if busy = '0' or way_clear = '1' then
        sum <= (others => '0');
      end if;
    end if;
  end process p_sum;

  -- Slots -------------------------------------------------------------------------------------------------------------
  s_ready   <= not busy and not down and not (request(0) xor done(0)) when slot = '0' else
               not busy and not down and not (request(1) xor done(1));
  f_request <= request;

  levels <= tx_rst & f_done;

  u_levels : entity work.cdc_sync
    generic map (
      G_WIDTH => 3
    )
    port map (
      clk => clk,
      d   => levels,
      q   => levels_q
    );

  down    <= levels_q(2);
  tx_down <= down;
  done    <= levels_q(1 downto 0);
  change  <= done xor done_seen;
  result <= f_result_0 when change(0) = '1' else
            f_result_1;

  p_slots : process (clk)
  begin
    if rising_edge(clk) then
      if walking = '1' and finish = '1' then
        slot <= not slot;
        if slot = '0' then
          request(0) <= not done(0);
          f_length_0 <= std_logic_vector(size);
        else
          request(1) <= not done(1);
          f_length_1 <= std_logic_vector(size);
        end if;
      end if;
      done_seen    <= done;
      ev_sent      <= (change(0) or change(1)) and to_sl(result = "00");
      ev_excessive <= (change(0) or change(1)) and to_sl(result = "01");
      ev_late      <= (change(0) or change(1)) and to_sl(result = "10");
      ev_deferred  <= (change(0) or change(1)) and to_sl(result = "11");
      if rst = '1' then
        slot <= '0';
      end if;
      if rst = '1' or down = '1' then
        request      <= "00";
        ev_sent      <= '0';
        ev_excessive <= '0';
        ev_late      <= '0';
        ev_deferred  <= '0';
      end if;
    end if;
  end process p_slots;

end architecture rtl;
