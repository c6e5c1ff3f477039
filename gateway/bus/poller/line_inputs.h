// The inputs of a line, and what they mean beside the job under way: the account of the line, what
// a device says unasked, stray bytes, and replies that come late or twice. The job itself has its
// part from LineSide. Driven by gateway/bus/poller/poller.cpp:
//
//   what happens                         call
//   the port opens, or closes            OnOpened, OnClosed
//   bytes, an end of connection, time    HandleBytes, OnEnded, OnTimer; then HandleEnd
//   the job takes its turn               Start
//   its request may be too late by now   Withdraw
//
// LineInputs drives LineSide, which joins the line and the job. LineSide drives Reception, which
// takes out the echo, and Reception asks ReplyJudge what a frame means.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "config/model/line.h"
#include "gateway/base/bytes.h"
#include "gateway/base/finding.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/bus/counters/accounts.h"
#include "gateway/bus/devices/arrivals.h"
#include "gateway/bus/devices/poller_listener.h"
#include "gateway/bus/exchange/echo.h"
#include "gateway/bus/exchange/line.h"
#include "gateway/bus/jobs/device_tracker.h"
#include "gateway/bus/jobs/job.h"
#include "gateway/bus/jobs/job_run.h"
#include "gateway/bus/poller/device_side.h"
#include "gateway/bus/replies/whose_reply.h"

namespace baudgate {

// What a frame means that came as the reply to a job's request: to which request it belongs
// (gateway/bus/replies/whose_reply.h), and what its conversation reads in it. Stores the result in
// the job. Called by Reception.
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

// Handles the bytes that come back for the request under way: its echo is taken out
// (gateway/bus/exchange/echo.h), what the rest looks like is kept for the status
// (gateway/bus/devices/poller_listener.h), and a whole frame is judged (ReplyJudge). Driven by
// LineSide:
//
//   on the line                          call
//   a request is to be sent              TakeChanged, then OnSend
//   bytes come, at any time              TakeOutEcho; what is not echo goes to the line
//   a whole frame has come               Judge
//   the exchange has ended               Assess
//
class Reception {
 public:
  /// Both references outlive it.
  Reception(config::Echo echo, LineObserver& observer, WhoseReply& whose)
      : echo_(echo), observer_(observer), judge_(whose) {}

  void OnOpened();
  void OnClosed() { echo_.OnClosed(); }
  /// Earlier exchanges that look different now, because more has come since they were looked at.
  std::vector<EarlierFinding> TakeChanged() { return observer_.TakeChanged(); }
  /// Before the request of this job goes to the port.
  void OnSend(const Job& job, Instant now);
  /// `job`: that of the line, which may wait for its turn; null: none.
  EchoWatch::Received TakeOutEcho(View bytes, const Job* job, Instant now);
  /// A whole frame came for the request of this job.
  Outcome Judge(Job& job, View frame, Instant now);

  /// How an exchange looked.
  struct Seen {
    Finding finding{};
    bool no_echo = false;     ///< `echo: verify`: it was missing
    bool cut = false;         ///< see EchoWatch::is_cut
    bool negotiates = false;  ///< see LineObserver::TakeNegotiation
  };
  /// The reason of `end` is set if the echo explains it.
  Seen Assess(const Job& job, ExchangeEnd& end);

 private:
  EchoWatch echo_;
  LineObserver& observer_;
  ReplyJudge judge_;
};

// Between the line and the job under way: gives the line the request of the job, and the job its
// replies and the end of its exchange. Everything else that happens on the line is returned as a
// value. Driven by LineInputs:
//
//   what happens                         call
//   the port opens, or closes            OnOpened; OnClosed, and at last OnPortClosed
//   bytes, an end of connection, time    FeedLine, OnEnded, OnTimer
//   the job takes its turn               Start
//   LineNews::send                       TakeChanged, then Send
//   LineNews::end                        KeepEnd; after all news of the input TakeEnd and PassToJob
//   its request may be too late by now   Withdraw
//
class LineSide : private LineClient {
 public:
  /// `standing`: what a device sends unasked; null: none does. All references outlive it; `port`
  /// may be made later than it.
  LineSide(Reception& reception, const Standing* standing, JobRun& run, RequestPort& port);

