-- A dissector for Wireshark and tshark: Dobot Magician, myCobot and ultraArm over TCP, UDP and serial captures.
-- Printed by `dobot-async trace dissector`, which puts in the command tables of the installed version.
--
--   magician   AA AA | Len | ID | Ctrl | Params ... | Checksum
--   mycobot    FE FE | Len | Cmd | Params ... | FA
--   ultraarm   G0 X200 F50 \r                                    lines of text
--
-- Frames may be cut anywhere. Over TCP Wireshark puts them together; elsewhere the rest of a packet waits here for the
-- next one of its way. A direction is known where a port is: what goes to it is a request.

--@TABLES@

local LONGEST = 2048 -- bytes that wait for the rest of a frame, or of a line
local REQUEST, REPLY = "request", "reply"

-- Numbers on the wire, by the letters of Python's struct.
local NUMBERS = {
  B = { 1, "uint" }, b = { 1, "int" }, H = { 2, "uint" }, h = { 2, "int" },
  I = { 4, "uint" }, i = { 4, "int" }, Q = { 8, "uint64" }, q = { 8, "int64" }, f = { 4, "float" },
}

local function size_of(spec)
  local size = 0
  for _, field in ipairs(spec) do
    if field.code == "s" then return nil end
    size = size + NUMBERS[field.code][1]
  end
  return size
end

local function fits(spec, length)
  return spec ~= nil and (size_of(spec) == nil or size_of(spec) == length)
end

-- One field of Wireshark for each parameter of each command, such as dobot_magician.setptpcmd.x
local function value_fields(prefix, tables, into)
  local found = {}
  for _, rows in pairs(tables) do
    for _, row in pairs(rows) do
      for _, role in ipairs({ REQUEST, REPLY }) do
        for _, field in ipairs(row[role] or {}) do
          local name = (prefix .. "." .. row.name .. "." .. field.name):lower():gsub("[^%w%._]", "")
          if not found[name] then
            local kind = ProtoField.double
            if field.code == "s" then kind = ProtoField.string
            elseif field.code == "Q" then kind = ProtoField.uint64
            elseif field.code ~= "f" and not field.scale then kind = ProtoField.int64 end
            found[name] = kind(name, field.name)
            table.insert(into, found[name])
          end
          field.field = found[name]
        end
      end
    end
  end
end

local function number_of(range, code, little)
  local read = NUMBERS[code][2]
  if read == "float" then return little and range:le_float() or range:float() end
  if read == "uint64" then return little and range:le_uint64() or range:uint64() end
  if read == "int64" then return little and range:le_int64() or range:int64() end
  if read == "int" then return little and range:le_int() or range:int() end
  return little and range:le_uint() or range:uint()
end

local function add_values(tree, params, spec, little)
  local at, words = 0, {}
  for _, field in ipairs(spec) do
    local width = field.code == "s" and params:len() - at or NUMBERS[field.code][1]
    if width > 0 and at + width <= params:len() then
      local range = params(at, width)
      local value
      if field.code == "s" then value = range:stringz()
      else
        value = number_of(range, field.code, little)
        if field.scale then value = value / field.scale end
      end
      if type(value) == "number" and field.code ~= "f" and not field.scale then value = Int64(value) end
      tree:add(field.field, range, value)
      table.insert(words, field.name .. " " .. tostring(value))
    end
    at = at + width
  end
  return table.concat(words, ", ")
end

-- The direction of a packet: by the ports, or by the end of a USB endpoint; nil where nothing tells.
local function direction_of(pinfo, port)
  if port and port > 0 and pinfo.dst_port ~= pinfo.src_port then
    if pinfo.dst_port == port then return REQUEST end
    if pinfo.src_port == port then return REPLY end
  end
  if pinfo.p2p_dir == P2P_DIR_SENT then return REQUEST end
  if pinfo.p2p_dir == P2P_DIR_RECV then return REPLY end
  return nil
end

