-- SPDX-License-Identifier: Apache-2.0
-- message_rules: what becomes of a message: who may ask, in which order, with which arguments; and the numbers of tile
--                and table that the order goes by.
--   Header    : in C_ST_DECIDE. p_admit refuses what needs no session to be refused; p_order knows the order of a
--               session's messages. Of both head_state is what the sequencer does next
--   Arguments : in C_ST_WORDS, with each word: word_state likewise. START is checked word by word, at last by
--               chunk_check
--   Order     : START brings the tile after the latest one, or that one again, which only gets its answer again; so
--               does TABLE, whose words come in order, with its table. WRITE, READ, RELEASE name the tile they are for
--   Result    : of the reply; bad_message is counted and overrules
--   Reset     : as the end of a session: no tile, no table, duplex by pin
--   Golden    : sw/golden/message_rules.hpp
library ieee;
  use ieee.std_logic_1164.all;
  use ieee.numeric_std.all;
  use work.psweep_pkg.all;
  use work.link_pkg.all;

entity message_rules is
  port (
    clk : in  std_logic;
    rst : in  std_logic;

    state        : in  std_logic_vector(4 downto 0);
    head_state   : out std_logic_vector(4 downto 0); -- after C_ST_DECIDE
    word_state   : out std_logic_vector(4 downto 0); -- after a word in C_ST_WORDS
    checked      : in  std_logic;                    -- C_ST_CHECK, C_ST_DIVIDE: the answer is there
    head_alive   : out std_logic;                    -- the session's host was heard
    admitted     : out std_logic;                    -- with C_ST_DECIDE: by p_admit
    open_new     : out std_logic;                    -- with a word: OPEN begins a session
    open_again   : out std_logic;                    -- .. or is repeated
    words_end    : out std_logic;
    only_header  : out std_logic;                    -- with C_ST_DECIDE: how long the reply is
    of_list      : out std_logic;
    result       : out std_logic_vector(2 downto 0);
    session      : in  std_logic;

    -- message_reader, session_memory
    msg_type    : in  std_logic_vector(7 downto 0);
    magic_ok    : in  std_logic;
    version_ok  : in  std_logic;
    peer_ok     : in  std_logic;
    token_ok    : in  std_logic;
    nonce_ok    : in  std_logic;
    long_header : in  std_logic;
    long_word   : in  std_logic;
    long_start  : in  std_logic;
    long_write  : in  std_logic;
    long_list   : in  std_logic;
    whole_words : in  std_logic;
    at_last     : in  std_logic;
    word        : in  std_logic_vector(31 downto 0);
    word_next   : in  std_logic_vector(31 downto 0);
    word_full   : in  std_logic;
    word_count  : in  std_logic_vector(4 downto 0);

    -- Chip.
    row_busy     : in  std_logic;
    staged       : in  std_logic;
    running      : in  std_logic;
    engine_idle  : in  std_logic;
    map_busy     : in  std_logic;
    map_complete : in  std_logic;
    map_tile     : in  std_logic_vector(15 downto 0);
    w_new        : in  std_logic;
    w_repeated   : in  std_logic;
    chunks_fit   : in  std_logic;

    number_ok   : out std_logic; -- the message's number is the one that it is compared with
    last_tile   : out std_logic_vector(15 downto 0); -- latest START
    table_id    : out std_logic_vector(15 downto 0);
    table_words : out std_logic_vector(13 downto 0);
    index       : out std_logic_vector(15 downto 0); -- chunk or table word
    pixels      : out std_logic_vector(23 downto 0);
    chunks      : out std_logic_vector(15 downto 0);
    duplex_mode : out std_logic_vector(1 downto 0);  -- 0 by pin, 1 half, 2 full
    row_open    : out std_logic;
    map_release : out std_logic;

    ev_bad      : out std_logic;
    ev_foreign  : out std_logic;
    ev_answer   : out std_logic;
    ev_repeated : out std_logic;
    ev_refused  : out std_logic
  );
end entity message_rules;

