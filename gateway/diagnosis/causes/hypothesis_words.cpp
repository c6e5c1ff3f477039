// The sentences of the hypotheses (hypotheses.h), except those about damaged replies
// (damage_words.cpp).
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>

#include "gateway/base/shown.h"
#include "gateway/base/system_trouble.h"
#include "gateway/diagnosis/causes/diagnose.h"
#include "gateway/diagnosis/causes/evidence.h"
#include "gateway/diagnosis/causes/hypotheses.h"
#include "gateway/diagnosis/causes/words.h"

namespace baudgate::diagnosis {
namespace {

using enum Symptom;

/// True if every request is answered now and then: most points have had a value, at least a third
/// of the exchanges were answered, and no poll always fails.
bool IsNowAndThen(const Evidence& evidence) {
  if (evidence.device == nullptr) return false;
  if (2 * (evidence.looked - evidence.failed) < evidence.failed) return false;
  const bus::DeviceRecord& record = *evidence.device;
  const auto had = std::ranges::count_if(
      record.points, [](const bus::PointRecord& point) { return HasValue(point.value); });
  const bool most = 2 * had >= std::ssize(record.points) && had > 0;
  return most && std::ranges::none_of(record.status.queries, [](const bus::QueryCount& query) {
           return query.in_vain >= kNeverByChance;
         });
}

bool OneNeverFits(const Evidence& evidence) {
  return std::ranges::any_of(evidence.device->status.queries, [](const bus::QueryCount& query) {
    return query.in_vain >= kNeverAnswered && query.symptom == odd;
  });
}

/// Returns the quotation in the cause of the finding, such as " ('+02.51')".
std::string QuotedIn(const Finding& finding) {
  const std::string text = Brief(finding);
  const std::size_t begin = text.find('\'');
  const std::size_t end = text.rfind('\'');
  if (begin == std::string::npos || end == begin) return {};
  return " (" + text.substr(begin, end + 1 - begin) + ")";
}

/// True if the reply is complete but answers a request for more or fewer registers.
bool IsOtherLength(const Evidence& evidence, const Finding& finding) {
  return finding.remedy.empty() && evidence.traits().register_reply.each > 0;
}

std::string Service(const Evidence& evidence) { return std::string(evidence.traits().service); }

/// Returns the number of registers in a complete reply of `bytes` bytes.
std::size_t RegistersIn(const Evidence& evidence, std::size_t bytes) {
  const config::Traits::RegisterReply& reply = evidence.traits().register_reply;
  return (bytes - std::min(bytes, reply.around)) / reply.each;
}

std::string SayFewerRegisters(const Evidence& evidence, const Finding& finding) {
  const std::size_t good = evidence.device->status.findings.lengths().longest_good();
  const std::size_t block = std::max<std::size_t>(1, RegistersIn(evidence, good));
  return fmt::format(
      "it gives fewer registers than requested ({}). Set block: {} in the configuration{}",
      Brief(finding), block, block == 1 ? ", or update its firmware" : "");
}

}  // namespace

bool IsDamageAsMisfit(const Evidence& evidence) {
  const bus::DeviceRecord& record = evidence.first();
  const config::Traits& traits = evidence.traits();
  if (!traits.is_unchecked || !traits.is_unchecked(record.device->options)) return false;
  const std::string quoted = QuotedIn(evidence.Last(odd));
  const bool strange = quoted.find_first_of(traits.never_in_reply, 3) < quoted.size() - 2;
  return IsNowAndThen(evidence) || (evidence.answered && quoted.size() > 5 && strange);
}

bool OnWire(const Evidence& evidence) { return SerialOf(evidence.first()).on_wire(); }

bool IsBehindServer(const Evidence& evidence) { return evidence.line->is_network(); }

std::string SayOtherDevice(const Evidence& evidence) {
  return WithRemedy(evidence.Last(evidence.Count(other_device) > 0 ? other_device : one_behind));
}

std::string SayOtherMaster(const Evidence& evidence) {
  if (evidence.Count({other_master, master_beside}) == 0) return WithRemedy(*evidence.master);
  return WithRemedy(evidence.Last(evidence.Count(other_master) > 0 ? other_master : master_beside));
}

std::string SayText(const Evidence& evidence) {
  const std::string& remedy = evidence.Last(text).remedy;
  const bool unasked = evidence.first().status.unasked;
  return std::string("text comes in place of ") + (unasked ? "messages (" : "replies (") +
         Brief(evidence.Last(text)) + ")" +
         NextSentence(remedy.empty()
                          ? "disconnect the modem or console that sends the text, or check the port"
                          : remedy);
}

std::string SayRestarts(const Evidence& evidence) {
  return "it restarts: a text (" + evidence.Words().cause +
         ") comes after a silence. Check its power supply and its firmware (watchdog)";
}

std::string SayEcho(const Evidence& evidence) {
  if (!OnWire(evidence)) {
    return "only the request itself comes back, so the server is not " + Service(evidence) +
           ". Check address and port of the server";
  }
  return "only the request itself comes back. Set 'echo: strip' at the line in the configuration, "
         "then check power, wire and address (" +
         evidence.first().device->address + ") of the device";
}

std::string SayLateEcho(const Evidence& evidence) {
  if (!evidence.Last(late_echo).cause.empty()) {
    return kHearsItself;
  }
  return "the gateway's own requests come back late. Switch the echo off at the converter, modem "
         "or serial server in between";
}

std::string SayNoise(const Evidence& evidence) {
  if (evidence.first().status.unasked) {
    return "they come damaged. Check for noise and a bad wire, and whether its profile and options "
           "describe its format";
  }
  const std::string cause = "its replies come damaged";
  if (!OnWire(evidence)) return cause + ". Check the server";
  const std::string& others = evidence.away.empty() ? evidence.losing : evidence.away;
  if (!others.empty()) {
    return cause +
           (evidence.shared_period
                ? " every " + FormatAge(*evidence.shared_period) + ", like those of "
                : " at the same times as those of ") +
           others + ". Check what these devices share: contacts, cable, termination and ground";
  }
  const std::string noise = "check termination, ground and shield against noise";
  // If several devices have the trouble, a shared address is not the cause.
  if (!evidence.alike.empty() || evidence.noisy) return cause + NextSentence(noise);
  // A new device that still has the address of another device does not answer at its own address.
  if (!evidence.missing.empty()) {
    return cause + ". Check whether " + evidence.missing + ", which never answers, has address " +
           evidence.first().device->address + " as well, and " + noise;
  }
  const std::string address = CheckAddress(*evidence.first().device);
  // Noise does not damage nearly all replies of one device and none of a neighbour.
  if (!evidence.healthy.empty() && 5 * evidence.failed >= 4 * evidence.looked) {
    return cause + NextSentence(address) + ", and check the wire at its end";
  }
  return cause + NextSentence(evidence.healthy.empty() ? noise : "check wire and plug at its end") +
         ", and " + address;
}

std::string SayEndless(const Evidence&) {
  return "bytes come without an end. A device sends unasked, or a transmitter is stuck: unplug the "
         "devices one by one";
}

std::string SaySaid(const Evidence& evidence) {
  if (evidence.Count(odd) > 0 && !evidence.Last(odd).remedy.empty()) {
    return WithRemedy(evidence.Last(odd));
  }
  if (evidence.answered) {
    return "the server closes the connection after some requests" +
           NextSentence(WhyEnded(*evidence.status, evidence.now - 1h, true));
  }
  if (evidence.Count(silence) > 0 && OnWire(evidence)) {
    return "the server closes the connection after the request. Set its port to raw TCP, and "
           "check the protocol (" +
           evidence.first().device->protocol + ")";
  }
  return "the server closes the connection after the request. Check that its port is for " +
         Service(evidence) + ", and that it serves unit " + evidence.first().device->address;
}

std::string SayOdd(const Evidence& evidence) {
  const Finding& finding = evidence.Last(evidence.Count(odd) > 0 ? odd : one_behind);
  if (IsDamageAsMisfit(evidence)) {
    return "some replies are damaged" + QuotedIn(finding) +
           " by noise or by a converter that loses characters. Check termination and ground, and "
           "switch a checksum on at the device and in the configuration";
  }
  if (IsNowAndThen(evidence) && !OneNeverFits(evidence) && IsOtherLength(evidence, finding)) {
    return "some replies belong to other requests (" + Brief(finding) +
           "). Look for another client of the server, or another master";
  }
  if (IsOtherLength(evidence, finding) && finding.bytes < finding.expected &&
      RegistersIn(evidence, finding.bytes) > 0) {
    return SayFewerRegisters(evidence, finding);
  }
  const bool fitted = evidence.changed && finding.remedy.empty();
  return "its replies do not fit the requests (" + Brief(finding) + ")" +
         NextSentence(fitted ? kHasWorked : RemedyOf(finding));
}

std::string SayOneBehind(const Evidence&) {
  return "its replies answer the previous request. Restart the serial server or radio in between, "
         "and switch its cache off";
}

std::string SaySameAgain(const Evidence& evidence) {
  const std::string& text = evidence.Last(same_again).cause;
  if (!text.empty()) {
    return "it answers every request with the same reply (" + text +
           "). End its local, test or programming mode, or restart it";
  }
  return std::string("it answers every request with the same reply. Restart the ") +
         (IsBehindServer(evidence)
              ? "serial server or gateway in between (switch its cache off), or the device"
              : "device, or a radio or gateway in between (switch its cache off)");
}

std::string SayLateOther(const Evidence& evidence) {
  return "late replies of " + evidence.Last(late_other).cause +
         " come in place of its own. Follow the sentence about that device";
}

std::string SayTwoReplies(const Evidence& evidence) {
  return "two different replies come to one request" +
         NextSentence(CheckAddress(*evidence.first().device)) + ", or " +
         RemoveOther(IsBehindServer(evidence));
}

std::string SayOtherReply(const Evidence& evidence) {
  const Finding& finding = evidence.Last(other_reply);
  if (!finding.cause.empty()) return WithRemedy(finding);
  const std::string& reason = evidence.first().status.last_reason;
  return "replies come that belong to other requests" +
         (reason.empty() ? "" : " (" + reason + ")") +
         ". Look for another master on the line, or a serial server that sends each reply only "
         "after the next request";
}

// The sentences about silence of all devices, of one device, or now and then.

namespace {

/// Addresses that are the characters XON and XOFF.
constexpr const char* kFlowControl[] = {"17", "19"};

/// Returns what to check if no device of the line answers: everything that the devices share.
std::string Shared(const Evidence& evidence) {
  if (!OnWire(evidence)) {
    const std::string counterpart(evidence.traits().counterpart);
    return "check the server at " + evidence.line->port +
           (evidence.answered || counterpart.empty()
                ? ""
                : "; for a plain serial server set protocol: " + counterpart);
  }
  if (evidence.answered) {
    return IsBehindServer(evidence)
               ? std::string("check the port of the serial server, power and wiring")
               : "check power, wiring and adapter; or " + OtherReader(evidence);
  }
  if (IsBehindServer(evidence)) {
    return "check power and wiring of the bus, then " + Settings(evidence.first());
  }
  return "check wiring (A and B), power, " + Settings(evidence.first()) +
         ", direction control of the converter; or " + OtherReader(evidence);
}

/// Returns what to check if neither a neighbour nor earlier answers of the device show which part
/// works.
std::string Unproven(const Evidence& evidence) {
  if (evidence.device == nullptr) return Shared(evidence);
  const bus::DeviceRecord& record = evidence.first();
  const std::string& address = record.device->address;
  const std::string counterpart(evidence.traits().counterpart);
  if (evidence.answered && !evidence.fell.empty() && !OnWire(evidence)) {
    return "restart the server at " + evidence.line->port + ", or check the power behind it";
  }
  if (evidence.answered && !evidence.fell.empty()) {
    return "check what these devices share: a branch of the line, or its power";
  }
  if (evidence.answered && OnWire(evidence))
    return "check its power and its wire, and whether its settings were changed";
  if (evidence.answered && !OnWire(evidence) && evidence.healthy.empty() &&
      evidence.status->port == bus::LineStatus::Port::open) {
    return "the server at " + evidence.line->port +
           " accepts connections but does not answer: restart it, or check what is behind it";
  }
  if (!OnWire(evidence)) {
    const bool alone =
        evidence.healthy.empty() && evidence.status->port == bus::LineStatus::Port::open;
    const std::string what = alone ? "the server at " + evidence.line->port +
                                         " accepts connections but does not answer: check unit " +
                                         address + " (try " + (address == "255" ? "1" : "255") +
                                         "), or restart it"
                                   : "check its power, its unit (" + address +
                                         ") and what is behind " + evidence.line->port;
    return what;
  }
  if (evidence.healthy.empty() && IsBehindServer(evidence)) {
    return "check its power, wire and address (" + address + "), then " + Settings(record) +
           (counterpart.empty() ? "" : "; or set protocol: " + counterpart);
  }
  if (evidence.healthy.empty()) {
    return "check power, wires (A and B), then address (" + address + "), " + Settings(record);
  }
  if (std::ranges::find(kFlowControl, address) != std::end(kFlowControl)) {
    return "check its power and wire; or a converter takes its address (" + address +
           ") for XON/XOFF: switch its flow control off";
  }
  return "check its power and wire, then its address (" + address + "), " + Settings(record);
}

constexpr const char* kCheckShared =
    ". Check what these devices share: supply, branch of the line, radio or server";

std::string SayLosses(const Evidence& evidence) {
  if (evidence.shared_period) {
    return "requests to it and " + evidence.losing + " get no answer every " +
           FormatAge(*evidence.shared_period) + kCheckShared;
  }
  if (!evidence.losing.empty()) {
    return "requests to it get no answer at the same times as requests to " + evidence.losing +
           kCheckShared;
  }
  const std::string cause = "now and then a request gets no answer. ";
  if (!OnWire(evidence)) {
    return cause + "Check the server and the network for losses, or poll it less often (poll)";
  }
  if (IsBehindServer(evidence)) {
    return cause +
           "Check for noise or a bad wire behind the serial server, and losses in the network";
  }
  if (!evidence.healthy.empty())
    return cause + "Check for noise, and for a bad wire or plug at its end";
  return cause + "Check noise, wire and plug; or " + OtherReader(evidence);
}

std::string SayAbsences(const Evidence& evidence, const Absences& absences) {
  const std::string every =
      absences.period ? " every " + FormatAge(*absences.period) : std::string(" now and then");
  const std::string length = " for about " + FormatAge(absences.length);
  const std::string away =
      absences.times > 1 ? "it stops answering" + length + every : "it did not answer" + length;
  const std::string& others = evidence.away.empty() ? evidence.losing : evidence.away;
  if (!others.empty()) {
    return away + ", at the same time as " + others +
           ". Check the supply and the branch of the line that these devices share";
  }
  if (!OnWire(evidence)) {
    return away + ". Check the server (power, restarts, dead connections) and the network (NAT)";
  }
  return away + ". Check its power and its wire, and whether it restarts";
}

}  // namespace

std::string OtherReader(const Evidence& evidence) {
  return "another program reads the port (" + NameHolders(evidence.line->port) + ")";
}

std::string SaySilent(const Evidence& evidence) {
  const bus::FailureRuns* const failures =
      evidence.device == nullptr ? nullptr : &evidence.device->status.failures;
  const bool now_and_then = failures != nullptr && IsUsualSilence(*failures, evidence.now);
  const Finding* const words =
      evidence.device == nullptr ? nullptr : &evidence.device->status.findings.LatestWords();
  if (evidence.absent && words != nullptr && !words->remedy.empty()) {
    return words->cause + " came, and nothing since" + NextSentence(words->remedy);
  }
  if ((evidence.absent && !now_and_then) || evidence.failed == evidence.looked) {
    const bool fell = evidence.answered && !evidence.fell.empty();
    return (evidence.answered ? "not a byte comes any more" : "not a byte came") +
           (fell ? ", nor from " + evidence.fell + " since the same moment" : "") +
           NextSentence(Unproven(evidence));
  }
  const auto absences = failures == nullptr ? std::nullopt : FindAbsences(*failures);
  const bool own = absences && !evidence.shared_period && !HasDeadQuery(*evidence.device);
  return own ? SayAbsences(evidence, *absences) : SayLosses(evidence);
}

// The sentences about serial settings: bit rate, parity, data bits and the protocol of a port.

namespace {

using enum Symptom;

/// Every reply has at least this many characters. If each of them comes as 00 or FF, the parity is
/// wrong.
constexpr std::size_t kWholeReply = 6;

}  // namespace

std::string SayEighthBit(const Evidence& evidence) {
  const config::SerialSettings serial = SerialOf(evidence.first());
  const bool mark = !evidence.Last(eighth_bit).cause.empty();
  const std::string cause =
      mark
          ? "the eighth bit of its characters is always 1, so it sends mark parity or two stop bits"
          : "its characters are right without the eighth bit, so it sends 7 data bits with parity";
  const std::string set = mark ? ". Set 7M1 or 7N2" : ". Set 7E1 or 7O1";
  if (IsBehindServer(evidence)) return cause + set + " at the serial server";
  if (serial.data_bits > 7) return cause + set + " in serial (now " + serial.ToString() + ")";
  return cause + ". Use an adapter that supports " + serial.ToString() + ", or set " +
         (mark ? "7N2" : "7O1");
}

std::string SaySevenBits(const Evidence& evidence) {
  const std::string cause =
      "the eighth bit of its replies is always 0. Set 8 data bits at the port";
  if (IsBehindServer(evidence)) return cause + " of the serial server";
  return cause + " of this gateway, or at a converter in between (now " +
         SerialOf(evidence.first()).ToString() + ")";
}

std::string SayOtherParity(const Evidence& evidence) {
  const bool network = evidence.line->is_network();
  return std::string("only characters with the right parity arrive") +
         (network ? "; the others are missing" : "; the others arrive as FF") +
         ". Set the same parity at the device and " +
         (network ? "the serial server" : "in the configuration") + " (" +
         SerialOf(evidence.first()).ToString() + ")";
}

std::string SaySettings(const Evidence& evidence) {
  const bus::DeviceRecord& record = evidence.first();
  const std::string serial = SerialOf(record).ToString();
  if (evidence.changed) {
    const char* const what = record.status.unasked ? "message" : "frame";
    return std::string("bytes come, but no good ") + what +
           " any more. Set the same bit rate and parity at the device and in the configuration (" +
           serial + "), and check A and B";
  }
  if (record.status.unasked) {
    return "bytes come, but no good message. Set the same bit rate and parity at the device and in "
           "the configuration (" +
           serial + "), and check that the profile describes its messages";
  }
  if (!evidence.healthy.empty()) {
    return "its replies cannot be read. Check " + Settings(record) +
           ", and for two devices at address " + record.device->address;
  }
  return "bytes come, but no good frame. Check " + Settings(record) +
         (IsBehindServer(evidence) ? "" : " with 'baudgate scan', then A and B");
}

std::string SayNoTcp(const Evidence& evidence) {
  const std::string other(evidence.traits().counterpart);
  return "its replies are not " + std::string(evidence.traits().service) + ". Check the port (" +
         evidence.line->port + ")" +
         (other.empty() ? "" : "; for a plain serial server set protocol: " + other);
}

std::string SayZeros(const Evidence& evidence) {
  const config::SerialSettings serial = SerialOf(evidence.first());
  if (evidence.Last(zeros).bytes >= kWholeReply && serial.parity != config::Parity::none) {
    return fmt::format(
        "nothing but 00 or FF comes ({} bytes). Set the same parity at the device and in the "
        "configuration ({}), or check A and B",
        evidence.Last(zeros).bytes, serial.ToString());
  }
  if (serial.parity != config::Parity::none) {
    return "nothing but 00 or FF comes. Check the parity and the bit rate (" + serial.ToString() +
           "), then A and B, the bias resistors and which device drives the line";
  }
  return "nothing but 00 or FF comes. Check A and B, the bias resistors and which device drives "
         "the line, then bit rate and parity (" +
         serial.ToString() + ")";
}

std::string CheckOf(const bus::DeviceRecord& record) {
  const auto checksum = record.device->options.all().find("checksum");
  if (checksum == record.device->options.all().end()) return {};
  if (const bool* flag = std::get_if<bool>(&checksum->second)) {
    return std::string(", checksum: ") + (*flag ? "on" : "off");
  }
  const auto* word = std::get_if<std::string>(&checksum->second);
  return word == nullptr ? std::string() : ", checksum: " + *word;
}

std::string Settings(const bus::DeviceRecord& record) {
  const std::string check = CheckOf(record);
  const bool server = record.line->is_network();
  return std::string("bit rate, parity and protocol") +
         (server ? " at device and serial server" : "") + " (" + SerialOf(record).ToString() +
         check + ", " + record.device->protocol + ")";
}

// The sentences about time: replies that are late or in pieces, requests at a bad moment.

namespace {

using enum Symptom;

/// A device that needs a pause before requests needs at least this pause.
constexpr Duration kPause = 100ms;
/// A device that seems to need a longer pause loses every second request, or is a radio.
constexpr Duration kUsualPause = 200ms;
/// A longer pause than this is not a reasonable setting.
constexpr Duration kLongestQuiet = 3s;
/// A suggested time is this many times the measured time.
constexpr double kMargin = 1.25;
/// The factor for the time `idle`, which may be too long without harm.
constexpr double kWideMargin = 1.5;

/// Returns the time with a margin, rounded for the configuration, such as "150ms".
std::string Suggest(Duration seen, double margin = kMargin) {
  const double ms = margin * std::chrono::duration<double, std::milli>(seen).count();
  const double step = ms < 100 ? 10 : ms < 1000 ? 50 : 500;
  const auto round = static_cast<std::int64_t>(step * std::ceil(ms / step + 0.01));
  return fmt::format("{}ms", round);
}

/// Returns text such as " (timing.gap: 50 ms). Set timing: { gap: 150ms } in the configuration".
std::string AndSet(const char* time, std::optional<Duration> now, Duration seen) {
  return fmt::format(" (timing.{}: {} ms). Set timing: {{ {}: {} }} in the configuration", time,
                     Milliseconds(now.value_or(Duration{})), time, Suggest(seen));
}

}  // namespace

std::string SayLate(const Evidence& evidence) {
  const auto reply = evidence.first().status.timing.reply;
  const Duration seen = evidence.Last(late).time;
  const std::string& others = evidence.away.empty() ? evidence.losing : evidence.away;
  // If more than half of the exchanges fail, the device is always slow, so the network is not named
  // as the cause.
  const bool stalls =
      evidence.line->is_network() && !others.empty() && 2 * evidence.failed < evidence.looked;
  return fmt::format("its replies come up to {} ms after the request", Milliseconds(seen)) +
         AndSet("reply", reply, std::max(seen, reply.value_or(Duration{}))) +
         (stalls ? ", or find what stalls the network or the server, as " + others +
                       " answers late at the same times"
                 : "");
}

std::string SaySplit(const Evidence& evidence) {
  const Duration seen = evidence.Last(split).time;
  const std::string pauses =
      fmt::format("come in pieces, with pauses of up to {} ms", Milliseconds(seen));
  if (evidence.first().status.unasked) {
    return "they " + pauses + ". Set idle: " + Suggest(seen, kWideMargin) +
           " in the configuration, or switch the packing of the serial server off";
  }
  return "its replies " + pauses + AndSet("gap", evidence.first().status.timing.gap, seen);
}

std::string SayTooFast(const Evidence& evidence) {
  const bus::Findings& findings = evidence.device->status.findings;
  const Duration pause = findings.ShortPause();
  const auto known = findings.ShortestAnswered();
  const std::string cause =
      fmt::format("requests soon ({} ms) after a message get no answer. ", Milliseconds(pause));
  const Duration probable = std::max<Duration>(kPause, 2 * pause);
  const auto set = [](Duration quiet, double margin) {
    return "timing: { quiet: " + Suggest(quiet, margin) + " } in the configuration";
  };
  if (!known || *known > kLongestQuiet)
    return cause + "Set " + set(probable, kMargin) + "; if needed, more";
  // The device has answered after this pause, and after no shorter one.
  const Duration enough = std::max<Duration>(kPause, *known);
  if (pause >= kUsualPause) {
    return cause + "Set " + set(enough, 1) +
           "; if every second request still gets no answer, the pause is not the cause";
  }
  if (enough <= kMargin * kWideMargin * probable) return cause + "Set " + set(enough, 1);
  return cause + "Set " + set(probable, kMargin) + "; if needed, " + Suggest(enough, 1);
}

std::string SayAsleep(const Evidence& evidence) {
  return "requests after a pause of " + FormatAge(evidence.device->status.findings.LongRest()) +
         " get no answer, but their retries do. Poll it more often (poll), or switch off sleep at "
         "the device or its radio";
}

}  // namespace baudgate::diagnosis
