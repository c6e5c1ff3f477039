// Sentences about bytes beside good replies, and about devices that send unasked. diagnose.h
// describes the functions.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "gateway/base/shown.h"
#include "gateway/diagnosis/causes/diagnose.h"
#include "gateway/diagnosis/causes/evidence.h"
#include "gateway/diagnosis/causes/words.h"

namespace baudgate::diagnosis {
namespace {

using Sentences = std::vector<std::string>;

/// If this many second replies equal the first reply, a single second reply that differs shows that
/// two devices answer.
constexpr std::size_t kMostlyAlike = 8;
/// Bytes that were equal around this many replies are not noise.
constexpr std::size_t kConstant = 4;
/// If only one device has stray bytes, and in this many exchanges, the device is the cause.
constexpr std::size_t kOfItsOwn = 16;

bool IsNearlyAlways(std::size_t count, const bus::Findings& findings) {
  return 10 * count >= 9 * findings.size();
}

/// Returns the cause and remedy of stray bytes. `always`: they come with nearly every reply, so
/// equipment in between or a bus without bias adds them. Noise would come only now and then.
const char* WhyStray(const bus::DeviceRecord& record, bool always) {
  if (!SerialOf(record).on_wire()) {
    return always
               ? "values are right, but the server appends bytes such as a CRC: set it to Modbus "
                 "TCP, without RTU, or update its firmware"
               : "the server sends unasked: limit it to one client, or update its firmware";
  }
  if (record.line->is_network()) {
    return always ? "the modem, radio or serial server adds them: set it to raw"
                  : "look for noise behind the serial server, and switch off its heartbeat packets";
  }
  return always ? "a converter, radio or modem adds them (set it to raw), or the bus lacks bias "
                  "resistors"
                : "noise comes while no device drives the bus: check bias, termination and ground";
}

/// Reports bytes around nearly all replies: equipment in between adds them.
std::string Wrapped(const bus::DeviceRecord& record) {
  if (!IsWrapped(record)) return {};
  const bus::Findings& findings = record.status.findings;
  const std::string& around = findings.Around();
  if (around == kOwnRequest) return kHearsItself;
  const bool idle = around.find_first_not_of("0FEC8 .") == std::string::npos;
  const bool network = record.line->is_network();
  const bool same = findings.SameAround() >= kConstant;
  const bool text = findings.Count(Symptom::text_beside) > 0;
  // Findings::Around is "... '> '" if the bytes behind the reply are a prompt.
  const bool prompt = same && around.starts_with("... '");
  if (prompt && network) {
    return "the same text comes behind its replies (" + around.substr(4) +
           "). Set the console or terminal server that sends this prompt to raw";
  }
  const std::string& shown = same ? around : findings.Last(Symptom::text_beside).cause;
  return std::string(same ? "the same " : "") + (text ? "text comes" : "bytes come") +
         " around its replies (" + shown + "). " +
         (network         ? "Set the modem, radio or serial server in between to raw"
          : text && !same ? "Switch its automatic output off, or that of a modem in between"
          : idle ? "Noise comes while no device drives the bus: fit bias resistors and termination"
                 : "Set the modem, radio or serial server in between to raw, or terminate the bus");
}

}  // namespace

bool IsWrapped(const bus::DeviceRecord& record) {
  const bus::Findings& findings = record.status.findings;
  const std::size_t beside =
      findings.Count(Symptom::few_beside) + findings.Count(Symptom::noise_before) +
      findings.Count(Symptom::noise_behind) + findings.Count(Symptom::text_beside);
  const bool echo = findings.Around() == kOwnRequest && findings.SameAround() >= kConstant;
  if (echo || beside < kNotableNoise || !IsNearlyAlways(beside, findings)) return echo;
  // Texts count even if they differ from reply to reply, because they may contain a value.
  if (findings.Count(Symptom::text_beside) == beside) return true;
  if (findings.SameAround() < kConstant) return false;
  // Bytes 00 and FF and pieces of characters come from a bus without bias, not from equipment.
  const std::string& around = findings.Around();
  return around.find_first_not_of("0F .") != std::string::npos;
}

bool AreTwo(const bus::Findings& findings) {
  const std::size_t others = findings.Count(Symptom::others_beside);
  return others >= kNotableNoise || (others > 0 && findings.Count(Symptom::copies) >= kMostlyAlike);
}

Sentences Beside(const bus::DeviceRecord& record, bool alone) {
  const bus::Findings& findings = record.status.findings;
  Sentences found;
  const auto say = [&](std::size_t count, const char* what, const std::string& remedy) {
    found.push_back(fmt::format("{} in {} of {} exchanges{}", what, count, findings.size(),
                                NextSentence(remedy)));
  };
  const std::size_t copies = findings.Count(Symptom::copies);
  if (AreTwo(findings)) {
    say(findings.Count(Symptom::others_beside), "a second reply with another content follows",
        CheckAddress(*record.device) + ", or " + RemoveOther(record.line->is_network()));
  } else if (copies >= kNotableNoise && record.status.doubled >= kNotableNoise) {
    say(copies, "its replies come twice and differ",
        CheckAddress(*record.device) +
            ", or switch the repetition off at the serial server or radio");
  } else if (copies >= kNotableNoise) {
    say(copies, "its replies come twice",
        "switch the repetition off at the serial server or radio, or check whether two devices "
        "have its address");
  }
  if (std::string wrapped = Wrapped(record); !wrapped.empty()) {
    found.push_back(std::move(wrapped));
    return found;
  }
  const std::size_t before = findings.Count(Symptom::noise_before);
  const std::size_t behind = findings.Count(Symptom::noise_behind);
  const char* const where = before == 0   ? "stray bytes follow its replies"
                            : behind == 0 ? "stray bytes come before its replies"
                                          : "stray bytes come before and behind its replies";
  const bool always = IsNearlyAlways(before + behind, findings);
  if (before + behind >= kNotableNoise) {
    say(before + behind, where,
        alone && !record.line->is_network() && before + behind >= kOfItsOwn
            ? "check the device and its converter, as no other device has stray bytes"
            : WhyStray(record, always));
  }
  return found;
}

namespace {

using Sentences = std::vector<std::string>;

/// A silence of a device that sends unasked is mentioned from this time on.
constexpr Duration kNotableSilence = 1min;
/// If the age limit of the values is longer than this, the device may be silent for any time.
constexpr Duration kLongestAge = 24h;

}  // namespace

std::optional<Duration> MustSpeakWithin(const bus::DeviceRecord& record) {
  Duration shortest = record.device->max_age.value_or(Duration::max());
  if (!record.device->max_age && !record.device->never_old) {
    for (const config::Point& point : record.device->points) {
      const auto group = static_cast<std::size_t>(point.group);
      shortest = std::min(shortest, record.age_limits[group].uncertain_after);
    }
  }
  return shortest <= kLongestAge ? std::optional(shortest) : std::nullopt;
}

std::optional<Duration> ComesEvery(const bus::DeviceRecord& record, Instant now) {
  const auto must = MustSpeakWithin(record);
  const bus::DeviceStatus& status = record.status;
  if (!status.unasked || !status.last_ok || !must) return std::nullopt;
  const auto period = status.findings.Period(*must);
  if (!period) return std::nullopt;
  const auto [shortest, longest] = *period;
  const bool regular = 4 * longest <= 5 * shortest;
  const bool stopped = 2 * (now - *status.last_ok) > 3 * longest;
  return regular && !stopped ? std::optional(longest) : std::nullopt;
}

Sentences AnswersNothing(const bus::DeviceRecord& record, const Evidence& evidence) {
  const bus::DeviceStatus& status = record.status;
  if (!status.unasked || !status.last_ok) return {};
  if (2 * evidence.Count(Symptom::silence) < evidence.seen) return {};
  const bus::MinuteCounts asked = status.hour.Sum(evidence.now);
  // A few answers are allowed: a message sent unasked may have been taken for an answer.
  if (asked.failed < kNotableFailures || 8 * asked.answered > asked.failed) return {};
  return {
      "sends unasked, but does not answer commands. Check its power and the wire that carries data "
      "to it (TX), or take 'commands' out of its options if the device has no commands"};
}

Sentences Unreadable(const bus::DeviceRecord& record, const Evidence& evidence) {
  if (!record.status.unasked || evidence.failed < kNotableFailures) return {};
  if (!record.status.last_ok) return Said("no message was good yet: ", evidence);
  return Said(fmt::format("{} of its last {} messages are bad: ", evidence.failed, evidence.looked),
              evidence);
}

Sentences Silence(const bus::DeviceRecord& record, Now now) {
  const bus::DeviceStatus& status = record.status;
  const auto& max_age = record.device->max_age;
  const auto must = MustSpeakWithin(record);
  if (!status.last_ok && must) {
    return {"has sent nothing yet, and its values are old after " + FormatDuration(*must) +
            ". Check its power and wire, then bit rate and parity (" +
            record.line->serial.ToString() + ") and its options"};
  }
  if (!status.last_ok) {
    return {
        "has sent nothing yet, which is normal if nothing has happened. Otherwise check power, bit "
        "rate, parity and wiring (" +
        record.line->serial.ToString() + ") and its options"};
  }
  Sentences found;
  if (const Duration silent = now.instant - *status.last_ok;
      silent >= kNotableSilence && !max_age && !must) {
    found.push_back("silent for " + FormatAge(silent) +
                    ", which is normal: it sends only when something happens");
  }
  if (status.lost_events > 0) {
    found.push_back(Plural(status.lost_events, "event") +
                    " lost, because it kept sending while the disk failed. See the sentence "
                    "'events: ...' of 'baudgate status'");
  }
  return found;
}

}  // namespace baudgate::diagnosis
