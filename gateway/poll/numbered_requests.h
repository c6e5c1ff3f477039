// When the latest requests went out, where frames carry a number: a reply that comes behind other
// requests tells by its number how late it is. Bounded memory. A part of gateway/poll/examiner.h.
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
#include "gateway/poll/roster.h"
#include "protocols/transaction.h"

namespace baudgate {

class NumberedRequests {
 public:
  /// A retry has the number of its first try.
  void OnSent(const Member& member, View request, Instant now) {
    size_ = std::min(TransactionBytes(*member.protocol), request.size());
    if (size_ == 0 || Find(request) != nullptr) return;
    sent_.push_back({&member, Bytes(request.begin(), request.end()), now});
    if (sent_.size() > kKept) sent_.pop_front();
  }
  struct Late {
    const Member* member = nullptr;
    Duration after{};  ///< behind the first try of its request
  };
  /// Nothing: it is the reply to the latest request, or its request is not known.
  std::optional<Late> Find(View reply, Instant came) const {
    const Sent* const sent = size_ > 0 && reply.size() >= size_ ? Find(reply) : nullptr;
    if (sent == nullptr || IsSame(sent_.back().request, reply)) return std::nullopt;
    return Late{sent->member, came - sent->at};
  }

 private:
  static constexpr std::size_t kKept = 32;
  struct Sent {
    const Member* member = nullptr;
    Bytes request;
    Instant at{};
  };
  bool IsSame(View one, View other) const {
    return std::ranges::equal(one.first(size_), other.first(size_));
  }
  const Sent* Find(View frame) const {
    const auto found =
        std::ranges::find_if(sent_, [&](const Sent& sent) { return IsSame(sent.request, frame); });
    return found == sent_.end() ? nullptr : &*found;
  }

  std::size_t size_ = 0;  // of the number
  std::deque<Sent> sent_;
};

}  // namespace baudgate
