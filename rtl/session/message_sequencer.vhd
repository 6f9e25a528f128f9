-- SPDX-License-Identifier: Apache-2.0
-- message_sequencer: what the responder does, one step after the other (states: link_pkg).
--   Message   : header, decision (message_rules), arguments or rows, reply; then the frame's slot is free
--   Map       : between messages a chunk of the READ in force; after each answer one goes before the next message
--   Session   : begins with OPEN and ends with CLOSE or silence: in C_ST_ABORT, which empties engine and buffers
--   Upsets    : from a code without a name, and when the watchdog says that a frame cannot be sent, it ends the session
--               and the frame, on both sides, and goes on
--   Reset     : no session, idle
--   Golden    : sw/golden/message_sequencer.hpp
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;
  use work.link_pkg.all;

entity message_sequencer is
  port (
    clk : in  std_logic;
    rst : in  std_logic;

    state      : out std_logic_vector(4 downto 0);
    step       : out std_logic_vector(5 downto 0); -- clocks in the state, of those that count them
    session    : out std_logic;
    alive      : out std_logic;                    -- the session's time begins anew; without one, that of a message
    is_map     : out std_logic;                    -- the frame is a map packet
    is_icmp    : out std_logic;                    -- .. an answer to ICMP, or port unreachable
    session_io : out std_logic;                    -- OPEN, READ: this frame has what the session's memory keeps
    renewed    : out std_logic;                    -- C_ST_ABORT ends the session, else it begins one
    idle_chunk : out std_logic;                    -- a map packet begins
    recover    : out std_logic;
    checked    : out std_logic;                    -- C_ST_CHECK, C_ST_DIVIDE: the answer is there

    -- session_timer, map_sender, reply_limiter
    expired : in  std_logic;
    stuck   : in  std_logic;
    due     : in  std_logic;
    first   : in  std_logic;
    request : out std_logic;
    bucket  : out std_logic_vector(1 downto 0);
    grant   : in  std_logic;
    refuse  : in  std_logic;

    -- message_reader
    msg_type   : in  std_logic_vector(7 downto 0);
    ask_answer : in  std_logic;
    word_full  : in  std_logic;
    header_end : in  std_logic;
    rows_end   : in  std_logic;
    peer_end   : in  std_logic;

    -- message_rules
    head_state : in  std_logic_vector(4 downto 0);
    word_state : in  std_logic_vector(4 downto 0);
    head_alive : in  std_logic;
    admitted   : in  std_logic;
    long_word  : in  std_logic;
    open_new   : in  std_logic;
    open_again : in  std_logic;
    result     : in  std_logic_vector(2 downto 0);
    read_head  : out std_logic; -- a READ is taken: its header, its argument
    read_tail  : out std_logic;

    -- reply_builder
    fetched    : in  std_logic;
    body_cells : in  std_logic;
    reply_end  : in  std_logic;
    cells_end  : in  std_logic;

    -- packet_rx, packet_tx, buffers, scheduler
    m_valid   : in  std_logic;
    m_kind    : in  std_logic_vector(1 downto 0);
    m_done    : out std_logic;
    s_ready   : in  std_logic;
    s_start   : out std_logic;
    tx_abort  : out std_logic; -- pulse: the frame that is being built is given up
    p_ready   : in  std_logic;
    row_clear : out std_logic;
    w_check   : out std_logic;
    w_new     : in  std_logic;
    w_commit  : out std_logic;
    map_clear : out std_logic;
    f_start   : out std_logic;
    stop      : out std_logic;

    ev_session     : out std_logic;
    ev_timeout     : out std_logic;
    ev_map_packet  : out std_logic;
    ev_limited     : out std_logic;
    ev_unreachable : out std_logic;
    ev_recovered   : out std_logic
  );
end entity message_sequencer;

architecture rtl of message_sequencer is

  signal state_q      : std_logic_vector(4 downto 0);
  signal clocks       : unsigned(5 downto 0);
  signal open_q       : std_logic;
  signal alive_q      : std_logic;
  signal map_q        : std_logic;
  signal icmp_q       : std_logic;
  signal io_q         : std_logic;
  signal renewed_q    : std_logic;
  signal silent       : std_logic; -- no reply
  signal by_timer     : std_logic; -- nobody waits for an answer
  signal is_open      : std_logic;
  signal illegal      : std_logic;
  signal lost         : std_logic;
  signal idle         : std_logic;
  signal idle_timeout : std_logic;
  signal idle_message : std_logic;
  signal idle_packet  : std_logic;
  signal word_open    : std_logic; -- OPEN is taken
  signal take_read    : std_logic;
  signal check_over   : std_logic;
  signal divide_over  : std_logic;

  attribute fsm_extract : string;

  attribute fsm_extract of state_q : signal is C_FSM_KEPT;

