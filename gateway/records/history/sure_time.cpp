// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/history/sure_time.h"

#include <algorithm>

namespace baudgate::history {

void SureTime::Begin(Now now, std::optional<Millis> newest) {
  began_ = now.instant;
  latest_ = newest ? *newest + kDay : ToMillis(now.wall);
  last_ = now;
  settles_ = now.instant + kSettled;
}

std::optional<Millis> SureTime::Look(Now now) {
  const Duration stepped = now.wall - last_.wall - (now.instant - last_.instant);
  last_ = now;
  if (stepped > kStep || stepped < -kStep) settles_ = now.instant + kSettled;
  if (now.instant < settles_) return std::nullopt;
  const Millis could = latest_ + (now.instant - began_) / 1ms;
  return std::min(ToMillis(now.wall), could);
}

}  // namespace baudgate::history
