// The settings of an open port. Those that a request needs are set before it goes out. Once a
// second, while the line works, the error counters of the driver are read, and it is checked
// whether another program has changed the settings. ModemManager, brltty, a getty and stty do that;
// each exchange would fail from then on, so the settings are set again.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "config/model/line.h"
#include "gateway/base/time.h"
#include "gateway/lines/port_display.h"
#include "transports/transport.h"

namespace baudgate {

class SettingsWatch {
 public:
  /// All outlive it. `listens`: a device of the line sends unasked, so the port is looked at even
  /// if nothing is sent.
  SettingsWatch(const config::Line& line, Transport& port, PortDisplay& display, bool listens)
      : line_(line),
        port_(port),
        display_(display),
        listens_(listens && !line.is_network()),
        applied_(line.serial) {}

  void OnOpened(Now now);
  /// The port was lent, and has the settings of the line again.
  void OnReturned() { applied_ = line_.serial; }
  void OnClosed() { due_.reset(); }
  /// A request is about to be sent, with these settings.
  void OnSend(const config::SerialSettings& serial, Now now);
  void OnTimer(Now now);
  std::optional<Instant> Deadline() const { return due_; }

 private:
  void Look(Now now);
  void CountErrors();
  void CheckSettings(Now now);

  const config::Line& line_;
  Transport& port_;
  PortDisplay& display_;
  const bool listens_;
  config::SerialSettings applied_;  // what the open port is set to
  Instant looked_{};
  std::optional<Instant> due_;
  std::uint64_t times_restored_ = 0;  // since the port was opened
};

}  // namespace baudgate
