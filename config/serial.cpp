// SPDX-License-Identifier: Apache-2.0
#include "config/serial.h"

#include <algorithm>

#include "config/checks/serial_checks.h"
#include "config/point_values.h"
#include "gateway/base/leading_zero.h"
#include "gateway/base/spelling.h"
#include "gateway/base/text.h"

namespace baudgate::config {
namespace {

constexpr int kSlowestBaud = 300;
constexpr int kFastestBaud = 921'600;
constexpr int kMostRetries = 10;

/// Empty: the port's own is none, and the gateway makes it.
using MapParity = std::optional<Parity>;
constexpr MapParity kSoftware;
constexpr std::array<Word<MapParity>, 11> kParities = {{{"none", Parity::none},
                                                        {"even", Parity::even},
                                                        {"odd", Parity::odd},
                                                        {"mark", Parity::mark},
                                                        {"space", Parity::space},
                                                        {"N", Parity::none},
                                                        {"E", Parity::even},
                                                        {"O", Parity::odd},
                                                        {"M", Parity::mark},
                                                        {"S", Parity::space},
                                                        {"software", kSoftware}}};
constexpr std::array<Word<bool>, 2> kWhoMakesParity = {{{"hardware", false}, {"software", true}}};

Rs485 ReadRs485(const YamlNode& node, Rs485 rs485, Problems& problems) {
  MapReader map(node, "rs485", problems);
  rs485.enabled = true;
  Assign(rs485.enabled, map.Flag("enabled"));
  Assign(rs485.delay_before_send, map.Time("delay_before_send", 0ms, 1s));
  Assign(rs485.delay_after_send, map.Time("delay_after_send", 0ms, 1s));
  Assign(rs485.rts_active_high, map.Flag("rts_active_high"));
  Assign(rs485.receive_while_sending, map.Flag("receive_while_sending"));
  map.Finish();
  CheckRs485(rs485, map.keys(), problems);
  return rs485;
}

void ReadParity(MapReader& map, SerialSettings& serial) {
  Assign(serial.software_parity, map.Flag("software_parity"));
  const auto parity = map.OneOf("parity", kParities);
  if (!parity) return;
  if (*parity) serial.parity = **parity;
  if (!*parity) serial.software_parity = true;
}

Timing ReadTiming(const YamlNode& node, Problems& problems) {
  Timing timing;
  MapReader map(node, "timing", problems);
  // Only the quiet time may be nothing: a waiting time of 0 would mean "never" or "for ever".
  timing.quiet = map.Time("quiet", 0ms, 1min);
  timing.reply = map.Time("reply", 1ms, 10min);
  timing.gap = map.Time("gap", 1ms, 1min);
  timing.ceiling = map.Time("ceiling", 1ms, 10min);
  timing.drain = map.Time("drain", 1ms, 1min);
  map.Finish();
  CheckTiming(timing, map.MarkOf("ceiling"), problems);
  return timing;
}

}  // namespace

Result<SerialSettings> ParseSerial(std::string_view text, SerialSettings base) {
  const Error error{Quoted(text) + " is not speed and character form; write for example 9600 8N1"};
  const std::string_view trimmed = Trim(text);
  const auto blank = trimmed.find(' ');
  if (blank == std::string_view::npos) return error;
  if (const std::string why = WhyLeadingZero(trimmed.substr(0, blank)); !why.empty()) {
    return Error{Quoted(text) + ": its speed " + why};
  }
  const auto baud = ParseInteger<int>(trimmed.substr(0, blank));
  const std::string_view form = Trim(trimmed.substr(blank));
  if (!baud || form.size() != 3) return error;
  const auto parity = ParityOf(form[1]);
  const bool known_data = form[0] == '7' || form[0] == '8';
  const bool known_stop = form[2] == '1' || form[2] == '2';
  if (!parity || !known_data || !known_stop) return error;
  if (*baud < kSlowestBaud || *baud > kFastestBaud) {
    return Error{std::to_string(*baud) + " baud is out of range; allowed: 300…921600"};
  }
  base.baud = *baud;
  base.data_bits = form[0] - '0';
  base.parity = *parity;
  base.stop_bits = form[2] - '0';
  return base;
}

SerialSettings ReadSerial(const YamlNode& node, const SerialSettings& base, Problems& problems) {
  SerialSettings serial = base;
  if (node.kind() == YamlNode::Kind::scalar) {
    const auto parsed = ParseSerial(node.text(), base);
    if (parsed) return *parsed;
    problems.Error(node.mark(), "serial: " + parsed.error());
    return serial;
  }
  MapReader map(node, "serial", problems);
  Assign(serial.baud, map.Integer("baud", kSlowestBaud, kFastestBaud));
  Assign(serial.data_bits, map.Integer("data", 7, 8));
  Assign(serial.stop_bits, map.Integer("stop", 1, 2));
  ReadParity(map, serial);
  Assign(serial.rtscts, map.Flag("rtscts"));
  Assign(serial.xonxoff, map.Flag("xonxoff"));
  Assign(serial.low_latency, map.Flag("low_latency"));
  if (const auto rs485 = map.Get("rs485")) serial.rs485 = ReadRs485(*rs485, serial.rs485, problems);
  map.Finish();
  CheckSoftwareParity(serial, map.MarkOf("parity"), problems);
  CheckFlowControl(serial, map.keys(), problems);
  return serial;
}

void ReadSerialExtras(MapReader& line, SerialSettings& serial) {
  const auto node = line.Get("parity");
  const auto given = std::find_if(kParities.begin(), kParities.end(), [&](const auto& known) {
    return node && node->kind() == YamlNode::Kind::scalar && node->text() == known.word &&
           known.meaning != kSoftware;
  });
  if (given != kParities.end()) {
    SerialSettings meant = serial;
    meant.parity = *given->meaning;
    line.problems().Error(node->mark(),
                          "parity: " + Quoted(node->text()) +
                              " belongs to the serial settings; write for example "
                              "serial: " +
                              meant.ToString() +
                              " (this key says who makes the parity: hardware or software)");
  } else if (const auto software = line.OneOf("parity", kWhoMakesParity)) {
    serial.software_parity = *software;
    CheckSoftwareParity(serial, line.MarkOf("parity"), line.problems());
  }
  if (const auto rs485 = line.Get("rs485")) {
    serial.rs485 = ReadRs485(*rs485, serial.rs485, line.problems());
  }
}

Pace ReadPace(MapReader& map, Level level) {
  Pace pace;
  pace.poll = map.Time("poll", kShortestPoll, 24h);
  pace.slow = map.Time("slow", kShortestPoll, 24h);
  pace.daily = map.Time("daily", 1min, std::chrono::hours(24 * 7));
  pace.retries = map.Integer("retries", 0, kMostRetries);
  pace.recheck = ReadRecheck(map);
  if (const auto timing = map.Get("timing")) pace.timing = ReadTiming(*timing, map.problems());
  pace.timing.from.fill(level);
  return pace;
}

}  // namespace baudgate::config
