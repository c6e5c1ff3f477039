// SPDX-License-Identifier: Apache-2.0
#include "gateway/status/hypotheses.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "gateway/base/shown.h"
#include "gateway/status/words.h"

namespace baudgate::control {
namespace {

using enum Symptom;

/// What a hypothesis leaves unexplained, from which another one is said as well.
constexpr double kUnexplained = 0.3;
/// Below that a cause is not worth a word beside others.
constexpr double kWorthSaying = 0.15;
/// A suggested time is so much longer than what was seen.
constexpr double kMargin = 1.25;

config::SerialSettings SerialOf(const DeviceRecord& record) {
  return record.device->serial.value_or(record.line->serial);
}

bool OnWire(const Evidence& evidence) { return SerialOf(evidence.first()).on_wire(); }

/// A time for the configuration, in round numbers: "150ms".
std::string Suggest(Duration seen) {
  const double ms = kMargin * std::chrono::duration<double, std::milli>(seen).count();
  const double step = ms < 100 ? 10 : ms < 1000 ? 50 : 500;
  const auto round = static_cast<std::int64_t>(step * std::ceil(ms / step + 0.01));
  return fmt::format("{}ms", round);
}

/// "wiring, " and what else is not proven right by a neighbour or by its own past.
std::string Unproven(const Evidence& evidence) {
  const DeviceRecord& record = evidence.first();
  if (evidence.device == nullptr) {
    const std::string shared = "look at what they share: ";
    if (!OnWire(evidence)) return shared + "the server at " + evidence.line->port;
    return shared + "port, power of the bus, wiring (A and B swapped?)" +
           (evidence.answered ? "" : ", bit rate and parity (" + SerialOf(record).ToString() + ")");
  }
  if (!OnWire(evidence)) {
    return "check its power, its unit (" + record.device->address + ") and what is behind " +
           evidence.line->port;
  }
  if (evidence.answered) return "check its power and its wire";
  if (evidence.healthy.empty()) {
    return "check power, wiring (A and B swapped?), address, bit rate and parity (" +
           Settings(record) + ")";
  }
  return "check its power, its address and its wire (" + Settings(record) +
         "); the line is right, " + evidence.healthy + " answers";
}

std::string LastReason(const Evidence& evidence) { return evidence.first().status.last_reason; }

// ---------------------------------------------------------------- support

template <Symptom kSymptom>
double Seen(const Evidence& evidence) {
  return evidence.Share({kSymptom});
}

/// Also beside good replies: one is a fact.
double OtherMaster(const Evidence& evidence) {
  const std::size_t count = evidence.Count(other_master);
  if (count == 0) return 0;
  return std::max(0.5, evidence.Share({other_master, other_device, other_reply, damaged, noise}));
}

/// Where a gap splits replies, a rest that comes alone looks like a lost head or tail.
double InPieces(const Evidence& evidence) {
  return evidence.Count(split) == 0
             ? 0
             : evidence.Share({split, tail_lost, head_lost, damaged, odd, noise});
}

double Late(const Evidence& evidence) {
  if (evidence.Count(late) == 0) return 0;
  return evidence.Share({late, silence, other_reply, odd, head_lost});
}

constexpr std::initializer_list<Symptom> kUnreadable = {noise,     zeros, damaged,    head_lost,
                                                        tail_lost, odd,   eighth_bit, endless};

/// Bytes came, and never a frame.
double WrongSettings(const Evidence& evidence) {
  if (evidence.answered || !OnWire(evidence)) return 0;
  if (evidence.Count({noise, damaged, zeros}) == 0) return 0;
  return 0.9 * evidence.Share(kUnreadable);
}

double NoTcp(const Evidence& evidence) {
  if (evidence.answered || OnWire(evidence)) return 0;
  return 0.9 * evidence.Share({noise, zeros, damaged, head_lost, tail_lost, odd, endless});
}

double Noise(const Evidence& evidence) {
  if (!evidence.answered) return 0;
  return 0.9 * evidence.Share({noise, zeros, damaged, head_lost, tail_lost});
}

double Silent(const Evidence& evidence) { return 0.9 * evidence.Share({silence}); }

double Odd(const Evidence& evidence) {
  return evidence.Count(odd) == 0 || evidence.Last(odd).cause.empty() ? 0 : evidence.Share({odd});
}

bool IsException(const std::string& reason) {
  return reason.find("exception") != std::string::npos;
}

/// A server has said why there is no value, or has gone.
double Said(const Evidence& evidence) {
  if (evidence.Count(odd) > 0 && IsException(evidence.Last(odd).cause))
    return evidence.Share({odd});
  const bool ended = LastReason(evidence).find("connection") != std::string::npos;
  return ended ? 0.95 * evidence.Share({silence}) : 0;
}

// ---------------------------------------------------------------- sentences

template <Symptom kSymptom>
std::string AsFound(const Evidence& evidence) {
  return WithRemedy(evidence.Last(kSymptom));
}

std::string SayOtherDevice(const Evidence& evidence) {
  return WithRemedy(evidence.Last(other_device)) +
         " (configured: " + evidence.first().device->address + ")";
}

std::string SayOtherMaster(const Evidence& evidence) {
  return WithRemedy(evidence.Last(other_master));
}

std::string SayLate(const Evidence& evidence) {
  const Duration reply = evidence.first().status.timing.reply.value_or(Duration{});
  const Duration seen = evidence.Last(late).time;
  return fmt::format(
      "its replies come up to {} ms after the request, and timing.reply is {} ms: set timing: {{ "
      "reply: "
      "{} }} at the device",
      Milliseconds(seen), Milliseconds(reply), Suggest(seen));
}

std::string SaySplit(const Evidence& evidence) {
  const Duration gap = evidence.first().status.timing.gap.value_or(Duration{});
  const Duration seen = evidence.Last(split).time;
  return fmt::format(
      "its replies come in pieces, with pauses of up to {} ms, and timing.gap is {} ms: set "
      "timing: {{ "
      "gap: {} }} at the device; a radio, a serial server or a slow adapter makes such pauses",
      Milliseconds(seen), Milliseconds(gap), Suggest(seen));
}

std::string SayHeadLost(const Evidence& evidence) {
  return "the first byte of its replies is missing: the converter turns from sending to receiving "
         "too late, so use one with automatic direction, or raise the answer delay of the device" +
         std::string(evidence.answered ? "; or noise eats it" : "");
}

std::string SayTailLost(const Evidence& evidence) {
  return fmt::format(
      "its replies break off after {} and nothing follows: a serial server or converter with too "
      "small a buffer, or a bad wire; ask for less at once if long replies fail only",
      Plural(evidence.Last(tail_lost).bytes, "byte"));
}

std::string SayEighthBit(const Evidence& evidence) {
  return "its replies are right once their eighth bit is taken away: it sends 7 data bits with "
         "parity, and the port is open with " +
         SerialOf(evidence.first()).ToString() + ": set serial: to 7E1 or 7O1 with its bit rate";
}

std::string SayText(const Evidence& evidence) {
  return "text comes in place of replies (" + evidence.Last(text).cause +
         "): " + evidence.line->port +
         " leads to a console, a modem or the menu of a serial server, not to the bus; check port:";
}

std::string SayEcho(const Evidence& evidence) {
  return "only the request itself comes back: the adapter or the line echoes (set echo: strip at "
         "the line), and the device is silent: " +
         Unproven(evidence);
}

std::string SaySettings(const Evidence& evidence) {
  const DeviceRecord& record = evidence.first();
  if (evidence.healthy.empty()) {
    return "bytes come, and not one good frame: bit rate, parity or data bits are not those of the "
           "device, or it speaks another protocol (" +
           Settings(record) + ", " + record.device->protocol + ")";
  }
  return "its replies cannot be read, and " + evidence.healthy +
         " is understood: two devices have its address (" + record.device->address +
         "), or its bit rate or parity is another than the line's (" + SerialOf(record).ToString() +
         ")";
}

std::string SayNoTcp(const Evidence& evidence) {
  return "what comes is not Modbus TCP: is it at " + evidence.line->port +
         "? A serial server that passes Modbus RTU on needs protocol: modbus_rtu";
}

std::string SayNoise(const Evidence& evidence) {
  const std::string reason = LastReason(evidence);
  const std::string damaged_by = reason.empty() ? std::string() : " (" + reason + ")";
  if (!OnWire(evidence)) return "its replies come damaged" + damaged_by + ": look at the server";
  return "its replies come damaged" + damaged_by +
         (evidence.healthy.empty() ? ": noise, bad termination or a bus without ground"
                                   : ": noise or a bad wire at its end (" + evidence.healthy +
                                         " is read well), or two devices with its address");
}

std::string SayZeros(const Evidence& evidence) {
  return "nothing but 00 or FF comes: A and B are swapped, a driver holds the line, or bias "
         "resistors are missing (" +
         SerialOf(evidence.first()).ToString() + ")";
}

std::string SayEndless(const Evidence&) {
  return "bytes come without an end: something on the line sends by itself, or a transmitter is "
         "stuck; unplug devices one by one";
}

std::string SaySilent(const Evidence& evidence) {
  if (evidence.absent) {
    return (evidence.answered ? "not a byte comes any more: " : "not a byte came: ") +
           Unproven(evidence);
  }
  return "no answer came: it is off for moments, misses requests in noise, or is asked faster than "
         "it can (raise its poll or timing.quiet)";
}

std::string RemedyOf(const std::string& reason, const Evidence& evidence) {
  const auto says = [&reason](std::string_view text) {
    return reason.find(text) != std::string::npos;
  };
  if (says("exception 0A") || says("exception 0B")) {
    return "the gateway in between works, and the device behind it does not answer: check its "
           "power, its wire and its address (" +
           evidence.first().device->address + ") there";
  }
  if (says("exception 01") || says("exception 02") || says("exception 03")) {
    return "does the profile fit the device, and is the address right?";
  }
  if (says("exception 06")) return "it is busy: raise its poll";
  if (says("connection")) {
    return "the server takes the connection and does not answer: is Modbus TCP behind this port, "
           "is "
           "another client connected, does it know unit " +
           evidence.first().device->address + "?";
  }
  return "does the profile fit the device, and its options?";
}

std::string SaySaid(const Evidence& evidence) {
  const std::string reason =
      evidence.Count(odd) > 0 ? evidence.Last(odd).cause : LastReason(evidence);
  return reason + ": " + RemedyOf(reason, evidence);
}

std::string SayOdd(const Evidence& evidence) {
  const std::string& reason = evidence.Last(odd).cause;
  return "its replies do not fit their requests (" + reason + "): " + RemedyOf(reason, evidence);
}

std::string SayLateOther(const Evidence& evidence) {
  return "late replies of " + evidence.Last(late_other).cause +
         " come in place of its own: what is said there mends both";
}

std::string SayOtherReply(const Evidence& evidence) {
  const Finding& finding = evidence.Last(other_reply);
  if (!finding.cause.empty()) return WithRemedy(finding);
  const std::string reason = LastReason(evidence);
  return "replies come that belong to other requests" +
         (reason.empty() ? "" : " (" + reason + ")") +
         ": another master on the line, two devices with one address, or replies that come too "
         "late; see 'baudgate trace " +
         evidence.line->name + "'";
}

}  // namespace

std::string WithRemedy(const Finding& finding) {
  return finding.remedy.empty() ? finding.cause : finding.cause + ": " + finding.remedy;
}

std::string Settings(const DeviceRecord& record) {
  std::string text = "address " + record.device->address;
  const config::SerialSettings serial = SerialOf(record);
  if (serial.on_wire()) text += ", " + serial.ToString();
  const auto checksum = record.device->options.all().find("checksum");
  if (checksum == record.device->options.all().end()) return text;
  if (const bool* flag = std::get_if<bool>(&checksum->second)) {
    return text + ", checksum " + (*flag ? "on" : "off");
  }
  const auto* word = std::get_if<std::string>(&checksum->second);
  return word == nullptr ? text : text + ", checksum " + *word;
}

const std::vector<Hypothesis>& Hypotheses() {
  // Of two that are supported equally the first is said: what is proven stands before what is
  // likely.
  static const std::vector<Hypothesis> kAll = {
      {"other protocol", Seen<other_protocol>, AsFound<other_protocol>},
      {"other setting", Seen<other_setting>, AsFound<other_setting>},
      {"other master", OtherMaster, SayOtherMaster},
      {"other device", Seen<other_device>, SayOtherDevice},
      {"text", Seen<text>, SayText},
      {"echo", Seen<echo>, SayEcho},
      {"split", InPieces, SaySplit},
      {"late", Late, SayLate},
      {"eighth bit", Seen<eighth_bit>, SayEighthBit},
      {"head lost", Seen<head_lost>, SayHeadLost},
      {"tail lost", Seen<tail_lost>, SayTailLost},
      {"zeros", Seen<zeros>, SayZeros},
      {"endless", Seen<endless>, SayEndless},
      {"late other", Seen<late_other>, SayLateOther},
      {"other reply", Seen<other_reply>, SayOtherReply},
      {"said", Said, SaySaid},
      {"no Modbus TCP", NoTcp, SayNoTcp},
      {"settings", WrongSettings, SaySettings},
      {"noise", Noise, SayNoise},
      {"odd", Odd, SayOdd},
      {"silence", Silent, SaySilent},
  };
  return kAll;
}

std::vector<const Hypothesis*> Judge(const Evidence& evidence) {
  std::vector<std::pair<double, const Hypothesis*>> all;
  for (const Hypothesis& hypothesis : Hypotheses()) {
    const double support = hypothesis.support(evidence);
    if (support >= kWorthSaying) all.emplace_back(support, &hypothesis);
  }
  std::ranges::stable_sort(all, std::ranges::greater{},
                           &std::pair<double, const Hypothesis*>::first);
  std::vector<const Hypothesis*> said;
  if (all.empty()) return said;
  said.push_back(all[0].second);
  const bool more =
      all.size() > 1 && all[0].first <= 1 - kUnexplained && all[1].first >= kUnexplained;
  if (more) said.push_back(all[1].second);
  return said;
}

}  // namespace baudgate::control
