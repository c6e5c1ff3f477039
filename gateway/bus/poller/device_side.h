// The devices of a line, as the gateway outside of it sees them: what it tells the line about a
// device, and what the opening or closing of the port means for all of them. Driven by
// gateway/bus/poller/poller.cpp. TelegramExchange sends a telegram by hand, UnaskedSide handles
// what a device says unasked, and IntakeParts groups the parts that take in replies.
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
#include "gateway/bus/exchange/echo.h"
#include "gateway/bus/exchange/line.h"
#include "gateway/bus/jobs/device_tracker.h"
#include "gateway/bus/jobs/intake.h"
#include "gateway/bus/jobs/job_end.h"
#include "gateway/bus/points/point_store.h"
#include "protocols/protocol.h"

namespace baudgate {

// One telegram by hand on a line that has paused for it: it is sent as it is, and whatever comes
// back is kept. Sans-I/O, as the line. Used by gateway/lines/telegram_queue.h.

/// The device in whose name it is sent.
struct Speaking {
  const Protocol* protocol = nullptr;
  ParsedOptions options{};
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

  const Request& request() const { return request_; }
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
  Request request_;
  std::optional<ExchangeEnd> end_;
  Bytes reply_;
};

// What a device says unasked, on its way from the line: what it means (gateway/bus/jobs/intake.h),
// how it is counted, and where its readings go.
class UnaskedSide {
 public:
  /// All outlive it.
  UnaskedSide(const Roster& roster, LineObserver& observer, Accounts& accounts,
              DeviceTracker& tracker, Intake& intake)
      : speaker_(roster, observer),
        observer_(observer),
        is_network_(roster.is_network()),
        accounts_(accounts),
        tracker_(tracker),
        intake_(intake) {
    if (const Device* const device = speaker_.device()) accounts_.devices.OnSpeaks(*device);
  }

  /// See Speaker.
  const Standing* standing() const { return speaker_.standing(); }
  std::optional<Instant> Deadline() const { return speaker_.DueAt(); }
  /// Its messages count.
  bool listens() const { return speaker_.in_use(); }

  void OnOpened();
  /// Bytes of the line.
  void Overhear(View bytes, Instant now);
  /// What the line has made of them.
  void OnInput(const UnaskedInput& heard, Now now);
  void OnTimer(Now now);
  /// A batch of events of the device is on the disk.
  void OnKept(const Device& device);
  /// An input was handled.
  void OnSettled(Instant now);

 private:
  void Take(Speaker::Said said, Instant now);

  Speaker speaker_;
  const LineObserver& observer_;
  const bool is_network_;
  bool first_ = true;  // nothing has come since the port was opened
  Accounts& accounts_;
  DeviceTracker& tracker_;
  Intake& intake_;
};

class DeviceSide {
 public:
  /// All outlive it.
  DeviceSide(Roster& roster, Accounts& accounts, DeviceTracker& tracker, UnaskedSide& unasked,
             EffectApplier& effects);

  void Attach(Tap& tap, std::vector<ForeignRule> foreign);

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
// go to the store, and to the listener, which keeps events. For gateway/bus/poller/poller.h.
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

}  // namespace baudgate
