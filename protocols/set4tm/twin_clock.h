// The clock of a simulated meter: that of this machine, and what it was corrected by.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "gateway/base/time.h"
#include "protocols/common/civil_zone.h"

namespace baudgate::protocols::set4tm {

class TwinClock {
 public:
  explicit TwinClock(const CivilZone& zone) : zone_(zone) {}

  void Set(Now now) { set_ = now; }
  /// What it shows; empty: it was never set.
  std::optional<CivilZone::Utc> At(Instant now) const;
  /// Returns the status: level 1 may correct it by up to two minutes, once a day, within an hour.
  std::uint8_t Correct(std::chrono::seconds by, Instant now);

  const CivilZone& zone() const { return zone_; }

 private:
  const CivilZone zone_;
  std::optional<Now> set_;
  std::chrono::seconds correction_{};
  std::optional<std::chrono::local_days> corrected_on_;
};

}  // namespace baudgate::protocols::set4tm
