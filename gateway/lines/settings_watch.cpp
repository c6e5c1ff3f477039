// SPDX-License-Identifier: Apache-2.0
#include "gateway/lines/settings_watch.h"

#include <fmt/format.h>

#include "gateway/base/log.h"
#include "transports/serial_settings.h"

namespace baudgate {
namespace {

/// Each look is a call into the driver.
constexpr Duration kLookEvery = 1s;

}  // namespace

void SettingsWatch::OnOpened(Now now) {
  applied_ = line_.serial;
  times_restored_ = 0;
  Look(now);
}

void SettingsWatch::OnSend(const config::SerialSettings& serial, Now now) {
  if (now.instant - looked_ >= kLookEvery) Look(now);
  if (SameSettings(serial, applied_)) return;
  const Status status = port_.Apply(serial);
  if (!status) {
    log::WarnFolded(line_.name + " settings",
                    "line {}: {}; it is tried again with the next request", line_.name,
                    status.error());
    return;
  }
  applied_ = serial;
}

void SettingsWatch::OnTimer(Now now) {
  if (due_ && *due_ <= now.instant) Look(now);
}

void SettingsWatch::Look(Now now) {
  looked_ = now.instant;
  CountErrors();
  CheckSettings(now);
  if (listens_) due_ = now.instant + kLookEvery;
}

void SettingsWatch::CountErrors() {
  const PortCounters errors = port_.Counters();
  display_.Update([&](LineStatus& status) {
    status.parity_errors = errors.parity;
    status.framing_errors = errors.framing;
    status.overruns = errors.overrun;
    status.modem = port_.ReadModemLines();
  });
}

void SettingsWatch::CheckSettings(Now now) {
  const auto changes = port_.Restore();
  if (!changes) return;
  ++times_restored_;
  display_.Update([this](LineStatus& status) {
    status.restored = static_cast<std::uint32_t>(times_restored_);
  });
  log::WarnFolded(line_.name + " restored",
                  "line {}: another program has changed the settings of {} ({}); they are set "
                  "again. Find it with 'baudgate ports'; docs/ports.md names the usual ones",
                  line_.name, line_.port, *changes);
  const auto times =
      times_restored_ == 1 ? std::string("once") : fmt::format("{} times", times_restored_);
  display_.Show(LineStatus::Port::open,
                fmt::format("{}; another program has changed its settings {}, last {} ({}); they "
                            "were set again",
                            port_.Describe(), times, FormatWallTime(now.wall), *changes),
                now);
}

}  // namespace baudgate
