// What a device says unasked, on its way from the line: what it means (gateway/bus/jobs/speaker.h),
// how it is counted, and where its readings go.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "gateway/base/bytes.h"
#include "gateway/bus/counters/ledger.h"
#include "gateway/bus/devices/line_observer.h"
#include "gateway/bus/exchange/unasked_receiver.h"
#include "gateway/bus/jobs/intake.h"
#include "gateway/bus/jobs/speaker.h"
#include "gateway/bus/jobs/upkeep.h"

namespace baudgate {

class UnaskedSide {
 public:
  /// All outlive it.
  UnaskedSide(const Roster& roster, LineObserver& observer, Ledger& ledger, Upkeep& upkeep,
              Intake& intake)
      : speaker_(roster, observer),
        observer_(observer),
        is_network_(roster.is_network()),
        ledger_(ledger),
        upkeep_(upkeep),
        intake_(intake) {
    if (const Device* const device = speaker_.device()) ledger_.devices.OnSpeaks(*device);
  }

  /// See Speaker.
  const Standing* standing() const { return speaker_.standing(); }
  std::optional<Instant> Deadline() const { return speaker_.DueAt(); }
  /// Its messages count.
  bool listens() const { return speaker_.in_use(); }

  void OnOpened();
  /// Bytes of the line.
  void OnBytes(View bytes, Instant now);
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
  Ledger& ledger_;
  Upkeep& upkeep_;
  Intake& intake_;
};

}  // namespace baudgate
