// Causes and sentences about damaged replies: bytes lost, added or changed, and wrong check values.
// A function that returns a double returns which share of a device's failed exchanges its cause
// explains, 0 to 1.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <string>
#include <string_view>

#include "gateway/diagnosis/causes/hypotheses.h"
#include "gateway/diagnosis/causes/words.h"

namespace baudgate::diagnosis {
namespace {

using enum Symptom;

/// A reply that lacks more bytes than this has broken off: a converter drops single bytes only.
constexpr std::size_t kMissing = 4;
/// If fewer replies lack their first bytes, noise can be the cause.
constexpr std::size_t kFewLosses = 3;
/// Replies up to this length, in bytes, fit into any buffer.
constexpr std::size_t kNoBuffer = 16;

/// True if replies often lack bytes and no reply was good.
bool LacksBytes(const Evidence& evidence) {
  return !evidence.answered && evidence.Count(bytes_lost) >= kMany;
}

/// True if replies up to some length are good and longer replies never are. `which`: whether the
/// longer replies did not come (silent) or came damaged.
bool OnlyLong(const Evidence& evidence,
              const bus::ReplyLengths::TooLong& (bus::ReplyLengths::*which)() const) {
  // An offline device may have sent its short good replies long ago, so the lengths prove nothing.
  if (evidence.device == nullptr || evidence.absent) return false;
  if (!evidence.traits().has_blocks) return false;
  const bus::Findings& findings = evidence.device->status.findings;
  if (findings.Runs() < kFacts || findings.lengths().longest_good() == 0) return false;
  const bus::ReplyLengths::TooLong& bad = (findings.lengths().*which)();
  return bad.count >= kFacts && bad.shortest > kNoBuffer &&
         4 * bad.shortest > 5 * findings.lengths().longest_good();
}

}  // namespace

/// True for a text protocol if a third of the failed replies or more lack bytes, in different
/// positions, and some replies are good. A text reply that lacks two characters can look complete
/// except for its check value.
bool LosesAnywhere(const Evidence& evidence) {
  if (!evidence.traits().speaks_text) return false;
  if (evidence.Count({damaged, noise, zeros, bytes_added}) > 0) return false;
  if (evidence.Count(other_setting) >= evidence.Count(bytes_lost)) return false;
  const auto plain = [&](Symptom symptom) {
    return evidence.Last(symptom).cause == kGarbled ? 0 : evidence.Count(symptom);
  };
  const std::size_t lost = evidence.Count(bytes_lost) + plain(head_lost) + plain(end_lost);
  return evidence.answered && evidence.Count(bytes_lost) > 0 && lost >= kFewLosses &&
         3 * lost >= evidence.seen;
}

/// Cause: a converter changes certain bytes. All failed replies contain one of these bytes, and no
/// good reply does. Returns the share of failures that this explains, or 0.
double NotTransparent(const Evidence& evidence) {
  if (evidence.device == nullptr || !evidence.answered) return 0;
  // For devices that send unasked, the bytes of good messages are not recorded, so nothing can be
  // compared.
  if (evidence.device->status.unasked) return 0;
  if (evidence.seen < kFacts || Suspects(evidence) == 0) return 0;
  // If most replies break off by more than a few bytes, a converter that drops certain bytes is not
  // the cause.
  const Finding& cut = evidence.Last(tail_lost);
  const bool breaks_off =
      cut.expected > cut.bytes + kMissing && 2 * evidence.Count(tail_lost) > evidence.seen;
  if (breaks_off) return 0;
  return evidence.Share({damaged, noise, bad_check, bytes_lost, bytes_added, tail_lost});
}

/// Cause: the eighth bit of characters is set or cleared. Returns 0 if a stored exchange has a good
/// reply: the other replies are then only damaged.
double EighthBit(const Evidence& evidence) {
  return evidence.answered && !evidence.changed ? 0 : evidence.Share({eighth_bit});
}

double BadCheck(const Evidence& evidence) {
  if (IsComputedOtherwise(evidence)) return evidence.Share({bad_check, damaged, noise});
  return evidence.answered ? 0 : evidence.Share({bad_check});
}

/// Cause: the beginning of replies is lost. A reply that lacks several bytes there looks like
/// noise, so noise is counted too.
double HeadLost(const Evidence& evidence) {
  if (evidence.Count(head_lost) < kFewLosses) return evidence.Share({head_lost});
  return evidence.Share({head_lost}, {noise, zeros, damaged}, 2);
}

/// Cause: bytes inside replies are lost. (Noise changes characters but removes none; two devices
/// that send at the same time do both.)
double BytesLost(const Evidence& evidence) {
  if (LosesAnywhere(evidence)) {
    return evidence.Share({bytes_lost, bad_check, head_lost, tail_lost, end_lost, other_setting});
  }
  const bool some = 3 * evidence.Count(bytes_lost) >= 2 * evidence.seen || LacksBytes(evidence);
  if (!some) return Always<bytes_lost>(evidence);
  return evidence.Share({bytes_lost, bad_check, damaged, tail_lost, end_lost});
}

/// Cause: the last byte of replies is lost. If other replies are good and the last byte came with
/// another value (kGarbled), nearly all failures must be of this kind.
double EndLost(const Evidence& evidence) {
  const bool only = evidence.Count(end_lost) >= kMany && evidence.Share({end_lost}) > 0.9;
  if (evidence.answered && !evidence.Last(end_lost).cause.empty() && !only) return 0;
  return Always<end_lost>(evidence);
}

/// Cause: replies break off, for example in a buffer that is too small. The buffer may also cut off
/// only the last byte or two, so replies that lack these are counted too, unless they are most.
double BreaksOff(const Evidence& evidence) {
  if (evidence.Count(tail_lost) == 0) return 0;
  const double share =
      LacksBytes(evidence) ? 0 : evidence.Share({tail_lost, end_lost}, {bytes_lost});
  return evidence.answered && share < 0.6 ? 0 : share;
}

/// Cause: another parity than configured. Returns 0 unless the failed replies of all devices in the
/// evidence contained characters of one parity only.
double OtherParity(const Evidence& evidence) {
  if (evidence.seen < kMany || !OnWire(evidence)) return 0;
  const bool network = evidence.line->is_network();
  if (network && evidence.answered) return 0;
  const bool all =
      std::ranges::all_of(evidence.records, [network](const bus::DeviceRecord* record) {
        const bus::SpecialBytes& specials = record->status.findings.specials();
        return network ? specials.LacksOneParity() : specials.IsOneParity();
      });
  if (!all) return 0;
  return evidence.Share({bad_check, damaged, noise, bytes_lost, tail_lost, end_lost, head_lost});
}

/// Cause: the eighth bit is cut off. Returns 0 unless it is missing in all characters that came.
double SevenBits(const Evidence& evidence) {
  if (evidence.seen < kMany || !OnWire(evidence)) return 0;
  const bool all = std::ranges::all_of(evidence.records, [](const bus::DeviceRecord* record) {
    return record->status.findings.specials().IsSevenBit();
  });
  return all ? evidence.Share({bad_check, damaged}) : 0;
}

double TooLong(const Evidence& evidence) {
  return OnlyLong(evidence, &bus::ReplyLengths::silent) ? evidence.Share({silence}) : 0;
}

double LongDamaged(const Evidence& evidence) {
  if (!OnlyLong(evidence, &bus::ReplyLengths::damaged) || evidence.Count(split) > 0) return 0;
  return evidence.Share({damaged, noise, bad_check, bytes_lost, tail_lost, end_lost});
}

namespace {

using enum Symptom;

/// A device whose driver leaves the bus too early cuts off at most this many bytes of a reply.
constexpr std::size_t kFewLost = 4;
/// Value of Finding::cause at bad_check: the reply is a text, so the kind of its check value is
/// uncertain.
constexpr std::string_view kText = "a text";
constexpr const char* kSetRaw =
    "set the converter or serial server to raw (no XON/XOFF, no Telnet)";

bool IsNearlyAll(std::size_t count, const Evidence& evidence) {
  return 10 * count >= 9 * evidence.seen;
}

std::string NamesOf(unsigned specials) {
  std::string names;
  for (std::size_t i = 0; i < std::size(kSpecialBytes); ++i) {
    if ((specials & (1U << i)) == 0) continue;
    names += (names.empty() ? "" : " and ") + fmt::format("{:02X}", kSpecialBytes[i]);
  }
  return names;
}

}  // namespace

bool IsComputedOtherwise(const Evidence& evidence) {
  const Finding* const check = evidence.first().status.findings.Check();
  const bool fits = check != nullptr && check->cause != kText;
  return fits && 2 * evidence.Count(bad_check) > evidence.seen;
}

/// Returns the suspect special bytes. On a serial port FF does not count, because the gateway's
/// ParmrkDecoder (transports/parity.h) replaces a character with wrong parity by FF.
unsigned Suspects(const Evidence& evidence) {
  const unsigned all = evidence.device->status.findings.specials().Suspects();
  constexpr unsigned kTelnet = 1U << (std::size(kSpecialBytes) - 1);
  return evidence.line->is_network() ? all : all & ~kTelnet;
}

std::string SayHeadLost(const Evidence& evidence) {
  const std::string& how = evidence.Last(head_lost).cause;
  const bool one = how.empty() && evidence.Count({noise, damaged}) == 0;
  const bool steals = !one && how != kGarbled && evidence.answered && !evidence.alike.empty() &&
                      !evidence.line->is_network();
  return std::string(how == kGarbled ? "the first byte of its replies is garbled"
                     : one           ? "the first byte of its replies is missing"
                                     : "the first bytes of its replies are missing") +
         ". Use a converter with automatic direction control, or raise the device's answer delay" +
         (steals ? "; or " + OtherReader(evidence) : "");
}

std::string SayEndLost(const Evidence& evidence) {
  if (evidence.Last(end_lost).cause == kGarbled && evidence.answered) {
    return "the last byte of its replies is garbled. Use automatic direction control, "
           "and check for noise and a bad wire";
  }
  if (evidence.Last(end_lost).cause == kGarbled) {
    return "the last byte of its replies is garbled. Use a converter with automatic direction "
           "control, or check how the device computes its check value";
  }
  if (evidence.line->is_network() && evidence.healthy.empty()) {
    return "the last byte of its replies is missing. The serial server takes it for a delimiter: "
           "set its port to raw, without delimiters";
  }
  return "the last byte of its replies is missing. A line driver releases the bus early: use a "
         "converter with automatic direction control";
}

std::string SayTailLost(const Evidence& evidence) {
  const Finding& finding = evidence.Last(tail_lost);
  if (!finding.cause.empty() && !finding.remedy.empty()) {
    const bool never = !evidence.answered && IsNearlyAll(evidence.Count(tail_lost), evidence);
    return never ? "its replies carry no check value" + NextSentence(finding.remedy)
                 : "its replies break off before their check value. A line driver releases the bus "
                   "early: use a converter with automatic direction control";
  }
  if (!finding.cause.empty()) {
    return "its replies break off before their line end. Set the converter to raw, or use one with "
           "automatic direction control";
  }
  const std::string of =
      finding.expected > finding.bytes ? fmt::format(" of {}", finding.expected) : std::string();
  const bool few = finding.expected > finding.bytes && OnWire(evidence) &&
                   finding.expected <= finding.bytes + kFewLost;
  // Other devices of the line answer well, so the cause is in this device, not in shared equipment.
  if (few && !evidence.healthy.empty() && !evidence.line->is_network()) {
    return fmt::format(
        "its replies break off ({}{} bytes came). Check its line driver, which releases the bus "
        "too early, and {}",
        finding.bytes, of, CheckAddress(*evidence.first().device));
  }
  // For a text reply the expected length is not known, so the last bytes may be missing.
  const bool end = few || (finding.expected == 0 && !evidence.line->is_network());
  return fmt::format("its replies break off ({}{} bytes came). {}", finding.bytes, of,
                     end ? "Use automatic direction control or a larger buffer, or ask for less "
                           "at once (block, max_items)"
                         : "Use a converter with a larger buffer, ask for less (block, max_items), "
                           "or check wires");
}

std::string SayBytesLost(const Evidence& evidence) {
  const Finding& finding = evidence.Last(bytes_lost);
  if (evidence.first().status.unasked) {
    if (!evidence.answered && !finding.remedy.empty()) return WithRemedy(finding);
    return "characters are missing in some of its messages. Check for a bad wire or plug, a buffer "
           "that overflows, and flow control at only one end";
  }
  if (!evidence.healthy.empty()) {
    return "bytes are missing inside its replies. A wire, plug or fibre at its end is bad, or a "
           "converter loses bytes (set it to raw)";
  }
  return "bytes are missing inside its replies. A converter removes them (set it to raw) or is "
         "overrun (replace it)";
}

std::string SayBytesAdded(const Evidence& evidence) {
  const Finding& finding = evidence.Last(bytes_added);
  const bool known = finding.expected > 0 && finding.bytes > finding.expected;
  return "its replies have too many bytes" +
         (known ? fmt::format(" ({}, not {})", finding.bytes, finding.expected) : std::string()) +
         (evidence.healthy.empty()
              ? NextSentence(kSetRaw)
              : ". Check whether two devices have its address, or set the converter or serial "
                "server to raw");
}

std::string SaySpecials(const Evidence& evidence) {
  return "only replies that contain " + NamesOf(Suspects(evidence)) + " fail" +
         NextSentence(kSetRaw);
}

std::string SayEatenRequests(const Evidence& evidence) {
  return "only requests that contain " + NamesOf(evidence.eaten) +
         " fail. Switch XON/XOFF off at the converter or serial server";
}

std::string SayBadCheck(const Evidence& evidence) {
  if (const Finding* const check = evidence.first().status.findings.Check()) {
    const bool fits = check->cause != kText;
    return fits ? WithRemedy(*check)
                : "its check value is computed in another way" + NextSentence(check->remedy);
  }
  if (evidence.first().status.unasked) {
    return "its messages have a wrong check value. Check for noise, and for a device in between "
           "that changes them, such as a multiplexer";
  }
  const std::string cause = "its replies have a wrong check value";
  // If other devices of the line answer well, a converter that loses bytes is not the cause.
  if (!evidence.healthy.empty() && !evidence.answered &&
      IsNearlyAll(evidence.Count(bad_check), evidence)) {
    const std::string check = CheckOf(evidence.first());
    return cause + (check.empty() ? "" : " (" + check.substr(2) + ")") +
           ". Check how it computes its check value (see its manual and options), and whether two "
           "devices have its address";
  }
  if (!evidence.Last(bad_check).cause.empty()) {
    return cause +
           ". Check whether two devices have its address and how it computes its check value, and "
           "set the converter to raw";
  }
  const std::string check = CheckOf(evidence.first());
  return cause + (check.empty() ? "" : " (" + check.substr(2) + ")") +
         ". Check whether two devices have its address, and how it computes its check value";
}

std::string SayTooLong(const Evidence& evidence) {
  const bus::Findings& findings = evidence.device->status.findings;
  return fmt::format(
      "it does not answer requests for long replies ({} bytes; up to {} are fine). Ask for less at "
      "once (block, max_items)",
      findings.lengths().silent().shortest, findings.lengths().longest_good());
}

std::string SayLongDamaged(const Evidence& evidence) {
  const bus::Findings& findings = evidence.device->status.findings;
  return fmt::format(
      "long replies come damaged ({} bytes; up to {} are fine). A buffer is too small: ask for "
      "less "
      "at once (block, max_items)",
      findings.lengths().damaged().shortest, findings.lengths().longest_good());
}

}  // namespace baudgate::diagnosis
