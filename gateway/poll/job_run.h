// Carries out one job after the other, from the first request to the end: what is asked, whether it
// is repeated, what a reply leads to, and which clients are answered. Knows nothing of bytes on the
// line; gateway/poll/poller.cpp and line_side.cpp call it:
//
//   on the line                          call
//   idle, and there is no job            Begin, with the job that goes first
//   idle, and a job waits                TakeTurn; if that says send: Start
//   quiet for long enough                Send
//   a whole frame has come               Reception::Judge, with the job (by LineSide::Judge)
//   the exchange has ended               OnEnd, and after all news of that input Conclude
//
// The table of all states of a job is in job_run.cpp.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "gateway/line/line.h"
#include "gateway/poll/chooser.h"
#include "gateway/poll/effect_applier.h"
#include "gateway/poll/job.h"
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
        effects_(owed, agenda_, ledger, upkeep, intake) {}

  /// Before each input of the line.
  void SetTime(Now now) { now_ = now; }
  /// `reason`: why the port is closed. Ends a job that waits for the line; the job of an exchange
  /// under way has ended before.
  void OnClosed(const std::string& reason);

  /// Null: nothing is to be done.
  Job* job() const { return job_.get(); }
  /// A read-back of the member, or the probe before it, is under way or parked, and nothing of it
  /// has failed yet.
  bool IsReadingBack(const Member& member) const;
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
  /// The exchange of its request. `idle_since`: since when the line is idle.
  Exchange Start(Instant idle_since);
  /// The line has been quiet long enough: the request to be sent now.
  const Request& Send();
  /// Its request waits for a quiet line. True: it is not sent now. The job has ended, has gone
  /// back to its queue, or has another request that closes what it has opened.
  bool Withdraw();

  /// The request that Send gave has never left this machine, and never will.
  void NeverLeft();
  /// The exchange has ended; Conclude decides what follows.
  void OnEnd(ExchangeEnd end);
  /// Empty: the exchange has not ended, or Conclude was called already.
  std::optional<ExchangeEnd> TakeEnd();
  void Conclude(ExchangeEnd end, const Finding& finding);

  /// Answers the requests of a client that has left. `unsent`: see RequestPort.
  void Abandon(std::uint64_t client, bool unsent);

 private:
  // job_run.cpp: to the request
  void Ask(int retries = 0);
  void PutProbeFirst();
  void Park(Instant until);
  void BreakOff(const Withheld& withheld);

  // job_answer.cpp: what an exchange leads to
  void OnAnswered(const ExchangeEnd& end);
  void OnRoutedAnswer(const ExchangeEnd& end);
  void TakeAnswer();
  void OnFailed(const ExchangeEnd& end);
  void OnRoutedFailure(Job::Routed& routed, const ExchangeEnd& end);
  void GiveUp(const ExchangeEnd& end);

  // job_finish.cpp: its end
  void Finish(Outcome outcome, const std::string& reason);
  void Resume(Job& probe, Outcome outcome, const std::string& reason);
  void GoOnUnproved(const std::string& why);
  void GoOn();
  void EndUnproved(Outcome outcome, const std::string& reason);

  OwedReplies& owed_;
  Chooser& chooser_;
  Agenda& agenda_;  // the chooser's
  Ledger& ledger_;
  Upkeep& upkeep_;
  EffectApplier effects_;
  std::unique_ptr<Job> job_;  // under way
  Now now_{};                 // of the input that is being handled
};

}  // namespace baudgate
