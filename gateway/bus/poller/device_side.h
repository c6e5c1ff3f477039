// The devices of a line, as the gateway outside of it sees them: what it tells the line about a
// device, and what the opening or closing of the port means for all of them. Driven by
// gateway/bus/poller/poller.cpp.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/bus/counters/ledger.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/bus/exchange/tap.h"
#include "gateway/bus/jobs/effect_applier.h"
#include "gateway/bus/jobs/upkeep.h"
#include "gateway/bus/poller/telegram_exchange.h"
#include "gateway/bus/poller/unasked_side.h"

namespace baudgate {

class DeviceSide {
 public:
  /// All outlive it.
  DeviceSide(Roster& roster, Ledger& ledger, Upkeep& upkeep, UnaskedSide& unasked,
             EffectApplier& effects);

  void Attach(Tap& tap, std::vector<ForeignRule> foreign);

  void OnOpened(Instant now);
  /// The port closes. Returns why, in words.
  std::string OnClosing(Override why);
  /// Its job has ended.
  void OnClosed(Instant now) { upkeep_.OnClosed(now); }
  std::string WhyClosed() const { return ledger_.states.WhyClosed(); }

  // See Poller. `index`: in the point store; `open`: the port is.
  void Recall(std::uint32_t index, std::string memory, Now now);
  void SetInUse(std::uint32_t index, bool in_use, bool open, Instant now);
  void OnEventsKept(std::uint32_t index, const std::string& said, Instant now);
  void OnHostClock(bool right);
  void OnUnsettledWrite(std::uint32_t index);
  void OnUnansweredTelegram(Instant now) { upkeep_.OnUnansweredTelegram(now); }
  void OnWritingTelegram(std::uint32_t index, View telegram, Instant now);
  Speaking SpeakingAs(std::uint32_t index) const;

  /// A device that speaks unasked may have something to tell without a message.
  void OnTimer(Now now) { unasked_.OnTimer(now); }
  std::optional<Instant> Deadline() const { return unasked_.Deadline(); }
  /// The input was handled.
  void OnSettled(Instant now) { unasked_.OnSettled(now); }

 private:
  Roster& roster_;
  Ledger& ledger_;
  Upkeep& upkeep_;
  UnaskedSide& unasked_;
  EffectApplier& effects_;
};

}  // namespace baudgate
