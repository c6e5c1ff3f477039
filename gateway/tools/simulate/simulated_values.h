// What the twins of simulated devices measure.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "config/model/point.h"
#include "protocols/twin.h"

namespace baudgate {

/// What a twin measures: each point follows its `simulate:` entry, a slow wave or a fixed value.
class SimulatedValues final : public TwinValues {
 public:
  /// `points` outlives the values; `seed` shifts the waves of one twin against those of another.
  SimulatedValues(const std::vector<config::Point>& points, std::uint32_t seed);
  Value Get(std::size_t point, Instant now) const override;
  void Set(std::size_t point, const Value& value) override;

 private:
  const std::vector<config::Point>& points_;
  std::uint32_t seed_;
  std::vector<Value> written_;
};

}  // namespace baudgate
