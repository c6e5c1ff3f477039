// What the point store holds of a device: the latest reading of every point, the device's status,
// and from which ages its values are doubted. gateway/bus/points/ageing.h derives the quality.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "config/model/line.h"
#include "gateway/base/quality.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"
#include "gateway/bus/points/device_status.h"

namespace baudgate {

struct PointRecord {
  Value value;                              ///< the last that was not bad; empty before the first
  Quality reported = Quality::bad_waiting;  ///< as the last reading said, before age and state
  Quality at_best = Quality::good;  ///< limit until the next reading: it was doubted or too old
  /// The end of the reply, monotonic. Earlier after a late one: such a value is as old as its
  /// request.
  std::optional<Instant> read_at;
  WallTime source_time{};    ///< the same, civil
  std::uint64_t seq = 0;     ///< counts the readings of this point
  std::uint32_t rtt_us = 0;  ///< round trip of the exchange that read it
};

/// For the values of one group.
struct AgeLimits {
  static constexpr Duration kNever = Duration::max();
  Duration uncertain_after = kNever;
  Duration bad_after = kNever;

  bool ages() const { return uncertain_after != kNever; }
  bool operator==(const AgeLimits&) const = default;
};

/// The quality of all values of a device, whatever their age; empty: each has its own.
using Override = std::optional<Quality>;

struct DeviceRecord {
  const config::Line* line = nullptr;
  const config::Device* device = nullptr;
  std::vector<PointRecord> points;  ///< as device->points
  DeviceStatus status;
  Override override_quality;
  Duration line_cycle{};  ///< measured: the line reads all its fast points once in this time
  std::array<AgeLimits, config::kGroups> age_limits;  ///< by config::Group
  /// Raised with every reading, override and age limit: while it stays, only age changes a quality.
  std::uint64_t version = 0;
};

}  // namespace baudgate
