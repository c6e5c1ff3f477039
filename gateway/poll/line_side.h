// Between the line and the job under way: gives the line the request of the job, and hands on what
// the line reports. Driven by gateway/poll/poller.cpp:
//
//   what happens                         call
//   the port opens, or closes            OnOpened, OnClosed
//   bytes, an end of connection, time    OnBytes, OnEnded, OnTimer; then Conclude
//   the job takes its turn               Start
//   its request may be too late by now   Withdraw
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "gateway/base/bytes.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/line/line.h"
#include "gateway/poll/job_run.h"
#include "gateway/poll/ledger.h"
#include "gateway/poll/poller_listener.h"
#include "gateway/poll/reception.h"
#include "gateway/poll/unasked_side.h"
#include "gateway/poll/upkeep.h"

namespace baudgate {

class LineSide : private LineClient {
 public:
  /// All references outlive it; `port` may be made later than it.
  LineSide(Reception reception, JobRun& run, UnaskedSide& unasked, Upkeep& upkeep, Ledger& ledger,
           RequestPort& port);

  /// `keeps_bit_rate`: see Line::OnOpened.
  void OnOpened(Now now, bool keeps_bit_rate);
  /// The job under way ends; `reason`: why the port is closed.
  void OnClosed(const std::string& reason, Now now);
  void OnBytes(View bytes, Now now);
  void OnEnded(Now now);
  void OnTimer(Now now);
  /// When OnTimer is due.
  std::optional<Instant> Deadline() const { return line_.Deadline(); }

  bool is_open() const { return line_.state() != Line::State::closed; }
  /// See RequestPort.
  bool is_unsent() const { return port_.IsUnsent(); }
  bool idle() const { return line_.idle(); }
  /// It has a request, and waits until it may be sent.
  bool waits_for_quiet() const { return line_.state() == Line::State::quiet; }

  /// The line is idle, and the job says send. `idle_since`: since when it is.
  void Start(Instant idle_since, Now now);
  /// The request that waits for a quiet line may have become too late. The line begins again with
  /// the next request, also if that is one of the same job that closes what it has opened.
  void Withdraw();
  /// Applies the end of an exchange, if one has ended. After all other news of the input.
  void Conclude();

 private:
  Outcome Judge(View frame, Instant now) override;
  void Hear(LineNews news, Now now);
  void Send(Now now);
  void OnStray(const StrayBytes& stray, Instant now);

  Line line_{*this};
  Reception reception_;
  JobRun& run_;
  UnaskedSide& unasked_;
  Upkeep& upkeep_;
  Ledger& ledger_;
  RequestPort& port_;
};

}  // namespace baudgate