-- Splits a packet into frames. `cut` returns the length of the frame at an offset, and nothing where it is junk:
--   length, "frame" | length, "junk" | missing bytes or nil, "more"
local function split(proto, waiting, cut, show)
  local prefixes = {} -- what waited before each packet, for it is dissected more than once

  return function(tvb, pinfo, tree, direction)
    local key = tostring(pinfo.src) .. pinfo.src_port .. tostring(pinfo.dst) .. pinfo.dst_port .. (direction or "")
    local own = not (pinfo.can_desegment > 0)
    if own then
      local before = prefixes[pinfo.number .. key]
      if not pinfo.visited then
        before = waiting[key] or ByteArray.new()
        prefixes[pinfo.number .. key] = before
        waiting[key] = nil
      end
      if before and before:len() > 0 then
        local whole = ByteArray.new(before:tohex())
        whole:append(tvb:bytes())
        tvb = whole:tvb("With what came before")
      end
    end

    local at = 0
    while at < tvb:len() do
      local length, kind = cut(tvb, at)
      if kind == "more" then
        if not own then
          pinfo.desegment_offset = at
          pinfo.desegment_len = length or DESEGMENT_ONE_MORE_SEGMENT
        elseif not pinfo.visited and tvb:len() - at <= LONGEST then
          waiting[key] = tvb:bytes(at, tvb:len() - at)
        end
        if own then tree:add(proto, tvb(at), proto.name .. ": the beginning of a frame") end
        return
      end
      if kind == "junk" then tree:add(proto, tvb(at, length), proto.name .. ": no frame"):add_expert_info(PI_MALFORMED, PI_WARN, "these bytes belong to no frame")
      else show(tvb, at, length, pinfo, tree, direction) end
      at = at + length
    end
  end
end

local function told(pinfo, proto, words)
  if tostring(pinfo.cols.protocol) ~= proto.name then
    pinfo.cols.protocol:set(proto.name)
    pinfo.cols.info:set(words)
  else
    pinfo.cols.info:append(" | " .. words)
  end
end

-- The request or the reply of a row that the parameters fit; the direction decides where both do.
local function chosen(row, direction, length)
  local first, second = direction or REQUEST, direction == REPLY and REQUEST or REPLY
  if fits(row[first], length) then return first, direction == nil and fits(row[second], length) and length > 0 end
  if direction == nil and fits(row[second], length) then return second, false end
  return direction, false
end

-- Dobot Magician

local magician = Proto("dobot_magician", "Dobot Magician")
local m = {
  length = ProtoField.uint8("dobot_magician.length", "Len"),
  id = ProtoField.uint8("dobot_magician.id", "ID"),
  command = ProtoField.string("dobot_magician.command", "Command"),
  section = ProtoField.string("dobot_magician.section", "Section of the manual"),
  role = ProtoField.string("dobot_magician.role", "Role"),
  write = ProtoField.bool("dobot_magician.write", "Write"),
  queued = ProtoField.bool("dobot_magician.queued", "Queued"),
  index = ProtoField.uint64("dobot_magician.index", "Index in the queue"),
  params = ProtoField.bytes("dobot_magician.params", "Params"),
  checksum = ProtoField.uint8("dobot_magician.checksum", "Checksum", base.HEX),
}
local fields = {}
for _, field in pairs(m) do table.insert(fields, field) end
value_fields("dobot_magician", { MAGICIAN }, fields)
magician.fields = fields
magician.prefs.port = Pref.uint("Port of the arm", 8899, "What goes to this port is a request")

local function magician_cut(tvb, at)
  local left = tvb:len() - at
  if tvb(at, 1):uint() ~= 0xAA or (left > 1 and tvb(at + 1, 1):uint() ~= 0xAA) then
    local junk = 1
    while junk < left and not (tvb(at + junk, 1):uint() == 0xAA and (junk + 1 == left or tvb(at + junk + 1, 1):uint() == 0xAA)) do
      junk = junk + 1
    end
    return junk, "junk"
  end
  if left < 3 then return nil, "more" end
  local length = tvb(at + 2, 1):uint()
  if length < 2 or length > 250 or length == 0xAA then return 1, "junk" end
  if left < length + 4 then return length + 4 - left, "more" end
  local sum = 0
  for place = 3, length + 3 do sum = sum + tvb(at + place, 1):uint() end
  if sum % 256 ~= 0 then return 1, "junk" end
  return length + 4, "frame"
end