architecture rtl of message_rules is

  signal at_header : std_logic; -- in C_ST_DECIDE
  signal at_word   : std_logic; -- in C_ST_WORDS, with a whole word
  signal at_check  : std_logic;
  signal at_divide : std_logic;

  -- One subtraction for all numbers that have to be in order.
  signal known     : unsigned(15 downto 0); -- what the message's number is compared with
  signal distance  : unsigned(15 downto 0);
  signal is_last   : std_logic;
  signal is_next   : std_logic;             -- the number is the known one + 1
  signal idle_chip : std_logic;             -- no tile anywhere but in the map buffer
  signal authentic : std_logic;
  signal count     : unsigned(4 downto 0);
  signal last_word : std_logic;

  -- Decisions: state that follows, result, and a message that is not one.
  signal admit         : std_logic; -- p_order decides
  signal admit_state   : std_logic_vector(4 downto 0);
  signal admit_result  : std_logic_vector(2 downto 0);
  signal admit_bad     : std_logic;
  signal admit_foreign : std_logic;
  signal order_state   : std_logic_vector(4 downto 0);
  signal order_result  : std_logic_vector(2 downto 0);
  signal order_bad     : std_logic;
  signal new_table     : std_logic;
  signal release_now   : std_logic;
  signal next_state    : std_logic_vector(4 downto 0);
  signal word_result   : std_logic_vector(2 downto 0);
  signal word_bad      : std_logic;
  signal word_foreign  : std_logic;
  signal bad           : std_logic;

  signal code      : std_logic_vector(2 downto 0);
  signal tile      : unsigned(15 downto 0);
  signal table_now : unsigned(15 downto 0);
  signal table_end : unsigned(13 downto 0);
  signal place     : unsigned(15 downto 0);

