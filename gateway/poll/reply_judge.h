// What a frame means that came as the reply to a job's request: whose it is (whose_reply.h), and
// what its conversation reads in it. Puts what it finds into the job. Asked by
// gateway/poll/poller_line.cpp.
//
//   a frame comes                        outcome
//   it may be the echo of the request    unexpected
//   damaged, or of another form          as the conversation or the carrier says
//   it may answer an earlier request     unexpected: the job asks again until that is certain
//   its own                              as the conversation says; only now that hears of the reply
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/line/line.h"
#include "gateway/poll/job.h"
#include "gateway/poll/whose_reply.h"

namespace baudgate {

class ReplyJudge {
 public:
  /// It outlives this.
  explicit ReplyJudge(WhoseReply& whose_reply) : whose_reply_(whose_reply) {}

  void OnOpened() { echo_free_ = false; }
  /// An exchange begins.
  void OnStart() { echoed_ = false; }
  /// The request under way has come back, and is not the reply.
  void OnEcho() { echoed_ = true; }
  /// `may_be_echo`: see EchoWatch.
  Outcome Judge(Job& job, View frame, bool may_be_echo, Instant now);
  /// The exchange has ended. Adds to `finding` what the bytes do not show: what the device has
  /// said, and that its reply was not taken.
  void OnEnd(const Job& job, const ExchangeEnd& end, Finding& finding);

 private:
  Outcome JudgeRouted(Job& job, View frame);
  Outcome Refuse(Job& job, View frame, Outcome outcome);

  WhoseReply& whose_reply_;
  bool echoed_ = false;     // the present request
  bool echo_free_ = false;  // the latest one whose reply cannot equal it has not come back
};

}  // namespace baudgate
