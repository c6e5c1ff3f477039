// Carries out one job after the other, from the first request to the end. Its parts (job_phases.h)
// decide, each about one phase of a job, and return the next step as a value (job.h):
//
//   JobAsking       what is asked next
//   JobDeparture    may the request go out now?
//   JobSending      it goes out
//   JobAnswer       what its exchange leads to
//   JobFinish       the end, and what goes on after it
//
// Knows nothing of bytes on the line; TurnTaker and gateway/bus/poller/poller.cpp call it:
//
//   on the line                          call
//   idle, and there is no job            Begin, with the job that goes first
//   idle, and a job waits                TakeTurn; if that says send: Start
//   quiet for long enough                Send
//   a whole frame has come               Reception::Judge, with the job (by LineSide::Judge)
//   the exchange has ended               KeepEnd, and after all news of that input FollowUp
//
// The table of all states of a job is in job_run.cpp.
//
// TurnTaker gives turns while the line is idle.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "gateway/base/time.h"
#include "gateway/bus/counters/line_account.h"
#include "gateway/bus/exchange/line.h"
#include "gateway/bus/jobs/chooser.h"
#include "gateway/bus/jobs/job.h"
#include "gateway/bus/jobs/job_phases.h"
#include "gateway/bus/schedule/turns.h"

namespace baudgate::bus {

class JobRun {
 public:
  /// They outlive it.
  explicit JobRun(JobPhases& phases) : phases_(phases) {}

  /// Before each input of the line.
  void SetTime(Now now) { now_ = now; }
  /// `reason`: why the port is closed. Ends a job that waits for the line; the job of an exchange
  /// under way has ended before.
  void OnClosed(const std::string& reason);

  /// Null: nothing is to be done.
  Job* job() const { return job_.get(); }
  /// The exchange of its request is under way.
  bool asks() const { return job_ && !job_->step.waiting; }
  /// The member of that exchange, or else of the latest one. Null: there was none.
  const Member* member() const { return asks() ? job_->member : last_; }
  /// Only without a job. The job, a new one or one that was parked, gets its next request, or ends
  /// at once.
  void Begin(std::unique_ptr<Job> job);

  enum class Turn : std::uint8_t {
    send,  ///< its request, now: call Start
    wait,  ///< until no late reply can come
    next,  ///< there is another job now, or none
  };
  /// The line is idle, and there is a job.
  Turn TakeTurn();
  /// When TakeTurn may say something else, where it has said wait.
  std::optional<Instant> NextTurnAt() const { return phases_.departure.NextAt(*job_); }
  /// The exchange of its request. `idle_since`: since when the line is idle.
  Exchange Start(Instant idle_since) {
    return phases_.sending.Start(*job_, idle_since, now_.instant);
  }
  /// The line has been quiet long enough: the request to be sent now.
  const protocols::Request& Send() { return phases_.sending.Send(*job_, now_); }
  /// Its request waits for a quiet line. True: it is not sent now. The job has ended, has gone
  /// back to its queue, or has another request that closes what it has opened.
  bool Withdraw();

  /// The request that Send gave has never left this machine, and never will.
  void NeverLeft() { JobSending::NeverLeft(*job_); }
  /// The exchange has ended; FollowUp decides what follows.
  void KeepEnd(ExchangeEnd end);
  /// Empty: the exchange has not ended, or FollowUp was called already.
  std::optional<ExchangeEnd> TakeEnd();
  void FollowUp(ExchangeEnd end, const Finding& finding);

  /// Answers the requests of a client that has left. `unsent`: see RequestPort.
  void Abandon(std::uint64_t client, bool unsent);

 private:
  void Do(NextStep step);
  NextStep AskProbe();
  NextStep Continue(JobFinish::After after);

  JobPhases& phases_;
  std::unique_ptr<Job> job_;      // under way
  const Member* last_ = nullptr;  // whose exchange ended last
  Now now_{};                     // of the input that is being handled
};

// Gives turns while the line is idle: to the job under way, or to one that is chosen, unless the
// line is held or has taken turns without end. Driven by gateway/bus/poller/poller.cpp.
class TurnTaker {
 public:
  /// All outlive it.
  TurnTaker(Chooser& chooser, JobRun& run, LineAccount& account)
      : chooser_(chooser), run_(run), account_(account) {}

  /// Before each input. `passed`: the time since the last one; `idle`: the line has been idle.
  void OnTime(Now now, Duration passed, bool idle);
  void OnOpened() { hold_.OnOpened(); }
  void OnClosed() { hold_.OnClosed(); }

  /// The line is idle. True: the request of the job is to be sent now.
  bool Take(const Idle& idle);
  /// The line is idle: when Take may say something else even if nothing else happens.
  std::optional<Instant> NextAt(const Idle& idle) const;
  /// The line is idle, so the cost of the probe that ended last is known.
  void ChargeProbe(Instant now) { chooser_.ChargeProbe(now); }

  // See Poller.
  void WindUp() { hold_.WindUp(); }
  void CallOffWindUp() { hold_.CallOffWindUp(); }
  /// True: no job is under way, and no late reply can come, or was waited for long enough.
  bool Pause(Instant now);
  /// False: there was no pause.
  bool GoOn() { return hold_.GoOn(); }
  /// Null: no job is under way.
  const Job* job() const { return run_.job(); }

 private:
  bool CountTurn(const Member* last, Instant now);

  Chooser& chooser_;
  JobRun& run_;
  LineAccount& account_;
  Hold hold_;
  TurnLimit limit_;
};

}  // namespace baudgate::bus