begin

  at_header <= to_sl(state = C_ST_DECIDE);
  at_word   <= word_full and to_sl(state = C_ST_WORDS);
  at_check  <= checked and to_sl(state = C_ST_CHECK);
  at_divide <= checked and to_sl(state = C_ST_DIVIDE);

  known     <= tile when msg_type = C_MSG_START or msg_type = C_MSG_WRITE
               else table_now when msg_type = C_MSG_TABLE
               else unsigned(map_tile);
  distance  <= unsigned(word(31 downto 16)) - known;
  is_last   <= to_sl(distance = 0);
  is_next   <= to_sl(distance = 1);
  idle_chip <= not row_busy and not staged and not running and engine_idle;
  authentic <= session and version_ok and token_ok and peer_ok;
  count     <= unsigned(word_count);
  last_word <= at_last when msg_type = C_MSG_TABLE
               else to_sl(count = C_START_FIELDS + C_JOB_WORDS - 1) when msg_type = C_MSG_START
               else '1';

  -- Header ------------------------------------------------------------------------------------------------------------
  p_admit : process (code, magic_ok, version_ok, authentic, session, msg_type, long_header, long_word, long_list)
  begin
    admit         <= '0';
    admit_state   <= C_ST_WAIT;
    admit_result  <= code;
    admit_bad     <= '0';
    admit_foreign <= '0';
    head_alive    <= authentic;
    only_header   <= not authentic;
    of_list       <= '0';
    if authentic = '0' then
      admit_state <= C_ST_LIMIT;
    end if;
    if magic_ok = '0' or long_header = '0' then
      admit_bad   <= '1';
      head_alive  <= '0';
      admit_state <= C_ST_DONE;
    elsif msg_type(7) = '1' then -- a reply
      head_alive  <= '0';
      admit_state <= C_ST_DONE;
    elsif msg_type = C_MSG_OPEN then
      admit_bad   <= not version_ok or not long_word;
      only_header <= '1';
      admit_state <= C_ST_LIMIT;
    elsif version_ok = '0' or msg_type = x"00" or unsigned(msg_type) > unsigned(C_MSG_SET) then
      admit_bad <= '1';
    elsif msg_type = C_MSG_INFO or msg_type = C_MSG_COUNTERS then
      admit_bad   <= not long_list;
      only_header <= not long_list;
      of_list     <= '1';
    elsif session = '0' then
      if msg_type /= C_MSG_CLOSE then
        admit_result <= C_RESULT_NO_SESSION;
      end if;
    elsif authentic = '0' then
      admit_foreign <= '1';
      admit_result  <= C_RESULT_BUSY;
    else
      admit <= '1';
    end if;
  end process p_admit;

  p_order : process (code, msg_type, word, is_last, is_next, idle_chip, table_now, table_end, row_busy, staged,
                     map_busy, map_complete, long_word, long_start, long_write, whole_words)
  begin
    order_state  <= C_ST_WAIT;
    order_result <= code;
    order_bad    <= '0';
    new_table    <= '0';
    release_now  <= '0';
    if msg_type = C_MSG_CLOSE then
      order_state <= C_ST_ABORT;
    elsif msg_type = C_MSG_READ or msg_type = C_MSG_SET then
      order_bad <= not long_word;
      if long_word = '1' then
        order_state <= C_ST_WORDS;
      end if;
    elsif msg_type = C_MSG_TABLE then
      if long_word = '0' or whole_words = '0' then
        order_bad <= '1';
      elsif is_last = '1' then
        if unsigned(word(15 downto 0)) > table_end or table_now = 0 then
          order_result <= C_RESULT_ORDER;
        elsif idle_chip = '0' then
          order_result <= C_RESULT_NOT_READY;
        else
          order_state <= C_ST_WORDS;
        end if;
      elsif is_next = '1' and unsigned(word(15 downto 0)) = 0 then
        if idle_chip = '0' then
          order_result <= C_RESULT_NOT_READY;
        else
          new_table   <= '1';
          order_state <= C_ST_WORDS;
        end if;
      else
        order_result <= C_RESULT_ORDER;
      end if;
    elsif msg_type = C_MSG_START then
      if long_start = '0' then
        order_bad <= '1';
      elsif is_next = '1' then
        if row_busy = '1' or staged = '1' then
          order_result <= C_RESULT_NOT_READY;
        else
          order_state <= C_ST_WORDS;
        end if;
      elsif is_last = '0' then
        order_result <= C_RESULT_ORDER;
      end if;
    elsif msg_type = C_MSG_WRITE then
      if long_write = '0' then
        order_bad <= '1';
      elsif is_last = '0' then
        order_result <= C_RESULT_ORDER;
      elsif row_busy = '1' then
        order_state <= C_ST_CHECK;
      end if;
    elsif msg_type = C_MSG_RELEASE then
      if is_last = '0' then
        order_result <= C_RESULT_ORDER;
      elsif map_busy = '1' and map_complete = '0' then
        order_result <= C_RESULT_NOT_READY;
      else
        release_now <= '1';
      end if;
    end if;
  end process p_order;

  head_state <= order_state when admit = '1' else
                admit_state;

  -- Arguments ---------------------------------------------------------------------------------------------------------
  p_arguments : process (code, msg_type, session, nonce_ok, peer_ok, token_ok, word_next, place, table_now, table_end,
                         count, last_word)
  begin
    next_state   <= C_ST_WORDS;
    word_result  <= code;
    word_bad     <= '0';
    word_foreign <= '0';
    open_again   <= '0';
    if last_word = '1' then
      next_state <= C_ST_WAIT;
    end if;
    if msg_type = C_MSG_OPEN then
      if session = '0' then
        next_state <= C_ST_ABORT;
      elsif nonce_ok = '1' and (peer_ok = '1' or token_ok = '1') then
        open_again <= '1';
      else
        word_foreign <= '1';
        word_result  <= C_RESULT_BUSY;
      end if;
    elsif msg_type = C_MSG_SET then
      word_bad <= to_sl(place /= 0 or unsigned(word_next(31 downto 2)) /= 0 or word_next(1 downto 0) = "11");
    elsif msg_type /= C_MSG_READ and msg_type /= C_MSG_TABLE then
      -- START: the table it needs, pixels, chunks, registers (the fifth of them is PLANES).
      if count = 0 and unsigned(word_next(31 downto 16)) /= table_now then
        word_result <= C_RESULT_ORDER;
        next_state  <= C_ST_WAIT;
      elsif (count = 1 and (unsigned(word_next) = 0 or unsigned(word_next(31 downto 24)) /= 0))
            or (count = 2 and (unsigned(word_next) = 0 or unsigned(word_next(31 downto 16)) /= 0)) then
        word_bad   <= '1';
        next_state <= C_ST_WAIT;
      elsif count = 7 and unsigned(word_next(10 downto 0)) > table_end(13 downto 3) then
        word_result <= C_RESULT_ORDER;
        next_state  <= C_ST_WAIT;
      elsif last_word = '1' then
        next_state <= C_ST_DIVIDE;
      end if;
    end if;
  end process p_arguments;

  -- Result ------------------------------------------------------------------------------------------------------------
  bad <= (at_header and (admit_bad or (admit and order_bad))) or (at_word and word_bad) or
         (at_divide and not chunks_fit);

  p_result : process (clk)
  begin
    if rising_edge(clk) then
      if state = C_ST_IDLE then
        code <= C_RESULT_OK;
      elsif at_header = '1' and admit = '1' then
        code <= order_result;
      elsif at_header = '1' then
        code <= admit_result;
      elsif at_word = '1' then
        code <= word_result;
      elsif at_check = '1' and w_new = '0' and w_repeated = '0' then
        code <= C_RESULT_NOT_READY;
      end if;
      if bad = '1' then
        code <= C_RESULT_BAD_MESSAGE;
      end if;
      ev_bad      <= bad;
      ev_foreign  <= (at_header and admit_foreign) or (at_word and word_foreign);
      ev_answer   <= at_header and magic_ok and long_header and msg_type(7);
      ev_repeated <= at_check and not w_new and w_repeated;
      ev_refused  <= at_check and not w_new and not w_repeated;
      map_release <= at_header and admit and release_now;
      row_open    <= at_divide and chunks_fit;
    end if;
  end process p_result;

  -- What the order goes by --------------------------------------------------------------------------------------------
  p_numbers : process (clk)
    variable v_place : unsigned(15 downto 0);
    variable v_inc   : unsigned(0 downto 0);
  begin
    if rising_edge(clk) then
      v_place  := place;
      v_inc(0) := at_word and to_sl(msg_type = C_MSG_TABLE);
      if at_header = '1' then
        v_place := unsigned(word(15 downto 0));
      end if;
      place <= v_place + v_inc;

      if at_header = '1' and admit = '1' and new_table = '1' then
        table_end <= (others => '0');
        table_now <= unsigned(word(31 downto 16)); -- + 1
      end if;
      if at_word = '1' and msg_type = C_MSG_TABLE and place = table_end and table_end(13) = '0' then
        table_end <= table_end + 1;
      end if;
      if at_word = '1' and msg_type = C_MSG_SET and word_bad = '0' then
        duplex_mode <= word_next(1 downto 0);
      end if;
      if at_divide = '1' and chunks_fit = '1' then
        tile <= tile + 1;
      end if;
      if rst = '1' or state = C_ST_ABORT then
        duplex_mode <= "00";
        tile        <= (others => '1');
        table_now   <= (others => '0');
        table_end   <= (others => '0');
      end if;
    end if;
  end process p_numbers;

  p_start : process (clk)
  begin
    if rising_edge(clk) then
      if at_word = '1' and msg_type /= C_MSG_OPEN and msg_type /= C_MSG_READ and msg_type /= C_MSG_SET
         and msg_type /= C_MSG_TABLE then
        if count = 1 then
          pixels <= word_next(23 downto 0);
        elsif count = 2 then
          chunks <= word_next(15 downto 0);
        end if;
      end if;
    end if;
  end process p_start;

  admitted    <= admit;
  word_state  <= next_state;
  open_new    <= to_sl(msg_type = C_MSG_OPEN) and not session;
  words_end   <= word_full and to_sl(next_state /= C_ST_WORDS);
  result      <= code;
  number_ok   <= is_last;
  last_tile   <= std_logic_vector(tile);
  table_id    <= std_logic_vector(table_now);
  table_words <= std_logic_vector(table_end);
  index       <= std_logic_vector(place);

end architecture rtl;
