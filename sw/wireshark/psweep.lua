-- SPDX-License-Identifier: Apache-2.0
-- Wireshark dissector of the psweep protocol, version 2 (docs/protocol.md; constants: sw/contract/protocol.hpp).
--
--   wireshark -X lua_script:sw/wireshark/psweep.lua wire.pcap        (other ways, filters, fields: docs/wireshark.md)
--
-- Input  : payloads of UDP port 20563 (preference psweep.port) that begin with the magic, whatever follows; on other
--          ports those with a whole, plausible header (heuristic psweep_udp).
-- Output : every field under its filter name psweep.*, the Info column, expert infos psweep.expert.*, and what spans
--          packets: request and reply by sequence, repetitions, the formats that an INFO reply told.
-- State  : is written once per frame, on the first pass, and kept per conversation and frame; later passes only read
--          it. So a click on a single packet shows the same as the whole file.
-- Errors : no payload raises one. Each read is checked against the captured bytes: see take().
-- Wireshark 4.0 has Lua 5.2, 4.4 may have 5.4: no operators but those of 5.2, and whole numbers by math.floor().

local psweep = Proto("psweep", "Plane-sweep stereo over UDP")
psweep.prefs.port = Pref.uint("UDP port", 20563, "UDP port of the chip (generic G_UDP_PORT); 0: by heuristic only")

local MAGIC, VERSION, HEADER, REPLY = 0x5053, 2, 16, 0x80
local OPEN, CLOSE, INFO, COUNTERS, STATUS, TABLE, START, WRITE, READ, RELEASE, SET = 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11
local MAP = 0x8c
local MOST_TABLE_WORDS = 364
local LEAST_REQUEST = { [INFO] = HEADER + 128, [COUNTERS] = HEADER + 160 } -- as long as the reply
local DOUBLED_WITHIN = 256 -- requests; sequence numbers come again after 65536
local POSITION_ONE = 524288 -- 1 px in sfix(13,19) and ufix(2,19)

local names = { [OPEN] = "OPEN", [CLOSE] = "CLOSE", [INFO] = "INFO", [COUNTERS] = "COUNTERS", [STATUS] = "STATUS",
                [TABLE] = "TABLE", [START] = "START", [WRITE] = "WRITE", [READ] = "READ", [RELEASE] = "RELEASE",
                [SET] = "SET" }
local type_names = { [MAP] = "MAP" }
for number, name in pairs(names) do
  type_names[number] = name
  type_names[number + REPLY] = name .. " reply"
end
local code_names = { [0] = "ok", [1] = "busy", [2] = "no session", [3] = "bad message", [4] = "order",
                     [5] = "not ready" }
local state_names = { [0] = "idle", [1] = "load", [2] = "sweep", [3] = "flush", [4] = "unload", [5] = "drain" }
local duplex_names = { [0] = "by pin", [1] = "half", [2] = "full" }

