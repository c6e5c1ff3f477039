// `EndedExchange` describes an exchange that has ended: the request, the outcome, the received
// reply, and which request this reply answers. Job::Ended (gateway/bus/jobs/job.h) makes it. Then
// DeviceTracker::OnExchange learns from it, each `ExchangeObserver` gets it once (the counters of
// device and line, and the diagnosis), and at last the job decides about its next step. An observer
// cannot change this decision.
//
// `LineObserver` is the interface to the diagnosis of a line (gateway/diagnosis/observer.h). Its
// functions do nothing by default, so the bus works without a diagnosis. They are called on the
// thread of the line:
//
//   on the line                          call
//   the port has opened                  OnOpened
//   a request is sent                    OnRequest
//   bytes come that are not an echo      Hear
//   a whole frame is accepted as reply   OnReply
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

/// A reply that was not accepted, because it may answer an earlier request.
struct Unproven {
  /// If the reply is a refusal: the reason of the device in words, and its outcome. Else empty, and
  /// Outcome::none.
  std::string refusal{};
  Outcome refused_as = Outcome::none;
};

/// The pointers are valid only during the call of OnExchange.
struct EndedExchange {
  Member* member = nullptr;
  Asked asked{};
  ExchangeEnd end{};  ///< outcome and reason are final: the job has judged the reply
  Instant began{};    ///< when the line got the request
  LineUse use = LineUse::polls;
  bool broadcast = false;  ///< the request expected no reply
  /// A client of a transparent route sent the request, so a refusal counts as a good answer.
  bool routed = false;
  /// True for a poll. Its line time counts for Schedule, which polls the device next that has used
  /// the least line time.
  bool polls = false;
  const protocols::Answer* answer = nullptr;
  WhoseReply::Verdict verdict{};
  /// Set if a reply came that may answer an earlier request; else null.
  const Unproven* unproven = nullptr;
  bool no_echo = false;  ///< option `echo: verify`: the request did not come back
  bool cut = false;      ///< the bus has stopped echoing requests (EchoWatch::is_cut)
  // DeviceTracker::OnExchange sets the two members below.
  Duration patience{};  ///< extra reply time of the device, because its earlier replies were late
  bool lags = false;    ///< the member's replies come one or more requests late

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
  /// Returns true, once, if the connection began with a Telnet negotiation and a device has
  /// answered on it since.
  virtual bool TakeNegotiation() { return false; }
  virtual void OnPoll(const Device& /*device*/, std::size_t /*query*/) {}

  virtual void OnUnaskedBytes(View /*bytes*/, Instant /*now*/) {}
  /// Returns true if these first bytes of a connection are a Telnet negotiation.
  virtual bool IsNegotiation(View /*bytes*/) const { return false; }
  /// A message has come from the device that sends without being asked. `rest`: silence since its
  /// previous message. `reason`: why the device refuses; `remedy`: what helps; both can be empty.
  /// If `outcome` is a failure, the message was damaged.
  virtual void OnUnasked(const Device& /*device*/, Outcome /*outcome*/,
                         const std::string& /*reason*/, const std::string& /*remedy*/,
                         Duration /*rest*/, Instant /*now*/) {}
};

/// Makes the observer of a line. The roster and the store must stay valid for the lifetime of the
/// observer.
using MakeObserver =
    std::function<std::unique_ptr<LineObserver>(const Roster& roster, PointStore& store)>;

}  // namespace baudgate::bus
