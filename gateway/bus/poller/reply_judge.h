// What a frame means that came as the reply to a job's request: to which request it belongs
// (gateway/bus/replies/whose_reply.h), and what its conversation reads in it. Stores the result in
// the job. Called by gateway/bus/poller/reception.h.
//
//   a frame comes                        outcome
//   it may be the echo of the request    unexpected
//   damaged, or of another form          as the conversation or the carrier says
//   it may answer an earlier request     unexpected: the job asks again until that is certain
//   its own                              as the conversation says, which sees only such replies
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/bus/exchange/line.h"
#include "gateway/bus/jobs/job.h"
#include "gateway/bus/replies/whose_reply.h"

namespace baudgate {

class ReplyJudge {
 public:
  /// It outlives this.
  explicit ReplyJudge(WhoseReply& whose_reply) : whose_reply_(whose_reply) {}

  void OnOpened() { echo_free_ = false; }
  /// `may_be_echo`: see EchoWatch.
  Outcome Judge(Job& job, View frame, bool may_be_echo, Instant now);
  /// The exchange has ended; `echoed`: its request has come back. Adds to `finding` what the bytes
  /// do not show: the words of the device, and that its reply was not taken.
  void OnEnd(const Job& job, const ExchangeEnd& end, bool echoed, Finding& finding);

 private:
  Outcome JudgeRouted(Job& job, View frame);
  static Outcome Doubt(Job& job, View frame, Outcome outcome);
  static Outcome Read(Job& job, View frame, Instant now);
  static Outcome Refuse(Job& job, View frame, Outcome outcome);

  WhoseReply& whose_reply_;
  bool echo_free_ = false;  // the latest one whose reply cannot equal it has not come back
};

}  // namespace baudgate
