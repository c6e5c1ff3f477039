// When the latest requests went out, where frames carry a number: a reply that comes behind other
// requests tells by its number how late it is. Bounded memory. A part of
// gateway/poll/earlier_replies.h.
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

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "gateway/line/line.h"
#include "gateway/poll/roster.h"
#include "protocols/transaction.h"

namespace baudgate {

class NumberedRequests {
 public:
  /// A retry has the number of its first try.
  void OnSent(const Member& member, const Request& request, Instant now) {
    size_ = std::min(TransactionBytes(*member.protocol), request.bytes.size());
    if (size_ == 0) return;
    if (const std::size_t at = IndexOf(request.bytes); at < sent_.size()) {
      ++sent_[at].owed;
      return;
    }
    sent_.push_back({&member, request.bytes, now, ReplyTime(request, member.times)});
    if (sent_.size() > kKept) sent_.pop_front();
  }
  void OnAnswered(View reply) {
    if (const std::size_t at = IndexOf(reply); at < sent_.size()) --sent_[at].owed;
  }

  struct Late {
    const Member* member = nullptr;
    Duration after{};     ///< behind the first try of its request
    Duration lateness{};  ///< since it was due; below zero: it is not late
  };
  /// What came is the late reply to an earlier request. Nothing: it is the reply to the latest one,
  /// its request is not known, or each try of that was answered before.
  std::optional<Late> Find(View reply, Instant came) const {
    const std::size_t at = IndexOf(reply);
    if (at + 1 >= sent_.size() || sent_[at].owed <= 0) return std::nullopt;
    const Sent& its = sent_[at];
    const Duration after = came - its.at;
    return Late{its.member, after, after - its.reply_time};
  }

 private:
  static constexpr std::size_t kKept = 32;
  struct Sent {
    const Member* member = nullptr;
    Bytes request;
    Instant at{};
    Duration reply_time{};
    int owed = 1;  // replies
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
