// SPDX-License-Identifier: Apache-2.0
#include "gateway/status/hypothesis_words.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "gateway/base/shown.h"
#include "gateway/status/hypotheses.h"
#include "gateway/status/words.h"

namespace baudgate::control {
namespace {

using enum Symptom;

/// A suggested time is so much longer than what was seen.
constexpr double kMargin = 1.25;
/// Failures in a row, on the average, from which they are outages and no single losses.
constexpr double kOutage = 2.5;
constexpr const char* kRaw = "set it to raw (no XON/XOFF, no Telnet, no change of line ends)";

/// A time for the configuration, in round numbers: "150ms".
std::string Suggest(Duration seen) {
  const double ms = kMargin * std::chrono::duration<double, std::milli>(seen).count();
  const double step = ms < 100 ? 10 : ms < 1000 ? 50 : 500;
  const auto round = static_cast<std::int64_t>(step * std::ceil(ms / step + 0.01));
  return fmt::format("{}ms", round);
}

/// What is not proven right by a neighbour or by its own past.
std::string Unproven(const Evidence& evidence) {
  const DeviceRecord& record = evidence.first();
  if (evidence.device == nullptr) {
    if (!OnWire(evidence)) return "check what they share: the server at " + evidence.line->port;
    return "check what they share: port, power of the bus, wiring (A and B swapped?)" +
           (evidence.answered ? "" : ", bit rate and parity (" + SerialOf(record).ToString() + ")");
  }
  if (!OnWire(evidence)) {
    return "check its power, its unit (" + record.device->address + ") and what is behind " +
           evidence.line->port;
  }
  if (evidence.answered) return "check its power and its wire";
  if (evidence.healthy.empty()) {
    return "check its power and wiring (A and B swapped?), then address and bit rate (" +
           Settings(record) + ")";
  }
  return "check its power, its wire and its address (" + record.device->address + "); " +
         evidence.healthy + " answers on the same line";
}

/// "; feeder-1 is read well".
std::string BesideHealthy(const Evidence& evidence) {
  return evidence.healthy.empty() ? "" : "; " + evidence.healthy + " is read well";
}

/// Bytes too few or too many.
std::string SayNotTransparent(const Evidence& evidence, const Finding& finding, const char* what) {
  const std::string count =
      finding.expected > 0 ? fmt::format(" ({} where {} belong)", finding.bytes, finding.expected)
                           : std::string();
  return what + count + ": a converter or serial server in between changes what passes; " + kRaw +
         BesideHealthy(evidence);
}

}  // namespace

bool OnWire(const Evidence& evidence) { return SerialOf(evidence.first()).on_wire(); }

std::string LastReason(const Evidence& evidence) { return evidence.first().status.last_reason; }

/// FF is what a character with wrong parity becomes; on a connection it is Telnet's.
unsigned Suspects(const Evidence& evidence) {
  const unsigned all = evidence.device->status.findings.Suspects();
  constexpr unsigned kTelnet = 1U << (std::size(kSpecialBytes) - 1);
  return evidence.line->is_network() ? all : all & ~kTelnet;
}

bool ComesAndGoes(const Evidence& evidence) {
  if (evidence.device == nullptr || !evidence.answered) return false;
  const Findings& findings = evidence.device->status.findings;
  const std::size_t runs = findings.Runs();
  if (2 * evidence.failed > evidence.looked && findings.LongestRun() == evidence.failed)
    return false;
  return runs > 0 && static_cast<double>(evidence.failed) >= kOutage * static_cast<double>(runs);
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
      "reply: {} }} at the device",
      Milliseconds(seen), Milliseconds(reply), Suggest(std::max(seen, reply)));
}

std::string SaySplit(const Evidence& evidence) {
  const Duration gap = evidence.first().status.timing.gap.value_or(Duration{});
  const Duration seen = evidence.Last(split).time;
  return fmt::format(
      "its replies come in pieces, with pauses of up to {} ms, and timing.gap is {} ms: set "
      "timing: {{ gap: {} }} at the device",
      Milliseconds(seen), Milliseconds(gap), Suggest(seen));
}