  /// `keeps_bit_rate`: see Line::OnOpened.
  void OnOpened(Now now, bool keeps_bit_rate);
  LineNews OnClosed() { return line_.OnClosed(); }
  /// After the news of OnClosed. `reason`: why the port is closed.
  void OnPortClosed(const std::string& reason);

  /// The effects of bytes that came.
  struct Received {
    const Member* member = nullptr;  ///< of the job; null: there is none
    EchoWatch::Received heard;
    LineNews collided;  ///< of a collision; before `news`
    LineNews news;      ///< of `heard.bytes`
  };
  Received FeedLine(View bytes, Instant now);
  LineNews OnEnded(Instant now) { return line_.OnEnded(now); }
  LineNews OnTimer(Instant now);
  /// When OnTimer is due.
  std::optional<Instant> Deadline() const;

  bool is_open() const { return line_.state() != Line::State::closed; }
  bool idle() const { return line_.idle(); }
  /// See JobRun.
  bool asks() const { return run_.asks(); }
  const Member* member() const { return run_.member(); }

  /// The line is idle, and the job says send. `idle_since`: since when it is.
  LineNews Start(Instant idle_since, Instant now);
  /// See Reception.
  std::vector<EarlierFinding> TakeChanged() { return reception_.TakeChanged(); }
  /// The request of the job goes to the port.
  void Send(Now now);
  /// The request that waits for a quiet line may have become too late. The line begins again with
  /// the next request, also if that is one of the same job that closes what it has opened.
  void Withdraw();
  /// See JobRun.
  void Abandon(std::uint64_t client) { run_.Abandon(client, port_.IsUnsent()); }

  void KeepEnd(ExchangeEnd end);
  /// An exchange that is over: how it ended, and how it looked.
  struct Over {
    const Member* member = nullptr;
    ExchangeEnd end;
    Reception::Seen seen;
  };
  /// Empty: none has ended since it was asked last.
  std::optional<Over> TakeEnd();
  /// The job decides what follows.
  void PassToJob(Over over);

 private:
  Outcome Judge(View frame, Instant now) override;
  /// It has a request, and waits until it may be sent.
  bool waits_for_quiet() const { return line_.state() == Line::State::quiet; }

  Line line_{*this};
  Reception& reception_;
  JobRun& run_;
  RequestPort& port_;
};

class LineInputs {
 public:
  /// All references outlive it.
  LineInputs(LineSide& line, UnaskedSide& unasked, DeviceTracker& tracker, Accounts& accounts)
      : line_(line), unasked_(unasked), tracker_(tracker), accounts_(accounts) {}

  /// See LineSide.
  bool is_open() const { return line_.is_open(); }
  bool idle() const { return line_.idle(); }
  std::optional<Instant> Deadline() const;
  void OnOpened(Now now, bool keeps_bit_rate) { line_.OnOpened(now, keeps_bit_rate); }
  void Withdraw() { line_.Withdraw(); }
  void Abandon(std::uint64_t client) { line_.Abandon(client); }

  /// Before each input.
  void OnTime(Now now);
  /// The job under way ends; `reason`: why the port is closed.
  void OnClosed(const std::string& reason, Now now);
  void HandleBytes(View bytes, Now now);
  void OnEnded(Now now) { Apply(line_.OnEnded(now.instant), now); }
  void OnTimer(Now now) { Apply(line_.OnTimer(now.instant), now); }
  /// The line is idle, and the job says send. `idle_since`: since when it is.
  void Start(Instant idle_since, Now now) { Apply(line_.Start(idle_since, now.instant), now); }
  /// Applies the end of an exchange, if one has ended. After all other news of the input.
  void HandleEnd();

 private:
  /// Bytes may come: of a reply, or of a device that speaks unasked.
  bool IsAwaiting() const { return line_.is_open() && (line_.asks() || unasked_.listens()); }
  void Date(LineNews& news, Instant now) const;
  void Apply(LineNews news, Now now);
  void Send(Now now);
  void HandleStray(const StrayBytes& stray, Instant now);

  LineSide& line_;
  UnaskedSide& unasked_;
  DeviceTracker& tracker_;
  Accounts& accounts_;
  ArrivalTime arrival_;
};

}  // namespace baudgate
