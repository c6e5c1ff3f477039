// HostClock tells whether this machine's clock is known to be synchronised (NTP, PTP, GPS), and
// tells every change. Devices are told the time only while it is. HostClock looks now and then, on
// a thread of its own, because the answer may take seconds. AskTimeService asks systemd.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>

#include "gateway/base/worker.h"

// Asks systemd's time service (org.freedesktop.timedate1) over the system bus whether this
// machine's clock is synchronised: for a service that may not ask the kernel (ProtectClock= of the
// unit). The answer is the kernel's own: timedated calls adjtimex.
struct sd_bus;

namespace baudgate {

/// Empty: there is no bus, no such service, or no answer. May take some seconds.
std::optional<bool> AskTimeService();
/// On a bus that is open.
std::optional<bool> AskTimeService(sd_bus& bus);

class HostClock {
 public:
  /// `tell` hears on the own thread of the first time that it is right, and of every change.
  explicit HostClock(std::function<void(bool right)> tell);
  /// Ends as soon as no answer is under way; the destructor waits for that.
  void RequestStop() { worker_.RequestStop(); }

 private:
  /// Returns until when the answer holds.
  Duration Look();

  const std::function<void(bool)> tell_;
  bool told_ = false;
  Worker worker_;
};

}  // namespace baudgate
