// What follows from a meter's replies: a table by the kind of their requests (replies.cpp).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "protocols/set4tm/meter_parts.h"
#include "protocols/set4tm/reply.h"
#include "protocols/set4tm/requests.h"

namespace baudgate::protocols::set4tm {

class MeterReplies {
 public:
  /// `parts` outlive it.
  explicit MeterReplies(MeterParts& parts) : parts_(parts) {}

  /// A reply that fits its request.
  struct Step {
    RequestKind asked;  ///< the kind of the request
    const Task& task;
    Reply reply;
    std::size_t bytes = 0;  ///< of the whole frame
    Instant now{};
  };
  Answer Take(Step step);

 private:
  struct Row;
  static const Row kRows[];
  static const Row& RowOf(RequestKind kind);

  Answer Unread(const Step& step, Answer answer);
  /// The reply answers the poll's own query.
  bool IsOwn(const Step& step) const;

  static Answer Plain(MeterReplies& its, Step& step);
  Answer TakeStatus(Step& step);
  Answer TakeData(Step& step);
  Answer TakePrelude(Step& step);
  Answer TakeRead(Step& step);
  Answer ReadRefused(Step& step);
  void AddDrift(Step& step);

  MeterParts& parts_;
};

}  // namespace baudgate::protocols::set4tm
