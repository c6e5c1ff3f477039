// EndedExchange is one exchange that has ended, as one value: what was asked, how it ended, whose
// reply it was, and what was seen on the wire. Made by Job::Ended (gateway/bus/jobs/job.h). The bus
// itself learns from it first (DeviceTracker::OnExchange); then each ExchangeObserver is told once:
// the counters of the device and of the line, and the diagnosis. At last the job decides what
// follows. Observers decide nothing.
//
// LineObserver is what the bus tells the diagnosis of a line. The bus works without: this class
// does nothing. Implemented by gateway/diagnosis/observer.h; called on the thread of the line by
// gateway/bus/poller/job_runner.h, and for a device that sends unasked by
// gateway/bus/jobs/unasked.h:
//
//   on the line                          call
//   the port has opened                  OnOpened
//   a request is to be sent              OnRequest
//   bytes come that are no echo          Hear
//   a whole frame is taken for the reply OnReply
//   the exchange has ended               OnExchange, then TakeNegotiation
//   a poll has ended                     OnPoll
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/bus/exchange/line.h"
#include "gateway/bus/points/line_status.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/replies/late_replies.h"
#include "gateway/bus/replies/whose_reply.h"
#include "protocols/conversation.h"

namespace baudgate::bus {

/// The reply was not taken: it may answer an earlier request.
struct Unproven {
  std::string refusal{};               ///< what it refuses, in words; empty: nothing
  Outcome refused_as = Outcome::none;  ///< the same as an outcome
};

/// Its pointers are valid during the call.
struct EndedExchange {
  Member* member = nullptr;
  Asked asked{};
  ExchangeEnd end{};  ///< outcome and reason are final
  Instant began{};    ///< when the line was given the request
  LineUse use = LineUse::polls;
  bool broadcast = false;  ///< nothing answers
  bool routed = false;     ///< of a client: a refusal says nothing about the member
  bool polls = false;      ///< line time that is counted for a fair share of the polls
  const protocols::Answer* answer = nullptr;  ///< what the reply says
  WhoseReply::Verdict verdict{};              ///< whose reply it was
  const Unproven* unproven = nullptr;         ///< null: its owner was certain, or none came
  bool no_echo = false;                       ///< `echo: verify`: the echo was missing
  bool cut = false;                           ///< see EchoWatch::is_cut
  // DeviceTracker::OnExchange sets these:
  Duration patience{};  ///< the line waits this much longer for the member
  bool lags = false;    ///< its replies come one or more requests late

  bool answered() const { return ProvesLife(end.outcome); }
  bool cut_off() const { return end.outcome == Outcome::line_down; }
};

class ExchangeObserver {
 public:
  virtual ~ExchangeObserver() = default;
  virtual void OnExchange(const EndedExchange& /*ended*/, Now /*now*/) {}
};

class LineObserver : public ExchangeObserver {
 public:
  virtual void OnOpened() {}
  virtual void OnRequest(const Member& /*member*/, const protocols::Request& /*request*/,
                         Instant /*now*/) {}
  virtual void Hear(View /*bytes*/, Instant /*now*/) {}
  virtual void OnReply(View /*frame*/) {}
  /// Returns true if a device has answered although the connection began with a Telnet negotiation.
  /// The call clears the flag.
  virtual bool TakeNegotiation() { return false; }
  /// A poll of this query has ended, and was counted.
  virtual void OnPoll(const Device& /*device*/, std::size_t /*query*/) {}

  /// Bytes of the device that sends unasked.
  virtual void OnUnaskedBytes(View /*bytes*/, Instant /*now*/) {}
  /// The first bytes of a connection are Telnet's.
  virtual bool IsNegotiation(View /*bytes*/) const { return false; }
  /// Its message has come, `rest` behind the one before; `reason` and `remedy`: what it refuses, or
  /// empty. An outcome that is no answer: the message could not be read.
  virtual void OnUnasked(const Device& /*device*/, Outcome /*outcome*/,
                         const std::string& /*reason*/, const std::string& /*remedy*/,
                         Duration /*rest*/, Instant /*now*/) {}
};

/// Makes the observer of a line; the roster and the store outlive it.
using MakeObserver =
    std::function<std::unique_ptr<LineObserver>(const Roster& roster, PointStore& store)>;

}  // namespace baudgate::bus
