// What is sent to all viewers of the same points: frames, made once and shared. Each viewer keeps
// the number of the frame that it sends next. One that falls so far behind that its frame is gone
// starts again with a snapshot; no viewer has a queue of its own.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <string>

#include "gateway/base/guarded.h"

namespace baudgate::web {

class Frames {
 public:
  using Text = std::shared_ptr<const std::string>;
  static constexpr std::size_t kMostFrames = 25;
  static constexpr std::size_t kMostBytes = 4 * 1024 * 1024;

  /// For all viewers that have the frame before.
  void Push(std::string text);
  /// How all stands now, with all frames until now.
  void SetSnapshot(std::string text);
  /// Nothing follows this.
  void End(std::string farewell);
  /// A viewer waits for a snapshot.
  bool wants_snapshot() const;

  struct Next {
    Text text{};  ///< null: nothing yet
    bool ended = false;
  };
  /// `position`: 0 at first; the viewer's alone.
  Next Take(std::uint64_t& position);

 private:
  mutable Mutex mutex_;
  std::deque<Text> frames_ BAUDGATE_GUARDED_BY(mutex_);
  std::size_t bytes_ BAUDGATE_GUARDED_BY(mutex_) = 0;
  std::uint64_t first_ BAUDGATE_GUARDED_BY(mutex_) = 1;  ///< number of frames_.front()
  Text snapshot_ BAUDGATE_GUARDED_BY(mutex_);
  std::uint64_t after_snapshot_ BAUDGATE_GUARDED_BY(mutex_) = 0;  ///< the frame that follows it
  bool wanted_ BAUDGATE_GUARDED_BY(mutex_) = false;
  bool ended_ BAUDGATE_GUARDED_BY(mutex_) = false;
};

}  // namespace baudgate::web
