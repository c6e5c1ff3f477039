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
/// Failures in a row from which an outage is no single loss.
constexpr std::uint32_t kLongRun = 4;
/// A suggested time is so much longer than what was seen.
constexpr double kMargin = 1.25;
/// Once may be chance.
constexpr std::size_t kFacts = 2;

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

/// One noise on a line without checksums may look like a request.
double OtherMaster(const Evidence& evidence) {
  if (evidence.Count({other_master, master_beside}) < kFacts) return 0;
  return std::max(0.5, evidence.Share({other_master, other_device, other_reply, damaged, noise}));
}

double OtherDevice(const Evidence& evidence) {
  return evidence.Count(other_device) < kFacts ? 0 : evidence.Share({other_device});
}

/// Where a gap splits replies, a rest that comes alone looks like a lost head or tail.
double InPieces(const Evidence& evidence) {
  return evidence.Count(split) == 0 ? 0
                                    : evidence.Share({split, tail_lost, head_lost, end_lost,
                                                      bytes_lost, bad_check, damaged, odd, noise});
}

double Late(const Evidence& evidence) {
  if (evidence.Count(late) == 0) return 0;
  return evidence.Share({late, silence, other_reply, odd, head_lost});
}

constexpr std::initializer_list<Symptom> kUnreadable = {
    noise,      zeros,       damaged,   head_lost, tail_lost,  end_lost,
    bytes_lost, bytes_added, bad_check, odd,       eighth_bit, endless};

/// Bytes came, and never a frame.
double WrongSettings(const Evidence& evidence) {
  if (evidence.answered || !OnWire(evidence)) return 0;
  if (evidence.Count({noise, damaged, zeros}) == 0) return 0;
  return 0.9 * evidence.Share(kUnreadable);
}

double NoTcp(const Evidence& evidence) {
  if (evidence.answered || OnWire(evidence)) return 0;
  return 0.9 * evidence.Share({noise, zeros, damaged, head_lost, tail_lost, end_lost, bytes_lost,
                               bytes_added, bad_check, odd, endless});
}

double Noise(const Evidence& evidence) {
  if (!evidence.answered) return 0;
  return 0.9 * evidence.Share({noise, zeros, damaged, head_lost, tail_lost, end_lost, bytes_lost,
                               bytes_added, bad_check});
}

/// All that failed had a byte which converters change, and nothing good had.
double NotTransparent(const Evidence& evidence) {
  if (evidence.device == nullptr || !evidence.answered) return 0;
  if (evidence.failed < kFacts || evidence.device->status.findings.Suspects() == 0) return 0;
  return evidence.Share({damaged, noise, bad_check, bytes_lost, bytes_added, tail_lost});
}

double BadCheck(const Evidence& evidence) {
  return evidence.answered ? 0 : evidence.Share({bad_check});
}

/// Where single ones are lost in noise, others are damaged.
template <Symptom kSymptom>
double Always(const Evidence& evidence) {
  const double share = evidence.Share({kSymptom});
  return evidence.answered && share < 0.6 ? 0 : share;
}

double Silent(const Evidence& evidence) { return 0.9 * evidence.Share({silence}); }

/// All requests for short replies are answered, and none for long ones.
double TooLong(const Evidence& evidence) {
  if (evidence.device == nullptr) return 0;
  const Findings& findings = evidence.device->status.findings;
  const bool split =
      findings.LongestGood() > 0 && findings.ShortestSilent() > findings.LongestGood();
  return split && findings.SilentLong() >= kFacts ? evidence.Share({silence}) : 0;
}

double Odd(const Evidence& evidence) {
  return evidence.Count(odd) == 0 || evidence.Last(odd).cause.empty() ? 0 : evidence.Share({odd});
}

bool IsException(const std::string& reason) {
  return reason.find("exception") != std::string::npos;
}

/// A server has said why there is no value, or has gone.
double Said(const Evidence& evidence) {
  if (evidence.Count(odd) > 0 && IsException(evidence.Last(odd).cause)) {
    return evidence.Share({odd});
  }
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
  return WithRemedy(evidence.Last(evidence.Count(other_master) > 0 ? other_master : master_beside));
}

