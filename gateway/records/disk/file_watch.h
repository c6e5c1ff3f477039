// When the file of a log is looked at although nothing is written to it, and when its disk does not
// answer in time. No thread, no lock, no clock: whoever has them asks once a second.
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace baudgate {

class FileWatch {
 public:
  /// A disk for which something waits at more ticks in a row does not answer in time.
  static constexpr int kMostTicks = 3;
  static constexpr int kLookEvery = 10;  ///< ticks

  /// `waits`: something is to be written, and nothing is known to be wrong. True: for too long.
  bool Tick(bool waits) {
    ++ticks_;
    look_ = look_ || ticks_ % kLookEvery == 0;
    waited_ = waits || writing_ ? waited_ + 1 : 0;
    return waited_ > kMostTicks;
  }
  bool look_due() const { return look_; }

  struct Look {
    bool due = false;
    bool whole = false;  ///< all of the file is read
  };
  Look TakeLook() {
    const Look look{look_, look_ && doubt_};
    if (look.whole) doubt_ = false;
    look_ = false;
    return look;
  }
  /// A reader has found that the file is damaged.
  void Doubt() { doubt_ = true; }

  /// The thread that writes may hang in between.
  void Begin() { writing_ = true; }
  void End() {
    writing_ = false;
    waited_ = 0;
  }

 private:
  int ticks_ = 0;
  int waited_ = 0;
  bool look_ = false;
  bool doubt_ = false;
  bool writing_ = false;
};

}  // namespace baudgate
