// SPDX-License-Identifier: Apache-2.0
#include "gateway/dds/write_pace.h"

namespace baudgate::dds {
namespace {

constexpr Duration kShortestHold = 1ms;

}  // namespace

bool WritePace::Took(Sent said, Instant now) {
  if (said != Sent::later) {
    hold_ = {};
    return true;
  }
  hold_ = std::clamp(2 * hold_, kShortestHold, kLongestHold);
  held_until_ = now + hold_;
  return false;
}

}  // namespace baudgate::dds
