// `Poller` runs one serial line and owns all parts of the bus for it. Its inputs are bytes, the
// time and requests of clients. Whenever the line is idle, `Chooser` picks the next job and
// `JobRunner` runs it; `WaitingClients` answers clients. `Poller` has no I/O and no clock: bytes
// and time are arguments. One thread at a time can call it.
//
// Most inputs are handled in three steps: Advance applies the time, the part that the input
// concerns handles it, and Settle answers clients and starts the next job.
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
  /// `first_device`: index of the line's first device in the point store. `find` returns the
  /// protocol with the given name, which exists because the configuration was checked. All
  /// references must stay valid for the lifetime of the poller. `port` and `listener` are not used
  /// by the constructor, so they can be constructed later. Without `observe` there is no diagnosis.
  Poller(const config::Line& line, std::uint32_t first_device, const FindProtocol& find,
         PointStore& store, RequestPort& port, PollerListener& listener,
         const MakeObserver& observe = {});

  /// Call before all other functions. `tap` must stay valid for the lifetime of the poller.
  /// `foreign`: the rules by which messages of other protocols are recognised.
  void Attach(Tap& tap, std::vector<protocols::ForeignRule> foreign = {});
  /// Gives a conversation its saved memory. Call before the port opens. `memory`: what
  /// PollerListener::OnMemory reported last before the restart.
  void Recall(std::uint32_t device, std::string memory, Now now);

  /// `keeps_bit_rate`: the port sends and receives at its bit rate; see Line::OnOpened.
  void OnOpened(Now now, bool keeps_bit_rate = false);
  /// The port has closed. `why`: the quality of all points until it opens; bad_out_of_service if
  /// the port was lent to another program.
  void OnClosed(Now now, Override why = Quality::bad_not_connected);
  /// Enables or disables a device. A disabled device is not asked, and its points are out of
  /// service. `device`: index in the point store.
  /// `by`: see DeviceStatus::disabled_by.
  void SetInUse(std::uint32_t device, bool in_use, Now now, const std::string& by = {});
  void Receive(View bytes, Now now);
  /// The server has closed the connection. The next request opens a new connection.
  void OnEnded(Now now);
  void OnTimer(Now now);
  std::optional<Instant> Deadline() const;

  /// Takes the command. Returns false if kQueueLimit commands wait. If the line is closed or the
  /// device is offline, the command is answered at once, so that it is not sent late. A write is
  /// kept if only a write can show that the device is back.
  bool Submit(WriteCommand command, Now now);
  static constexpr std::size_t kQueueLimit = WriteQueue::kLimit;
  /// Takes a request of a transparent route. The caller must not exceed RouteQueue::kLimit
  /// requests. The request can be answered at once, if the line is closed or the slave does not
  /// answer.
  void Submit(RoutedRequest request, Now now);
  /// The events that PollerListener::OnEvents reported are saved on disk, so the device can delete
  /// them. `said`: see Conversation::OnEventsKept.
  void OnEventsKept(std::uint32_t device, const std::string& said, Now now);
  /// Reports whether the clock of this machine is synchronised (`right`).
  void OnHostClock(bool right);
  void OnUnsettledWrite(std::uint32_t device);
  /// The client has left: its routed requests are answered, and those that were not sent yet are
  /// not sent.
  void Abandon(std::uint64_t client, Now now);

  /// Starts no further job until the port has been closed and opened again. The job under way
  /// continues.
  void WindUp() { hold_.WindUp(); }
  /// Cancels WindUp, because the port stays open.
  void CallOffWindUp(Now now);
  bool IsWriting() const;

  /// Starts no further job until GoOn, because a telegram by hand needs the line. Call until it
  /// returns true: the port is open, the last job has ended, the line is silent, and no late reply
  /// can come, or 4 s have passed (bus::Hold).
  bool Pause(Now now);
  /// True if the request that was given to the port can still be sent after it has waited for a
  /// connection. False if, for example, its deadline has passed.
  bool MayGoOut(Now now) const;
  /// Call before GoOn if the telegram by hand was sent and got no reply.
  void OnUnansweredTelegram(Now now);
  /// Call before GoOn if a telegram by hand to this device was sent and may have changed it.
  void OnWritingTelegram(std::uint32_t device, View telegram, Now now);
  /// Ends Pause. Does nothing if there was no Pause.
  void GoOn(Now now);
  /// Returns the protocol, options, port settings and times with which a telegram that a user sends
  /// by hand (`baudgate ask`) goes to this device.
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
