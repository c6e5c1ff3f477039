// A reply that broke off, and whose rest may come in a later exchange. A part of
// gateway/diagnosis/damage/earlier_replies.h.
//
//   < 01 03 04 00 0B          kept
//   > the next request
//   < 00 16 6B F5             with what is kept it makes a whole reply: it is the rest
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/diagnosis/damage/heard_exchange.h"

namespace baudgate {

class BrokenReply {
 public:
  BrokenReply() = default;
  /// `begin` came to a request; its last byte at `last`.
  BrokenReply(const Member& member, const Request& request, View begin, Instant last)
      : member_(&member), request_(request), begin_(begin.begin(), begin.end()), last_(last) {}

  /// An exchange with the member has begun.
  void OnBegin(const Member& member) { began_ += member_ == &member ? 1 : 0; }
  /// When its rest came in this exchange: before or behind the reply that was taken; where none
  /// was, before or behind the beginning of another one. Empty: it did not come. From the computed
  /// end of the request.
  std::optional<Duration> FindRest(const HeardExchange& exchange) const;

  const Member& member() const { return *member_; }
  /// When its last byte came.
  Instant last() const { return last_; }
  /// Exchanges of the member that have begun since.
  std::size_t began() const { return began_; }

 private:
  bool IsAwaited(const HeardExchange& exchange) const;
  bool IsRest(View rest, Instant came) const;

  const Member* member_ = nullptr;
  Request request_;
  Bytes begin_;
  Instant last_{};
  std::size_t began_ = 0;
};

}  // namespace baudgate
