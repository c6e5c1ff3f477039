// Poller runs one line: takes in bytes, time and requests, has the next job chosen whenever the
// line is idle (gateway/bus/jobs/job_run.h), and has those answered who wait
// (gateway/bus/jobs/waiting_clients.h). The composition root of the bus. Sans-I/O like
// gateway/bus/exchange/line.h: bytes and time come in as arguments. One thread at a time.
//
// Poller drives LineInputs, which gets all that happens on the line, and DeviceSide, which gets
// what the gateway says of a device. LineInputs drives LineSide, which joins the line and the job.
// LineSide drives Reception, which takes out the echo, and Reception asks ReplyJudge what a frame
// means. TelegramExchange sends a telegram by hand.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "config/model/line.h"
#include "gateway/base/bytes.h"
#include "gateway/base/finding.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/bus/counters/accounts.h"
#include "gateway/bus/devices/poller_listener.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/bus/exchange/line.h"
#include "gateway/bus/jobs/chooser.h"
#include "gateway/bus/jobs/device_tracker.h"
#include "gateway/bus/jobs/job.h"
#include "gateway/bus/jobs/job_end.h"
#include "gateway/bus/jobs/job_phases.h"
#include "gateway/bus/jobs/job_run.h"
#include "gateway/bus/jobs/unasked.h"
#include "gateway/bus/jobs/waiting_clients.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/replies/whose_reply.h"
#include "gateway/bus/schedule/turns.h"
#include "gateway/bus/writes/route_queue.h"
#include "gateway/bus/writes/write_command.h"
#include "gateway/bus/writes/write_queue.h"
#include "protocols/protocol.h"

namespace baudgate::bus {

// One telegram by hand on a line that has paused for it: it is sent as it is, and whatever comes
// back is kept. Sans-I/O, as the line. Used by gateway/lines/telegram_queue.h.

/// The device in whose name it is sent.
struct Speaking {
  const protocols::Protocol* protocol = nullptr;
  protocols::ParsedOptions options{};
  config::SerialSettings serial{};
  LineTimes times{};
};

class TelegramExchange final : private LineClient {
 public:
  TelegramExchange(const Speaking& as, config::Echo echo, View telegram, Instant now);

  /// True: the request is to be sent now.
  bool Begin(Instant now);
  bool Receive(View bytes, Instant now);
  bool OnTimer(Instant now);
  std::optional<Instant> Deadline() const { return line_.Deadline(); }

  const protocols::Request& request() const { return request_; }
  bool has_ended() const { return end_.has_value(); }
  /// It has ended, and the line is silent again.
  bool is_over() const { return end_ && line_.idle(); }
  /// Once it has ended.
  const ExchangeEnd& end() const { return *end_; }
  /// All that came back, without its echo if that is removed.
  const Bytes& reply() const { return reply_; }

 private:
  Outcome Judge(View, Instant) override { return Outcome::ok; }
  bool Take(LineNews news);

  Line line_{static_cast<LineClient&>(*this)};
  EchoFilter echo_;
  Speaking as_;
  protocols::Request request_;
  std::optional<ExchangeEnd> end_;
  Bytes reply_;
};

// The devices of a line, as the gateway outside of it sees them: what it tells the line about a
// device, and what the opening or closing of the port means for all of them. Driven by Poller.
class DeviceSide {
 public:
  /// All outlive it.
  DeviceSide(Roster& roster, Accounts& accounts, DeviceTracker& tracker, UnaskedSide& unasked,
             EffectApplier& effects);

  void Attach(Tap& tap, std::vector<protocols::ForeignRule> foreign);

  void OnOpened(Instant now);
  /// The port closes. Returns why, in words.
  std::string OnClosing(Override why);
  /// Its job has ended.
  void OnClosed(Instant now) { tracker_.OnClosed(now); }
  std::string WhyClosed() const { return accounts_.states.WhyClosed(); }

  // See Poller. `index`: in the point store; `open`: the port is.
  void Recall(std::uint32_t index, std::string memory, Now now);
  void SetInUse(std::uint32_t index, bool in_use, bool open, Instant now);
  void OnEventsKept(std::uint32_t index, const std::string& said, Instant now);
  void OnHostClock(bool right);
  void OnUnsettledWrite(std::uint32_t index);
  void OnUnansweredTelegram(Instant now) { tracker_.OnUnansweredTelegram(now); }
  void OnWritingTelegram(std::uint32_t index, View telegram, Instant now);
  Speaking SpeakingAs(std::uint32_t index) const;

