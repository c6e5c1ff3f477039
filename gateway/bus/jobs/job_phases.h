// The parts that decide about one phase of a job each, for gateway/bus/jobs/job_run.h, in the order
// of a job; JobPhases groups them. ReplyJudge says what the reply of an exchange means.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "gateway/base/bytes.h"
#include "gateway/base/finding.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/bus/counters/accounts.h"
#include "gateway/bus/counters/line_account.h"
#include "gateway/bus/exchange/line.h"
#include "gateway/bus/jobs/chooser.h"
#include "gateway/bus/jobs/device_tracker.h"
#include "gateway/bus/jobs/job.h"
#include "gateway/bus/jobs/job_end.h"
#include "gateway/bus/replies/late_replies.h"
#include "gateway/bus/replies/whose_reply.h"
#include "gateway/bus/schedule/probes.h"
#include "gateway/bus/schedule/schedule.h"
#include "gateway/bus/schedule/turns.h"
#include "gateway/bus/writes/write_queue.h"

namespace baudgate::bus {

// Asks the conversation of a job for its next request. A part of gateway/bus/jobs/job_run.h.
class JobAsking {
 public:
  /// Both outlive it.
  JobAsking(Probes& probes, DeviceAccounts& accounts) : probes_(probes), accounts_(accounts) {}

  /// Asks the conversation for the next request and puts it into the job. `repeats`: see Job::Step.
  NextStep Ask(Job& job, int repeats, Instant now);

 private:
  Probes& probes_;
  DeviceAccounts& accounts_;
};

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
class JobDeparture {
 public:
  /// All outlive it.
  JobDeparture(WhoseReply& whose, const LateReplies& late, Chooser& chooser, Agenda& agenda)
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
  const LateReplies& late_;
  Chooser& chooser_;
  Agenda& agenda_;
};

// The request of a job goes out: which times its exchange has, and who learns that it was sent. A
// part of gateway/bus/jobs/job_run.h.
class JobSending {
 public:
  /// All outlive it.
  JobSending(OwedReplies& owed, Turns& turns, WriteQueue& writes, LineAccount& account)
      : owed_(owed), turns_(turns), writes_(writes), account_(account) {}

  /// The line is given the exchange. `idle_since`: since when the line is idle.
  Exchange Start(Job& job, Instant idle_since, Instant now);
  /// The line has been quiet long enough: the request to be sent now.
  const protocols::Request& Send(Job& job, Now now);
  /// Its exchange has ended. A reply that comes from now on is late.
  void NoteEnd(const Job& job, Outcome outcome, Instant now) {
    owed_.late_replies.OnEnd(job.asked(), outcome, now);
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

// ReplyJudge decides what a frame means that comes while a request of a job is out: to which
// request it belongs (gateway/bus/replies/whose_reply.h), and what the conversation reads in it.
// ReplyJudge stores the result in the job. Called by Reception (gateway/bus/poller/poller.h).
//
//   a frame comes                        outcome
//   it may be the echo of the request    unexpected
//   damaged, or of another form          as the conversation or the carrier says
//   it may answer an earlier request     unexpected: the job asks again until that is certain
//   its own                              as the conversation says, which sees only such replies
//
class ReplyJudge {
 public:
  /// It outlives this.
  explicit ReplyJudge(WhoseReply& whose_reply) : whose_reply_(whose_reply) {}

  void OnOpened() { echo_free_ = false; }
  /// `may_be_echo`: see EchoWatch.
  Outcome Judge(Job& job, View frame, bool may_be_echo, Instant now);
  /// The exchange has ended; `echoed`: its request has come back. Adds to `finding` what the bytes
  /// do not show: the words of the device, and that its reply was not taken.
  void CompleteFinding(const Job& job, const ExchangeEnd& end, bool echoed, Finding& finding);

 private:
  Outcome JudgeRouted(Job& job, View frame);
  static Outcome LeaveUnproven(Job& job, View frame, Outcome outcome);
  static Outcome Read(Job& job, View frame, Instant now);
  static Outcome Refuse(Job& job, View frame, Outcome outcome);

  WhoseReply& whose_reply_;
  bool echo_free_ = false;  // the latest one whose reply cannot equal it has not come back
};

// Decides what an exchange leads to: the next request, the same one again, or the end of the job. A
// part of gateway/bus/jobs/job_run.h, whose table has all states of a job.
class JobAnswer {
 public:
  /// All outlive it.
  JobAnswer(WhoseReply& whose, const Chooser& chooser, const ParkedJobs& parked,
            DeviceTracker& tracker, EffectApplier& effects)
      : whose_(whose), chooser_(chooser), parked_(parked), tracker_(tracker), effects_(effects) {}

  /// The exchange is over; `finding`: how it looked.
  NextStep Conclude(Job& job, ExchangeEnd end, const Finding& finding, Now now);
  /// Its answer counts.
  NextStep Take(Job& job, Instant now);

 private:
  NextStep OnAnswered(Job& job, const ExchangeEnd& end, Now now);
  NextStep OnRoutedAnswer(Job& job, const ExchangeEnd& end);
  NextStep OnFailed(Job& job, const ExchangeEnd& end, Instant now);
  NextStep OnRoutedFailure(Job& job, Job::Routed& routed, const ExchangeEnd& end);
  NextStep GiveUp(Job& job, const ExchangeEnd& end, Instant now);
  NextStep Repeat(Job& job);
  bool MustRepeat(const Job& job, Instant now) const;
  bool ParksBusy(const Job& job, Outcome outcome) const;

  WhoseReply& whose_;
  const Chooser& chooser_;
  const ParkedJobs& parked_;
  DeviceTracker& tracker_;
  EffectApplier& effects_;
};

// The end of a job, and what goes on after it: the job that has waited for its probe, or the points
// of a write that remain. EffectsOf in job_end.h says what each kind of job leads to, and
// EffectApplier applies the effects. A part of gateway/bus/jobs/job_run.h.
class JobFinish {
 public:
  /// All outlive it.
  JobFinish(WhoseReply& whose, const Schedule& schedule, DeviceTracker& tracker,
            EffectApplier& effects)
      : whose_(whose), schedule_(schedule), tracker_(tracker), effects_(effects) {}

  /// The job that is under way now, and its next step. Null: none.
  struct After {
    std::unique_ptr<Job> job;
    NextStep next;
  };
  After Finish(std::unique_ptr<Job> done, const JobEnd& end, Instant now);
  /// The probe cannot be asked, which says nothing of the device. A reply whose owner is not proven
  /// yet is not taken.
  After GoUnproved(std::unique_ptr<Job> probe, const std::string& why, Instant now);

 private:
  After Resume(Job& probe, const JobEnd& end, Instant now);

  WhoseReply& whose_;
  const Schedule& schedule_;
  DeviceTracker& tracker_;
  EffectApplier& effects_;
};

struct JobPhases {
  /// All outlive it.
  JobPhases(LineContext& context, Chooser& chooser, EffectApplier& effects)
      : asking(context.agenda.probes, context.accounts.devices),
        departure(context.owed.whose, context.owed.late_replies, chooser, context.agenda),
        sending(context.owed, context.agenda.turns, context.agenda.write_queue,
                context.accounts.line),
        answer(context.owed.whose, chooser, context.agenda.parked, context.tracker, effects),
        finish(context.owed.whose, context.agenda.schedule, context.tracker, effects) {}

  JobAsking asking;
  JobDeparture departure;
  JobSending sending;
  JobAnswer answer;
  JobFinish finish;
};

}  // namespace baudgate::bus