-- Fields --------------------------------------------------------------------------------------------------------------
-- Created in the order in which they appear here; f.<name> has the filter name psweep.<name>, '_' for '.' allowed.
local f, all_fields = {}, {}
local function field(key, make, abbreviation, ...)
  f[key] = make("psweep." .. abbreviation, ...)
  all_fields[#all_fields + 1] = f[key]
end

field("magic", ProtoField.uint16, "magic", "Magic", base.HEX)
field("version", ProtoField.uint8, "version", "Version")
field("type", ProtoField.uint8, "type", "Type", base.HEX, type_names)
field("token", ProtoField.uint32, "token", "Token", base.HEX)
field("sequence", ProtoField.uint16, "sequence", "Sequence")
field("flags", ProtoField.uint8, "flags", "Flags", base.HEX)
field("flags_answer", ProtoField.bool, "flags.answer", "Answer this WRITE", 8, nil, 0x01)
field("code", ProtoField.uint8, "code", "Code", base.DEC, code_names)
field("reserved", ProtoField.uint8, "reserved", "Reserved", base.HEX)
field("tile", ProtoField.uint16, "tile", "Tile")
field("index", ProtoField.uint16, "index", "Index")
field("padding", ProtoField.bytes, "padding", "Padding")
field("data", ProtoField.bytes, "data", "Data")

field("request_in", ProtoField.framenum, "request_in", "Request in frame", base.NONE, frametype.REQUEST)
field("response_in", ProtoField.framenum, "response_in", "Reply in frame", base.NONE, frametype.RESPONSE)
field("response_time", ProtoField.relative_time, "response_time", "Time since the request")
field("repeats", ProtoField.framenum, "repeats", "Repeats frame", base.NONE, frametype.RETRANS_PREV)

field("nonce", ProtoField.uint32, "nonce", "Nonce", base.HEX)
field("read_count", ProtoField.uint16, "read.count", "Chunks asked for")
field("read_keep", ProtoField.uint16, "read.keep", "First chunk still needed")
field("set_value", ProtoField.uint32, "set.value", "Value")

field("table", ProtoField.none, "table", "Plane table words")
field("table_plane", ProtoField.uint32, "table.plane", "Plane")
field("write_pixels", ProtoField.bytes, "write.pixels", "Pixel pairs")
field("write_pairs", ProtoField.uint32, "write.pairs", "Pairs")
field("write_first", ProtoField.uint32, "write.first_pair", "First pair")

local table_words = { "x0_left", "y0_left", "x0_right", "y0_right", "dx_left", "dy_left", "dx_right", "dy_right" }
for i, name in ipairs(table_words) do
  field("table_" .. name, i <= 4 and ProtoField.int32 or ProtoField.uint32, "table." .. name, name)
end

-- START: name, then the kind of number: u unsigned, p position, s signed.
field("start", ProtoField.none, "start", "Tile")
field("start_table", ProtoField.uint16, "start.table", "Table")
field("start_zero", ProtoField.uint16, "start.zero", "Zero")
field("start_pixels", ProtoField.uint32, "start.pixels", "Pixels")
field("start_chunks", ProtoField.uint32, "start.chunks", "Chunks")
local start_words = {
  { "tile_cols", "u" }, { "tile_rows", "u" }, { "win_cols", "u" }, { "win_rows", "u" }, { "planes", "u" },
  { "threshold", "u" }, { "tx_left", "p" }, { "ty_left", "p" }, { "tx_right", "p" }, { "ty_right", "p" },
  { "left_x_lo", "s" }, { "left_x_hi", "s" }, { "left_y_lo", "s" }, { "left_y_hi", "s" },
  { "right_x_lo", "s" }, { "right_x_hi", "s" }, { "right_y_lo", "s" }, { "right_y_hi", "s" },
}
for _, word in ipairs(start_words) do
  field("start_" .. word[1], word[2] == "u" and ProtoField.uint32 or ProtoField.int32, "start." .. word[1], word[1])
end

-- Status block.
field("status", ProtoField.none, "status", "Status block")
field("status_row_tile", ProtoField.uint16, "status.row_tile", "Tile in the row buffer")
field("status_flags", ProtoField.uint16, "status.flags", "Flags", base.HEX)
local status_flags = {
  { "session", "Session open" }, { "rows", "Row buffer holds a tile" }, { "engine", "Engine holds a tile" },
  { "map", "Map buffer holds a tile" }, { "map_complete", "Map complete" },
  { "failed", "A tile failed since OPEN" }, { "full_duplex", "Full duplex" }, { "speed_100", "100 Mbit/s" },
}
for i, flag in ipairs(status_flags) do
  field("status_" .. flag[1], ProtoField.bool, "status.flags." .. flag[1], flag[2], 16, nil, math.floor(2 ^ (i - 1)))
end
field("status_state", ProtoField.uint16, "status.flags.engine_state", "Engine state", base.DEC, state_names, 0x0700)
field("status_engine_tile", ProtoField.uint16, "status.engine_tile", "Tile in the engine")
field("status_map_tile", ProtoField.uint16, "status.map_tile", "Tile in the map buffer")
field("status_base", ProtoField.uint16, "status.base", "Base: chunks consumed")
field("status_received", ProtoField.uint16, "status.received", "Chunks received")
field("status_table", ProtoField.uint16, "status.table", "Table")
field("status_table_words", ProtoField.uint16, "status.table_words", "Table words written")
field("status_cells", ProtoField.uint32, "status.cells", "Cells in the map buffer")
field("status_errors", ProtoField.uint16, "status.errors", "Engine errors", base.HEX)
local error_names = { "config", "table", "short", "long", "window", "address", "busy", "upset" }
for i, name in ipairs(error_names) do
  field("status_error_" .. name, ProtoField.bool, "status.errors." .. name, name, 16, nil, math.floor(2 ^ (i - 1)))
end
field("status_error_count", ProtoField.uint16, "status.error_count", "Engine error count")
field("status_tiles_done", ProtoField.uint16, "status.tiles_done", "Tiles done")
field("status_tiles_dropped", ProtoField.uint16, "status.tiles_dropped", "Tiles dropped")
field("status_tile_clocks", ProtoField.uint32, "status.tile_clocks", "Clocks of the latest tile")
field("status_window_errors", ProtoField.uint16, "status.window_errors", "Samples outside the window")
field("status_failed_tile", ProtoField.uint16, "status.failed_tile", "Latest tile that failed")
field("status_bitmap", ProtoField.bytes, "status.bitmap", "Bitmap from chunk 'base' on")
field("status_chunks", ProtoField.string, "status.chunks", "Chunks in the bitmap")
field("status_stored", ProtoField.uint32, "status.stored", "Number of chunks in the bitmap")

-- Capability words: name in the filter, label. Word 0 and the MAC address are taken apart below.
field("info", ProtoField.none, "info", "Capability words")
field("info_version", ProtoField.uint16, "info.version", "Version")
field("info_words", ProtoField.uint16, "info.words", "Number of words")
local info_words = {
  { "img_cols", "Image buffer, columns" }, { "img_rows", "Image buffer, rows" },
  { "plane_cols", "Largest tile, columns" }, { "plane_rows", "Largest tile, rows" }, { "planes", "Planes" },
  { "window", "Window" }, { "pix_bits", "Bits of a pixel" }, { "weight_bits", "Bits of a weight" },
  { "interp_frac", "Fraction bits of an interpolated pixel" }, { "mncc_bits", "Bits of v" },
  { "frac_bits", "Bits of the depth fraction" }, { "lanes", "Lanes" }, { "cell_bits", "Bits of a cell" },
  false, false, { "clk_khz", "Clock, kHz" }, { "chunk_bytes", "Bytes of a chunk, at most" },
  { "pair_bytes", "Bytes of a pixel pair" }, { "chunk_pairs", "Pixel pairs of a chunk" },
  { "row_slots", "Chunks in the row buffer" }, { "cell_bytes", "Bytes of a cell" },
  { "chunk_cells", "Cells of a chunk" }, { "map_depth", "Cells in the map buffer" },
  { "session_ms", "Silence that ends a session, ms" }, { "rx_slots", "Frames in the receive buffer" },
  { "counters", "Number of counters" }, { "rectified", "Built for rectified pairs" },
}
for _, word in ipairs(info_words) do
  if word then field("info_" .. word[1], ProtoField.uint32, "info." .. word[1], word[2]) end
end
field("info_mac_zero", ProtoField.uint16, "info.mac_zero", "Zero")
field("info_mac", ProtoField.ether, "info.mac", "MAC address")
field("info_reserved", ProtoField.uint32, "info.reserved", "Reserved")

field("counters", ProtoField.none, "counters", "Counters")
local counter_names = {
  "rx_frames", "rx_fcs", "rx_align", "rx_short", "rx_long", "rx_error", "rx_filtered", "rx_no_slot", "rx_overflow",
  "rx_other", "ip_header", "ip_fragment", "checksum", "arp", "icmp", "udp", "bad_message", "foreign", "tx_frames",
  "tx_collisions", "tx_late", "tx_excessive", "sessions", "timeouts", "engine_wait_rows", "engine_wait_map",
  "chunks_repeated", "chunks_refused", "map_packets", "bad_source", "limited", "answers", "rx_fragment", "tx_deferred",
  "unreachable", "recovered", "resynchronised", "rx_clock_lost", "tx_clock_lost", "tiles_failed",
}
for _, name in ipairs(counter_names) do field("counter_" .. name, ProtoField.uint32, "counters." .. name, name) end

field("map", ProtoField.bytes, "map", "Cells")
field("map_first", ProtoField.uint32, "map.first_cell", "First cell")
field("map_cells", ProtoField.uint32, "map.cells", "Number of cells")
field("cell", ProtoField.bytes, "cell", "Cell")
field("cell_not_local", ProtoField.bool, "cell.not_local", "Not a local maximum")
field("cell_plane", ProtoField.uint16, "cell.plane", "Plane")
field("cell_frac", ProtoField.uint16, "cell.frac", "Fraction")
field("cell_v", ProtoField.uint16, "cell.v", "V")
field("cell_mask", ProtoField.uint8, "cell.mask", "Mask", base.HEX)
local cell_fields = { f.cell, f.cell_not_local, f.cell_plane, f.cell_frac, f.cell_v, f.cell_mask }

psweep.fields = all_fields

local expert_infos = {
  version = { "Not version 2", expert.group.PROTOCOL, expert.severity.ERROR },
  truncated = { "Truncated message", expert.group.MALFORMED, expert.severity.ERROR },
  cut = { "Cut off by the capture", expert.group.UNDECODED, expert.severity.NOTE },
  length = { "Wrong length", expert.group.PROTOCOL, expert.severity.WARN },
  value = { "Value out of range", expert.group.PROTOCOL, expert.severity.WARN },
  type = { "Unknown type", expert.group.PROTOCOL, expert.severity.WARN },
  code = { "Not done", expert.group.RESPONSE_CODE, expert.severity.WARN },
  repeated = { "Repeated request", expert.group.SEQUENCE, expert.severity.NOTE },
  repeated_reply = { "Second reply to a request", expert.group.SEQUENCE, expert.severity.NOTE },
  repeated_chunk = { "Map chunk sent before", expert.group.SEQUENCE, expert.severity.NOTE },
  no_request = { "No request for it", expert.group.SEQUENCE, expert.severity.NOTE },
  no_response = { "No reply to it", expert.group.SEQUENCE, expert.severity.NOTE },
}
local e = {}
for key, info in pairs(expert_infos) do
  e[key] = ProtoExpert.new("psweep.expert." .. key, info[1], info[2], info[3])
end
psweep.experts = e

-- What spans packets --------------------------------------------------------------------------------------------------
--   conversation: pending[sequence] = latest request with it; latest[type] = latest request of this type; seen[token]
--     [tile][type and index] = frame, for repetitions; chunks likewise, for map packets; threshold[token][tile]
--   request: frame, time, order, type, tile, index, answered, response (frame)
--   frames[number]: what was found out about this frame on the first pass
--   layouts[chip], addresses: below
local conversations, layouts, frames, addresses = {}, {}, {}, {}
function psweep.init() conversations, layouts, frames, addresses = {}, {}, {}, {} end

-- An address as a number. Not its text, which may turn into a name in the middle of a capture; and not udp.stream,
-- since fields of other protocols can only be read on passes that build a tree.
local function number_of(address)
  for number, known in ipairs(addresses) do
    if known == address then return number end
  end
  addresses[#addresses + 1] = address
  return #addresses
end

-- Keys of the chip and of its conversation with this host.
local function keys_of(m, pinfo)
  local from = number_of(pinfo.net_src) .. " " .. pinfo.src_port
  local to = number_of(pinfo.net_dst) .. " " .. pinfo.dst_port
  if m.is_request then return to, from .. " " .. to end
  return from, to .. " " .. from
end

local function conversation_of(key)
  if not conversations[key] then
    conversations[key] = { pending = {}, latest = {}, seen = {}, chunks = {}, threshold = {}, order = 0 }
  end
  return conversations[key]
end

-- of[a][b], made when it is not there yet.
local function nested(of, a, b)
  local first = of[a]
  if not first then first = {}; of[a] = first end
  if not first[b] then first[b] = {} end
  return first[b]
end

-- Registers a request; the earlier one that it repeats, or nil. extra: nonce of an OPEN, value of a SET.
local function note_request(conversation, pinfo, m, extra)
  local now = { frame = pinfo.number, time = pinfo.rel_ts, type = m.type, tile = m.tile, index = m.index,
                order = conversation.order, wanted = m.type ~= WRITE or m.flags % 2 == 1 }
  conversation.order = conversation.order + 1
  -- The same packet once more (doubled on the way): replies go with the first one. Later, when sequence numbers come
  -- again, it is another request.
  local same = conversation.pending[m.sequence]
  local doubled = same and same.type == m.type and same.tile == m.tile and same.index == m.index and
    now.order - same.order < DOUBLED_WITHIN
  if not doubled then conversation.pending[m.sequence] = now end
  local record = doubled and same or now

  local first
  if m.type == INFO or m.type == COUNTERS or m.type == STATUS then
    -- They are asked again and again; a repetition is only what follows a question that is still open.
    local before = conversation.latest[m.type]
    if doubled then
      first = same.frame
    elseif before and not before.answered then
      first = before.frame
    end
    conversation.latest[m.type] = record
  else
    local of_tile = nested(conversation.seen, m.token, m.tile)
    local key = m.type .. " " .. m.index .. " " .. (extra or "")
    first = of_tile[key]
    if not first then of_tile[key] = pinfo.number end
    -- Tile numbers come again after 65536 tiles.
    if m.type == START then
      local far = (m.tile + 32768) % 65536
      conversation.seen[m.token][far] = nil
      if conversation.chunks[m.token] then conversation.chunks[m.token][far] = nil end
    end
  end
  return record, first
end

-- The request that a reply or map packet belongs to.
local function request_of(conversation, m)
  local request = conversation.pending[m.sequence]
  if not request then return nil end
  if m.is_map then return request.type == READ and request or nil end
  return request.type % REPLY + REPLY == m.type and request or nil
end

-- Formats that the words of an INFO reply fix; nil if they contradict each other.
local function layout_from(words)
  if #words < 27 then return nil end
  local w = function(number) return words[number + 1] end
  if w(0) < VERSION * 65536 or w(0) >= (VERSION + 1) * 65536 then return nil end
  local layout = { planes = w(5), v_bits = w(10), frac_bits = w(11), cell_bytes = w(21), chunk_cells = w(22),
                   pair_bytes = w(18), chunk_pairs = w(19), row_slots = w(20), plane_bits = 1 }
  if layout.planes < 1 or layout.planes > 65536 or layout.v_bits > 16 or layout.frac_bits > 16 then return nil end
  while 2 ^ layout.plane_bits < layout.planes do layout.plane_bits = layout.plane_bits + 1 end
  layout.cell_bits = 1 + layout.plane_bits + layout.frac_bits + layout.v_bits
  if layout.cell_bits ~= w(13) or layout.cell_bytes ~= math.floor((layout.cell_bits + 7) / 8) then return nil end
  return layout
end

-- One message ---------------------------------------------------------------------------------------------------------
--   m: tvb, size (bytes captured), whole (bytes on the wire), at (next byte), short (name of what did not fit), and the
--   header's fields as numbers

-- Adds the next bytes as a field, if they are all there. Returns value and tree item, or nothing.
local function take(m, tree, what, bytes)
  if m.short then return end
  if m.at + bytes > m.size then
    m.short = what
    return
  end
  local range = m.tvb(m.at, bytes)
  m.at = m.at + bytes
  return range:uint(), tree:add(what, range)
end
local function rest(m) return m.size - m.at end
-- Subtree for the next bytes, or nothing if there are none.
local function branch(m, tree, what, bytes)
  if m.short then return end
  if rest(m) <= 0 then
    m.short = what
    return
  end
  return tree:add(what, m.tvb(m.at, math.min(bytes or rest(m), rest(m))))
end
local function take_rest(m, tree, what)
  if m.short or rest(m) <= 0 then return end
  local item = tree:add(what, m.tvb(m.at, rest(m)))
  m.at = m.size
  return item
end
local function generated(tree, what, range, value)
  local item = range and tree:add(what, range, value) or tree:add(what, value)
  item:set_generated()
  return item
end
local function warn(m, tree, info, text) tree:add_proto_expert_info(info, text) end

local function signed(value) return value >= 2147483648 and value - 4294967296 or value end
local function add_position(m, tree, what, is_signed)
  local value, item = take(m, tree, what, 4)
  if not value then return end
  item:append_text(string.format(" (%.6f px)", (is_signed and signed(value) or value) / POSITION_ONE))
  return value
end

-- Payloads of requests. Each returns what the Info column says behind the name.
local request_payload = {}

request_payload[OPEN] = function(m, tree)
  local nonce = take(m, tree, f.nonce, 4)
  m.extra = nonce
  return nonce and string.format("nonce 0x%08x", nonce) or ""
end

request_payload[TABLE] = function(m, tree)
  local bytes = rest(m)
  local words = math.floor(bytes / 4)
  local items = branch(m, tree, f.table)
  if items then
    local parent
    for i = 0, words - 1 do
      local number = m.index + i
      local plane, word = math.floor(number / 8), number % 8
      if word == 0 or i == 0 then
        parent = items:add(f.table_plane, m.tvb(m.at, 4 * math.min(8 - word, words - i)), plane)
      end
      add_position(m, parent, f["table_" .. table_words[word + 1]], word < 4)
    end
    take_rest(m, items, f.data)
    items:append_text(": " .. words)
  end
  if not m.cut and bytes > 0 and (bytes % 4 ~= 0 or words > MOST_TABLE_WORDS) then
    warn(m, tree, e.length, "TABLE has 1 .. 364 whole words, this one " .. bytes .. " bytes")
  end
  if words == 0 then return "" end
  return string.format("%d words %d..%d", m.tile, m.index, m.index + words - 1)
end

request_payload[START] = function(m, tree)
  local items = branch(m, tree, f.start, 12 + 4 * #start_words)
  if not items then return "tile " .. m.tile end
  local number = take(m, items, f.start_table, 2)
  take(m, items, f.start_zero, 2)
  local pixels = take(m, items, f.start_pixels, 4)
  local chunks = take(m, items, f.start_chunks, 4)
  local words = {}
  for _, word in ipairs(start_words) do
    local what = f["start_" .. word[1]]
    if word[2] == "p" then
      add_position(m, items, what, true)
    else
      words[word[1]] = take(m, items, what, 4)
    end
  end
  m.threshold = words.threshold
  if pixels and (pixels == 0 or pixels >= 16777216) then
    warn(m, items, e.value, "pixels has to be 1 .. 2^24 - 1")
  elseif words.win_rows and pixels ~= words.win_cols * words.win_rows then
    warn(m, items, e.value, "pixels is not win_cols * win_rows: the engine will drop the tile")
  end
  if chunks and (chunks == 0 or chunks >= 65536) then
    warn(m, items, e.value, "chunks has to be 1 .. 65535")
  elseif chunks and m.layout and m.layout.chunk_pairs > 0 and
    chunks ~= math.floor((pixels + m.layout.chunk_pairs - 1) / m.layout.chunk_pairs) then
    warn(m, items, e.value, "chunks is not pixels / " .. m.layout.chunk_pairs .. ", rounded up")
  end
  local text = "tile " .. m.tile
  if not words.right_y_hi then return text end
  return string.format("%s table %d: %dx%d cells, window %dx%d in %d chunks, %d planes", text, number,
                       words.tile_cols, words.tile_rows, words.win_cols, words.win_rows, chunks, words.planes)
end

request_payload[WRITE] = function(m, tree)
  local bytes = rest(m)
  local item = branch(m, tree, f.write_pixels)
  m.at = m.size
  local layout = m.layout
  if item and layout and layout.pair_bytes > 0 and not m.cut then
    generated(item, f.write_first, nil, m.index * layout.chunk_pairs)
    generated(item, f.write_pairs, nil, math.floor(bytes / layout.pair_bytes))
    if bytes ~= layout.chunk_pairs * layout.pair_bytes then
      warn(m, tree, e.length, string.format("WRITE has %d pairs of %d bytes, this one %d bytes", layout.chunk_pairs,
                                            layout.pair_bytes, bytes))
    end
  end
  return string.format("tile %d chunk %d%s", m.tile, m.index, m.flags % 2 == 1 and ", answer" or "")
end

request_payload[READ] = function(m, tree)
  local count = take(m, tree, f.read_count, 2)
  local keep = take(m, tree, f.read_keep, 2)
  if not keep then return "tile " .. m.tile end
  local chunks = count > 0 and string.format("chunks %d..%d", m.index, m.index + count - 1) or "no chunks"
  return string.format("tile %d %s keep %d", m.tile, chunks, keep)
end

request_payload[RELEASE] = function(m) return "tile " .. m.tile end

request_payload[SET] = function(m, tree)
  local value, item = take(m, tree, f.set_value, 4)
  if not value then return "register " .. m.index end
  m.extra = value
  if m.index == 0 and duplex_names[value] then
    item:append_text(" (duplex " .. duplex_names[value] .. ")")
    return "duplex " .. duplex_names[value]
  end
  warn(m, tree, e.value, "register 0 takes 0, 1 or 2; there is no other")
  return string.format("register %d = %d", m.index, value)
end

for _, number in ipairs({ CLOSE, INFO, COUNTERS, STATUS }) do
  request_payload[number] = function(m, tree)
    local least = LEAST_REQUEST[number]
    if least and not m.cut and m.size < least then
      warn(m, tree, e.length, string.format("The request has to be as long as its reply, %d bytes", least))
    end
    return ""
  end
end

-- OPEN, and those whom the chip does not know, get the header alone; a bad message and CLOSE may.
local function is_bare(m)
  if m.type == OPEN + REPLY or m.code == 1 or m.code == 2 then return true end
  return m.whole <= HEADER and (m.code == 3 or (m.code == 0 and m.type == CLOSE + REPLY))
end

-- Chunk numbers of the set bits, as "3, 5-9", and how many.
local function bitmap_text(m, from, bytes, first)
  local parts, count, begun = {}, 0, nil
  local function close_run(last)
    if begun then parts[#parts + 1] = begun == last and tostring(begun) or begun .. "-" .. last end
    begun = nil
  end
  for i = 0, 8 * bytes - 1 do
    local chunk = first + i
    if m.tvb(from + math.floor(i / 8), 1):bitfield(i % 8, 1) == 1 then
      count = count + 1
      begun = begun or chunk
    else
      close_run(chunk - 1)
    end
  end
  close_run(first + 8 * bytes - 1)
  return #parts > 0 and table.concat(parts, ", ") or "none", count
end

local function has(flags, bit_number) return math.floor(flags / 2 ^ bit_number) % 2 == 1 end

local function status_payload(m, tree)
  local items = branch(m, tree, f.status)
  if not items then return "" end
  local row_tile = take(m, items, f.status_row_tile, 2)
  local flags, item = take(m, items, f.status_flags, 2)
  if flags then
    local range = m.tvb(m.at - 2, 2)
    for _, flag in ipairs(status_flags) do item:add(f["status_" .. flag[1]], range) end
    item:add(f.status_state, range)
  end
  local engine_tile = take(m, items, f.status_engine_tile, 2)
  local map_tile = take(m, items, f.status_map_tile, 2)
  local first = take(m, items, f.status_base, 2)
  take(m, items, f.status_received, 2)
  take(m, items, f.status_table, 2)
  take(m, items, f.status_table_words, 2)
  local cells = take(m, items, f.status_cells, 4)
  local errors, errors_item = take(m, items, f.status_errors, 2)
  if errors then
    local range = m.tvb(m.at - 2, 2)
    for _, name in ipairs(error_names) do errors_item:add(f["status_error_" .. name], range) end
  end
  take(m, items, f.status_error_count, 2)
  take(m, items, f.status_tiles_done, 2)
  take(m, items, f.status_tiles_dropped, 2)
  take(m, items, f.status_tile_clocks, 4)
  take(m, items, f.status_window_errors, 2)
  local failed_tile = take(m, items, f.status_failed_tile, 2)
  if failed_tile then
    -- As many words as there are, or as INFO told: what follows then is padding.
    local bytes = math.floor(rest(m) / 4) * 4
    if m.layout then
      local told = 4 * math.floor((m.layout.row_slots + 31) / 32)
      if told > bytes then
        m.short = f.status_bitmap
      else
        bytes = told
      end
    end
    if bytes > 0 then
      local range = m.tvb(m.at, bytes)
      local bitmap = items:add(f.status_bitmap, range)
      local text, count = bitmap_text(m, m.at, bytes, first)
      generated(bitmap, f.status_chunks, range, text)
      generated(bitmap, f.status_stored, range, count)
      m.at = m.at + bytes
    end
    if m.short then m.at = m.size end
  end

  if not flags then return "" end
  local parts = {}
  if not has(flags, 0) then parts[#parts + 1] = "no session" end
  if has(flags, 1) then parts[#parts + 1] = "rows " .. row_tile end
  if has(flags, 2) and engine_tile then parts[#parts + 1] = "engine " .. engine_tile end
  if has(flags, 3) and map_tile then
    local state = has(flags, 4) and " complete" or cells and " (" .. cells .. " cells)" or ""
    parts[#parts + 1] = "map " .. map_tile .. state
  end
  if has(flags, 5) then parts[#parts + 1] = "FAILED" .. (failed_tile and " " .. failed_tile or "") end
  return table.concat(parts, " ")
end

local function info_payload(m, tree)
  local items = branch(m, tree, f.info)
  if not items then return "" end
  local words = {}
  local version = take(m, items, f.info_version, 2)
  local count = take(m, items, f.info_words, 2)
  if count then words[1] = version * 65536 + count end
  for _, word in ipairs(info_words) do
    if word then
      words[#words + 1] = take(m, items, f["info_" .. word[1]], 4)
    elseif #words == 14 then -- 14 and 15 together
      local zero = take(m, items, f.info_mac_zero, 2)
      if not m.short and rest(m) >= 6 then
        items:add(f.info_mac, m.tvb(m.at, 6))
        words[15] = zero * 65536 + m.tvb(m.at, 2):uint()
        words[16] = m.tvb(m.at + 2, 4):uint()
        m.at = m.at + 6
      else
        m.short = m.short or f.info_mac
      end
    end
  end
  while count and not m.short and #words < count do words[#words + 1] = take(m, items, f.info_reserved, 4) end
  if not m.short then m.new_layout = layout_from(words) end
  if not words[7] then return "" end
  return string.format("%dx%d cells, %d planes, window %d", words[4], words[5], words[6], words[7])
end

local function counters_payload(m, tree)
  local items = branch(m, tree, f.counters)
  if not items then return "" end
  local parts = {}
  for _, name in ipairs(counter_names) do
    local value = take(m, items, f["counter_" .. name], 4)
    if value and value > 0 then parts[#parts + 1] = name .. " " .. value end
  end
  return table.concat(parts, ", ")
end

-- Bits first .. first + count - 1 of the cell at byte `at`, counted from the low end of its word, and where they are.
local function cell_part(m, at, cell_bytes, first, count)
  if count == 0 then return 0, m.tvb(at, cell_bytes) end
  local top = 8 * cell_bytes - first - count -- from the front
  local from, to = math.floor(top / 8), math.floor((top + count - 1) / 8)
  local range = m.tvb(at + from, to - from + 1)
  return range:bitfield(top % 8, count), range
end

local function mask_of(frac, v, not_local, threshold)
  if v == 0 and frac % 2 == 0 then return 1, "outside" end
  if v == 0 and frac % 4 == 1 then return 2, "no variance" end
  local mask, words = 0, {}
  if v < threshold then mask, words[1] = 4, "below threshold" end
  if not_local == 1 then mask, words[#words + 1] = mask + 8, "not a local maximum" end
  return mask, #words > 0 and table.concat(words, ", ") or "good"
end

local function wants_cells(tree)
  if tree.visible then return true end
  for _, what in ipairs(cell_fields) do
    if tree:referenced(what) then return true end
  end
  return false
end

local function map_payload(m, tree)
  local text = string.format("tile %d chunk %d", m.tile, m.index)
  local bytes, start = rest(m), m.at
  local items = branch(m, tree, f.map)
  if not items then return text end
  m.at = m.size
  local layout = m.layout
  if not layout then return text .. string.format(": %d bytes", bytes) end
  local cell_bytes = layout.cell_bytes
  local count = math.floor(bytes / cell_bytes)
  local first = m.index * layout.chunk_cells
  generated(items, f.map_first, nil, first)
  generated(items, f.map_cells, nil, count)
  if not m.cut and (bytes % cell_bytes ~= 0 or count > layout.chunk_cells) then
    warn(m, tree, e.length, string.format("MAP has 1 .. %d cells of %d bytes, this one %d bytes", layout.chunk_cells,
                                          cell_bytes, bytes))
  end
  -- Hundreds of cells: not for those who do not look.
  if wants_cells(items) then
    local v_bits, frac_bits, plane_bits = layout.v_bits, layout.frac_bits, layout.plane_bits
    for i = 0, count - 1 do
      local at = start + i * cell_bytes
      local v, v_range = cell_part(m, at, cell_bytes, 0, v_bits)
      local frac, frac_range = cell_part(m, at, cell_bytes, v_bits, frac_bits)
      local plane, plane_range = cell_part(m, at, cell_bytes, v_bits + frac_bits, plane_bits)
      local not_local, not_local_range = cell_part(m, at, cell_bytes, v_bits + frac_bits + plane_bits, 1)
      local cell = items:add(f.cell, m.tvb(at, cell_bytes))
      cell:add(f.cell_not_local, not_local_range, not_local == 1)
      cell:add(f.cell_plane, plane_range, plane)
      cell:add(f.cell_frac, frac_range, frac)
      cell:add(f.cell_v, v_range, v)
      local label = string.format("Cell %d: plane %d, frac %d, v %d", first + i, plane, frac, v)
      if m.threshold then
        local mask, words = mask_of(frac, v, not_local, m.threshold)
        generated(cell, f.cell_mask, m.tvb(at, cell_bytes), mask):append_text(" (" .. words .. ")")
        label = label .. ", " .. words
        if mask == 0 then
          label = label .. string.format(", position %.4f", plane - 0.5 + (frac + 0.5) / 2 ^ frac_bits)
        end
      end
      cell:set_text(label)
    end
  end
  return text .. string.format(": %d cells", count)
end

-- What spans packets, of this one; on the first pass only, and not from a packet quoted in an ICMP error.
local function note(m, pinfo, conversation)
  local found = {}
  if m.is_request then
    found.request, found.repeats = note_request(conversation, pinfo, m, m.extra)
    if m.type == START and m.threshold then nested(conversation.threshold, m.token, m.tile).v = m.threshold end
    return found
  end
  local request = request_of(conversation, m)
  if request then
    found.request_in = request.frame
    found.time = math.max(0, pinfo.rel_ts - request.time)
  end
  if m.is_map then
    local of_tile = nested(conversation.chunks, m.token, m.tile)
    found.repeated_chunk = of_tile[m.index]
    if not found.repeated_chunk then of_tile[m.index] = pinfo.number end
  elseif request then
    found.repeated_reply = request.response
    if not request.response then request.response = pinfo.number end
    request.answered = true
  end
  return found
end

local function add_notes(m, tree, pinfo, found)
  local request = found.request
  if request then
    -- Of a packet that came twice the second one has no reply of its own.
    if request.frame == pinfo.number then
      if request.response then
        generated(tree, f.response_in, nil, request.response)
      elseif pinfo.visited and request.wanted then
        tree:add_proto_expert_info(e.no_response)
      end
    end
    if found.repeats then
      generated(tree, f.repeats, nil, found.repeats)
      tree:add_proto_expert_info(e.repeated, "Repeats the request in frame " .. found.repeats)
    end
    return
  end
  if found.request_in then
    generated(tree, f.request_in, nil, found.request_in)
    local seconds = math.floor(found.time)
    generated(tree, f.response_time, nil, NSTime.new(seconds, math.floor((found.time - seconds) * 1e9 + 0.5)))
  else
    tree:add_proto_expert_info(e.no_request)
  end
  if found.repeated_reply then
    generated(tree, f.repeats, nil, found.repeated_reply)
    tree:add_proto_expert_info(e.repeated_reply, "The request was answered in frame " .. found.repeated_reply)
  end
  if found.repeated_chunk then
    generated(tree, f.repeats, nil, found.repeated_chunk)
    tree:add_proto_expert_info(e.repeated_chunk, "The chunk was sent in frame " .. found.repeated_chunk)
  end
end

-- Returns false if the bytes are no message.
local function dissect(tvb, pinfo, root)
  local m = { tvb = tvb, size = tvb:len(), whole = tvb:reported_len(), at = 0 }
  if m.size < 2 or tvb(0, 2):uint() ~= MAGIC then return false end
  m.cut = m.size < m.whole
  pinfo.cols.protocol:set("psweep")
  local tree = root:add(psweep, tvb())

  take(m, tree, f.magic, 2)
  local version, version_item = take(m, tree, f.version, 1)
  local type_item
  m.type, type_item = take(m, tree, f.type, 1)
  -- Who speaks is a matter of the port; between two ports that are both the chip's, or none, of the type.
  if m.type then
    local port = psweep.prefs.port
    if port ~= 0 and pinfo.dst_port == port and pinfo.src_port ~= port then
      m.is_request = true
    elseif port ~= 0 and pinfo.src_port == port and pinfo.dst_port ~= port then
      m.is_request = false
    else
      m.is_request = m.type < REPLY
    end
  end
  m.token = take(m, tree, f.token, 4)
  m.sequence = take(m, tree, f.sequence, 2)
  if m.is_request then
    local item
    m.flags, item = take(m, tree, f.flags, 1)
    if m.flags then item:add(f.flags_answer, tvb(m.at - 1, 1)) end
  else
    m.code = take(m, tree, f.code, 1)
  end
  take(m, tree, f.reserved, 1)
  m.tile = take(m, tree, f.tile, 2)
  m.index = take(m, tree, f.index, 2)

  local name, text = "message", ""
  if m.type then name = type_names[m.type] or string.format("type 0x%02x", m.type) end
  if version and version ~= VERSION then
    version_item:add_proto_expert_info(e.version, "This is version 2 of the protocol, not " .. version)
    text = "version " .. version
  end
  if m.index then
    -- Code and type tell a map packet from the refusal of the unknown type 0x0c.
    m.is_map = not m.is_request and m.type == MAP and m.code == 0
    if m.type == MAP and not m.is_request and m.code ~= 0 then name = "type 0x0c" end
    local known = m.is_map
    if not known then
      local number = m.is_request and m.type or m.type - REPLY
      known = names[number] ~= nil
      if known and not m.is_request then name = names[number] end
    end
    if not known then type_item:add_proto_expert_info(e.type) end

    local found = frames[pinfo.number]
    local track = not pinfo.in_error_pkt
    local chip, key = keys_of(m, pinfo)
    local conversation = conversation_of(key)
    if found and pinfo.visited then
      -- Capture files that begin in the middle: what INFO tells later will do.
      m.layout = found.layout or layouts[chip]
      m.threshold = found.threshold
    elseif track then
      m.layout = layouts[chip]
      local thresholds = m.is_map and conversation.threshold[m.token]
      m.threshold = thresholds and thresholds[m.tile] and thresholds[m.tile].v
    end
    local threshold = m.threshold

    local left_over = f.padding
    if version ~= VERSION or (m.is_request and not known) or (not m.is_request and not known and m.code == 0) then
      left_over = f.data
    elseif m.is_request then
      text = request_payload[m.type](m, tree)
    elseif m.is_map then
      text = map_payload(m, tree)
    elseif m.code == 0 and m.type == INFO + REPLY then
      text = info_payload(m, tree)
    elseif m.code == 0 and m.type == COUNTERS + REPLY then
      text = counters_payload(m, tree)
    elseif not is_bare(m) then
      text = status_payload(m, tree)
    end
    if not m.is_request and not m.is_map then
      local code = code_names[m.code] or "code " .. m.code
      if m.code ~= 0 then tree:add_proto_expert_info(e.code, name .. " was answered with: " .. code) end
      text = code .. (text ~= "" and ": " .. text or "")
    end
    take_rest(m, tree, left_over)

    if not (found and pinfo.visited) and track then
      found = note(m, pinfo, conversation)
      found.layout, found.threshold = m.layout, threshold
      frames[pinfo.number] = found
      layouts[chip] = m.new_layout or layouts[chip]
    end
    if found and track then
      add_notes(m, tree, pinfo, found)
      m.repeated = found.repeats
    end
  end

  if text ~= "" then name = name .. " " .. text end
  if m.repeated then name = name .. " [repeated]" end
  if m.cut then
    tree:add_proto_expert_info(e.cut)
    if m.short then name = name .. " [cut off by the capture]" end
  elseif m.short then
    tree:add_proto_expert_info(e.truncated, "The message ends after " .. m.size .. " bytes")
    name = name .. " [truncated]"
  end
  tree:append_text(", " .. name)
  pinfo.cols.info:set(name)
  return true
end

-- Another protocol's bytes: 0, and others may try.
function psweep.dissector(tvb, pinfo, tree) return dissect(tvb, pinfo, tree) and tvb:len() or 0 end

-- On any port: more than the magic, since "PS" begins other things, too.
local function heuristic(tvb, pinfo, tree)
  if tvb:len() < HEADER or tvb(0, 2):uint() ~= MAGIC or tvb(2, 1):uint() ~= VERSION then return false end
  local kind = tvb(3, 1):uint()
  if not type_names[kind] then return false end
  if kind >= REPLY and (tvb(10, 1):uint() > 5 or tvb(11, 1):uint() ~= 0) then return false end
  return dissect(tvb, pinfo, tree)
end
psweep:register_heuristic("udp", heuristic)

local udp_ports = DissectorTable.get("udp.port")
local registered = 0
local function register_port()
  local port = psweep.prefs.port
  if port == registered then return end
  if registered ~= 0 then udp_ports:remove(registered, psweep) end
  if port ~= 0 then udp_ports:add(port, psweep) end
  registered = port
end
psweep.prefs_changed = register_port
register_port()
