// The request of a job goes out: which times its exchange has, and who learns that it was sent. A
// part of gateway/bus/jobs/job_run.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/bus/counters/line_account.h"
#include "gateway/bus/exchange/line.h"
#include "gateway/bus/jobs/job.h"
#include "gateway/bus/replies/owed_replies.h"
#include "gateway/bus/schedule/turns.h"
#include "gateway/bus/schedule/write_queue.h"

namespace baudgate {

class JobSending {
 public:
  /// All outlive it.
  JobSending(OwedReplies& owed, Turns& turns, WriteQueue& writes, LineAccount& account)
      : owed_(owed), turns_(turns), writes_(writes), account_(account) {}

  /// The line is given the exchange. `idle_since`: since when the line is idle.
  Exchange Start(Job& job, Instant idle_since, Instant now);
  /// The line has been quiet long enough: the request to be sent now.
  const Request& Send(Job& job, Now now);
  /// Its exchange has ended. A reply that comes from now on is late.
  void OnEnd(const Job& job, Outcome outcome, Instant now) {
    owed_.late.OnEnd(job.asked(), outcome, now);
  }
  /// That request has never left this machine, and never will.
  static void NeverLeft(Job& job);

 private:
  void NoteWriting(Job::Write& write, const Device& device);

  OwedReplies& owed_;
  Turns& turns_;
  WriteQueue& writes_;
  LineAccount& account_;
};

}  // namespace baudgate
