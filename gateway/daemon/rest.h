// Connections of a server that ends them in good order, as some do behind each answer and others
// after a rest. Such an end is no outage: the next request opens the connection again.
//
//   answered, ended while nothing is asked        rests; opened by the next request
//   answered, ended with a request under way      the same, and from then on each request gets a
//                                                 connection of its own: the next would be lost,
//                                                 too
//   ended before any answer                       an outage
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <utility>

#include "gateway/base/bytes.h"

namespace baudgate {

class Rest {
 public:
  /// A connection was opened, with so many answers on the line before. True: it goes on for one
  /// that rested.
  bool OnOpened(std::uint64_t answers) {
    answers_before_ = answers;
    is_used_ = asks_ = false;
    return std::exchange(rests_, false);
  }
  /// It was ended in good order. False: that is an outage.
  bool OnEnded(std::uint64_t answers) {
    const bool answered = answers > answers_before_;
    if (!answered || rests_) return false;
    once_each_ = once_each_ || asks_;
    return rests_ = true;
  }
  void OnBytes() { asks_ = false; }
  /// A request is to be sent. True: it waits for a connection to be opened.
  bool Holds(View request) {
    const bool holds = rests_ || (once_each_ && is_used_);
    if (holds) {
      rests_ = true;
      held_.assign(request.begin(), request.end());
    }
    is_used_ = asks_ = !holds;
    return holds;
  }
  /// The request that has waited, if it is still wanted.
  Bytes TakeHeld() {
    is_used_ = asks_ = !held_.empty();
    return std::exchange(held_, {});
  }
  void GiveUpHeld() { held_.clear(); }
  /// It is closed for another reason.
  void End() {
    rests_ = false;
    held_.clear();
  }

  bool rests() const { return rests_; }

 private:
  std::uint64_t answers_before_ = 0;
  bool rests_ = false;
  bool once_each_ = false;
  bool is_used_ = false;  // a request went out over this connection
  bool asks_ = false;     // and nothing has come since
  Bytes held_;
};

}  // namespace baudgate
