// `FixedValues` makes a simulated device measure the values that a test sets.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>

#include "protocols/twin.h"

namespace baudgate {

struct FixedValues final : protocols::TwinValues {
  std::map<std::size_t, Value> values;
  Value fallback;
  protocols::TwinValues* instead = nullptr;
  Value Get(std::size_t point, Instant now) const override {
    if (instead != nullptr) return instead->Get(point, now);
    const auto found = values.find(point);
    return found == values.end() ? fallback : found->second;
  }
  void Set(std::size_t point, const Value& value) override {
    if (instead != nullptr) return instead->Set(point, value);
    values[point] = value;
  }
};

}  // namespace baudgate
