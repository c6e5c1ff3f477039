// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "gateway/base/shown.h"
#include "gateway/diagnosis/causes/diagnose_parts.h"

namespace baudgate::control {
namespace {

using Sentences = std::vector<std::string>;

/// It may be silent so long without a word about it.
constexpr Duration kNotableSilence = 1min;
/// What may be older is read now and then, and not all the time.
constexpr Duration kLongestAge = 24h;

}  // namespace

std::optional<Duration> MustSpeakWithin(const DeviceRecord& record) {
  Duration shortest = record.device->max_age.value_or(Duration::max());
  if (!record.device->max_age && !record.device->never_old) {
    for (const config::Point& point : record.device->points) {
      const auto group = static_cast<std::size_t>(point.group);
      shortest = std::min(shortest, record.age_limits[group].uncertain_after);
    }
  }
  return shortest <= kLongestAge ? std::optional(shortest) : std::nullopt;
}

std::optional<Duration> ComesEvery(const DeviceRecord& record, Instant now) {
  const auto must = MustSpeakWithin(record);
  const DeviceStatus& status = record.status;
  if (!status.unasked || !status.last_ok || !must) return std::nullopt;
  const auto period = status.findings.Period(*must);
  if (!period) return std::nullopt;
  const auto [shortest, longest] = *period;
  const bool regular = 4 * longest <= 5 * shortest;
  const bool stopped = 2 * (now - *status.last_ok) > 3 * longest;
  return regular && !stopped ? std::optional(longest) : std::nullopt;
}

Sentences AnswersNothing(const DeviceRecord& record, const Evidence& evidence) {
  const DeviceStatus& status = record.status;
  if (!status.unasked || !status.last_ok) return {};
  if (2 * evidence.Count(Symptom::silence) < evidence.seen) return {};
  const MinuteCounts asked = status.hour.Sum(evidence.now);
  // What it sends by itself may come where an answer is awaited.
  if (asked.failed < kNotableFailures || 8 * asked.answered > asked.failed) return {};
  return {
      "speaks by itself, and does not answer its commands: check the wire that carries them to it "
      "(TX), its power, and whether it knows them (else take commands out of its options)"};
}

Sentences Unreadable(const DeviceRecord& record, const Evidence& evidence) {
  if (!record.status.unasked || evidence.failed < kNotableFailures) return {};
  if (!record.status.last_ok) return Said("no message was good yet: ", evidence);
  return Said(fmt::format("{} of its last {} messages are bad: ", evidence.failed, evidence.looked),
              evidence);
}

Sentences Silence(const DeviceRecord& record, Now now) {
  const DeviceStatus& status = record.status;
  const auto& max_age = record.device->max_age;
  const auto must = MustSpeakWithin(record);
  if (!status.last_ok && must) {
    return {"has not spoken yet, and its values are old after " + FormatDuration(*must) +
            ": check its power and wire, then bit rate and parity (" +
            record.line->serial.ToString() + ") and its options"};
  }
  if (!status.last_ok) {
    return {
        "has not spoken yet: normal where nothing has happened; if something has, check power, "
        "bit rate, parity and wiring (" +
        record.line->serial.ToString() + ") and its options"};
  }
  Sentences found;
  if (const Duration silent = now.instant - *status.last_ok;
      silent >= kNotableSilence && !max_age && !must) {
    found.push_back("silent for " + FormatAge(silent) +
                    ": normal, it speaks only when it has something to say");
  }
  if (status.lost_events > 0) {
    found.push_back(Plural(status.lost_events, "event") +
                    " lost: it went on while the disk failed; see the events in 'baudgate status'");
  }
  return found;
}

}  // namespace baudgate::control
