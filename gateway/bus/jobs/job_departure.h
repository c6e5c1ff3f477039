// Decides whether the request of a job may go out: now, later, behind a probe, or not at all. A job
// that cannot go is put aside. A part of gateway/bus/jobs/job_run.h.
//
//   the request                                       next
//   may not be sent any more (WhyNotSend)             what is open is closed; else the job ends
//   could be met by a reply to an earlier one         a probe goes first
//   is a retry, or nothing is owed                    it is sent
//   of a read, a late reply of its device is due      the job is parked, where replies name their
//                                                     sender
//   of anything else, a late reply is due             the line waits
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>

#include "gateway/base/time.h"
#include "gateway/bus/jobs/agenda.h"
#include "gateway/bus/jobs/chooser.h"
#include "gateway/bus/jobs/job.h"
#include "gateway/bus/jobs/next_step.h"
#include "gateway/bus/replies/late_answers.h"
#include "gateway/bus/replies/whose_reply.h"

namespace baudgate {

class JobDeparture {
 public:
  /// All outlive it.
  JobDeparture(WhoseReply& whose, const LateAnswers& late, Chooser& chooser, Agenda& agenda)
      : whose_(whose), late_(late), chooser_(chooser), agenda_(agenda) {}

  /// The line is idle.
  NextStep Decide(Job& job, Instant now);
  /// When Decide may say something else, where it has said hold.
  std::optional<Instant> NextAt(const Job& job) const;
  /// The line has the request, and is not quiet yet. Empty: it waits on. A read lets a short write
  /// pass, and a request that has become too late, or is forbidden by now, is not sent.
  std::optional<NextStep> Withdraw(Job& job, Instant now);

  void Park(std::unique_ptr<Job> job, Instant until);
  /// The requests of a route wait again.
  void PutBack(Job& job) { chooser_.PutBack(job); }

 private:
  WhoseReply& whose_;
  const LateAnswers& late_;
  Chooser& chooser_;
  Agenda& agenda_;
};

}  // namespace baudgate