local function magician_show(tvb, at, length, pinfo, tree, direction)
  local id, ctrl = tvb(at + 3, 1):uint(), tvb(at + 4, 1):uint()
  local write, queued = ctrl % 2, math.floor(ctrl / 2) % 2
  local row = MAGICIAN[id * 2 + write] or MAGICIAN[id * 2 + 1 - write]
  local name = row and row.name or string.format("ID %d", id)
  local sub = tree:add(magician, tvb(at, length), "Dobot Magician: " .. name)
  sub:add(m.length, tvb(at + 2, 1))
  sub:add(m.id, tvb(at + 3, 1))
  sub:add(m.command, tvb(at + 3, 1), name)
  sub:add(m.write, tvb(at + 4, 1), write == 1)
  sub:add(m.queued, tvb(at + 4, 1), queued == 1)
  local words = ""
  if length > 6 then
    local params = tvb(at + 5, length - 6)
    sub:add(m.params, params)
    if row and not (queued == 1 and params:len() == 8 and direction ~= REQUEST) then
      local role, either = chosen(row, direction, params:len())
      if role then sub:add(m.role, either and "request or reply" or role):set_generated() end
      if role and fits(row[role], params:len()) then words = add_values(sub, params, row[role], true) end
    elseif row then
      sub:add(m.role, REPLY):set_generated()
      sub:add_le(m.index, params)
      words = "index " .. tostring(params:le_uint64())
    end
  elseif direction then
    sub:add(m.role, direction):set_generated()
  end
  if row then sub:add(m.section, row.section):set_generated() end
  sub:add(m.checksum, tvb(at + length - 1, 1))
  told(pinfo, magician, words == "" and name or name .. " " .. words)
end

local magician_split = split(magician, {}, magician_cut, magician_show)
local function dissect_magician(tvb, pinfo, tree)
  magician_split(tvb, pinfo, tree, direction_of(pinfo, magician.prefs.port))
end
magician.dissector = dissect_magician

-- myCobot, myArm, mechArm, myPalletizer

local mycobot = Proto("elephant_mycobot", "myCobot")
local c = {
  length = ProtoField.uint8("elephant_mycobot.length", "Len"),
  id = ProtoField.uint8("elephant_mycobot.id", "Cmd", base.HEX),
  command = ProtoField.string("elephant_mycobot.command", "Command"),
  role = ProtoField.string("elephant_mycobot.role", "Role"),
  params = ProtoField.bytes("elephant_mycobot.params", "Params"),
}
fields = {}
for _, field in pairs(c) do table.insert(fields, field) end
value_fields("elephant_mycobot", MYCOBOT, fields)
mycobot.fields = fields
mycobot.prefs.port = Pref.uint("Port of the arm", 9000, "What goes to this port is a request")
mycobot.prefs.model = Pref.enum("Model", 1, "Which arm it is: some commands have another ID there", MODELS, false)

local function cobot_rows()
  return MYCOBOT[MODELS[mycobot.prefs.model][2]]
end

local function mycobot_cut(tvb, at)
  local left = tvb:len() - at
  if tvb(at, 1):uint() ~= 0xFE or (left > 1 and tvb(at + 1, 1):uint() ~= 0xFE) then return 1, "junk" end
  if left < 3 then return nil, "more" end
  local length = tvb(at + 2, 1):uint()
  if length < 2 or length > 30 then return 1, "junk" end
  if left < length + 3 then return length + 3 - left, "more" end
  if tvb(at + length + 2, 1):uint() ~= 0xFA then return 1, "junk" end
  return length + 3, "frame"
end

local function mycobot_show(tvb, at, length, pinfo, tree, direction)
  local id = tvb(at + 3, 1):uint()
  local row = cobot_rows()[id]
  local name = row and row.name or string.format("Cmd 0x%02X", id)
  local sub = tree:add(mycobot, tvb(at, length), "myCobot: " .. name)
  sub:add(c.length, tvb(at + 2, 1))
  sub:add(c.id, tvb(at + 3, 1))
  sub:add(c.command, tvb(at + 3, 1), name)
  local words, role = "", direction
  if length > 5 then
    local params = tvb(at + 4, length - 5)
    sub:add(c.params, params)
    if row then
      role = chosen(row, direction, params:len())
      if role and fits(row[role], params:len()) then words = add_values(sub, params, row[role], false) end
    end
  end
  if role then sub:add(c.role, role):set_generated() end
  told(pinfo, mycobot, words == "" and name or name .. " " .. words)
end

local mycobot_split = split(mycobot, {}, mycobot_cut, mycobot_show)
local function dissect_mycobot(tvb, pinfo, tree)
  mycobot_split(tvb, pinfo, tree, direction_of(pinfo, mycobot.prefs.port))
