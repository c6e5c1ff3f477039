// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "gateway/base/shown.h"
#include "gateway/diagnosis/causes/diagnose_parts.h"
#include "gateway/diagnosis/causes/hypotheses.h"
#include "gateway/diagnosis/causes/words.h"

namespace baudgate::control {
namespace {

using enum Symptom;

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

bool OnWire(const Evidence& evidence) { return SerialOf(evidence.first()).on_wire(); }

bool IsBehindServer(const Evidence& evidence) { return evidence.line->is_network(); }

std::string SayOtherDevice(const Evidence& evidence) {
  return WithRemedy(evidence.Last(evidence.Count(other_device) > 0 ? other_device : one_behind)) +
         " (configured: " + evidence.first().device->address + ")";
}

std::string SayOtherMaster(const Evidence& evidence) {
  if (evidence.Count({other_master, master_beside}) == 0) return WithRemedy(*evidence.master);
  return WithRemedy(evidence.Last(evidence.Count(other_master) > 0 ? other_master : master_beside));
}

std::string SayText(const Evidence& evidence) {
  const std::string& remedy = evidence.Last(text).remedy;
  const bool unasked = evidence.first().status.unasked;
  return std::string("text comes in place of ") + (unasked ? "messages (" : "replies (") +
         Brief(evidence.Last(text)) + "): " +
         (remedy.empty() ? "a modem, console or menu: disconnect it, or check the port" : remedy);
}

std::string SayRestarts(const Evidence& evidence) {
  return "it restarts: text (" + evidence.Words().cause +
         ") comes after silence: look at its power supply and its firmware (watchdog)";
}

std::string SayEcho(const Evidence& evidence) {
  if (!OnWire(evidence)) {
    return "only the request itself comes back: another service than " + Service(evidence) +
           " is there; check address and port";
  }
  return "only the request itself comes back: set echo: strip in the configuration, then check "
         "power, wire "
         "and address (" +
         evidence.first().device->address + ") of the device";
}

std::string SayLateEcho(const Evidence& evidence) {
  if (!evidence.Last(late_echo).cause.empty()) {
    return kHearsItself;
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
        "it gives fewer registers than are asked for ({}): set block: {} in the configuration",
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
