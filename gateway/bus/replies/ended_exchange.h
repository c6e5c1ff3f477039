// `EndedExchange` describes an exchange that has ended, as one value: the request, the outcome, to
// which request the reply belongs, and what was received. Job::Ended (gateway/bus/jobs/job.h) makes
// it. It is used in this order: the bus learns from it (DeviceTracker::OnExchange), each
// `ExchangeObserver` gets it once (the counters of device and line, and the diagnosis), then the
// job decides about its next step. Observers have no influence on that.
//
// `LineObserver` is the interface to the diagnosis of a line; gateway/diagnosis/observer.h
// implements it. The functions of this class do nothing, so the bus works without a diagnosis as
// well. They are called on the thread of the line:
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
  /// Why the device refused the request, in words; empty: the reply is not a refusal.
  std::string refusal{};
  Outcome refused_as = Outcome::none;
};

/// An exchange that has ended. The pointers in it are valid during the call only.
struct EndedExchange {
  Member* member = nullptr;
  Asked asked{};
  ExchangeEnd end{};  ///< outcome and reason are final: the job has judged the reply
  Instant began{};    ///< when the line got the request
  LineUse use = LineUse::polls;
  bool broadcast = false;  ///< the request expected no reply
  /// The request came from a client, so a refusal is not a fault of the device.
  bool routed = false;
  bool polls = false;  ///< the line time counts when polls are shared fairly among devices
  const protocols::Answer* answer = nullptr;
  WhoseReply::Verdict verdict{};
  /// Set if a reply came that may answer an earlier request; else null.
  const Unproven* unproven = nullptr;
  bool no_echo = false;  ///< with `echo: verify`: the echo was missing
  bool cut = false;      ///< the bus has stopped echoing requests (EchoWatch::is_cut)
  // DeviceTracker::OnExchange sets these:
  Duration patience{};  ///< extra reply time of the member, because its replies came late
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
  /// A message of the device that sends unasked has come. `rest`: time since the message before.
  /// `reason`, `remedy`: why the device refuses, and what helps; or empty. If `outcome` is a
  /// failure, the message was damaged.
  virtual void OnUnasked(const Device& /*device*/, Outcome /*outcome*/,
                         const std::string& /*reason*/, const std::string& /*remedy*/,
                         Duration /*rest*/, Instant /*now*/) {}
};

/// Makes the observer of a line. The roster and the store must stay valid for the lifetime of the
/// observer.
using MakeObserver =
    std::function<std::unique_ptr<LineObserver>(const Roster& roster, PointStore& store)>;

}  // namespace baudgate::bus
