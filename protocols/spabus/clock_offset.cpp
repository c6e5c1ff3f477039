// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/clock_offset.h"

#include <algorithm>
#include <cmath>

#include "gateway/base/text.h"

namespace baudgate::protocols::spabus {

std::optional<Duration> SecondsOf(std::string_view data) {
  constexpr double kMinute = 60;
  constexpr double kNanos = 1e9;
  const auto seconds = ParseDecimal(Trim(data));
  if (!seconds || !(*seconds >= 0 && *seconds < kMinute)) return std::nullopt;
  return Duration(std::llround(*seconds * kNanos));
}

void ClockOffset::OnSent(Now arrives, Duration character) {
  if (!first_) first_ = arrives.instant;
  arrives_ = arrives;
  character_ = character;
}

ClockOffset::Offset ClockOffset::Of(std::string_view data, std::size_t characters, Instant now,
                                    bool right) const {
  constexpr Duration kHalf = 30s;
  const auto said = SecondsOf(data);
  if (!said) return {{}, Quality::bad_configuration};
  if (!first_) return {{}, Quality::bad_waiting};
  const Duration reply = static_cast<std::int64_t>(characters) * character_;
  const Instant began = std::max(now - reply, arrives_.instant);
  const WallTime looked = arrives_.wall + (began - arrives_.instant) / 2;
  Duration offset = (*said - looked.time_since_epoch() % Duration(1min)) % Duration(1min);
  if (offset > kHalf) offset -= 1min;
  if (offset <= -kHalf) offset += 1min;
  const bool narrow = began - *first_ <= kWidest;
  return {std::chrono::duration<double>(offset).count(),
          right && narrow ? Quality::good : Quality::uncertain_sub_normal};
}

}  // namespace baudgate::protocols::spabus
