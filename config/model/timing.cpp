// SPDX-License-Identifier: Apache-2.0
#include "config/model/timing.h"

#include <algorithm>

namespace baudgate::config {

namespace {

// Indices into kNamedTimes.
constexpr std::size_t kReply = 1;
constexpr std::size_t kGap = 2;
constexpr std::size_t kCeiling = 3;

/// Assumed number of pauses inside the longest frame: a device sends 256 bytes in packets of 16.
constexpr int kPauses = 16;
constexpr Duration kMostForPauses = 5s;

/// Rounds for messages: 5.2 ms, 4601 ms.
Duration Rounded(Duration time) {
  if (time >= 10ms) return std::chrono::round<std::chrono::milliseconds>(time);
  constexpr Duration kStep = 100us;
  return (time + kStep / 2) / kStep * kStep;
}

}  // namespace

Timing Merge(const Timing& first, const Timing& second) {
  Timing merged = first;
  for (std::size_t i = 0; i < kNamedTimes.size(); ++i) {
    const auto time = kNamedTimes[i].time;
    if (first.*time || !(second.*time)) continue;
    merged.*time = second.*time;
    merged.from[i] = second.from[i];
  }
  return merged;
}

Timing MergeDevice(const Timing& device, const Timing& profile, const Timing& line) {
  Timing base = profile;
  for (std::size_t i = 0; i < kNamedTimes.size(); ++i) {
    const auto time = kNamedTimes[i].time;
    const bool waits = time == &Timing::reply || time == &Timing::gap || time == &Timing::ceiling;
    if (!waits || !(base.*time) || !(line.*time) || *(line.*time) <= *(base.*time)) continue;
    base.*time = line.*time;
    base.from[i] = line.from[i];
  }
  return Merge(device, base);
}

Timing Resolve(const Timing& given, const Timing& fallback) {
  Timing timing = Merge(given, fallback);
  if (given.reply && !given.ceiling) {
    timing.ceiling = *fallback.ceiling + *given.reply - *fallback.reply;
    timing.from[kCeiling] = timing.from[kReply];
  }
  if (given.gap && !given.ceiling && *given.gap > *fallback.gap) {
    *timing.ceiling += std::min(kPauses * (*given.gap - *fallback.gap), kMostForPauses);
    timing.from[kCeiling] = timing.from[kGap];
  }
  timing.ceiling = std::max(*timing.ceiling, *timing.reply + *timing.gap);
  return timing;
}

Timing Lengthen(const Timing& timing, const Timing& least) {
  Timing longer = timing;
  for (std::size_t i = 0; i < kNamedTimes.size(); ++i) {
    const auto time = kNamedTimes[i].time;
    Duration needed = (least.*time).value_or(Duration::zero());
    if (i == kCeiling) needed = std::max(needed, *timing.ceiling + *longer.reply - *timing.reply);
    if (needed <= *(timing.*time)) continue;
    longer.*time = needed;
    longer.from[i] = Level::learned;
  }
  return longer;
}

std::string TimesText(const Timing& timing) {
  std::string text;
  for (std::size_t i = 0; i < kNamedTimes.size(); ++i) {
    const auto& [name, time] = kNamedTimes[i];
    text +=
        (i == 0 ? "" : ", ") + std::string(name) + " " + FormatDuration(Rounded(*(timing.*time)));
    if (timing.from[i] != Level::protocol) text += " (" + std::string(Name(timing.from[i])) + ")";
  }
  return text;
}

Pace Merge(const Pace& first, const Pace& second) {
  Pace merged = first;
  VisitFields(&merged, [&](auto field) {
    auto& own = merged.*field.member;
    const auto& other = second.*field.member;
    if constexpr (requires { Merge(own, other); }) {
      own = Merge(own, other);
    } else if (!own) {
      own = other;
    }
  });
  return merged;
}

}  // namespace baudgate::config
