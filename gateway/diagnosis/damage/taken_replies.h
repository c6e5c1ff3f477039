// The latest replies that were taken, and what they answered: a copy of one is no reply to another
// request, and damage shows in its length. Bounded memory. A part of
// gateway/diagnosis/damage/reply_habits.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>
#include <utility>

#include "gateway/base/bytes.h"
#include "gateway/diagnosis/damage/changed_bytes.h"

namespace baudgate {

struct TakenReply {
  Bytes request;
  Bytes reply;

  bool operator==(const TakenReply&) const = default;
};

class TakenReplies {
 public:
  void Add(const Bytes& request, const Bytes& reply) {
    latest_.push_back({request, reply});
    if (latest_.size() > kKept) latest_.pop_front();
  }
  /// The frame was taken for the reply to another request than this.
  bool WasForOther(const Bytes& request, const Bytes& frame) const {
    return std::ranges::any_of(latest_, [&](const TakenReply& one) {
      return one.request != request && one.reply == frame;
    });
  }
  /// A text that is a character or two shorter than the last reply to the same request.
  bool IsShorterThanLast(const Bytes& request, const Bytes& text) const {
    if (text.empty() || !std::ranges::all_of(request, IsPrintable)) return false;
    const auto last =
        std::find_if(latest_.rbegin(), latest_.rend(),
                     [&request](const TakenReply& one) { return one.request == request; });
    if (last == latest_.rend() || text.front() != last->reply.front()) return false;
    return text.size() < last->reply.size() && text.size() + kFewLost >= last->reply.size();
  }

 private:
  static constexpr std::size_t kKept = 8;
  /// So many characters may be missing inside a text.
  static constexpr std::size_t kFewLost = 2;

  std::deque<TakenReply> latest_;
};

}  // namespace baudgate