  /// A device that speaks unasked may have something to tell without a message.
  void OnTimer(Now now) { unasked_.OnTimer(now); }
  std::optional<Instant> Deadline() const { return unasked_.Deadline(); }
  /// The input was handled.
  void OnSettled(Instant now) { unasked_.OnSettled(now); }

 private:
  Roster& roster_;
  Accounts& accounts_;
  DeviceTracker& tracker_;
  UnaskedSide& unasked_;
  EffectApplier& effects_;
};

// Groups the parts that take in replies, and messages that a device sends unasked: from there they
// go to the store, and to the listener, which keeps events.
struct IntakeParts {
  /// All outlive it.
  IntakeParts(LineContext& context, LineObserver& observer, PointStore& store,
              PollerListener& listener)
      : intake(store, listener),
        replies(context.owed, context.agenda, context.accounts, context.tracker, intake),
        unasked(context.roster, observer, context.accounts, context.tracker, intake) {}

  Intake intake;
  EffectApplier replies;
  UnaskedSide unasked;
};

// Handles the bytes that come back for the request under way: its echo is taken out
// (gateway/bus/exchange/line.h), what the rest looks like is kept for the status
// (gateway/bus/devices/poller_listener.h), and a whole frame is judged (ReplyJudge). Driven by
// LineSide:
//
//   on the line                          call
//   a request is to be sent              TakeChanged, then OnSend
//   bytes come, at any time              TakeOutEcho; what is not echo goes to the line
//   a whole frame has come               Judge
//   the exchange has ended               Assess
//
class Reception {
 public:
  /// Both references outlive it.
  Reception(config::Echo echo, LineObserver& observer, WhoseReply& whose)
      : echo_(echo), observer_(observer), judge_(whose) {}

  void OnOpened();
  void OnClosed() { echo_.OnClosed(); }
  /// Earlier exchanges that look different now, because more has come since they were looked at.
  std::vector<EarlierFinding> TakeChanged() { return observer_.TakeChanged(); }
  /// Before the request of this job goes to the port.
  void OnSend(const Job& job, Instant now);
  /// `job`: that of the line, which may wait for its turn; null: none.
  EchoWatch::Received TakeOutEcho(View bytes, const Job* job, Instant now);
  /// A whole frame came for the request of this job.
  Outcome Judge(Job& job, View frame, Instant now);

  /// How an exchange looked.
  struct Seen {
    Finding finding{};
    bool no_echo = false;     ///< `echo: verify`: it was missing
    bool cut = false;         ///< see EchoWatch::is_cut
    bool negotiates = false;  ///< see LineObserver::TakeNegotiation
  };
  /// The reason of `end` is set if the echo explains it.
  Seen Assess(const Job& job, ExchangeEnd& end);

 private:
  EchoWatch echo_;
  LineObserver& observer_;
  ReplyJudge judge_;
};

// Between the line and the job under way: gives the line the request of the job, and the job its
// replies and the end of its exchange. Everything else that happens on the line is returned as a
// value. Driven by LineInputs:
//
//   what happens                         call
//   the port opens, or closes            OnOpened; OnClosed, and at last OnPortClosed
//   bytes, an end of connection, time    FeedLine, OnEnded, OnTimer
//   the job takes its turn               Start
//   LineNews::send                       TakeChanged, then Send
//   LineNews::end                        KeepEnd; after all news of the input TakeEnd and PassToJob
//   its request may be too late by now   Withdraw
//
class LineSide : private LineClient {
 public:
  /// `standing`: what a device sends unasked; null: none does. All references outlive it; `port`
  /// may be made later than it.
  LineSide(Reception& reception, const protocols::Standing* standing, JobRun& run,
           RequestPort& port);

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
  Received FeedLine(View bytes, Instant now);
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

  void KeepEnd(ExchangeEnd end);
  /// An exchange that is over: how it ended, and how it looked.
  struct Over {
    const Member* member = nullptr;
    ExchangeEnd end;
    Reception::Seen seen;
  };
  /// Empty: none has ended since it was asked last.
  std::optional<Over> TakeEnd();
  /// The job decides what follows.
  void PassToJob(Over over);