std::string SayLate(const Evidence& evidence) {
  const Duration reply = evidence.first().status.timing.reply.value_or(Duration{});
  const Duration seen = evidence.Last(late).time;
  return fmt::format(
      "its replies come up to {} ms after the request, and timing.reply is {} ms: set timing: {{ "
      "reply: "
      "{} }} at the device",
      Milliseconds(seen), Milliseconds(reply), Suggest(std::max(seen, reply)));
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

std::string SayHeadLost(const Evidence&) {
  return "the first byte of its replies is missing: the converter turns from sending to receiving "
         "too late, so use one with automatic direction, or raise the answer delay of the device";
}

std::string SayEndLost(const Evidence&) {
  return "the last byte of its replies is missing: a converter, or the driver of the device, lets "
         "go "
         "of the bus too early; use a converter with automatic direction";
}

std::string SayTailLost(const Evidence& evidence) {
  const Finding& finding = evidence.Last(tail_lost);
  const std::string of =
      finding.expected > finding.bytes ? fmt::format(" of {}", finding.expected) : std::string();
  return fmt::format(
      "its replies break off ({}{} came last) and nothing follows: a serial server or converter "
      "with too small a buffer, or a bad wire; ask for less at once if only long replies fail",
      finding.bytes, of.empty() ? " bytes" : of + " bytes");
}

/// Bytes too few or too many.
std::string SayNotTransparent(const Evidence& evidence, const Finding& finding, const char* what) {
  const std::string count =
      finding.expected > 0 ? fmt::format(" ({} where {} belong)", finding.bytes, finding.expected)
                           : std::string();
  return what + count +
         ": a converter or serial server in between changes what passes; set it to raw (no "
         "XON/XOFF, "
         "no Telnet, no change of line ends), or use another one" +
         (evidence.healthy.empty() ? "" : "; " + evidence.healthy + " is read well");
}

std::string SayBytesLost(const Evidence& evidence) {
  return SayNotTransparent(evidence, evidence.Last(bytes_lost),
                           "bytes are missing inside its replies");
}

std::string SayBytesAdded(const Evidence& evidence) {
  return SayNotTransparent(evidence, evidence.Last(bytes_added), "its replies have bytes too many");
}

std::string SaySpecials(const Evidence& evidence) {
  const std::uint8_t suspects = evidence.device->status.findings.Suspects();
  std::string names;
  for (std::size_t i = 0; i < std::size(kSpecialBytes); ++i) {
    if ((suspects & (1U << i)) == 0) continue;
    names += (names.empty() ? "" : " and ") + fmt::format("{:02X}", kSpecialBytes[i]);
  }
  return "replies fail that contain " + names +
         ", and no others: a converter or serial server in between changes such bytes; set it to "
         "raw "
         "(no XON/XOFF, no Telnet, no change of line ends)";
}

std::string SayBadCheck(const Evidence& evidence) {
  return "its replies have the right form and length, and their check value is always wrong: it "
         "computes another one (" +
         Settings(evidence.first()) + "), or two devices with its address answer together";
}

std::string SayTooLong(const Evidence& evidence) {
  const Findings& findings = evidence.device->status.findings;
  return fmt::format(
      "it does not answer requests for long replies ({} bytes and more), and answers those for up "
      "to "
      "{}: ask for less at once (block, max_items or the like at the device)",
      findings.ShortestSilent(), findings.LongestGood());
}

std::string SayEighthBit(const Evidence& evidence) {
  return "its replies are right once their eighth bit is taken away: it sends 7 data bits with "
         "parity, and the port is open with " +
         SerialOf(evidence.first()).ToString() + ": set serial: to 7E1 or 7O1 with its bit rate";
}

std::string SayText(const Evidence& evidence) {
  return "text comes in place of replies (" + evidence.Last(text).cause +
         "): " + evidence.line->port +
         " leads to a console, a modem, another service or the menu of a serial server, not to the "
         "bus; check the port";
}

std::string SayEcho(const Evidence& evidence) {
  return "only the request itself comes back: the adapter or the line echoes (set echo: strip at "
         "the line), and the device is silent: " +
         Unproven(evidence);
}

std::string SayLateEcho(const Evidence&) {
  return "the gateway's own requests come back late: a converter, a modem or a serial server in "
         "between echoes; switch its echo off";
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
  const bool in_runs = evidence.minutes.outages > 0 &&
                       evidence.minutes.failed >= kLongRun * evidence.minutes.outages;
  if (in_runs) {
    return "it is away for some time and comes back: look for restarts, its power and a loose wire";
  }
  return "single requests get no answer: it misses them in noise, or is asked faster than it can "
         "(set timing: { quiet: 50ms } at the device, or raise its poll)";
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
  if (reason.find("two different") != std::string::npos) {
    return "two different replies come to one request: two devices have its address (" +
           evidence.first().device->address + "); unplug one";
  }
  return "replies come that belong to other requests" +
         (reason.empty() ? "" : " (" + reason + ")") +
         ": another master on the line, or a serial server that answers one request late; see "
         "'baudgate trace " +
         evidence.line->name + "'";
}

}  // namespace

std::string RemedyOf(const std::string& reason, const Evidence& evidence) {
  const auto says = [&reason](std::string_view text) {
    return reason.find(text) != std::string::npos;
  };
  if (says("exception 0A") || says("exception 0B")) {
    return "the gateway in between works, and the device behind it does not answer: check its "
           "power, its wire and its address (" +
           evidence.first().device->address + ") there";
  }
  if (says("exception 04") || says("exception 08")) {
    return "the device reports a fault of its own: look at it, restart or replace it";
  }
  if (says("exception 05") || says("exception 06")) return "raise its poll";
  if (says("exception")) return "does the profile fit the device, and is the address right?";
  if (says("echo")) return "set echo: off at the line if the bus does not echo";
  if (says("connection")) {
    return "the server takes the connection and does not answer: is Modbus TCP behind this port, "
           "is "
           "another client connected, does it know unit " +
           evidence.first().device->address + "?";
  }
  return "does the profile fit the device, with its options?";
}

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
      {"other device", OtherDevice, SayOtherDevice},
      {"text", Seen<text>, SayText},
      {"echo", Seen<echo>, SayEcho},
      {"late echo", Seen<late_echo>, SayLateEcho},
      {"not transparent", NotTransparent, SaySpecials},
      {"split", InPieces, SaySplit},
      {"late", Late, SayLate},
      {"eighth bit", Seen<eighth_bit>, SayEighthBit},
      {"head lost", Seen<head_lost>, SayHeadLost},
      {"end lost", Always<end_lost>, SayEndLost},
      {"tail lost", Always<tail_lost>, SayTailLost},
      {"bytes lost", Always<bytes_lost>, SayBytesLost},
      {"bytes added", Always<bytes_added>, SayBytesAdded},
      {"bad check", BadCheck, SayBadCheck},
      {"zeros", Seen<zeros>, SayZeros},
      {"endless", Seen<endless>, SayEndless},
      {"late other", Seen<late_other>, SayLateOther},
      {"other reply", Seen<other_reply>, SayOtherReply},
      {"too long", TooLong, SayTooLong},
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
