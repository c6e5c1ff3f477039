// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/placed_time.h"

#include <algorithm>
#include <array>

namespace baudgate::events {
namespace {

/// The last moment up to `until` of which a clock says `said`.
WallTime LastUpTo(WallTime until, const SaidTime& said) {
  const Duration since = until.time_since_epoch() - said.time;
  Duration beyond = since % said.period;
  if (beyond < Duration::zero()) beyond += said.period;
  return until - beyond;
}

PlacedTime PlaceOne(const SaidTime& said, WallTime until, WallTime received,
                    std::optional<Duration> oldest) {
  if (said.period <= Duration::zero()) return {WallTime(said.time), ClockQuality::device};
  const WallTime last = LastUpTo(until, said);
  if (!oldest) return {last, ClockQuality::minute_guessed};
  const WallTime from = received - *oldest - kClockTolerance;
  if (last < from) return {last, ClockQuality::out_of_step};
  const bool others = last - said.period >= from;
  return {last, others ? ClockQuality::minute_guessed : ClockQuality::device};
}

}  // namespace

std::string_view Name(ClockQuality quality) {
  constexpr std::array<std::string_view, kClockQualities> kNames = {
      "none", "gateway", "device", "minute guessed", "out of step"};
  return kNames[static_cast<std::size_t>(quality)];
}

ClockQuality ClockQualityOf(std::int64_t number) {
  const bool known = number >= 0 && number < static_cast<std::int64_t>(kClockQualities);
  return known ? static_cast<ClockQuality>(number) : ClockQuality::none;
}

/// From the last to the first: what came later bounds what came before.
std::vector<PlacedTime> Place(const std::vector<std::optional<SaidTime>>& said, WallTime received,
                              std::optional<Duration> oldest) {
  std::vector<PlacedTime> placed(said.size());
  WallTime until = received + kClockTolerance;
  for (std::size_t i = said.size(); i-- > 0;) {
    if (!said[i]) {
      placed[i] = {received, ClockQuality::none};
      continue;
    }
    placed[i] = PlaceOne(*said[i], until, received, oldest);
    // One that is said to be a moment later than its successor is not a minute older.
    const bool fits = placed[i].quality != ClockQuality::out_of_step;
    if (fits) until = std::min(until, placed[i].time + kClockTolerance);
  }
  return placed;
}

}  // namespace baudgate::events
