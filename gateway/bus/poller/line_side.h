// Between the line and the job under way: gives the line the request of the job, and the job its
// replies and the end of its exchange. Everything else that happens on the line is returned as a
// value. Driven by gateway/bus/poller/line_inputs.cpp:
//
//   what happens                         call
//   the port opens, or closes            OnOpened; OnClosed, and at last OnPortClosed
//   bytes, an end of connection, time    OnBytes, OnEnded, OnTimer
//   the job takes its turn               Start
//   LineNews::send                       TakeChanged, then Send
//   LineNews::end                        OnEnd; after all news of the input TakeEnd and Conclude
//   its request may be too late by now   Withdraw
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/bus/devices/poller_listener.h"
#include "gateway/bus/exchange/line.h"
#include "gateway/bus/jobs/job_run.h"
#include "gateway/bus/poller/reception.h"

namespace baudgate {

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
  Received OnBytes(View bytes, Instant now);
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

  void OnEnd(ExchangeEnd end);
  /// An exchange that is over: how it ended, and how it looked.
  struct Over {
    const Member* member = nullptr;
    ExchangeEnd end;
    Reception::Seen seen;
  };
  /// Empty: none has ended since it was asked last.
  std::optional<Over> TakeEnd();
  /// The job decides what follows.
  void Conclude(Over over);

 private:
  Outcome Judge(View frame, Instant now) override;
  /// It has a request, and waits until it may be sent.
  bool waits_for_quiet() const { return line_.state() == Line::State::quiet; }

  Line line_{*this};
  Reception& reception_;
  JobRun& run_;
  RequestPort& port_;
};

}  // namespace baudgate
