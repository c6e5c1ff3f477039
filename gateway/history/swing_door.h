// Which readings of a number have to be kept, so that straight lines between them stay within the
// deadband of all that is left out. No clock, no disk.
//
//   deadband 1    time 0   1   2   3   4   5
//                 value 0   1   2   3   9   9
//                 kept  0           3   9        a line from 0 to 3; a step to 9 at 4
//
// From the last that was kept, each reading narrows the fan of lines that pass all since within the
// deadband. One that lies in the fan may end the line, and the next may end it further on. One
// beside it ends the line at the reading before. What is not a good or uncertain number has no
// line; a change of quality, and max_gap, end one.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <optional>
#include <vector>

#include "gateway/history/entry.h"

namespace baudgate::history {

class SwingDoor {
 public:
  SwingDoor(double deadband, Millis max_gap) : deadband_(deadband), max_gap_(max_gap) {}

  /// Entries that are to be kept now, none, one or two, by their times. Times rise.
  std::vector<Entry> Take(const Entry& now);
  /// What has to be kept where nothing follows; nothing is known from then on.
  std::optional<Entry> End();
  /// Nobody knows what was kept.
  void Forget();

 private:
  void Begin(const Entry& at);
  bool Fits(const Entry& now) const;
  void Narrow(const Entry& now);

  const double deadband_;
  const Millis max_gap_;
  std::optional<Entry> begin_;   // of the line: kept
  std::optional<Entry> latest_;  // in the fan, not kept
  double low_ = 0;               // slopes
  double high_ = 0;
};

}  // namespace baudgate::history
