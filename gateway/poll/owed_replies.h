// Replies that may still come: until when (late_answers.h), to which request (whose_reply.h), and
// which readings are in doubt if one came twice (latest_readings.h).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/poll/late_answers.h"
#include "gateway/poll/latest_readings.h"
#include "gateway/poll/whose_reply.h"

namespace baudgate {

struct OwedReplies {
  /// `roster` outlives it.
  explicit OwedReplies(const Roster& roster) : late(roster), whose(roster) {}

  LateAnswers late;
  WhoseReply whose;
  LatestReadings readings;
};

}  // namespace baudgate
