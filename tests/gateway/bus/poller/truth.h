// The values that a toy line's devices have, and that its store may show: nothing else is the
// truth.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include "tests/support/virtual_line.h"

namespace baudgate::bus {

/// Truth that differs from point to point, so that a value at the wrong place is seen.
inline double TruthOf(std::size_t device, std::size_t point) {
  return static_cast<double>(1000 * (device + 1) + point);
}

inline void SetTruth(VirtualLine& line, std::size_t devices, std::size_t points) {
  for (std::size_t device = 0; device < devices; ++device) {
    for (std::size_t point = 0; point < points; ++point) {
      line.twin(device).values.Set(point, TruthOf(device, point));
    }
  }
}

/// Every value in the store is nothing or the truth, whatever its quality.
inline void ExpectOnlyTruth(VirtualLine& line, std::uint32_t devices, std::uint32_t points) {
  for (std::uint32_t device = 0; device < devices; ++device) {
    for (std::uint32_t point = 0; point < points; ++point) {
      const Value value = line.ValueOf(device, point);
      ASSERT_TRUE(!HasValue(value) || value == Value(TruthOf(device, point)))
          << "device " << device << " point " << point << " shows " << ToText(value) << " after "
          << FormatDuration(line.elapsed());
    }
  }
}

}  // namespace baudgate::bus
