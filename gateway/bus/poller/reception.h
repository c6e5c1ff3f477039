// Handles the bytes that come back for the request under way: its echo is taken out
// (gateway/bus/exchange/echo_watch.h), what the rest looks like is kept for the status
// (gateway/bus/devices/line_observer.h), and a whole frame is judged (reply_judge.h). Driven by
// gateway/bus/poller/line_side.cpp:
//
//   on the line                          call
//   a request is to be sent              TakeChanged, then OnSend
//   bytes come, at any time              OnBytes; what is not echo goes to the line
//   a whole frame has come               Judge
//   the exchange has ended               OnEnd
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "config/model/line.h"
#include "gateway/base/bytes.h"
#include "gateway/base/finding.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/bus/devices/line_observer.h"
#include "gateway/bus/exchange/echo_watch.h"
#include "gateway/bus/exchange/line.h"
#include "gateway/bus/jobs/job.h"
#include "gateway/bus/poller/reply_judge.h"
#include "gateway/bus/replies/whose_reply.h"

namespace baudgate {

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
  EchoWatch::Received OnBytes(View bytes, const Job* job, Instant now);
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
  Seen OnEnd(const Job& job, ExchangeEnd& end);

 private:
  EchoWatch echo_;
  LineObserver& observer_;
  ReplyJudge judge_;
};

}  // namespace baudgate
