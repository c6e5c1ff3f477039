// Replies that may still come: until when (late_answers.h), to which request (whose_reply.h), and
// which readings are in doubt if one came twice (gateway/bus/devices/latest_readings.h).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/base/time.h"
#include "gateway/bus/devices/latest_readings.h"
#include "gateway/bus/exchange/line.h"
#include "gateway/bus/replies/asked.h"
#include "gateway/bus/replies/late_answers.h"
#include "gateway/bus/replies/whose_reply.h"

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
