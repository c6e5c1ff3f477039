// What a twin measures in a test: the values that the test has set.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>

#include "protocols/twin.h"

namespace baudgate {

struct FixedValues final : TwinValues {
  std::map<std::size_t, Value> values;
  Value fallback;  ///< of points without one
  Value Get(std::size_t point, Instant) const override {
    const auto found = values.find(point);
    return found == values.end() ? fallback : found->second;
  }
  void Set(std::size_t point, const Value& value) override { values[point] = value; }
};

}  // namespace baudgate
