// SPDX-License-Identifier: Apache-2.0
#include "config/model/timing.h"

#include <algorithm>

namespace baudgate::config {

Timing Merge(const Timing& first, const Timing& second) {
  Timing merged = first;
  if (!merged.quiet) merged.quiet = second.quiet;
  if (!merged.reply) merged.reply = second.reply;
  if (!merged.gap) merged.gap = second.gap;
  if (!merged.ceiling) merged.ceiling = second.ceiling;
  if (!merged.drain) merged.drain = second.drain;
  return merged;
}

Timing Resolve(const Timing& given, const Timing& fallback) {
  Timing timing = Merge(given, fallback);
  if (given.reply && !given.ceiling) {
    timing.ceiling = *fallback.ceiling + *given.reply - *fallback.reply;
  }
  timing.ceiling = std::max(*timing.ceiling, *timing.reply + *timing.gap);
  return timing;
}

Pace Merge(const Pace& first, const Pace& second) {
  Pace merged = first;
  merged.timing = Merge(first.timing, second.timing);
  if (!merged.retries) merged.retries = second.retries;
  if (!merged.poll) merged.poll = second.poll;
  if (!merged.slow) merged.slow = second.slow;
  if (!merged.daily) merged.daily = second.daily;
  return merged;
}

}  // namespace baudgate::config
