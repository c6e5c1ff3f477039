// SPDX-License-Identifier: Apache-2.0
#include "gateway/status/hypothesis_words.h"

#include <fmt/format.h>

#include <algorithm>

#include "gateway/base/shown.h"
#include "gateway/status/connection_words.h"
#include "gateway/status/hypotheses.h"
#include "gateway/status/reason.h"
#include "gateway/status/words.h"

namespace baudgate::control {
namespace {

using enum Symptom;

/// A driver that lets go too early costs no more.
constexpr std::size_t kFewLost = 4;
/// Of a wrong check value that may be computed in any way.
constexpr std::string_view kText = "a text";
constexpr const char* kSetRaw =
    "set the converter or serial server to raw (no XON/XOFF, no Telnet)";

bool IsNearlyAll(std::size_t count, const Evidence& evidence) {
  return 10 * count >= 9 * evidence.failed;
}

/// Each request is answered well at other times: most points have had a value.
bool IsNowAndThen(const Evidence& evidence) {
  if (evidence.device == nullptr) return false;
  if (2 * (evidence.looked - evidence.failed) < evidence.failed) return false;
  const DeviceRecord& record = *evidence.device;
  const auto had = std::ranges::count_if(
      record.points, [](const PointRecord& point) { return HasValue(point.value); });
  const bool most = 2 * had >= std::ssize(record.points) && had > 0;
  return most && std::ranges::none_of(record.status.queries, [](const QueryCount& query) {
           return query.in_vain >= kNeverByChance;
         });
}

/// The replies to one request never fit.
bool OneNeverFits(const Evidence& evidence) {
  return std::ranges::any_of(evidence.device->status.queries, [](const QueryCount& query) {
    return query.in_vain >= kNeverAnswered && query.symptom == odd;
  });
}

/// " ('+02.51')": what the reason quotes.
std::string QuotedIn(const Finding& finding) {
  const std::string text = Brief(finding);
  const std::size_t begin = text.find('\'');
  const std::size_t end = text.rfind('\'');
  if (begin == std::string::npos || end == begin) return {};
  return " (" + text.substr(begin, end + 1 - begin) + ")";
}

/// What came is a whole reply, and answers a request for more or less.
bool IsOtherLength(const Evidence& evidence, const Finding& finding) {
  return finding.remedy.empty() && evidence.traits().register_reply.each > 0;
}

/// "11 and 13".
std::string NamesOf(unsigned specials) {
  std::string names;
  for (std::size_t i = 0; i < std::size(kSpecialBytes); ++i) {
    if ((specials & (1U << i)) == 0) continue;
    names += (names.empty() ? "" : " and ") + fmt::format("{:02X}", kSpecialBytes[i]);
  }
  return names;
}

std::string Service(const Evidence& evidence) { return std::string(evidence.traits().service); }

/// As many as its longest whole reply has.
std::size_t RegistersGiven(const Evidence& evidence) {
  const config::Traits::RegisterReply& reply = evidence.traits().register_reply;
  const std::size_t good = evidence.device->status.findings.lengths().longest_good();
  return std::max<std::size_t>(1, (good - std::min(good, reply.around)) / reply.each);
}

}  // namespace

bool IsDamageAsMisfit(const Evidence& evidence) {
  const DeviceRecord& record = evidence.first();
  const config::Traits& traits = evidence.traits();
  if (!traits.is_unchecked || !traits.is_unchecked(record.device->options)) return false;
  const std::string quoted = QuotedIn(evidence.Last(odd));
  const bool strange = quoted.find_first_of(traits.never_in_reply, 3) < quoted.size() - 2;
  return IsNowAndThen(evidence) || (evidence.answered && quoted.size() > 5 && strange);
}

bool IsComputedOtherwise(const Evidence& evidence) {
  const Finding* const check = evidence.first().status.findings.Check();
  const bool fits = check != nullptr && check->cause != kText;
  return fits && 2 * evidence.Count(bad_check) > evidence.failed;
}

bool OnWire(const Evidence& evidence) { return SerialOf(evidence.first()).on_wire(); }

bool IsBehindServer(const Evidence& evidence) { return evidence.line->is_network(); }

/// FF is what a character with wrong parity becomes; on a connection it is Telnet's.
unsigned Suspects(const Evidence& evidence) {
  const unsigned all = evidence.device->status.findings.specials().Suspects();
  constexpr unsigned kTelnet = 1U << (std::size(kSpecialBytes) - 1);
  return evidence.line->is_network() ? all : all & ~kTelnet;
}

std::string SayOtherDevice(const Evidence& evidence) {
  return WithRemedy(evidence.Last(evidence.Count(other_device) > 0 ? other_device : one_behind)) +
         " (configured: " + evidence.first().device->address + ")";
}

std::string SayOtherMaster(const Evidence& evidence) {
  if (evidence.Count({other_master, master_beside}) == 0) return WithRemedy(*evidence.master);
  return WithRemedy(evidence.Last(evidence.Count(other_master) > 0 ? other_master : master_beside));
}

std::string SayHeadLost(const Evidence& evidence) {
  const std::string& how = evidence.Last(head_lost).cause;
  const bool several = !how.empty() && how != kGarbled;
  if (several && evidence.answered && !evidence.alike.empty() && !evidence.line->is_network()) {
    return "the first bytes of its replies are missing, as those of its neighbours: another "
           "program reads the port (baudgate ports), or a converter switches too late";
  }
  return std::string(how == kGarbled ? "the first byte of its replies comes garbled"
                     : how.empty()   ? "the first byte of its replies is missing"
                                     : "the first bytes of its replies are missing") +
         ": use a converter with automatic direction, or raise the answer delay of the device";
}

std::string SayEndLost(const Evidence& evidence) {
  if (evidence.Last(end_lost).cause == kGarbled && evidence.answered) {
    return "the last byte of its replies comes garbled: a driver lets go of the bus too early (use "
           "one with automatic direction), or its replies come damaged: noise, a bad wire";
  }
  if (evidence.Last(end_lost).cause == kGarbled) {
    return "the last byte of its replies comes garbled: it computes another check value, or a "
           "driver lets go of the bus too early (use a converter with automatic direction)";
  }
  if (evidence.line->is_network() && evidence.healthy.empty()) {
    return "the last byte of its replies is missing: the serial server takes it for a delimiter: "
           "set its port to raw, without delimiters";
  }
  return "the last byte of its replies is missing: a driver lets go of the bus too early; use a "
         "converter with automatic direction";
}

std::string SayTailLost(const Evidence& evidence) {
  const Finding& finding = evidence.Last(tail_lost);
  if (!finding.cause.empty() && !finding.remedy.empty()) {
    const bool never = !evidence.answered && IsNearlyAll(evidence.Count(tail_lost), evidence);
    return never ? "its replies carry no check value: " + finding.remedy
                 : "its replies break off before their check value: a driver lets go of the bus "
                   "too early; use a converter with automatic direction";
  }
  if (!finding.cause.empty()) {
    return "its replies break off before their line end, the last byte or two: a converter takes "
           "it out (set it to raw), or a driver lets go of the bus too early";
  }
  const std::string of =
      finding.expected > finding.bytes ? fmt::format(" of {}", finding.expected) : std::string();
  const bool few = finding.expected > finding.bytes && OnWire(evidence) &&
                   finding.expected <= finding.bytes + kFewLost;
  // What others share with it is not the cause.
  if (few && !evidence.healthy.empty() && !evidence.line->is_network()) {
    return fmt::format(
        "its replies break off ({}{} bytes came): its driver lets go of the bus too "
        "early, or {}",
        finding.bytes, of, TwoDevices(*evidence.first().device));
  }
  // Of a text nobody knows how long it should be.
  const bool end = few || (finding.expected == 0 && !evidence.line->is_network());
  return fmt::format("its replies break off ({}{} bytes came): {}", finding.bytes, of,
                     end ? "a driver lets go of the bus too early, or the buffer of a converter is "
                           "too small"
                         : "the buffer of a serial server or converter is too small, or a wire is "
                           "bad");
}

std::string SayBytesLost(const Evidence& evidence) {
  const Finding& finding = evidence.Last(bytes_lost);
  if (evidence.first().status.unasked) {
    // Such a length may be wrong in the configuration, where none was ever right.
    if (!evidence.answered && !finding.remedy.empty()) return WithRemedy(finding);
    return "characters are missing in some of its messages: a bad wire or plug, a buffer that runs "
           "over, or flow control at one end alone";
  }
  if (!evidence.healthy.empty()) {
    return "bytes are missing inside its replies: a bad wire, plug or fibre at its end, or a "
           "converter there loses them (set it to raw)";
  }
  return "bytes are missing inside its replies: a converter takes them out (set it to raw) or is "
         "overrun (replace it)";
}

std::string SayBytesAdded(const Evidence& evidence) {
  const Finding& finding = evidence.Last(bytes_added);
  const bool known = finding.expected > 0 && finding.bytes > finding.expected;
  return "its replies have bytes too many" +
         (known ? fmt::format(" ({}, not {})", finding.bytes, finding.expected) : std::string()) +
         (evidence.healthy.empty() ? ": "
                                   : ": two devices have its address and answer at once; or ") +
         kSetRaw;
}

std::string SaySpecials(const Evidence& evidence) {
  return "replies fail that contain " + NamesOf(Suspects(evidence)) + ", and no others: " + kSetRaw;
}

std::string SayEatenRequests(const Evidence& evidence) {
  return "requests fail that contain " + NamesOf(evidence.eaten) +
         ", and no others: switch XON/XOFF off at the converter or serial server";
}

std::string SayBadCheck(const Evidence& evidence) {
  if (const Finding* const check = evidence.first().status.findings.Check()) {
    const bool fits = check->cause != kText;
    return fits ? WithRemedy(*check) : "its check value is computed otherwise: " + check->remedy;
  }
  if (evidence.first().status.unasked) {
    return "its messages have a wrong check value: something in between changes them, as a "
           "multiplexer, or noise";
  }
  const std::string cause = "its replies have a wrong check value";
  // A converter would lose bytes of its neighbours as well.
  if (!evidence.healthy.empty() && !evidence.answered &&
      IsNearlyAll(evidence.Count(bad_check), evidence)) {
    const std::string check = CheckOf(evidence.first());
    return cause + (check.empty() ? "" : " (" + check.substr(2) + ")") +
           ": it computes another one (see its manual and options), or two devices have its "
           "address";
  }
  if (!evidence.Last(bad_check).cause.empty()) {
    return cause +
           ": two devices have its address, it computes another one, or a converter loses bytes "
           "(use raw)";
  }
  const std::string check = CheckOf(evidence.first());
  return cause + (check.empty() ? "" : " (" + check.substr(2) + ")") +
         ": two devices have its address, or it computes another one";
}

std::string SayTooLong(const Evidence& evidence) {
  const Findings& findings = evidence.device->status.findings;
  return fmt::format(
      "it does not answer requests for long replies ({} bytes; up to {} are fine): ask for less at "
      "once (block, max_items)",
      findings.lengths().silent().shortest, findings.lengths().longest_good());
}

std::string SayLongDamaged(const Evidence& evidence) {
  const Findings& findings = evidence.device->status.findings;
  return fmt::format(
      "long replies come damaged ({} bytes; up to {} are fine): ask for less at once (block, "
      "max_items): a buffer is small",
      findings.lengths().damaged().shortest, findings.lengths().longest_good());
}

std::string SayText(const Evidence& evidence) {
  const std::string& remedy = evidence.Last(text).remedy;
  const bool unasked = evidence.first().status.unasked;
  return std::string("text comes in place of ") + (unasked ? "messages (" : "replies (") +
         Brief(evidence.Last(text)) + "): " +
         (remedy.empty() ? "a modem, console or menu: disconnect it, or check the port" : remedy);
}

std::string SayEcho(const Evidence& evidence) {
  if (!OnWire(evidence)) {
    return "only the request itself comes back: another service than " + Service(evidence) +
           " is there; check address and port";
  }
  return "only the request itself comes back: set echo: strip at the line, then check power, wire "
         "and address (" +
         evidence.first().device->address + ") of the device";
}

std::string SayLateEcho(const Evidence& evidence) {
  if (!evidence.Last(late_echo).cause.empty()) {
    return "the end of each request comes back in front of the reply: the adapter hears itself; "
           "switch its echo off, or use one with automatic direction";
  }
  return "the gateway's own requests come back late: a converter, modem or serial server in "
         "between echoes; switch its echo off";
}

std::string SayNoise(const Evidence& evidence) {
  if (evidence.first().status.unasked) {
    return "they come damaged: noise or a bad wire, or its profile or options describe another "
           "format";
  }
  const std::string cause = "its replies come damaged";
  if (!OnWire(evidence)) return cause + ": look at the server";
  const std::string& others = evidence.away.empty() ? evidence.losing : evidence.away;
  if (!others.empty()) {
    return cause +
           (evidence.shared_period
                ? " every " + FormatAge(*evidence.shared_period) + ", as those of "
                : " at the same times as those of ") +
           others +
           ": a bad contact or noise in what they share: check cable, termination and ground";
  }
  // What two devices have in common is no address.
  const std::string noise = "noise on the line";
  const std::string remedy = "check termination, ground and shield";
  if (!evidence.alike.empty() || evidence.noisy) return cause + ": " + noise + ": " + remedy;
  // A new device that was left at the address of another one is missing at its own.
  if (!evidence.missing.empty()) {
    return cause + ": " + evidence.missing + ", which never answers, may have its address (" +
           evidence.first().device->address + ") as well: unplug one; or " + noise + " (" + remedy +
           ")";
  }
  // No noise damages nearly all, and none of a neighbour.
  if (!evidence.healthy.empty() && 5 * evidence.failed >= 4 * evidence.looked) {
    return cause + ": " + TwoDevices(*evidence.first().device) + ", or a bad wire at its end";
  }
  return cause +
         (evidence.healthy.empty()
              ? ": " + noise + " (" + remedy + "), or " + TwoDevices(*evidence.first().device)
              : ": a bad wire or plug at its end, or " + TwoDevices(*evidence.first().device));
}

std::string SayEndless(const Evidence&) {
  return "bytes come without an end: something on the line sends by itself, or a transmitter is "
         "stuck; unplug devices one by one";
}

std::string SaySaid(const Evidence& evidence) {
  if (evidence.Count(odd) > 0 && !evidence.Last(odd).remedy.empty()) {
    return WithRemedy(evidence.Last(odd));
  }
  if (evidence.answered) {
    return "the server closes the connection behind some requests: " +
           WhyEnded(*evidence.status, evidence.now - 1h, true);
  }
  if (evidence.Count(silence) > 0 && OnWire(evidence)) {
    return "the server closes the connection behind the request: set its port to raw TCP, and "
           "check the protocol (" +
           evidence.first().device->protocol + ")";
  }
  return "the server closes the connection behind the request: is " + Service(evidence) +
         " behind this port, does it know unit " + evidence.first().device->address + "?";
}

std::string SayOdd(const Evidence& evidence) {
  const Finding& finding = evidence.Last(evidence.Count(odd) > 0 ? odd : one_behind);
  if (IsDamageAsMisfit(evidence)) {
    return "some replies are damaged" + QuotedIn(finding) +
           ": noise on the line, or a converter loses characters: check termination and ground, "
           "and "
           "switch its checksum on";
  }
  if (IsNowAndThen(evidence) && !OneNeverFits(evidence) && IsOtherLength(evidence, finding)) {
    return "some replies belong to other requests (" + Brief(finding) +
           "): another client of the server, or another master";
  }
  if (IsOtherLength(evidence, finding) && finding.bytes < finding.expected) {
    return fmt::format(
        "it gives fewer registers than are asked for ({}): set block: {} at the device",
        Brief(finding), RegistersGiven(evidence));
  }
  const bool fitted = evidence.changed && finding.remedy.empty();
  return "its replies do not fit (" + Brief(finding) +
         "): " + (fitted ? kHasWorked : RemedyOf(finding));
}

std::string SayOneBehind(const Evidence&) {
  return "its replies answer the request before: restart the serial server or radio in between, "
         "and switch its cache off";
}

std::string SaySameAgain(const Evidence& evidence) {
  const std::string& text = evidence.Last(same_again).cause;
  if (!text.empty()) {
    return "the same reply comes whatever is asked (" + text +
           "): end its local or other mode, or restart it";
  }
  return std::string("the same reply comes whatever is asked: restart the ") +
         (IsBehindServer(evidence)
              ? "serial server or gateway in between (switch its cache off), or "
                "the device"
              : "device, or a radio or gateway in between (switch its cache "
                "off)");
}

std::string SayLateOther(const Evidence& evidence) {
  return "late replies of " + evidence.Last(late_other).cause +
         " come in place of its own: what is said there mends both";
}

std::string SayTwoReplies(const Evidence& evidence) {
  return "two different replies come to one request: " + TwoDevices(*evidence.first().device) +
         ", or " + AnotherAsksIt(IsBehindServer(evidence));
}

std::string SayOtherReply(const Evidence& evidence) {
  const Finding& finding = evidence.Last(other_reply);
  if (!finding.cause.empty()) return WithRemedy(finding);
  const std::string& reason = evidence.first().status.last_reason;
  return "replies come that belong to other requests" +
         (reason.empty() ? "" : " (" + reason + ")") +
         ": another master on the line, or a serial server that answers one request late";
}

}  // namespace baudgate::control
