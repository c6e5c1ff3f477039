// Carries out one job after the other, from the first request to the end: what is asked, whether it
// is repeated, what an answer leads to, and who is answered. Knows nothing of bytes on the line;
// gateway/poll/poller_line.cpp tells it what happens there:
//
//   on the line                          to be called
//   idle, and nothing is to be done      Begin, with the job that goes first
//   idle, and a job waits                TakeTurn; where that says send: Start
//   quiet for long enough                Send
//   a whole frame has come               ReplyJudge::Judge, with the job
//   the exchange has ended               OnEnd, and behind all news of that input Conclude
//
// The table of all states of a job is in job_run.cpp.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "gateway/line/line.h"
#include "gateway/poll/intake.h"
#include "gateway/poll/job.h"
#include "gateway/poll/job_end.h"
#include "gateway/poll/upkeep.h"

namespace baudgate {

class JobRun {
 public:
  /// All references outlive it.
  JobRun(OwedReplies& owed, Chooser& chooser, Ledger& ledger, Upkeep& upkeep, Intake& intake)
      : owed_(owed),
        chooser_(chooser),
        agenda_(chooser.agenda()),
        ledger_(ledger),
        upkeep_(upkeep),
        intake_(intake) {}

  /// Before each input of the line.
  void SetTime(Now now) { now_ = now; }
  /// `reason`: why the port is closed. The job that waits for the line has ended by it; that of an
  /// exchange under way has ended before.
  void OnClosed(const std::string& reason);

  /// Null: nothing is to be done.
  Job* job() const { return job_.get(); }
  /// A read-back, or the probe before it, and nothing of it has failed yet.
  bool IsReadingBack() const;
  /// Only without a job. It asks for its first request, and may be over already.
  void Begin(std::unique_ptr<Job> job);

  enum class Turn : std::uint8_t {
    send,  ///< its request, now: call Start
    wait,  ///< until no late answer can meet its request
    next,  ///< there is another job now, or none
  };
  /// The line is idle, and there is a job.
  Turn TakeTurn();
  /// The exchange of its request. `idle_since`: the line.
  Exchange Start(Instant idle_since);
  /// The line has been quiet long enough: the request to be sent now.
  const Request& Send();
  /// The line waits for quiet with its request. True: it is not to be sent, or another goes first.
  bool Withdraw();

  /// The exchange has ended; what follows from that is for Conclude.
  void OnEnd(ExchangeEnd end);
  /// Nothing: the exchange has not ended, or Conclude has been called.
  std::optional<ExchangeEnd> TakeEnd();
  void Conclude(ExchangeEnd end, const Finding& finding);

  /// Answers what is in its jobs of a client that has left.
  void Forget(std::uint64_t client);

 private:
  // job_run.cpp: to the request
  void Ask(int attempts = 0);
  void NextWrite();
  void Deny(const std::string& why);
  void PutProbeFirst();
  bool SetAside(Instant until);
  void BreakOff(const std::string& why);

  // job_answer.cpp: what an exchange leads to
  bool GoesOnBehindBroadcast();
  void OnAnswered(const ExchangeEnd& end);
  void OnRoutedAnswer(const ExchangeEnd& end);
  void TakeAnswer();
  void OnFailed(const ExchangeEnd& end);
  void OnRoutedFailure(Job::Routed& routed, const ExchangeEnd& end);
  void GiveUp(const ExchangeEnd& end);

  // job_finish.cpp: its end
  void Finish(Outcome outcome, const std::string& reason);
  void Resume(Job& probe, Outcome outcome, const std::string& reason);
  void Apply(const Device& device, const ReplyEffects& effects);
  void Apply(Job& done, EndEffects effects, const JobEnd& end);
  void Apply(Job::Write& write, Device& device, const EndEffects::Write& effects);

  OwedReplies& owed_;
  Chooser& chooser_;
  Agenda& agenda_;  // the chooser's
  Ledger& ledger_;
  Upkeep& upkeep_;
  Intake& intake_;
  std::unique_ptr<Job> job_;  // under way
  Now now_{};                 // of the input that is being handled
};

}  // namespace baudgate
