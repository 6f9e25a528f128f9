-- SPDX-License-Identifier: Apache-2.0
-- packet_rx: turns frames of the MAC into messages for the responder: ARP requests, ICMP echo requests, UDP to one
--            port, and UDP to any other port, whose sender is told.
--   Input     : bytes after the SFD, FCS included; then one beat with s_last whose s_data is the MAC's verdict
--               (mac_rx; 0 = good: at least 64, at most 1518 bytes, FCS right). s_ready is low in the clock after a
--               verdict
--   Accepts   : destination own_mac; broadcast for ARP only. ARP (RFC 826): Ethernet, IPv4, request, target own_ip.
--               IPv4 (RFC 791): header of 5 words, total length at least 28 and within the frame, header checksum, not
--               a fragment, destination own_ip; with ICMP (RFC 792): type 8, code 0, checksum over the message; or with
--               UDP (RFC 768): length = total length - 20, checksum (0: none). Anything behind the IP packet (padding,
--               FCS) is ignored
--   Sources   : refused, as RFC 1122 (3.2.1.3) demands: source MAC with the group bit, or own_mac; source IP of 0/8,
--               127/8, 224/4 and 240/4, or own_ip; ARP: sender's MAC with the group bit, or own_mac, sender's IP own_ip
--               (0.0.0.0 is a probe, RFC 5227, and answered)
--   Output    : m_valid, m_kind (0 ARP, 1 ICMP, 2 UDP, 3 UDP to another port than G_UDP_PORT), m_length (ICMP: bytes
--               from frame byte 34 on, UDP: payload, from byte 42 on; ARP: 0) of the oldest message, until m_done; its
--               frame through r_addr, r_data (1 clock)
--   Ring      : G_SLOTS * 2 KB in granules of 512 bytes. A frame takes 1 to 3 of them, as many as it needs, FCS
--               included. Bytes are stored as they come, and a frame becomes a message only at its verdict. Each of its
--               granules must be free at its first byte, else the frame is lost. Waiting messages are never
--               overwritten, whatever the input
--   Events    : bits 0 to 15: counter of that number in docs/protocol.md; 16 bad_source, 17 rx_fragment, 18
--               resynchronised (not of a frame). One pulse per frame two clocks after its verdict, for a message two (0
--               and its kind; kind 3: 0 and 9). Order: the MAC's verdict (8, 5, 4, 3 or, in half duplex with a wrong
--               FCS, 17, 2, 1), 6 destination MAC, 9 ethertype or ARP, 10 IP header, 16 source, 11 fragment, 9 protocol
--               or ICMP type, 12 UDP length or checksum, 7 no slot
--   Upsets    : a message is stored with its number of granules (1 to 3) and the lap in which it was written. A message
--               without granules or of another lap than the reader's, or more granules in use than there are, reveals
--               that a pointer was upset: the ring is emptied, and the frame that is coming in is lost
--               (resynchronised). So whatever is upset, the reader moves towards the writer with each message, shows at
--               most as many wrong ones as there are granules, and with an empty ring everything is right again
--   Latency   : m_valid 3 clocks after the verdict
--   Structure : one position counter. It starts at -34, so that it also counts the bytes after the IP header; its lower
--               6 bits identify every header byte. Each byte is compared with one expected byte, and a sticky bit
--               records the class of any difference.
--               Sums: ones' complement, 8 bits per byte: {high, low} rotate by a byte at each step, and the carry waits
--               for the next byte, whichever half that is. One for the IP header; one for ICMP, or for UDP with
--               addresses, total length and a constant in place of the pseudo header (17 + length = total length - 3).
--               Both are right when all ones; bytes behind the end add nothing, but settle the carry. Past the end of
--               the IP packet there must be at least 4 bytes, the FCS: else the length was wrong.
--               The ring is addressed with the position, too: granule of the frame + its upper two bits, mod granules.
--               So the first 34 bytes (position -34 .. -1) are the last 34 of the granule before, which no frame uses
--               for its own end: the next one is taken at frame byte 512, position 478. Pointers are granule numbers
--               with one bit more, the lap; kind, length and granules of a message are stored under its first granule
--   Reset     : no message, next byte is the first of a frame; RAM and data registers have no reset
--   Golden    : sw/golden/packet_rx.hpp
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;
  use work.link_pkg.all;