std::string SayHeadLost(const Evidence&) {
  return "the first byte of its replies is missing: the converter turns round too late; use one "
         "with automatic direction, or raise the answer delay of the device";
}

std::string SayEndLost(const Evidence&) {
  return "the last byte of its replies is missing: a driver lets go of the bus too early; use a "
         "converter with automatic direction";
}

std::string SayTailLost(const Evidence& evidence) {
  const Finding& finding = evidence.Last(tail_lost);
  const std::string of =
      finding.expected > finding.bytes ? fmt::format(" of {}", finding.expected) : std::string();
  return fmt::format(
      "its replies break off ({}{} bytes came last): a serial server with too small a buffer, or a "
      "bad wire; ask for less at once where only long ones do",
      finding.bytes, of);
}

std::string SayBytesLost(const Evidence& evidence) {
  return SayNotTransparent(evidence, evidence.Last(bytes_lost),
                           "bytes are missing inside its replies");
}

std::string SayBytesAdded(const Evidence& evidence) {
  return SayNotTransparent(evidence, evidence.Last(bytes_added), "its replies have bytes too many");
}

std::string SaySpecials(const Evidence& evidence) {
  const unsigned suspects = Suspects(evidence);
  std::string names;
  for (std::size_t i = 0; i < std::size(kSpecialBytes); ++i) {
    if ((suspects & (1U << i)) == 0) continue;
    names += (names.empty() ? "" : " and ") + fmt::format("{:02X}", kSpecialBytes[i]);
  }
  return "replies fail that contain " + names +
         ", and no others: a converter or serial server in between changes such bytes; " + kRaw;
}

std::string SayBadCheck(const Evidence& evidence) {
  return "its replies have the right form and length, and always a wrong check value: it computes "
         "another one (" +
         Settings(evidence.first()) + "), or two devices have its address";
}

std::string SayTooLong(const Evidence& evidence) {
  const Findings& findings = evidence.device->status.findings;
  return fmt::format(
      "it does not answer requests for long replies ({} bytes and more), and answers those for up "
      "to {}: ask for less at once (block, max_items or the like at the device)",
      findings.ShortestSilent(), findings.LongestGood());
}

std::string SayEighthBit(const Evidence& evidence) {
  return "its replies are right once their eighth bit is taken away: it sends 7 data bits with "
         "parity; set serial: to 7E1 or 7O1 (now " +
         SerialOf(evidence.first()).ToString() + ")";
}

std::string SaySevenBits(const Evidence& evidence) {
  return "no character of its replies has its eighth bit: the port or a converter in between has 7 "
         "data bits; set 8 (now " +
         SerialOf(evidence.first()).ToString() + ")";
}

std::string SayText(const Evidence& evidence) {
  return "text comes in place of replies (" + evidence.Last(text).cause +
         "): a modem, a console or a menu is at this port; take it off, or check the port (" +
         evidence.line->port + ")";
}

std::string SayEcho(const Evidence& evidence) {
  if (!OnWire(evidence)) {
    return "only the request itself comes back: another service than a Modbus server is at this "
           "port; check address and port (" +
           evidence.line->port + ")";
  }
  return "only the request itself comes back: the adapter echoes (set echo: strip at the line), "
         "and the device is silent: check its power, its wire and its address (" +
         evidence.first().device->address + ")";
}

std::string SayLateEcho(const Evidence&) {
  return "the gateway's own requests come back late: a converter, modem or serial server in "
         "between echoes; switch its echo off";
}

