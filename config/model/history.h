// Which values are kept, and how long (gateway/records/history).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "config/model/fields.h"
#include "gateway/base/decimal.h"
#include "gateway/base/time.h"

namespace baudgate::config {

/// One point whose values are kept: every change of its quality, and of its value as said here.
struct HistoryPoint {
  std::uint32_t device = 0;  ///< through all lines, as FirstDevice counts
  std::uint32_t point = 0;   ///< in that device's points
  bool every = false;        ///< every reading, changed or not
  Decimal deadband = 0;      ///< smaller changes are not kept, in units of the value
  Duration max_gap = std::chrono::minutes(10);  ///< an unchanged value is kept again after this
};

template <typename Visit>
void VisitFields(const HistoryPoint*, Visit visit) {
  visit(Derived<&HistoryPoint::device>());
  visit(Derived<&HistoryPoint::point>());
  visit(Field<&HistoryPoint::every>());
  visit(Field<&HistoryPoint::deadband>());
  visit(Field<&HistoryPoint::max_gap>());
}

inline constexpr std::uint64_t kMegabyte = 1'000'000;

struct History {
  std::string directory;                   ///< folder of the files; empty = as `state`
  std::uint64_t limit = 1000 * kMegabyte;  ///< bytes of all files together
  Duration keep = std::chrono::hours(24) * 365;
  std::vector<HistoryPoint> points;  ///< by device and point; empty: nothing is kept

  bool on() const { return !points.empty(); }
};

template <typename Visit>
void VisitFields(const History*, Visit visit) {
  visit(Field<&History::directory>());
  visit(Field<&History::limit>());
  visit(Field<&History::keep>());
  visit(Field<&History::points>());
}

}  // namespace baudgate::config
