// Is this reading kept? The one decision about each reading, without clock and disk.
//
//   deadband 0.5, kept 10.0 good     10.4 good: no      10.6 good: yes      10.0 uncertain: yes
//   max_gap 10min, kept at 12:00     the same at 12:09: no      at 12:10: yes
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/model/history.h"
#include "gateway/records/history/entry.h"

namespace baudgate::history {

struct LogRule {
  bool every = false;
  Decimal deadband = 0;  ///< a change by just so much is not kept; 0: every change is
  Millis max_gap = 10 * kMinute;

  static LogRule Of(const config::HistoryPoint& point);
};

/// `last`: the value kept last; null: none, or what happened since is not known.
bool IsKept(const LogRule& rule, const Entry* last, const Entry& now);

}  // namespace baudgate::history
