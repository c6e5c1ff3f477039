// Events of a device that speaks unasked and that are not on the disk yet. It cannot be made to
// wait, so their number is bounded here: what comes beyond is lost, and counted.
//
//   Take() 1000 times, OnKept() never    true
//   Take()                               false: one is lost
//   OnKept(), Take()                     true; TakeLost(): 1, to be told with this one
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>

namespace baudgate {

class EventBacklog {
 public:
  static constexpr std::size_t kMost = 1000;

  /// A batch of so many events is to be kept. False: there is no room for it.
  bool Take(std::size_t events) {
    if (waiting_ >= kMost) {
      lost_ += events;
      return false;
    }
    ++waiting_;
    return true;
  }
  /// One that was taken is on the disk.
  void OnKept() {
    if (waiting_ > 0) --waiting_;
  }
  /// How many were lost since this was asked last.
  std::size_t TakeLost() { return std::exchange(lost_, 0); }
  std::size_t waiting() const { return waiting_; }

 private:
  std::size_t waiting_ = 0;  // batches
  std::size_t lost_ = 0;     // events
};

}  // namespace baudgate
