// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/web/frames.h"

#include <utility>

namespace baudgate::web {

void Frames::Push(std::string text) {
  auto made = std::make_shared<const std::string>(std::move(text));
  const MutexLock lock(mutex_);
  bytes_ += made->size();
  frames_.push_back(std::move(made));
  while (frames_.size() > 1 && (frames_.size() > kMostFrames || bytes_ > kMostBytes)) {
    bytes_ -= frames_.front()->size();
    frames_.pop_front();
    ++first_;
  }
  if (snapshot_ && after_snapshot_ < first_) snapshot_.reset();
}

void Frames::SetSnapshot(std::string text) {
  auto made = std::make_shared<const std::string>(std::move(text));
  const MutexLock lock(mutex_);
  snapshot_ = std::move(made);
  after_snapshot_ = first_ + frames_.size();
  wanted_ = false;
}

void Frames::End(std::string farewell) {
  Push(std::move(farewell));
  const MutexLock lock(mutex_);
  ended_ = true;
}

bool Frames::wants_snapshot() const {
  const MutexLock lock(mutex_);
  return wanted_;
}

Frames::Next Frames::Take(std::uint64_t& position) {
  const MutexLock lock(mutex_);
  if (position < first_) {
    if (ended_) {
      position = first_ + frames_.size();
      return {frames_.back(), false};
    }
    if (!snapshot_) {
      wanted_ = true;
      return {};
    }
    position = after_snapshot_;
    return {snapshot_, false};
  }
  if (position >= first_ + frames_.size()) return {nullptr, ended_};
  return {frames_[position++ - first_], false};
}

}  // namespace baudgate::web