 private:
  Outcome Judge(View frame, Instant now) override;
  /// It has a request, and waits until it may be sent.
  bool waits_for_quiet() const { return line_.state() == Line::State::quiet; }

  Line line_{*this};
  Reception& reception_;
  JobRun& run_;
  RequestPort& port_;
};

// Since when bytes that are read now may have been waiting. While bytes are
// awaited, the line looks for them every kLook. If a look is late, the program was stopped or
// starved, or its machine was paused: what is read then may have come at any time since the look
// before. The same holds for what is read directly behind, because one read does not empty a port.
//
//   look before    this look    what is read has come
//   1.0 s          1.1 s        now
//   1.0 s          61.0 s       since 1.0 s
//                  61.4 s       since 1.0 s: it may have waited as well
//                  61.6 s       now
class ArrivalTime {
 public:
  /// An input comes; `looks`: bytes were awaited before it.
  void OnInput(Instant now, bool looks) {
    const Instant before = std::exchange(last_, now);
    if (!looks || now - before <= kLook + kLate) return;
    if (now >= held_until_) held_since_ = before;
    held_until_ = now + kHeld;
  }
  /// When the next input is due, while bytes are awaited.
  Instant NextLook() const { return last_ + kLook; }
  /// When bytes that were read at this moment have come at the earliest.
  Instant Earliest(Instant read) const {
    return read >= held_since_ && read < held_until_ ? held_since_ : read;
  }

 private:
  static constexpr Duration kLook = 100ms;
  static constexpr Duration kLate = 100ms;
  static constexpr Duration kHeld = 500ms;

  Instant last_{};
  Instant held_since_{};
  Instant held_until_{};
};

// The inputs of a line, and what they mean beside the job under way: the account of the line, what
// a device says unasked, stray bytes, and replies that come late or twice. The job itself has its
// part from LineSide. Driven by Poller:
//
//   what happens                         call
//   the port opens, or closes            OnOpened, OnClosed
//   bytes, an end of connection, time    HandleBytes, OnEnded, OnTimer; then HandleEnd
//   the job takes its turn               Start
//   its request may be too late by now   Withdraw
//
class LineInputs {
 public:
  /// All references outlive it.
  LineInputs(LineSide& line, UnaskedSide& unasked, DeviceTracker& tracker, Accounts& accounts)
      : line_(line), unasked_(unasked), tracker_(tracker), accounts_(accounts) {}

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
  void HandleBytes(View bytes, Now now);
  void OnEnded(Now now) { Apply(line_.OnEnded(now.instant), now); }
  void OnTimer(Now now) { Apply(line_.OnTimer(now.instant), now); }
  /// The line is idle, and the job says send. `idle_since`: since when it is.
  void Start(Instant idle_since, Now now) { Apply(line_.Start(idle_since, now.instant), now); }
  /// Applies the end of an exchange, if one has ended. After all other news of the input.
  void HandleEnd();

 private:
  /// Bytes may come: of a reply, or of a device that speaks unasked.
  bool IsAwaiting() const { return line_.is_open() && (line_.asks() || unasked_.listens()); }
  void Date(LineNews& news, Instant now) const;
  void Apply(LineNews news, Now now);
  void Send(Now now);
  void HandleStray(const StrayBytes& stray, Instant now);

  LineSide& line_;
  UnaskedSide& unasked_;
  DeviceTracker& tracker_;
  Accounts& accounts_;
  ArrivalTime arrival_;
};

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
  void Attach(Tap& tap, std::vector<protocols::ForeignRule> foreign = {}) {
    devices_.Attach(tap, std::move(foreign));
  }
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

  /// Takes the command, or says no when kQueueLimit are waiting. Commands for an offline device, or
  /// on a closed line, are answered at once: nothing is sent late.
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
  void WindUp() { turn_taker_.WindUp(); }
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

  LineContext context_;
  const std::unique_ptr<LineObserver> observer_;
  IntakeParts intake_parts_;
  Chooser chooser_;
  JobPhases phases_;
  JobRun run_;
  Reception reception_;
  LineSide line_side_;
  // The parts above are joined here, and used by these alone:
  IdleTime time_;
  DeviceSide devices_;
  WaitingClients clients_;
  TurnTaker turn_taker_;
  LineInputs line_;
};

}  // namespace baudgate::bus
