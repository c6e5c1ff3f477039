// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/request_intake.h"

#include <utility>

namespace baudgate::dds {

void RequestIntake::Offer(WriteArrival arrival, Instant now) {
  if (Keep(arrival, now) && wake_) wake_();
}

bool RequestIntake::Keep(WriteArrival& arrival, Instant now) {
  const MutexLock lock(mutex_);
  if (waiting_.size() >= kMost || !pace_.Take(now)) {
    ++dropped_;
    return false;
  }
  waiting_.push_back(std::move(arrival));
  return true;
}

std::optional<WriteArrival> RequestIntake::Take() {
  const MutexLock lock(mutex_);
  if (waiting_.empty()) return std::nullopt;
  WriteArrival arrival = std::move(waiting_.front());
  waiting_.pop_front();
  return arrival;
}

std::uint64_t RequestIntake::dropped() const {
  const MutexLock lock(mutex_);
  return dropped_;
}

}  // namespace baudgate::dds
