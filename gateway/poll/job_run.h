// Carries out one job after the other, from the first request to the end: what is asked, whether it
// is repeated, what an answer leads to, and who is answered. Knows nothing of bytes on the line;
// gateway/poll/poller_line.cpp tells it what happens there:
//
//   on the line                          to be called
//   idle, and nothing is to be done      Begin, with the job that goes first
//   idle, and a job waits                TakeTurn; where that says send: Start
//   quiet for long enough                Send
//   a whole frame has come               Judge
//   the exchange has ended               OnEnd, and behind all news of that input Conclude
//
// The table of all states of a job is in job_run.cpp.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gateway/line/line.h"
#include "gateway/poll/chooser.h"
#include "gateway/poll/job.h"
#include "gateway/poll/jump_check.h"
#include "gateway/poll/late_answers.h"
#include "gateway/poll/ledger.h"
#include "gateway/poll/poller_listener.h"
#include "gateway/poll/roster.h"
#include "gateway/poll/routed_side.h"
#include "gateway/poll/schedule.h"
#include "gateway/poll/told_events.h"
#include "gateway/poll/upkeep.h"
#include "gateway/poll/whose_reply.h"
#include "gateway/poll/write_queue.h"
#include "gateway/store/point_store.h"

namespace baudgate {

class JobRun {
 public:
  /// All references outlive it.
  JobRun(PointStore& store, PollerListener& listener, Roster& roster, Schedule& schedule,
         WriteQueue& writes, RoutedSide& routes, LateAnswers& late, WhoseReply& whose_reply,
         Ledger& ledger, Chooser& chooser, Upkeep& upkeep, ToldEvents& told);

  /// Before each input of the line: time has passed; `busy`: the line was.
  void OnTime(Now now, bool busy);
  void OnOpened() {
    open_ = true;
    echo_free_ = false;
  }
  /// The request under way has come back, and is not the reply.
  void OnEcho() { echoed_ = true; }
  /// `reason`: why the port is closed. The job under way has ended by it.
  void OnClosed(const std::string& reason);

  /// Null: nothing is to be done.
  const Job* job() const { return job_.get(); }
  /// A read-back that has not failed yet.
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

  /// What a frame means; the conversation hears of a reply when it is certain whose it is.
  /// `may_be_echo`: see EchoWatch.
  Outcome Judge(View frame, bool may_be_echo, Instant now);
  /// The exchange has ended; what follows from that is for Conclude.
  void OnEnd(ExchangeEnd end);
  /// Nothing: the exchange has not ended, or Conclude has been called.
  std::optional<ExchangeEnd> TakeEnd();
  void Conclude(ExchangeEnd end, Finding finding);

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

  // job_answer.cpp: the reply, and what it means
  Outcome JudgeRouted(View frame);
  bool GoesOnBehindBroadcast();
  static void Explain(const Job& job, const ExchangeEnd& end, Finding& finding);
  void OnAnswered(const ExchangeEnd& end);
  void OnRoutedAnswer(const ExchangeEnd& end);
  void TakeAnswer();
  void Store(Device& device, const Answer& answer);
  JumpCheck::Result CheckJumps(Device& device, std::vector<Sample>& samples);
  void Report(const Device& device, EventBatch batch);

  // job_end.cpp: how it ends
  void OnFailed(const ExchangeEnd& end);
  void GiveUp(const ExchangeEnd& end);
  void Finish(Outcome outcome, const std::string& reason);
  void Resume(std::unique_ptr<Job> job, Outcome outcome, const std::string& reason);
  void FinishWrite(Job::Write& write, Device& device, Outcome outcome, const std::string& reason);

  PointStore& store_;
  PollerListener& listener_;
  Roster& roster_;
  Schedule& schedule_;
  WriteQueue& writes_;
  RoutedSide& routes_;
  LateAnswers& late_;
  WhoseReply& whose_reply_;
  Ledger& ledger_;
  Chooser& chooser_;
  Upkeep& upkeep_;
  ToldEvents& told_;
  std::unique_ptr<Job> job_;  // under way
  bool open_ = false;         // the port
  bool echoed_ = false;       // the present request
  bool echo_free_ = false;    // the latest one whose reply cannot equal it has not come back
  Now now_{};                 // of the input that is being handled
};

}  // namespace baudgate
