// Asks systemd's time service (org.freedesktop.timedate1) over the system bus whether this
// machine's clock is synchronised: for a service that may not ask the kernel (ProtectClock= of the
// unit). The answer is the kernel's own: timedated calls adjtimex.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

struct sd_bus;

namespace baudgate {

/// Empty: there is no bus, no such service, or no answer. May take some seconds.
std::optional<bool> AskTimeService();
/// On a bus that is open.
std::optional<bool> AskTimeService(sd_bus& bus);

}  // namespace baudgate
