// SPDX-License-Identifier: Apache-2.0
#include "config/checks/line_checks.h"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

namespace baudgate::config {

namespace {

std::size_t ShortestReply(const protocols::Expectation& expect) {
  if (expect.reply == protocols::Expectation::Reply::none) return 0;
  std::size_t shortest = expect.shapes.empty() ? 1 : expect.shapes.front().min_length;
  for (const protocols::Shape& shape : expect.shapes)
    shortest = std::min(shortest, shape.min_length);
  return shortest;
}

}  // namespace

Round RoundOf(Group group, const Line& line, const Device& device,
              const protocols::Protocol& protocol, protocols::Bus* bus) {
  const SerialSettings serial = device.serial.value_or(line.serial);
  const Timing times = TimesInForce(line, device, protocol);
  const auto conversation = MakeConversation(protocol, device, bus);
  const auto queries = conversation->Queries();
  Round round;
  for (std::size_t i = 0; i < queries.size(); ++i) {
    if (queries[i].group != group) continue;
    const auto request =
        conversation->Ask({protocols::Task::Kind::poll, i, protocols::kNoPoint, {}}, Instant{});
    if (!request) continue;
    const std::size_t characters = request->bytes.size() + ShortestReply(request->expect);
    round.time += *times.quiet + static_cast<int>(characters) * serial.CharacterTime();
    ++round.requests;
  }
  return round;
}

Timing TimesInForce(const Line& line, const Device& device, const protocols::Protocol& protocol) {
  const SerialSettings serial = device.serial.value_or(line.serial);
  return Resolve(Merge(device.timing, line.timing), protocol.timing(serial));
}

void CheckTiming(const Timing& timing, const Mark& mark, Problems& problems) {
  if (timing.ceiling && timing.reply && *timing.ceiling < *timing.reply) {
    problems.Error(mark, "timing: ceiling " + FormatDuration(*timing.ceiling) +
                             " is shorter than reply " + FormatDuration(*timing.reply) +
                             "; ceiling limits the whole exchange, so set it to reply or more");
  }
}

void CheckSoftwareParity(const SerialSettings& serial, const Mark& mark, Problems& problems) {
  if (!serial.software_parity) return;
  const bool even_or_odd = serial.parity == Parity::even || serial.parity == Parity::odd;
  if (serial.data_bits == 7 && even_or_odd && serial.stop_bits == 1) return;
  problems.Error(mark, "parity: software parity works with 7E1 or 7O1 only, not with " +
                           serial.ToString().substr(serial.ToString().find(' ') + 1) +
                           "; correct serial, or remove parity: software");
}

void CheckFlowControl(const SerialSettings& serial, const Keys& keys, Problems& problems) {
  if (serial.rtscts && serial.xonxoff) {
    problems.Error(keys.MarkOf("xonxoff"),
                   "xonxoff: a port can use only one flow control; remove xonxoff or rtscts");
  }
  if (serial.rtscts && serial.rs485.enabled) {
    problems.Error(
        keys.MarkOf("rtscts"),
        "rtscts: the driver needs RTS to switch the direction of rs485; remove rtscts or rs485");
  }
}

void CheckRs485(const Rs485& rs485, const Keys& keys, Problems& problems) {
  for (const auto& [key, delay] : {std::pair("delay_before_send", rs485.delay_before_send),
                                   std::pair("delay_after_send", rs485.delay_after_send)}) {
    if (delay % 1ms != Duration::zero()) {
      problems.Error(
          keys.MarkOf(key),
          std::string(key) + ": the driver accepts whole milliseconds only; write for example 2ms");
    }
  }
}

void CheckDataBits(const SerialSettings& serial, const protocols::Protocol& protocol,
                   const Mark& mark, Problems& problems) {
  if (serial.xonxoff && protocol.data_bits == 8) {
    problems.Error(mark, "xonxoff: " + std::string(protocol.name) +
                             " uses all byte values, but XON/XOFF removes 0x11 and 0x13; use "
                             "rtscts, or remove xonxoff");
  }
  if (serial.data_bits >= protocol.data_bits) return;
  SerialSettings wide = serial;
  wide.data_bits = 8;
  problems.Error(mark, "serial: " + std::string(protocol.name) + " needs 8 data bits, but " +
                           serial.ToString() + " has 7; write for example " + wide.ToString());
}

void CheckPortSettings(const std::string& port, const SerialSettings& serial, const Mark& mark,
                       Problems& problems) {
  if (!IsNetworkPort(port)) return;
  for (const auto& [key, used] :
       {std::pair("rs485", serial.rs485.enabled), std::pair("rtscts", serial.rtscts),
        std::pair("xonxoff", serial.xonxoff)}) {
    if (!used) continue;
    problems.Error(mark, std::string(key) +
                             ": the serial server (tcp://) has this setting; set it in the serial "
                             "server and remove the key here");
  }
}

void CheckTcp(const protocols::Protocol& protocol, const std::string& port, const Keys& keys,
              Problems& problems) {
  if (!protocol.tcp) return;
  const std::string name(protocol.name);
  if (!port.empty() && !IsNetworkPort(port)) {
    const std::string other(protocol.profiles_of);
    problems.Error(keys.MarkOf(keys.Has("port") ? "port" : "protocol"),
                   "port: " + port + " is a serial port, but " + name +
                       " runs over TCP; write port: tcp://host:502" +
                       (other.empty() ? "" : ", or protocol: " + other + " for a serial line"));
  }
  for (const char* const key : {"serial", "parity", "rs485", "echo"}) {
    if (!keys.Has(key)) continue;
    problems.Error(keys.MarkOf(key),
                   std::string(key) + ": " + name + " has no serial line; remove the key");
  }
}

void CheckPortServer(const PortServer& server, const std::string& key, Problems& problems) {
  if (server.on_loopback()) return;
  if (server.allow.empty()) {
    problems.Error(server.mark,
                   key + ": " + server.Address() +
                       " can be reached from other machines; list the clients that may connect, "
                       "for example allow: [10.0.0.7], or listen on 127.0.0.1");
  } else if (!std::ranges::all_of(server.allow, IsLoopback)) {
    problems.Warning(server.mark, key + ": clients that `allow` admits at " + server.Address() +
                                      " can send anything to the devices; `write: deny`, limits "
                                      "and interlocks do not apply to them (docs/security.md)");
  }
}

void CheckPortServers(const Line& line, const Keys& keys, Problems& problems) {
  if (line.lend && line.serial_server) {
    problems.Error(
        keys.MarkOf("lend"),
        "lend: serial_server already serves this port all the time; remove lend or serial_server");
  }
  if (!line.serial_server) return;
  if (keys.Has("devices")) {
    problems.Error(keys.MarkOf("serial_server"),
                   "serial_server: the gateway polls the devices of this line; use lend instead, "
                   "or remove the devices");
  }
  for (const char* const key :
       {"protocol", "timing", "retries", "poll", "slow", "daily", "recheck", "echo", "ask"}) {
    if (!keys.Has(key)) continue;
    problems.Warning(keys.MarkOf(key), std::string(key) +
                                           ": has no effect, because the gateway polls no devices "
                                           "at a port with serial_server; remove the key");
  }
}

namespace {

// USB adapters and serial servers hold bytes back for up to 16 ms, so shorter times fail.
constexpr Duration kShortestWait = 20ms;

using Messages = std::vector<std::string>;

/// Checks the times that are configured, not those of the protocol, which are known to work.
Messages TimingMessages(const Timing& given, const Timing& fallback, const SerialSettings& serial) {
  Messages messages;
  const auto add = [&](std::string text) { messages.push_back("timing: " + std::move(text)); };
  const auto late = [&](std::string_view key, std::optional<Duration> time) {
    if (!time || *time >= kShortestWait) return;
    add(std::string(key) + " " + FormatDuration(*time) +
        " is too short: USB adapters and serial servers can delay bytes by 16ms, so good replies "
        "would be lost; write 20ms or more");
  };
  late("reply", given.reply);
  late("gap", given.gap);
  const Duration three = 3 * serial.CharacterTime();
  if (given.gap && *given.gap >= kShortestWait && *given.gap < three) {
    add("gap " + FormatDuration(*given.gap) + " is shorter than three characters at " +
        serial.ToString() + ": good replies would be cut in two; remove gap, or write " +
        FormatDuration(std::chrono::ceil<std::chrono::milliseconds>(three)) + " or more");
  }
  const Timing used = Resolve(given, fallback);
  if (given.ceiling && *given.ceiling < *used.ceiling) {
    add("ceiling " + FormatDuration(*given.ceiling) + " is shorter than reply " +
        FormatDuration(*used.reply) + " and gap " + FormatDuration(*used.gap) +
        " together, so the gateway uses " + FormatDuration(*used.ceiling) +
        "; set ceiling to this or more");
  }
  if (given.drain && *used.drain < *used.gap) {
    add("drain " + FormatDuration(*used.drain) + " is shorter than gap " +
        FormatDuration(*used.gap) +
        ": the rest of a broken reply may disturb the next request; set drain to gap or more");
  }
  return messages;
}

SerialSettings SerialOf(const Line& line, const Device& device) {
  return device.serial.value_or(line.serial);
}

/// Reports problems of a device's times. A problem of the line's times is reported once for the
/// line, not again for each device.
void CheckTimes(const Line& line, const Catalog& catalog, Problems& problems) {
  Messages known;
  if (const protocols::Protocol* own = catalog.FindProtocol(line.protocol)) {
    known = TimingMessages(line.timing, own->timing(line.serial), line.serial);
  }
  for (const std::string& message : known) {
    problems.Warning(line.mark, "line '" + line.name + "': " + message);
  }
  for (const Device& device : line.devices) {
    const protocols::Protocol* protocol = catalog.FindProtocol(device.protocol);
    if (!protocol) continue;
    const SerialSettings serial = SerialOf(line, device);
    for (const std::string& message :
         TimingMessages(Merge(device.timing, line.timing), protocol->timing(serial), serial)) {
      if (std::find(known.begin(), known.end(), message) != known.end()) continue;
      problems.Warning(device.mark, "device '" + device.name + "': " + message);
    }
  }
}

std::string InMilliseconds(Duration time) {
  return FormatDuration(std::chrono::ceil<std::chrono::milliseconds>(time));
}

std::vector<Group> PolledGroups(const Device& device) {
  std::vector<Group> groups = {Group::fast, Group::slow, Group::daily};
  for (std::size_t i = 0; i < device.intervals.size(); ++i) groups.push_back(OwnGroup(i));
  return groups;
}

/// Warns of more polls than the line has time for. The computed load is a minimum, because real
/// devices do not reply at once.
void CheckLoad(const Line& line, const Catalog& catalog, Problems& problems) {
  std::map<const protocols::Protocol*, std::unique_ptr<protocols::Bus>> buses;
  double fast = 0;
  double slow = 0;
  bool told = false;
  for (const Device& device : line.devices) {
    const protocols::Protocol* protocol = catalog.FindProtocol(device.protocol);
    if (!protocol || !device.enabled) continue;
    auto& bus = buses[protocol];
    if (!bus) bus = MakeBus(*protocol);
    for (const Group group : PolledGroups(device)) {
      const Duration period = PeriodOf(device, group);
      const Round round = RoundOf(group, line, device, *protocol, bus.get());
      (group >= Group::fast ? fast : slow) +=
          static_cast<double>(round.time.count()) / static_cast<double>(period.count());
      if (round.time <= period) continue;
      told = true;
      problems.Warning(device.mark,
                       "device '" + device.name +
                           "': " + (group >= Group::fast ? "poll" : std::string(Name(group))) +
                           " " + FormatDuration(period) + " is too short for one poll of its " +
                           std::string(Name(group)) + " points at " +
                           SerialOf(line, device).ToString() +
                           " (requests: " + std::to_string(round.requests) + ", time: at least " +
                           InMilliseconds(round.time) +
                           "): polls will be late; poll less often, or read fewer points");
    }
  }
  if (told || fast + slow <= 1) return;
  problems.Warning(line.mark, "line '" + line.name + "': polling needs at least " +
                                  std::to_string(std::lround((fast + slow) * 100)) +
                                  " % of the line's time, so polls will be late; lengthen " +
                                  (slow > fast ? "slow, or read fewer points"
                                               : "poll, or move points to the group slow"));
}

/// True if the reply to the device's probe cannot be a reply to another request, or if the
/// conversation has no request for a probe.
bool HasProof(const Device& device, const protocols::Protocol& protocol, protocols::Bus* bus) {
  const auto conversation = MakeConversation(protocol, device, bus);
  const auto probe =
      conversation->Ask({protocols::Task::Kind::probe, 0, protocols::kNoPoint, {}}, Instant{});
  return !probe || probe->is_proof();
}

void CheckOrder(const Line& line, const Catalog& catalog, Problems& problems) {
  std::map<const protocols::Protocol*, std::unique_ptr<protocols::Bus>> buses;
  for (const Device& device : line.devices) {
    const protocols::Protocol* protocol = catalog.FindProtocol(device.protocol);
    if (!protocol || !device.enabled || device.trust_order) continue;
    auto& bus = buses[protocol];
    if (!bus) bus = MakeBus(*protocol);
    if (HasProof(device, *protocol, bus.get())) continue;
    problems.Warning(
        device.mark,
        "device '" + device.name +
            "': its replies do not show which request they answer, so after a lost reply the "
            "gateway sends extra requests to find out; " +
            (device.options.Has("identify") ? "set identify: true if the device can send its name, "
                                            : "add an identity to its profile, ") +
            "or set trust_order: true if no serial server or radio can delay replies");
  }
}

}  // namespace

void CheckLine(const Line& line, const Catalog& catalog, Problems& problems) {
  CheckTimes(line, catalog, problems);
  CheckLoad(line, catalog, problems);
  CheckOrder(line, catalog, problems);
}

}  // namespace baudgate::config
