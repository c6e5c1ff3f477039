// Events that are not on the disk yet, of a device that sends unasked. It cannot be made to wait,
// so their number is bounded here: events beyond it are lost and counted.
//
//   Take() 1000 times, OnKept() never    true
//   Take()                               false: one is lost
//   OnKept(), Take()                     true; TakeLost(): 1, to be reported with this one
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>

namespace baudgate {

class EventBacklog {
 public:
  static constexpr std::size_t kMost = 1000;

  /// A batch of this many events is to be saved. False: there is no room for it.
  bool Take(std::size_t events) {
    if (waiting_ >= kMost) {
      lost_ += events;
      return false;
    }
    ++waiting_;
    return true;
  }
  /// A batch that was taken is on the disk.
  void OnKept() {
    if (waiting_ > 0) --waiting_;
  }
  /// How many were lost since the last call.
  std::size_t TakeLost() { return std::exchange(lost_, 0); }
  std::size_t waiting() const { return waiting_; }

 private:
  std::size_t waiting_ = 0;  // batches
  std::size_t lost_ = 0;     // events
};

}  // namespace baudgate
