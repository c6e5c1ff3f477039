// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/twin_clock.h"

#include "protocols/set4tm/status.h"

namespace baudgate::protocols::set4tm {

std::optional<CivilZone::Utc> TwinClock::At(Instant now) const {
  if (!set_) return std::nullopt;
  const WallTime wall = set_->wall + (now - set_->instant);
  return std::chrono::floor<std::chrono::seconds>(wall) + correction_;
}

std::uint8_t TwinClock::Correct(std::chrono::seconds by, Instant now) {
  constexpr std::chrono::seconds kMost(120);
  if (std::chrono::abs(by) > kMost) return kNotAllowed;
  const auto shown = zone_.ToCivil(At(now).value_or(CivilZone::Utc()));
  if (std::chrono::floor<std::chrono::hours>(shown) !=
      std::chrono::floor<std::chrono::hours>(shown + by)) {
    return kNotAllowed;
  }
  const auto today = std::chrono::floor<std::chrono::days>(shown);
  if (corrected_on_ == today) return kClockAlreadyCorrected;
  corrected_on_ = today;
  correction_ += by;
  return kOk;
}

}  // namespace baudgate::protocols::set4tm
