// Poller runs one line: takes in bytes, time and requests, has the next job chosen whenever the
// line is idle (gateway/bus/jobs/chooser.h) and run (gateway/bus/poller/job_runner.h), and has
// those answered who wait (gateway/bus/jobs/waiting_clients.h). It owns all parts of the bus for
// this line. Sans-I/O like gateway/bus/exchange/line.h: bytes and time come in as arguments. One
// thread at a time.
//
// Most inputs are handled in three steps: Advance lets time pass, the part that the input is for
// takes it in, and Settle answers clients and gives the next turns.
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
  /// `first_device`: the index of line.devices[0] in the store. `find` names the descriptor of a
  /// protocol that the configuration has checked to exist. All references outlive the poller;
  /// `port` and `listener` may be made later than it. Without `observe` nothing is diagnosed.
  Poller(const config::Line& line, std::uint32_t first_device, const FindProtocol& find,
         PointStore& store, RequestPort& port, PollerListener& listener,
         const MakeObserver& observe = {});

  /// Before anything else; `tap` outlives the poller. `foreign`: of all protocols.
  void Attach(Tap& tap, std::vector<protocols::ForeignRule> foreign = {});
  /// Before the port opens: what OnMemory said last before a restart.
  void Recall(std::uint32_t device, std::string memory, Now now);

  /// `keeps_bit_rate`: see Line::OnOpened.
  void OnOpened(Now now, bool keeps_bit_rate = false);
  /// `why` is shown with all points: out_of_service when the port has been lent to another program.
  void OnClosed(Now now, Override why = Quality::bad_not_connected);
  /// `device` is an index in the point store. Not in use: not asked, its points out of service.
  void SetInUse(std::uint32_t device, bool in_use, Now now);
  void Receive(View bytes, Now now);
  /// The server has ended the connection, and the next request opens another.
  void OnEnded(Now now);
  void OnTimer(Now now);
  std::optional<Instant> Deadline() const;

  /// Takes the command, or says no when kQueueLimit are waiting. Commands for an offline device
  /// (unless only a write can show that it is back), or on a closed line, are answered at once:
  /// nothing is sent late.
  bool Submit(WriteCommand command, Now now);
  static constexpr std::size_t kQueueLimit = WriteQueue::kLimit;
  /// Takes a request of a transparent route; the caller keeps to RouteQueue::kLimit. On a closed
  /// line, and for a slave that does not answer, it may be answered at once.
  void Submit(RoutedRequest request, Now now);
  /// What OnEvents has reported of the device is on the disk: it may forget it. `said`: see
  /// Conversation.
  void OnEventsKept(std::uint32_t device, const std::string& said, Now now);
  /// See Conversation.
  void OnHostClock(bool right);
  void OnUnsettledWrite(std::uint32_t device);
  /// The client has left: its routed requests are answered, and what is not on the wire is not
  /// sent.
  void Abandon(std::uint64_t client, Now now);

  /// Nothing is begun any more until the port opens again: the write under way may end.
  void WindUp() { hold_.WindUp(); }
  /// The port stays open after all.
  void CallOffWindUp(Now now);
  bool IsWriting() const;

  /// Nothing is begun any more until GoOn: the line is wanted for a telegram by hand. True: what
  /// was under way has ended, the line is silent, and no late reply can come, or was waited for
  /// long enough.
  bool Pause(Now now);
  /// The request that it has sent may still go out: it has waited for a connection until now.
  bool MayGoOut(Now now) const;
  /// Before GoOn: the telegram was sent, and got no reply.
  void OnUnansweredTelegram(Now now);
  /// Before GoOn: the telegram to this device was sent, and may have written.
  void OnWritingTelegram(std::uint32_t device, View telegram, Now now);
  /// Without a Pause: nothing.
  void GoOn(Now now);
  /// The protocol and the settings with which a telegram by hand to this device is sent.
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