entity packet_rx is
  generic (
    G_SLOTS    : integer := 2;    -- 2 or 4: RAM of 2 KB each
    G_UDP_PORT : integer := 20563 -- 1 .. 65535
  );
  port (
    clk : in  std_logic;
    rst : in  std_logic;

    s_valid : in  std_logic;
    s_ready : out std_logic;
    s_last  : in  std_logic;
    s_data  : in  std_logic_vector(7 downto 0);

    own_mac     : in  std_logic_vector(47 downto 0); -- first byte on the wire on the left; static
    own_ip      : in  std_logic_vector(31 downto 0);
    half_duplex : in  std_logic;

    m_valid  : out std_logic;
    m_kind   : out std_logic_vector(1 downto 0);
    m_length : out std_logic_vector(10 downto 0);
    m_done   : in  std_logic; -- pulse, only while m_valid: its room is free
    r_addr   : in  std_logic_vector(10 downto 0);
    r_data   : out std_logic_vector(7 downto 0);

    events : out std_logic_vector(18 downto 0)
  );
end entity packet_rx;

architecture rtl of packet_rx is

  constant C_RING_W : integer := clog2(4 * G_SLOTS); -- bits of a granule number
  constant C_RING_END : unsigned(C_RING_W - 2 downto 0) := (others => '1');
  constant C_HEADER : integer := 34; -- bytes up to the end of the IP header: position 0 is frame byte 34
  constant C_FIRST  : unsigned(10 downto 0) := to_unsigned(2048 - C_HEADER, 11);
  constant C_PORT   : unsigned(15 downto 0) := to_unsigned(G_UDP_PORT mod 65536, 16);

  -- Position of the byte on s_data.
  signal fire   : std_logic;
  signal pos    : unsigned(10 downto 0);
  signal near   : std_logic;             -- frame byte 0 .. 41, of which the lower bits of pos know which
  signal place  : unsigned(5 downto 0);
  signal header : std_logic;             -- frame byte 0 .. 33
  signal arp    : std_logic;             -- from frame byte 13 on
  signal icmp   : std_logic;             -- from frame byte 23 on
  signal udp    : std_logic;
  signal sender : std_logic;             -- frame byte 6 .. 11, or 22 .. 27
  signal in_mac : std_logic;             -- destination, source; ARP: sender
  signal in_ip  : std_logic;             -- source, destination; ARP: sender, target
  signal mac_at : unsigned(2 downto 0);  -- byte of a MAC address + 6 (mod 8)
  signal ip_at  : unsigned(1 downto 0);

  -- The byte that is expected there.
  signal mac_byte    : std_logic_vector(7 downto 0);
  signal ip_byte     : std_logic_vector(7 downto 0);
  signal length_byte : std_logic_vector(7 downto 0);
  signal fixed_byte  : std_logic_vector(7 downto 0);
  signal want_next   : std_logic_vector(7 downto 0);

  -- One clock later: the data, what it should be, and to what class it belongs.
  signal got          : std_logic;
  signal near_q       : std_logic; -- the flags below mean this byte
  signal verdict      : std_logic; -- data is the verdict
  signal data         : std_logic_vector(7 downto 0);
  signal want         : std_logic_vector(7 downto 0);
  signal of_mac       : std_logic;
  signal of_type      : std_logic; -- ethertype, ARP
  signal of_head      : std_logic;
  signal of_fragment  : std_logic;
  signal of_kind      : std_logic; -- protocol, ICMP type
  signal of_port      : std_logic;
  signal of_length    : std_logic;
  signal of_checksum  : std_logic;
  signal only_low     : std_logic; -- bits 7..6 do not matter (fragment flags)
  signal only_high    : std_logic; -- bits 2..0 do not matter (total length)
  signal takes_length : std_logic;
  signal of_group     : std_logic; -- first byte of a MAC address that may not be a group's
  signal of_net       : std_logic; -- first byte of the source IP
  signal of_first     : std_logic; -- of an address of the sender
  signal of_last      : std_logic;
  signal differs      : std_logic;
  signal bad_net      : std_logic;

  -- What was wrong so far.
  signal not_mine     : std_logic;
  signal not_all      : std_logic; -- destination is not broadcast
  signal bad_type     : std_logic;
  signal bad_head     : std_logic;
  signal bad_fragment : std_logic;
  signal bad_kind     : std_logic;
  signal closed       : std_logic; -- another port
  signal own_so_far   : std_logic; -- the address of the sender is our own
  signal bad_source   : std_logic;
  signal bad_length   : std_logic;
  signal has_checksum : std_logic;

  -- Length of the IP packet's content, and its end.
  signal upper  : std_logic_vector(2 downto 0);
  signal length : unsigned(10 downto 0);
  signal past_end : std_logic_vector(4 downto 0); -- bit n: data is at least n bytes behind the first one past the end

  -- Sums.
  signal add_head   : std_logic;
  signal add_body   : std_logic;
  signal add_minus3 : std_logic_vector(1 downto 0); -- the two bytes of -3 (mod 65535), low one on the right
  signal restart    : std_logic;
  signal head_byte  : std_logic_vector(7 downto 0);
  signal body_byte  : std_logic_vector(7 downto 0);
  signal head_sum   : unsigned(16 downto 0); -- the carry on the left
  signal body_sum   : unsigned(16 downto 0);

  -- Judgement.
  signal ip_bad  : std_logic;
  signal sum_bad : std_logic;
  signal outcome : std_logic_vector(17 downto 0);
  signal commit  : std_logic;

  -- Ring: granule numbers with one bit more.
  signal store      : std_logic;                        -- a byte of a frame
  signal crossing   : std_logic;                        -- it is the first of a granule
  signal write_head : unsigned(C_RING_W downto 0);      -- of the frame that comes in
  signal read_head  : unsigned(C_RING_W downto 0);      -- of the oldest message
  signal used       : unsigned(C_RING_W downto 0);      -- by messages
  signal taken      : unsigned(1 downto 0);             -- by the frame so far
  signal taken_now  : unsigned(1 downto 0);             -- the same, none before its first one
  signal full       : std_logic;                        -- all in use, by the frame, too
  signal broken     : std_logic;                        -- more used than there are
  signal shown      : std_logic;
  signal stale      : std_logic;                        -- what is shown is no message
  signal room       : std_logic;                        -- all bytes of the frame so far had room
  signal room_now   : std_logic;

  signal write_step  : unsigned(C_RING_W - 1 downto 0); -- granule of the position: -1, 0, 1, 2
  signal read_step   : unsigned(C_RING_W - 1 downto 0);
  signal write_place : unsigned(C_RING_W - 1 downto 0);
  signal read_place  : unsigned(C_RING_W - 1 downto 0);
  signal frame_we    : std_logic;
  signal frame_waddr : std_logic_vector(C_RING_W + 8 downto 0);
  signal frame_raddr : std_logic_vector(C_RING_W + 8 downto 0);
  signal read_pos    : unsigned(10 downto 0);

  signal info_waddr   : std_logic_vector(C_RING_W - 1 downto 0);
  signal info_raddr   : std_logic_vector(C_RING_W - 1 downto 0);
  signal info_write   : std_logic_vector(15 downto 0);
  signal info_read    : std_logic_vector(15 downto 0);
  signal reply_length : unsigned(10 downto 0);

  -- Frame byte n, as place.
  function at_byte (code : unsigned; n : natural) return std_logic is
  begin
    return to_sl(code = to_unsigned((n + 64 - C_HEADER) mod 64, 6));
  end function at_byte;

