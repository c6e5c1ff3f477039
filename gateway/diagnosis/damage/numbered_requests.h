// When the latest requests went out, where frames carry a number: a reply that comes behind other
// requests tells by its number how late it is. Bounded memory. A part of
// gateway/diagnosis/damage/earlier_replies.h.
//
//   > 01 5C ...                 1.0 s
//   > 01 66 ...                 2.5 s
//   < 01 5C ...                 2.8 s: 1.8 s behind its request
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>
#include <optional>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/bus/exchange/line.h"
#include "protocols/transaction.h"

namespace baudgate {

class NumberedRequests {
 public:
  /// A retry has the number of its first try.
  void OnSent(const Member& member, const Request& request, Instant now) {
    size_ = std::min(TransactionBytes(*member.protocol), request.bytes.size());
    if (size_ == 0) return;
    if (const std::size_t at = IndexOf(request.bytes); at < sent_.size()) {
      sent_[at].tries.push_back(now);
      return;
    }
    sent_.push_back({&member, request.bytes, {now}, ReplyTime(request, member.times)});
    if (sent_.size() > kKept) sent_.pop_front();
  }
  void OnAnswered(View reply) {
    if (const std::size_t at = IndexOf(reply); at < sent_.size()) ++sent_[at].answered;
  }

  struct Late {
    const Member* member = nullptr;
    /// Behind the first try of its request. If another try was answered before: behind the last
    /// try that it may answer, as that one's reply would not be late.
    Duration after{};
    Duration lateness{};  ///< since it was due; below zero: it is not late
  };
  /// What came is the late reply to an earlier request. Nothing: it is the reply to the latest one,
  /// its request is not known, or each try of that was answered before.
  std::optional<Late> Find(View reply, Instant came) const {
    const std::size_t at = IndexOf(reply);
    if (at + 1 >= sent_.size()) return std::nullopt;
    const Sent& its = sent_[at];
    if (its.answered >= its.tries.size()) return std::nullopt;
    Duration after = came - its.tries.front();
    for (const Instant tried : its.tries) {
      if (its.answered > 0 && came - tried > its.reply_time) after = came - tried;
    }
    return Late{its.member, after, after - its.reply_time};
  }

 private:
  static constexpr std::size_t kKept = 32;
  struct Sent {
    const Member* member = nullptr;
    Bytes request;
    std::vector<Instant> tries;
    Duration reply_time{};
    std::size_t answered = 0;  // of them
  };
  /// sent_.size(): there is none.
  std::size_t IndexOf(View frame) const {
    if (size_ == 0 || frame.size() < size_) return sent_.size();
    const auto found = std::ranges::find_if(sent_, [&](const Sent& sent) {
      return std::ranges::equal(View(sent.request).first(size_), frame.first(size_));
    });
    return static_cast<std::size_t>(found - sent_.begin());
  }

  std::size_t size_ = 0;  // of the number
  std::deque<Sent> sent_;
};

}  // namespace baudgate
