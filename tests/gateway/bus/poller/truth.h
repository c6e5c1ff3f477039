// The true value of each point of a toy line, and a check that the store contains no other values.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include "tests/support/virtual_line.h"

namespace baudgate::bus {

/// Returns a value that differs for each device and point, so a value at the wrong place is found.
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

/// Expects that each point has either no value or its true value, whatever its quality.
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
