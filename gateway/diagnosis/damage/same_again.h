// Does the same come whatever is asked? Byte for byte what came to other requests before, one after
// another, and it was right once. A part of gateway/diagnosis/damage/reply_habits.h.
//
//   asked            came             it is the same again
//   A, B             x, x             no: two replies may be alike
//   A, B, C, D, E    x, x, x, x, x    yes, if x was right once
//   A, B, B, B, B, B, B    each x     yes, if x cannot answer B
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>

#include "gateway/base/bytes.h"

namespace baudgate {

class SameAgain {
 public:
  /// The same reply to this many other requests is no chance, where each of them may be answered
  /// alike; and where replies are numbered.
  static constexpr std::size_t kSame = 4;
  static constexpr std::size_t kSameNumbered = 2;

  /// `right`: it is the reply to `request`; `misfit`: it cannot be.
  bool OnCame(View came, const Bytes& request, bool right, bool misfit, bool numbered) {
    if (came.size() < kShortest) return false;
    if (!std::ranges::equal(came, came_)) {
      *this = {};
      came_.assign(came.begin(), came.end());
      asked_ = request;
    } else if (request != asked_) {
      ++others_;
      asked_ = request;
    }
    right_ = right_ || right;
    if (misfit) ++misfits_;
    if (!right_ || others_ == 0) return false;
    return misfits_ >= kMisfits || others_ >= (numbered ? kSameNumbered : kSame);
  }

 private:
  /// Fewer bytes may well be the same.
  static constexpr std::size_t kShortest = 4;
  /// So often in a row it came to requests that it cannot answer: more than a lag brings.
  static constexpr std::size_t kMisfits = 6;

  Bytes came_;
  Bytes asked_;              // by which request
  std::size_t others_ = 0;   // further requests in a row to which the same came
  std::size_t misfits_ = 0;  // exchanges that it came to and is no reply to
  bool right_ = false;       // it was the reply to one of them
};

}  // namespace baudgate
