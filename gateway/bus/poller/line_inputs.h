// The inputs of a line, and what they mean beside the job under way: the account of the line, what
// a device says unasked, stray bytes, and replies that come late or twice. The job itself has its
// part from line_side.h. Driven by gateway/bus/poller/poller.cpp:
//
//   what happens                         call
//   the port opens, or closes            OnOpened, OnClosed
//   bytes, an end of connection, time    OnBytes, OnEnded, OnTimer; then Conclude
//   the job takes its turn               Start
//   its request may be too late by now   Withdraw
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "gateway/bus/counters/ledger.h"
#include "gateway/bus/devices/arrival_time.h"
#include "gateway/bus/exchange/line.h"
#include "gateway/bus/jobs/upkeep.h"
#include "gateway/bus/poller/line_side.h"
#include "gateway/bus/poller/unasked_side.h"

namespace baudgate {

class LineInputs {
 public:
  /// All references outlive it.
  LineInputs(LineSide& line, UnaskedSide& unasked, Upkeep& upkeep, Ledger& ledger)
      : line_(line), unasked_(unasked), upkeep_(upkeep), ledger_(ledger) {}

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
  void OnBytes(View bytes, Now now);
  void OnEnded(Now now) { Apply(line_.OnEnded(now.instant), now); }
  void OnTimer(Now now) { Apply(line_.OnTimer(now.instant), now); }
  /// The line is idle, and the job says send. `idle_since`: since when it is.
  void Start(Instant idle_since, Now now) { Apply(line_.Start(idle_since, now.instant), now); }
  /// Applies the end of an exchange, if one has ended. After all other news of the input.
  void Conclude();

 private:
  /// Bytes may come: of a reply, or of a device that speaks unasked.
  bool IsAwaiting() const { return line_.is_open() && (line_.asks() || unasked_.listens()); }
  void Date(LineNews& news, Instant now) const;
  void Apply(LineNews news, Now now);
  void Send(Now now);
  void OnStray(const StrayBytes& stray, Instant now);

  LineSide& line_;
  UnaskedSide& unasked_;
  Upkeep& upkeep_;
  Ledger& ledger_;
  ArrivalTime arrival_;
};

}  // namespace baudgate
