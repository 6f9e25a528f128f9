-- SPDX-License-Identifier: Apache-2.0
-- stream_reg: skid buffer; cuts every path of a valid/ready stream, forward and backward.
--   Rate     : one beat per clock while m_tready = '1'
--   Latency  : 1 clock
--   Contract : m_tvalid never waits for m_tready; a beat shown on m_* holds until it is taken (or reset)
--   Reset    : both places become empty; data registers have no reset
library ieee;
  use ieee.std_logic_1164.all;

entity stream_reg is
  generic (
    G_DATA_W : integer := 8
  );
  port (
    clk      : in  std_logic;
    rst      : in  std_logic;
    s_tvalid : in  std_logic;
    s_tready : out std_logic;
    s_tdata  : in  std_logic_vector(G_DATA_W - 1 downto 0);
    m_tvalid : out std_logic;
    m_tready : in  std_logic;
    m_tdata  : out std_logic_vector(G_DATA_W - 1 downto 0)
  );
end entity stream_reg;

architecture rtl of stream_reg is

  signal main_valid : std_logic;
  signal main_data  : std_logic_vector(G_DATA_W - 1 downto 0);
  signal skid_valid : std_logic; -- a beat is parked because main was stuck when it came
  signal skid_data  : std_logic_vector(G_DATA_W - 1 downto 0);
  signal s_fire     : std_logic;
  signal m_stall    : std_logic;

begin

  assert G_DATA_W >= 1
    report "stream_reg: G_DATA_W=" & integer'image(G_DATA_W) & " below 1"
    severity failure;

  s_tready <= not skid_valid;
  m_tvalid <= main_valid;
  m_tdata  <= main_data;
  s_fire   <= s_tvalid and not skid_valid;
  m_stall  <= main_valid and not m_tready;

  p_buffer : process (clk)
  begin
    if rising_edge(clk) then
      if m_stall = '0' then
        -- Main is free: refill from skid first, else from the input.
        if skid_valid = '1' then
          main_data <= skid_data;
        else
          main_data <= s_tdata;
        end if;
        main_valid <= skid_valid or s_fire;
        skid_valid <= '0';
      elsif s_fire = '1' then
        -- Main is stuck, but ready was promised: park the beat.
        skid_data  <= s_tdata;
        skid_valid <= '1';
      end if;
      if rst = '1' then
        main_valid <= '0';
        skid_valid <= '0';
      end if;
    end if;
  end process p_buffer;

  -- synthesis translate_off
  -- Rules of a stream, in simulators: a beat that was not taken is still there, on both sides.
  p_rules : process (clk)
    variable v_s_waits : boolean := false;
    variable v_m_waits : boolean := false;
    variable v_s_data  : std_logic_vector(G_DATA_W - 1 downto 0);
    variable v_m_data  : std_logic_vector(G_DATA_W - 1 downto 0);
  begin
    if rising_edge(clk) then
      if rst = '0' then
        assert not v_s_waits or (s_tvalid = '1' and s_tdata = v_s_data)
          report "stream_reg: a beat that waited at s_* was withdrawn or changed"
          severity failure;
        assert not v_m_waits or (m_stall /= 'U' and main_valid = '1' and main_data = v_m_data)
          report "stream_reg: a beat that waited at m_* was withdrawn or changed"
          severity failure;
        assert skid_valid = '0' or main_valid = '1'
          report "stream_reg: a parked beat behind an empty place"
          severity failure;
      end if;
      v_s_waits := rst = '0' and s_tvalid = '1' and skid_valid = '1';
      v_m_waits := rst = '0' and main_valid = '1' and m_tready = '0';
      v_s_data  := s_tdata;
      v_m_data  := main_data;
    end if;
  end process p_rules;
  -- synthesis translate_on

end architecture rtl;
