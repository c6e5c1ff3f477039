// `Poller` runs one line and owns all parts of the bus for it. Inputs are bytes, the time and
// requests. Whenever the line is idle, the next job is chosen (gateway/bus/jobs/chooser.h) and run
// (gateway/bus/poller/job_runner.h); waiting clients are answered
// (gateway/bus/jobs/waiting_clients.h). Like `Line` it has no input, output or clock: bytes and
// time are arguments. One thread at a time.
//
// Most inputs are handled in three steps: Advance applies the time, the part that the input is for
// takes it, and Settle answers clients and gives the next turns.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "config/model/line.h"
#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "gateway/bus/counters/accounts.h"
#include "gateway/bus/devices/poller_listener.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/bus/exchange/telegram_exchange.h"
#include "gateway/bus/jobs/line_context.h"
#include "gateway/bus/jobs/unasked.h"
#include "gateway/bus/jobs/waiting_clients.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/poller/job_runner.h"
#include "gateway/bus/schedule/turns.h"
#include "gateway/bus/writes/route_queue.h"
#include "gateway/bus/writes/write_command.h"
#include "gateway/bus/writes/write_queue.h"
#include "protocols/protocol.h"

namespace baudgate::bus {

class Poller {
 public:
  using FindProtocol = Roster::FindProtocol;
  /// `first_device`: the index of line.devices[0] in the point store. `find` returns the descriptor
  /// of a protocol; the configuration has checked that it exists. All references must stay valid
  /// for the lifetime of the poller; `port` and `listener` may be constructed later. Without
  /// `observe` there is no diagnosis.
  Poller(const config::Line& line, std::uint32_t first_device, const FindProtocol& find,
         PointStore& store, RequestPort& port, PollerListener& listener,
         const MakeObserver& observe = {});

  /// Call before anything else. `tap` must stay valid for the lifetime of the poller. `foreign`:
  /// rules of all protocols, to recognise their messages.
  void Attach(Tap& tap, std::vector<protocols::ForeignRule> foreign = {});
  /// Call before the port opens. `memory`: what OnMemory reported last before a restart.
  void Recall(std::uint32_t device, std::string memory, Now now);

  /// `keeps_bit_rate`: see Line::OnOpened.
  void OnOpened(Now now, bool keeps_bit_rate = false);
  /// `why` is shown with all points: out_of_service if the port has been lent to another program.
  void OnClosed(Now now, Override why = Quality::bad_not_connected);
  /// `device` is an index in the point store. A device that is not in use is not asked, and its
  /// points are out of service.
  void SetInUse(std::uint32_t device, bool in_use, Now now);
  void Receive(View bytes, Now now);
  /// The server has closed the connection. The next request opens another.
  void OnEnded(Now now);
  void OnTimer(Now now);
  std::optional<Instant> Deadline() const;

  /// Takes the command. Returns false if kQueueLimit commands wait. Commands for an offline device
  /// (unless only a write can show that it is back), or on a closed line, are answered at once, so
  /// nothing is sent late.
  bool Submit(WriteCommand command, Now now);
  static constexpr std::size_t kQueueLimit = WriteQueue::kLimit;
  /// Takes a request of a transparent route; the caller keeps to RouteQueue::kLimit. On a closed
  /// line, and for a slave that does not answer, the request may be answered at once.
  void Submit(RoutedRequest request, Now now);
  /// The events that OnEvents reported are on the disk, so the device may forget them. `said`: see
  /// Conversation::OnEventsKept.
  void OnEventsKept(std::uint32_t device, const std::string& said, Now now);
  /// See Conversation::OnHostClock.
  void OnHostClock(bool right);
  void OnUnsettledWrite(std::uint32_t device);
  /// The client has left: its routed requests are answered, and requests that are not on the wire
  /// are not sent.
  void Abandon(std::uint64_t client, Now now);

  /// Begins no further job until the port opens again. A write under way may end.
  void WindUp() { hold_.WindUp(); }
  /// Cancels WindUp: the port stays open.
  void CallOffWindUp(Now now);
  bool IsWriting() const;

  /// Begins no further job until GoOn, because a telegram by hand needs the line. Returns true if
  /// the last job has ended, the line is silent, and no late reply can come, or the wait for it was
  /// long enough.
  bool Pause(Now now);
  /// Returns whether the request that was sent may still go out, after it has waited for a
  /// connection.
  bool MayGoOut(Now now) const;
  /// Call before GoOn if the telegram was sent and got no reply.
  void OnUnansweredTelegram(Now now);
  /// Call before GoOn if the telegram to this device was sent and may have written.
  void OnWritingTelegram(std::uint32_t device, View telegram, Now now);
  /// Ends Pause. Does nothing without a Pause.
  void GoOn(Now now);
  /// Returns the protocol and the settings for a telegram by hand to this device.
  Speaking SpeakingAs(std::uint32_t device) const;

  const Accounts& accounts() const { return context_.accounts; }

 private:
  void Advance(Now now);
  void SettleIfOpen();
  void Settle();
  void TakeTurns();
  bool TakeTurn();
  bool CountTurn(const Member* last);
  std::optional<Instant> NextTurnAt() const;
  bool IsClear(Instant now) const;

  LineContext context_;
  UnaskedSide unasked_;
  JobRunner runner_;
  WaitingClients clients_;
  IdleTime time_;
  Hold hold_;
  TurnLimit limit_;
};

}  // namespace baudgate::bus
