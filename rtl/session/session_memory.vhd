-- SPDX-License-Identifier: Apache-2.0
-- session_memory: what the chip remembers of its session's host, and whether a message is from it.
--   Memory    : 64 bytes, each at the place that it has in a frame (lower six bits): the host's MAC (6-11), IP (26-29)
--               and port (34-35), the token (46-49), the header of the READ in force (42-57), the nonce (58-61). One
--               comparator checks all of them while a message passes. OPEN writes addresses and nonce, and the new
--               token in place of its own header's; READ writes its header, and the rest as it is
--   Token     : a shift register that never stops (x^32 + x^22 + x^2 + x + 1, maximal), 8 steps a clock. Arguments are
--               mixed in, the nonces of OPEN among them; and the milliseconds, so that it does not stay at zero. Which
--               token comes depends on all that and on the time; its lowest bit is 1
--   Peer      : the sender's addresses on the way to packet_tx: 0-5 MAC, 6-9 IP, 10-11 port
--   Reset     : the shift register; the memory has none, and means nothing without a session
--   Golden    : sw/golden/session_memory.hpp
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;
  use work.link_pkg.all;

entity session_memory is
  port (
    clk : in  std_logic;
    rst : in  std_logic;

    state      : in  std_logic_vector(4 downto 0);
    m_kind     : in  std_logic_vector(1 downto 0);
    of_read    : in  std_logic; -- the message is a READ, not an OPEN
    session_io : in  std_logic; -- OPEN and READ: the bytes that pass are written
    renewed    : in  std_logic; -- a repeated OPEN, or no OPEN: the token stays
    tick_ms    : in  std_logic;

    r_addr     : in  std_logic_vector(10 downto 0);
    r_data     : in  std_logic_vector(7 downto 0);
    byte_valid : in  std_logic;
    byte_place : in  std_logic_vector(5 downto 0);

    memory_byte : out std_logic_vector(7 downto 0); -- at r_addr, one clock later
    peer_ok     : out std_logic;
    token_ok    : out std_logic;
    nonce_ok    : out std_logic;                    -- with the byte that is passing

    peer_we    : out std_logic;
    peer_index : out std_logic_vector(3 downto 0)
  );
end entity session_memory;

architecture rtl of session_memory is

  signal place        : unsigned(5 downto 0);
  signal at_peer      : std_logic; -- the byte is the sender's MAC, IP or port
  signal at_header    : std_logic; -- .. of the message's header
  signal at_token     : std_logic;
  signal peer_shift   : unsigned(2 downto 0); -- from place to index, halved
  signal memory_we    : std_logic;
  signal memory_write : std_logic_vector(7 downto 0);
  signal memory_read  : std_logic_vector(7 downto 0);
  signal differs      : std_logic; -- the byte that passes, from the one at its place in the memory
  signal nonce_so_far : std_logic;
  signal lfsr         : std_logic_vector(31 downto 0); -- next token, but for its lowest bit
  signal lfsr_next    : std_logic_vector(7 downto 0);

begin

  place <= unsigned(byte_place);

  -- Bytes 6-11, 26-29, 34-35 of the frame, in ARP 22-27, 28-31.
  at_peer   <= to_sl((place >= 6 and place < 12) or (place >= 26 and place < 30) or place = 34 or place = 35);
  at_header <= to_sl(place >= C_AT_MESSAGE and place < C_AT_ARGUMENTS);
  at_token  <= to_sl(place >= C_AT_MESSAGE + 4 and place < C_AT_MESSAGE + 8);

  peer_we    <= byte_valid and to_sl(state = C_ST_PEER) and at_peer when m_kind /= C_FRAME_ARP
                else byte_valid and to_sl(state = C_ST_PEER and place >= 22 and place < 32);
  -- place - 6 in ARP and for MAC, place - 20 for IP, place - 24 for the port; modulo 16.
  peer_shift <= "101" when m_kind = C_FRAME_ARP or place(5 downto 4) = 0
                else "100" when place(5) = '1'
                else "110";
  peer_index <= std_logic_vector(place(3 downto 1) + peer_shift) & place(0);

  -- Memory ------------------------------------------------------------------------------------------------------------
  memory_we    <= byte_valid and to_sl(state = C_ST_PEER) and session_io and (not at_header or not renewed or of_read);
  memory_write <= lfsr(7 downto 1) & (lfsr(0) or (not place(1) and place(0))) when at_token = '1' and of_read = '0'
                  else r_data;
  differs      <= to_sl(r_data /= memory_read);
  memory_byte  <= memory_read;
  nonce_ok     <= nonce_so_far and not differs;

  u_memory : entity work.ram_sdp
    generic map (
      G_DATA_W  => 8,
      G_DEPTH   => 64,
      G_LATENCY => 1
    )
    port map (
      clk   => clk,
      we    => memory_we,
      waddr => byte_place,
      wdata => memory_write,
      raddr => r_addr(5 downto 0),
      rdata => memory_read
    );

  p_compare : process (clk)
  begin
    if rising_edge(clk) then
      if differs = '1' and byte_valid = '1' then
        if at_peer = '1' then
          peer_ok <= '0';
        end if;
        if at_token = '1' then
          token_ok <= '0';
        end if;
        if state = C_ST_WORDS then
          nonce_so_far <= '0';
        end if;
      end if;
      if state = C_ST_IDLE then
        peer_ok      <= '1';
        token_ok     <= '1';
        nonce_so_far <= '1';
      end if;
    end if;
  end process p_compare;

  -- Token -------------------------------------------------------------------------------------------------------------
  lfsr_next <= lfsr(31 downto 24) xor lfsr(30 downto 23) xor lfsr(29 downto 22) xor lfsr(9 downto 2);

  p_token : process (clk)
  begin
    if rising_edge(clk) then
      lfsr <= lfsr(23 downto 0) & lfsr_next;
      if byte_valid = '1' and state = C_ST_WORDS then
        lfsr(7 downto 0) <= lfsr_next xor r_data;
      elsif tick_ms = '1' then
        lfsr(0) <= not lfsr_next(0);
      end if;
      if rst = '1' then
        lfsr <= x"5eed1234";
      end if;
    end if;
  end process p_token;

end architecture rtl;