end
mycobot.dissector = dissect_mycobot

-- ultraArm

local ultraarm = Proto("elephant_ultraarm", "ultraArm")
local u = {
  line = ProtoField.string("elephant_ultraarm.line", "Line"),
  command = ProtoField.string("elephant_ultraarm.command", "Command"),
  section = ProtoField.string("elephant_ultraarm.section", "Section of the manual"),
  reply = ProtoField.string("elephant_ultraarm.reply", "Reply"),
  values = ProtoField.string("elephant_ultraarm.values", "Values"),
}
ultraarm.fields = { u.line, u.command, u.section, u.reply, u.values }

local function ultraarm_cut(tvb, at)
  for place = at, tvb:len() - 1 do
    local byte = tvb(place, 1):uint()
    if byte == 10 or byte == 13 then
      while place + 1 < tvb:len() and (tvb(place + 1, 1):uint() == 10 or tvb(place + 1, 1):uint() == 13) do place = place + 1 end
      return place + 1 - at, "frame"
    end
  end
  return nil, "more"
end

local function ultraarm_show(tvb, at, length, pinfo, tree)
  local line = tvb(at, length):string():gsub("[\r\n]+$", "")
  if line == "" then return end
  local sub = tree:add(ultraarm, tvb(at, length), "ultraArm: " .. line)
  sub:add(u.line, tvb(at, length), line)
  local word = line:upper():gsub("%s", ""):match("^([GM]%d+)")
  if word and ULTRAARM[word] then
    sub:add(u.command, word):set_generated()
    sub:add(u.section, ULTRAARM[word]):set_generated()
  else
    local name, values = line:match("([%a ]+)%[([^%]]*)%]")
    if name then
      sub:add(u.reply, (name:gsub("^ +", ""))):set_generated()
      sub:add(u.values, values):set_generated()
    else
      sub:add(u.reply, line):set_generated()
    end
  end
  told(pinfo, ultraarm, line)
end

local ultraarm_split = split(ultraarm, {}, ultraarm_cut, ultraarm_show)
local function dissect_ultraarm(tvb, pinfo, tree)
  ultraarm_split(tvb, pinfo, tree, nil)
end
ultraarm.dissector = dissect_ultraarm

-- Where they are looked for. USB and other serial captures, and TCP, are recognised by a whole frame at the beginning.

-- What was recognised between two ends stays recognised, for USB has no conversations as TCP and UDP have.
local function between(pinfo)
  local one, other = tostring(pinfo.src) .. pinfo.src_port, tostring(pinfo.dst) .. pinfo.dst_port
  if one < other then one, other = other, one end
  return one .. " " .. other
end

local function recognised(proto, dissect, looks)
  local known = {}
  return function(tvb, pinfo, tree)
    local ends = between(pinfo)
    if tvb:len() == 0 or not (known[ends] or looks(tvb)) then return false end
    known[ends] = true
    pinfo.conversation = proto
    dissect(tvb, pinfo, tree) -- not through the Proto, which could not wait for the next segment
    return true
  end
end

local function whole(cut)
  return function(tvb)
    local _, kind = cut(tvb, 0)
    return kind == "frame"
  end
end

local function text_looks(tvb)
  local text = tvb(0, math.min(tvb:len(), 256)):string()
  return text:find("^[GM]%d[%w%.%- ]*\r") ~= nil or text:find("^ok\r\n") ~= nil or text:find("^[%a :]+%[[%d%.,%- ]*%]") ~= nil
end

for _, where in ipairs({ "tcp", "udp", "usb.bulk" }) do
  magician:register_heuristic(where, recognised(magician, dissect_magician, whole(magician_cut)))
  mycobot:register_heuristic(where, recognised(mycobot, dissect_mycobot, whole(mycobot_cut)))
  ultraarm:register_heuristic(where, recognised(ultraarm, dissect_ultraarm, text_looks))
end

DissectorTable.get("udp.port"):add(8899, magician)
for number, proto in ipairs({ magician, mycobot, ultraarm }) do
  DissectorTable.get("tcp.port"):add_for_decode_as(proto)
  DissectorTable.get("udp.port"):add_for_decode_as(proto)
  DissectorTable.get("wtap_encap"):add(wtap.USER0 + number - 1, proto) -- text2pcap -l 147, 148, 149
end
