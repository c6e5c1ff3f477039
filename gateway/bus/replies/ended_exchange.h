// `EndedExchange` describes an exchange that has ended, as one value: the request, the outcome, to
// which request the reply belongs, and what was seen on the wire. Job::Ended
// (gateway/bus/jobs/job.h) makes it. First the bus itself learns from it
// (DeviceTracker::OnExchange). Then each `ExchangeObserver` is called once: the counters of the
// device and of the line, and the diagnosis. Last the job decides what follows. Observers decide
// nothing.
//
// `LineObserver` is the interface to the diagnosis of a line. The bus works without a diagnosis:
// this class does nothing. Implemented by gateway/diagnosis/observer.h.
// gateway/bus/poller/job_runner.h calls it on the thread of the line, gateway/bus/jobs/unasked.h
// for a device that sends unasked:
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

/// The reply was not accepted, because it may answer an earlier request.
struct Unproven {
  std::string refusal{};  ///< reason of the refusal in the reply, in words; empty: it is no refusal
  Outcome refused_as = Outcome::none;
};

/// The pointers are valid during the call only.
struct EndedExchange {
  Member* member = nullptr;
  Asked asked{};
  ExchangeEnd end{};  ///< outcome and reason are final
  Instant began{};    ///< when the request was given to the line
  LineUse use = LineUse::polls;
  bool broadcast = false;  ///< no reply was expected
  bool routed = false;  ///< the request came from a client, so a refusal is no fault of the member
  bool polls = false;   ///< the line time counts for a fair share of the polls
  const protocols::Answer* answer = nullptr;
  WhoseReply::Verdict verdict{};
  /// Null: the owner of the reply was certain, or no reply came.
  const Unproven* unproven = nullptr;
  bool no_echo = false;  ///< `echo: verify`: the echo was missing
  bool cut = false;      ///< see EchoWatch::is_cut
  // DeviceTracker::OnExchange sets these:
  Duration patience{};  ///< extra time that the line waits for the member
  bool lags = false;    ///< replies of the member come one or more requests late

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
  virtual void OnPoll(const Device& /*device*/, std::size_t /*query*/) {}

  virtual void OnUnaskedBytes(View /*bytes*/, Instant /*now*/) {}
  /// Returns true if these first bytes of a connection are a Telnet negotiation.
  virtual bool IsNegotiation(View /*bytes*/) const { return false; }
  /// A message of the device that sends unasked has come, `rest` after the message before. `reason`
  /// and `remedy`: of a refusal, or empty. If `outcome` is no answer, the message could not be
  /// read.
  virtual void OnUnasked(const Device& /*device*/, Outcome /*outcome*/,
                         const std::string& /*reason*/, const std::string& /*remedy*/,
                         Duration /*rest*/, Instant /*now*/) {}
};

/// Makes the observer of a line. The roster and the store must stay valid for the lifetime of the
/// observer.
using MakeObserver =
    std::function<std::unique_ptr<LineObserver>(const Roster& roster, PointStore& store)>;

}  // namespace baudgate::bus