std::string SaySettings(const Evidence& evidence) {
  const DeviceRecord& record = evidence.first();
  if (evidence.healthy.empty()) {
    return "bytes come, and not one good frame: check bit rate, parity and data bits (" +
           SerialOf(record).ToString() + "), A and B, then the protocol (" +
           record.device->protocol + ")";
  }
  return "its replies cannot be read, and " + evidence.healthy +
         " is understood: two devices have its address (" + record.device->address +
         "), or its bit rate or parity differs (" + SerialOf(record).ToString() + ")";
}

std::string SayNoTcp(const Evidence& evidence) {
  return "what comes is not Modbus TCP: check the port (" + evidence.line->port +
         "); a serial server that passes RTU on needs protocol: modbus_rtu";
}

std::string SayNoise(const Evidence& evidence) {
  const std::string reason = LastReason(evidence);
  const bool plain = reason.starts_with("checksum") || reason.starts_with("syntax");
  const std::string damaged_by = plain ? " (" + reason + ")" : std::string();
  if (!OnWire(evidence)) return "its replies come damaged" + damaged_by + ": look at the server";
  return "its replies come damaged" + damaged_by +
         (evidence.healthy.empty()
              ? ": look for noise, bad termination or a bus without ground"
              : ": noise or a bad wire at its end, or two devices with its address; " +
                    evidence.healthy + " is read well");
}

std::string SayZeros(const Evidence& evidence) {
  return "nothing but 00 or FF comes: check A and B, the bias resistors and who drives the line, "
         "then the bit rate (" +
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
  if (ComesAndGoes(evidence)) {
    return "it is away for some time and comes back: look for restarts, its power and a loose wire";
  }
  if (!OnWire(evidence)) {
    return "single requests get no answer: the server or the network loses them, or it is asked "
           "too fast (raise its poll)";
  }
  return "single requests get no answer: it misses them in noise, or is asked too fast (set "
         "timing: { quiet: 50ms } at the device, or raise its poll)";
}

std::string SaySaid(const Evidence& evidence) {
  if (evidence.Count(odd) > 0 && !evidence.Last(odd).remedy.empty()) {
    return WithRemedy(evidence.Last(odd));
  }
  return LastReason(evidence) +
         ": the server takes the connection and does not answer; is Modbus TCP behind this port, "
         "does it know unit " +
         evidence.first().device->address + "?";
}

std::string SayOdd(const Evidence& evidence) {
  const Finding& finding = evidence.Last(evidence.Count(odd) > 0 ? odd : one_behind);
  return "its replies do not fit their requests (" + Brief(finding) + "): " + RemedyOf(finding);
}

std::string SayOneBehind(const Evidence&) {
  return "its replies answer the request before: a serial server or radio in between is one reply "
         "behind; restart it, switch its cache off, and let one client use it";
}

std::string SayLateOther(const Evidence& evidence) {
  return "late replies of " + evidence.Last(late_other).cause +
         " come in place of its own: what is said there mends both";
}

std::string SayTwoReplies(const Evidence& evidence) {
  return "two different replies come to one request: two devices have its address (" +
         evidence.first().device->address + "); unplug one and give it another";
}

std::string SayOtherReply(const Evidence& evidence) {
  const Finding& finding = evidence.Last(other_reply);
  if (!finding.cause.empty()) return WithRemedy(finding);
  const std::string reason = LastReason(evidence);
  if (reason.find("two different") != std::string::npos) return SayTwoReplies(evidence);
  return "replies come that belong to other requests" +
         (reason.empty() ? "" : " (" + reason + ")") +
         ": another master on the line, or a serial server that answers one request late";
}

std::string Brief(const Finding& finding) {
  return finding.remedy.empty() ? finding.cause : finding.cause.substr(0, finding.cause.find("; "));
}

std::string RemedyOf(const Finding& finding) {
  return finding.remedy.empty() ? "does the profile fit the device, with its options?"
                                : finding.remedy;
}

std::string WithRemedy(const Finding& finding) {
  return finding.remedy.empty() ? finding.cause : Brief(finding) + ": " + finding.remedy;
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

}  // namespace baudgate::control