begin

  assert G_SLOTS = 2 or G_SLOTS = 4
    report "packet_rx: G_SLOTS"
           -- synthesis translate_off
           & "=" & integer'image(G_SLOTS)
           -- synthesis translate_on
           & " is neither 2 nor 4"
    severity failure;
  assert G_UDP_PORT >= 1 and G_UDP_PORT <= 65535
    report "packet_rx: G_UDP_PORT"
           -- synthesis translate_off
           & "=" & integer'image(G_UDP_PORT)
           -- synthesis translate_on
           & " outside 1..65535"
    severity failure;

  -- Position ----------------------------------------------------------------------------------------------------------
  s_ready <= not verdict;
  fire    <= s_valid and not verdict;
  place   <= pos(5 downto 0);
  header  <= pos(10) and pos(9); -- a body never gets that far: 1518 bytes
  udp     <= not arp and not icmp;

  p_position : process (clk)
  begin
    if rising_edge(clk) then
      if fire = '1' then
        pos <= pos + 1;
        if at_byte(place, 41) = '1' then
          near <= '0';
        end if;
        -- One bit decides, the comparison with the whole byte follows.
        if near = '1' and at_byte(place, 13) = '1' then
          arp <= s_data(1);
        end if;
        if near = '1' and at_byte(place, 23) = '1' then
          icmp <= not s_data(4) and not arp;
        end if;
      end if;
      if rst = '1' or verdict = '1' then
        arp <= '0';
      end if;
      if rst = '1' or (fire = '1' and s_last = '1') then
        pos  <= C_FIRST;
        near <= '1';
      end if;
    end if;
  end process p_position;

  -- Places of addresses: MAC 30 to 35 and 36 to 41, ARP 52 to 57; IP 56 to 63, ARP 58 to 61 and 4 to 7.
  sender <= place(5) and (place(4) or place(3) or place(2));
  in_mac <= to_sl(place(5 downto 1) = 15 or place(5 downto 2) = 8 or place(5 downto 2) = 9 or
                   place(5 downto 1) = 20) or
            (arp and to_sl(place(5 downto 2) = 13 or place(5 downto 1) = 28));
  in_ip  <= to_sl(place(5 downto 1) = 29 or place(5 downto 1) = 30) or
            (not arp and to_sl(place(5 downto 3) = 7)) or (arp and to_sl(place(5 downto 2) = 1));
  mac_at <= (place(2 downto 1) + unsigned'('0' & sender)) & place(0);
  ip_at  <= (place(1) xor (arp and place(5))) & place(0);

  -- Expected bytes ----------------------------------------------------------------------------------------------------
  mac_byte <= mac_byte_of(own_mac, mac_at);

  -- All but the sender of ARP begin at a multiple of 4.
  ip_byte  <= word_byte(own_ip, ip_at);

  length_byte <= "00000" & std_logic_vector(length(10 downto 8)) when place(0) = '0' else
                 std_logic_vector(length(7 downto 0));

  -- Zero where nothing else is said; ARP and IP share what they can.
  p_fixed_byte : process (place, arp, icmp, s_data)
  begin
    fixed_byte <= (others => '0');
    if at_byte(place, 12) = '1' then
      fixed_byte <= x"08";
    elsif at_byte(place, 13) = '1' then
      fixed_byte <= "00000" & s_data(1) & s_data(1) & '0';
    elsif at_byte(place, 14) = '1' then
      if arp = '0' then
        fixed_byte <= x"45";
      end if;
    elsif at_byte(place, 15) = '1' or at_byte(place, 21) = '1' then
      fixed_byte <= "0000000" & arp;
    elsif at_byte(place, 16) = '1' then
      fixed_byte <= "0000" & arp & "000";
    elsif at_byte(place, 18) = '1' then
      fixed_byte <= x"06";
    elsif at_byte(place, 19) = '1' then
      fixed_byte <= x"04";
    elsif at_byte(place, 23) = '1' then
      fixed_byte <= "000" & s_data(4) & "0001";
    elsif at_byte(place, 34) = '1' then
      fixed_byte <= x"08";
    elsif at_byte(place, 36) = '1' then
      fixed_byte <= std_logic_vector(C_PORT(15 downto 8));
    elsif at_byte(place, 37) = '1' then
      fixed_byte <= std_logic_vector(C_PORT(7 downto 0));
    end if;
  end process p_fixed_byte;

  p_want : process (place, in_mac, in_ip, mac_byte, ip_byte, length_byte, fixed_byte)
  begin
    if in_mac = '1' then
      want_next <= mac_byte;
    elsif in_ip = '1' then
      want_next <= ip_byte;
    elsif place(5 downto 1) = "00010" then
      want_next <= length_byte;                        -- 38, 39 of UDP
    else
      want_next <= fixed_byte;
    end if;
  end process p_want;

  p_byte : process (clk)
  begin
    if rising_edge(clk) then
      got     <= fire and not s_last and not rst;
      verdict <= fire and s_last and not rst;
      data    <= s_data;
      want    <= want_next;

      near_q       <= near;
      of_mac       <= to_sl(place(5 downto 3) = "011" or place(5 downto 2) = "1000");
      of_type      <= at_byte(place, 12) or at_byte(place, 13) or
                      (arp and (to_sl(place(5 downto 2) = "1011" or place(5 downto 2) = "1100") or
                                to_sl(place(5 downto 2) = "0001")));
      of_head      <= at_byte(place, 14) or at_byte(place, 16) or to_sl(place(5 downto 2) = "1111");
      of_fragment  <= at_byte(place, 20) or at_byte(place, 21);
      of_kind      <= at_byte(place, 23) or (icmp and to_sl(place(5 downto 1) = "00000"));
      of_port      <= udp and to_sl(place(5 downto 1) = "00001");
      of_length    <= udp and to_sl(place(5 downto 1) = "00010");
      of_checksum  <= udp and to_sl(place(5 downto 1) = "00011");
      only_low     <= at_byte(place, 20) and not arp;
      only_high    <= at_byte(place, 16) and not arp;
      takes_length <= near and at_byte(place, 17);
      of_group     <= at_byte(place, 6) or (arp and at_byte(place, 22));
      of_net       <= at_byte(place, 26) and not arp;
      of_first     <= at_byte(place, 6) or (arp and (at_byte(place, 22) or at_byte(place, 28))) or
                      (at_byte(place, 26) and not arp);
      of_last      <= at_byte(place, 11) or (arp and (at_byte(place, 27) or at_byte(place, 31))) or
                      (at_byte(place, 29) and not arp);

      add_head   <= header and to_sl(place >= 44);
      add_body   <= not near or to_sl(place = 46 or place = 47 or place >= 56 or place < 8);
      add_minus3 <= (others => near and to_sl(place = 48 or place = 49));
      if place(0) = '1' then
        add_minus3(0) <= '0';
      end if;
      restart <= near and icmp and to_sl(place = 63);
    end if;
  end process p_byte;

  differs <= to_sl((data(7 downto 6) /= want(7 downto 6) and only_low = '0') or data(5 downto 3) /= want(5 downto 3) or
                    (data(2 downto 0) /= want(2 downto 0) and only_high = '0'));

  bad_net <= to_sl(data(7 downto 5) = "111" or data = x"00" or data = x"7f");

  p_wrong : process (clk)
  begin
    if rising_edge(clk) then
      if got = '1' and near_q = '1' then
        not_mine     <= not_mine or (of_mac and differs);
        not_all      <= not_all or (of_mac and to_sl(data /= x"ff"));
        bad_type     <= bad_type or (of_type and differs);
        bad_head     <= bad_head or (of_head and differs);
        bad_fragment <= bad_fragment or (of_fragment and differs);
        bad_kind     <= bad_kind or (of_kind and differs);
        closed       <= closed or (of_port and differs);
        own_so_far   <= (own_so_far or of_first) and not differs;
        bad_source   <= bad_source or (of_group and data(0)) or (of_net and bad_net) or
                        (of_last and own_so_far and not differs);
        bad_length   <= bad_length or (of_length and differs);
        has_checksum <= has_checksum or (of_checksum and differs);
      end if;
      if rst = '1' or verdict = '1' then
        not_mine     <= '0';
        not_all      <= '0';
        bad_type     <= '0';
        bad_head     <= '0';
        bad_fragment <= '0';
        bad_kind     <= '0';
        closed       <= '0';
        bad_source   <= '0';
        bad_length   <= '0';
        has_checksum <= '0';
      end if;
    end if;
  end process p_wrong;

  -- Length and end ----------------------------------------------------------------------------------------------------
  -- An ARP frame has the length of the shortest IP packet: so it must be there as far, too.
  p_length : process (clk)
  begin
    if rising_edge(clk) then
      if got = '1' then
        upper <= data(2 downto 0);
      end if;
      if got = '1' and takes_length = '1' then
        length <= unsigned(upper & data) - 20;
      end if;
      if arp = '1' then
        length <= to_unsigned(8, 11);
      end if;
      if pos = length then
        past_end(0) <= '1';
      end if;
      if got = '1' then
        past_end(4 downto 1) <= past_end(3 downto 0);
      end if;
      if header = '1' then
        past_end <= (others => '0');
      end if;
    end if;
  end process p_length;

  -- Sums --------------------------------------------------------------------------------------------------------------
  head_byte <= data when add_head = '1' else
               (others => '0');
  body_byte <= (7 downto 2 => add_minus3(1), 1 downto 0 => add_minus3(0)) when add_body = '0' else
               data when past_end(0) = '0' else
               (others => '0');

  p_sums : process (clk)
  begin
    if rising_edge(clk) then
      if got = '1' then
        head_sum <= checksum_add(head_sum, head_byte);
        body_sum <= checksum_add(body_sum, body_byte);
      end if;
      if rst = '1' or verdict = '1' then
        head_sum <= (others => '0');
      end if;
      if rst = '1' or verdict = '1' or restart = '1' then
        body_sum <= (others => '0');
      end if;
    end if;
  end process p_sums;

  -- Judgement ---------------------------------------------------------------------------------------------------------
  ip_bad  <= to_sl(length(10 downto 3) = 0) or not past_end(4) or
             (not arp and (bad_head or to_sl(head_sum(15 downto 0) /= x"ffff")));
  sum_bad <= bad_length or (to_sl(body_sum(15 downto 0) /= x"ffff") and (icmp or has_checksum));

  p_outcome : process (data, half_duplex, not_mine, not_all, bad_type, ip_bad, bad_source, arp, icmp, bad_fragment,
                       bad_kind, sum_bad, closed, room)
  begin
    outcome <= (others => '0');
    if data(5) = '1' then
      outcome(8) <= '1';
    elsif data(4) = '1' then
      outcome(5) <= '1';
    elsif data(3) = '1' then
      outcome(4) <= '1';
    elsif data(2) = '1' then
      outcome(3)  <= not half_duplex or not data(0);
      outcome(17) <= half_duplex and data(0);
    elsif data(1) = '1' then
      outcome(2) <= '1';
    elsif data(0) = '1' then
      outcome(1) <= '1';
    elsif not_mine = '1' and (not_all = '1' or arp = '0') then
      outcome(6) <= '1';
    elsif bad_type = '1' then
      outcome(9) <= '1';
    elsif ip_bad = '1' then
      outcome(10) <= '1';
    elsif bad_source = '1' then
      outcome(16) <= '1';
    elsif bad_fragment = '1' and arp = '0' then
      outcome(11) <= '1';
    elsif bad_kind = '1' and arp = '0' then
      outcome(9) <= '1';
    elsif sum_bad = '1' and arp = '0' then
      outcome(12) <= '1';
    elsif room = '0' then
      outcome(7) <= '1';
    else
      outcome(0)  <= '1';
      outcome(9)  <= closed;
      outcome(13) <= arp;
      outcome(14) <= icmp;
      outcome(15) <= udp and not closed;
    end if;
  end process p_outcome;

  commit <= verdict and outcome(0);

  p_events : process (clk)
  begin
    if rising_edge(clk) then
      events(17 downto 0) <= outcome;
      if verdict = '0' then
        events(17 downto 0) <= (others => '0');
      end if;
      events(18) <= broken or stale;
      if rst = '1' then
        events(18) <= '0';
      end if;
    end if;
  end process p_events;

  -- Ring --------------------------------------------------------------------------------------------------------------
  store    <= fire and not s_last;
  crossing <= store and to_sl(pos(8 downto 0) = C_FIRST(8 downto 0));
  used     <= write_head - read_head;
  broken   <= used(C_RING_W) and to_sl(used(C_RING_W - 1 downto 0) /= 0);
  room_now <= not full and (near or room) when crossing = '1' else -- near: the first granule
              room;

  taken_now <= "00" when near = '1' else taken;
  full      <= used(C_RING_W) or (to_sl(used(C_RING_W - 1 downto 1) = C_RING_END) and
                                  (taken_now(1) or (taken_now(0) and used(0))));

  p_ring : process (clk)
  begin
    if rising_edge(clk) then
      room <= room_now;
      if crossing = '1' then
        taken <= taken_now + 1;
      end if;
      if commit = '1' then
        write_head <= write_head + taken;
      end if;
      if m_done = '1' then
        read_head <= read_head + unsigned(info_read(14 downto 13));
      end if;
      -- info_read follows read_head by one clock.
      shown <= to_sl(used /= 0) and not m_done;
      if rst = '1' or broken = '1' or stale = '1' then
        room       <= '0';
        write_head <= (others => '0');
        read_head  <= (others => '0');
        shown      <= '0';
      end if;
    end if;
  end process p_ring;

  stale   <= shown and ((info_read(15) xor read_head(C_RING_W)) or not (info_read(14) or info_read(13)));
  m_valid <= shown and not stale;

  -- A frame that is longer than 1569 bytes would come to the granule before its own once more.
  frame_we <= store and room_now and (near or not header);

  write_step(1 downto 0)            <= pos(10 downto 9);
  write_step(C_RING_W - 1 downto 2) <= (others => header);
  write_place                       <= write_head(C_RING_W - 1 downto 0) + write_step;
  frame_waddr                       <= std_logic_vector(write_place & pos(8 downto 0));

  read_pos                         <= unsigned(r_addr) - C_HEADER;
  read_step(1 downto 0)            <= read_pos(10 downto 9);
  read_step(C_RING_W - 1 downto 2) <= (others => read_pos(10) and read_pos(9));
  read_place                       <= read_head(C_RING_W - 1 downto 0) + read_step;
  frame_raddr                      <= std_logic_vector(read_place & read_pos(8 downto 0));

  u_frames : entity work.ram_sdp
    generic map (
      G_DATA_W  => 8,
      G_DEPTH   => G_SLOTS * 2048,
      G_LATENCY => 1
    )
    port map (
      clk   => clk,
      we    => frame_we,
      waddr => frame_waddr,
      wdata => s_data,
      raddr => frame_raddr,
      rdata => r_data
    );

  -- The UDP header is no part of the message; ARP: 8 - 8.
  reply_length <= length when icmp = '1' else
                  length - 8;

  info_waddr <= std_logic_vector(write_head(C_RING_W - 1 downto 0));
  info_raddr <= std_logic_vector(read_head(C_RING_W - 1 downto 0));
  info_write <= write_head(C_RING_W) & std_logic_vector(taken) & udp & (icmp or (udp and closed)) &
                std_logic_vector(reply_length);

  u_info : entity work.ram_sdp
    generic map (
      G_DATA_W  => 16,
      G_DEPTH   => 4 * G_SLOTS,
      G_LATENCY => 1
    )
    port map (
      clk   => clk,
      we    => commit,
      waddr => info_waddr,
      wdata => info_write,
      raddr => info_raddr,
      rdata => info_read
    );

  m_kind   <= info_read(12 downto 11);
  m_length <= info_read(10 downto 0);

end architecture rtl;
