// Means and bounds of one point over spans of one width (a minute, an hour) that count from 1970,
// from every reading, before any of them is left out. A value counts from its reading until the
// next one; the mean is over the time in which it was good.
//
//   width 60 s; 0 s: 10   30 s: 20   90 s: bad   →   span 0: mean 15, min 10, max 20, first 10,
//   last 20, count 2, 60 s good                      span 60: mean 20, …, count 0, 30 s good
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "gateway/records/history/entry.h"

namespace baudgate::history {

struct Trend {
  Millis begin = 0;
  double mean = 0;
  double min = 0;
  double max = 0;
  double first = 0;  ///< of the good ones in force during the span, one from before it included
  double last = 0;
  std::int64_t count = 0;  ///< good readings that came in it
  Millis good = 0;         ///< time of good quality; never 0

  bool operator==(const Trend&) const = default;
};

/// `later` is of the same span, and what was behind `trend`.
void Merge(Trend& trend, const Trend& later);

/// Times never run backwards between two calls of Forget.
class Rollup {
 public:
  explicit Rollup(Millis width) : width_(width) {}

  /// From now on this is in force; empty: what is not good. `reading`: it was read just now.
  /// Spans that have ended go to `out`; those without good time are left out.
  void Set(Millis time, std::optional<double> value, bool reading, std::vector<Trend>& out);
  /// What is in force stays so until now.
  void Advance(Millis time, std::vector<Trend>& out);
  /// Advance; and the span that has not ended goes to `out` as far as it came. Nothing is in force.
  void Forget(Millis time, std::vector<Trend>& out);

 private:
  void Hold(Millis from, Millis until);
  void Close(std::vector<Trend>& out);

  Millis width_;
  Millis now_ = 0;
  std::optional<double> value_;
  double sum_ = 0;  // of value - first, times milliseconds, made small
  Trend span_{};    // good is 0: nothing was good in it yet
  bool begun_ = false;
};

}  // namespace baudgate::history
