// Replies that may still come: until when (late_answers.h), to which request (whose_reply.h), and
// which readings are in doubt if one came twice (latest_readings.h).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/base/time.h"
#include "gateway/line/line.h"
#include "gateway/poll/asked.h"
#include "gateway/poll/late_answers.h"
#include "gateway/poll/latest_readings.h"
#include "gateway/poll/whose_reply.h"

namespace baudgate {

struct OwedReplies {
  /// `roster` outlives it.
  explicit OwedReplies(const Roster& roster)
      : late(roster), orders(roster), whose(roster, orders) {}

  /// The exchange of a request that the line is given now: as long as what is owed demands.
  /// `trusted`: the device has `trust_order`; `idle_since`: since when the line is idle.
  Exchange ExchangeOf(const Asked& asked, bool trusted, Instant idle_since, Instant now);

  LateAnswers late;
  ReplyOrders orders;
  WhoseReply whose;
  LatestReadings readings;
};

}  // namespace baudgate