begin

  -- Odd parity, or the one even code that is no state.
  illegal <= (state_q(4) xor state_q(3) xor state_q(2) xor state_q(1) xor state_q(0)) or
             to_sl(state_q = C_ST_UNUSED);
  lost    <= illegal or (stuck and not alive_q and to_sl(state_q /= C_ST_IDLE));

  idle         <= to_sl(state_q = C_ST_IDLE);
  idle_timeout <= idle and open_q and expired;
  idle_message <= idle and not (open_q and expired) and m_valid and (not first or not due);
  idle_packet  <= idle and not (open_q and expired) and not (m_valid and (not first or not due)) and due and s_ready;

  is_open     <= to_sl(m_kind = C_FRAME_UDP and msg_type = C_MSG_OPEN);
  word_open   <= word_full and to_sl(state_q = C_ST_WORDS) and (open_new or open_again);
  take_read   <= to_sl(state_q = C_ST_DECIDE and msg_type = C_MSG_READ) and admitted and long_word;
  check_over  <= to_sl(state_q = C_ST_CHECK and clocks = 3); -- three clocks after w_check
  divide_over <= to_sl(state_q = C_ST_DIVIDE) and clocks(5);

  -- Sequence ----------------------------------------------------------------------------------------------------------
  p_state : process (clk)
  begin
    if rising_edge(clk) then
      if state_q = C_ST_IDLE then
        if idle_timeout = '1' then
          state_q <= C_ST_ABORT;
        elsif idle_message = '1' then
          state_q <= C_ST_LIMIT;
          if m_kind = C_FRAME_UDP then
            state_q <= C_ST_HEADER;
          end if;
        elsif idle_packet = '1' then
          state_q <= C_ST_FETCH;
        end if;
      elsif state_q = C_ST_HEADER then
        if header_end = '1' then
          state_q <= C_ST_DECIDE;
        end if;
      elsif state_q = C_ST_DECIDE then
        state_q <= head_state;
      elsif state_q = C_ST_LIMIT then
        if refuse = '1' then
          state_q <= C_ST_DONE;
        elsif grant = '1' then
          state_q <= C_ST_WAIT;
          if is_open = '1' and result = C_RESULT_OK then
            state_q <= C_ST_WORDS;
          end if;
        end if;
      elsif state_q = C_ST_WORDS then
        if word_full = '1' then
          state_q <= word_state;
        end if;
      elsif state_q = C_ST_DIVIDE then
        if divide_over = '1' then
          state_q <= C_ST_WAIT;
        end if;
      elsif state_q = C_ST_CHECK then
        if check_over = '1' then
          state_q <= C_ST_WAIT;
          if w_new = '1' then
            state_q <= C_ST_ROWS;
          end if;
        end if;
      elsif state_q = C_ST_ROWS then
        if rows_end = '1' then
          state_q <= C_ST_WAIT;
        end if;
      elsif state_q = C_ST_WAIT then
        if silent = '1' then
          state_q <= C_ST_DONE;
        elsif s_ready = '1' then
          state_q <= C_ST_PEER;
        end if;
      elsif state_q = C_ST_PEER then
        if peer_end = '1' then
          state_q <= C_ST_FETCH;
          if m_kind = C_FRAME_ARP then
            state_q <= C_ST_DONE;
          end if;
        end if;
      elsif state_q = C_ST_FETCH then
        if fetched = '1' then
          state_q <= C_ST_SHOW;
        end if;
      elsif state_q = C_ST_SHOW then
        if p_ready = '1' then
          state_q <= C_ST_FETCH;
          if body_cells = '1' then
            state_q <= C_ST_CELLS;
          elsif reply_end = '1' then
            state_q <= C_ST_DONE;
          end if;
        end if;
      elsif state_q = C_ST_CELLS then
        if cells_end = '1' then
          state_q <= C_ST_IDLE;
        end if;
      elsif state_q = C_ST_DONE then
        if clocks = 3 then -- m_valid takes a clock to fall
          state_q <= C_ST_IDLE;
        end if;
      else -- C_ST_ABORT
        state_q <= C_ST_WAIT;
        if by_timer = '1' then
          state_q <= C_ST_IDLE;
        end if;
      end if;
      if lost = '1' then
        state_q <= C_ST_ABORT;
      end if;
      if rst = '1' then
        state_q <= C_ST_IDLE;
      end if;
    end if;
  end process p_state;

  p_clocks : process (clk)
  begin
    if rising_edge(clk) then
      if state_q = C_ST_IDLE or peer_end = '1' or check_over = '1' or
         (state_q = C_ST_FETCH and fetched = '1') then
        clocks <= (others => '0');
      elsif state_q = C_ST_WORDS then
        if word_full = '1' and word_state = C_ST_DIVIDE then
          clocks <= to_unsigned(8, 6); -- bits 23 to 0
        end if;
      elsif state_q = C_ST_DIVIDE or state_q = C_ST_CHECK or state_q = C_ST_FETCH or state_q = C_ST_DONE then
        clocks <= clocks + 1;
      end if;
    end if;
  end process p_clocks;

  -- What is under way -------------------------------------------------------------------------------------------------
  p_flags : process (clk)
  begin
    if rising_edge(clk) then
      if state_q = C_ST_IDLE then
        map_q     <= idle_packet;
        icmp_q    <= idle_message and m_kind(0) and to_sl(m_kind /= C_FRAME_UDP);
        io_q      <= idle_packet;
        silent    <= '0';
        by_timer  <= idle_timeout;
        renewed_q <= '1';
      elsif take_read = '1' or word_open = '1' then
        io_q <= '1';
      end if;
      if word_open = '1' and open_new = '1' then
        renewed_q <= '0';
      end if;
      if state_q = C_ST_DECIDE and admitted = '1' and msg_type = C_MSG_WRITE then
        silent <= not ask_answer;
      end if;
      if lost = '1' then
        silent    <= '1';
        by_timer  <= '0';
        renewed_q <= '1';
      end if;

      alive_q <= (idle and not open_q) or (to_sl(state_q = C_ST_DECIDE) and head_alive) or
                 (word_open and not open_new) or to_sl(state_q = C_ST_ABORT) or lost;
      if state_q = C_ST_ABORT then
        open_q <= not renewed_q;
      end if;
      if rst = '1' then
        open_q <= '0';
      end if;
    end if;
  end process p_flags;

  -- Pulses ------------------------------------------------------------------------------------------------------------
  p_pulses : process (clk)
  begin
    if rising_edge(clk) then
      s_start        <= idle_packet or peer_end;
      f_start        <= idle_packet;
      m_done         <= to_sl(state_q = C_ST_DONE and clocks = 0) and m_valid and not map_q;
      w_check        <= to_sl(state_q = C_ST_DECIDE and head_state = C_ST_CHECK);
      w_commit       <= rows_end;
      stop           <= to_sl(state_q = C_ST_ABORT);
      row_clear      <= to_sl(state_q = C_ST_ABORT);
      map_clear      <= to_sl(state_q = C_ST_ABORT);
      tx_abort       <= lost;
      ev_session     <= to_sl(state_q = C_ST_ABORT) and not renewed_q;
      ev_timeout     <= idle_timeout;
      ev_map_packet  <= idle_packet;
      ev_limited     <= refuse;
      ev_unreachable <= peer_end and to_sl(m_kind = C_FRAME_CLOSED);
      ev_recovered   <= lost;
    end if;
  end process p_pulses;

  state      <= state_q;
  step       <= std_logic_vector(clocks);
  session    <= open_q;
  alive      <= alive_q;
  is_map     <= map_q;
  is_icmp    <= icmp_q;
  session_io <= io_q;
  renewed    <= renewed_q;
  idle_chunk <= idle_packet;
  recover    <= lost;
  checked    <= check_over or divide_over;
  request    <= to_sl(state_q = C_ST_LIMIT);
  bucket(0)  <= is_open;
  bucket(1)  <= not is_open and to_sl(m_kind /= C_FRAME_ARP);
  read_head  <= take_read;
  read_tail  <= word_full and to_sl(state_q = C_ST_WORDS and msg_type = C_MSG_READ);

  -- synthesis translate_off
  p_rules : process (clk)
  begin
    if rising_edge(clk) then
      assert rst = '1' or not is_x(state_q)
        report "message_sequencer: an unknown state"
        severity failure;
    end if;
  end process p_rules;
  -- synthesis translate_on

end architecture rtl;
