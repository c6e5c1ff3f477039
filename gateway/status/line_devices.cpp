// SPDX-License-Identifier: Apache-2.0
#include "gateway/status/line_devices.h"

#include <algorithm>

namespace baudgate::control {
namespace {

/// It fails often when so many of its recent exchanges do.
constexpr double kOften = 0.125;
/// The part of the time from which an absent device is named; the gateway gives it less of what
/// others want.
constexpr double kNotableWaste = 0.1;

double Seconds(Duration duration) { return std::chrono::duration<double>(duration).count(); }

/// What it took of the line without an answer.
double Wasted(const DeviceStatus& status) {
  const double answered =
      Seconds(status.round_trips.mean()) * static_cast<double>(status.round_trips.count());
  return std::max(Seconds(status.busy) - answered, 0.0);
}

bool FailsOften(const DeviceStatus& status) {
  const std::size_t failures = RecentFailures(status);
  return failures > 1 &&
         static_cast<double>(failures) >= kOften * static_cast<double>(status.recent.size());
}

}  // namespace

bool IsAbsent(const DeviceStatus& status) {
  return status.state == DeviceState::offline ||
         (status.state == DeviceState::never_seen && status.exchanges > 0);
}

std::size_t RecentFailures(const DeviceStatus& status) {
  std::size_t failures = 0;
  for (const Outcome outcome :
       {Outcome::no_reply, Outcome::partial, Outcome::corrupt, Outcome::unexpected}) {
    failures += status.recent.Count(outcome);
  }
  return failures;
}

double MissedShare(const DeviceRecord& device, Now now, Instant started) {
  const double periods = Seconds(now.instant - started) / Seconds(device.device->poll);
  return periods > 0 ? std::min(device.status.missed / periods, 1.0) : 0;
}

LineDevices LookAt(std::span<const DeviceRecord> devices, Now now, Instant started) {
  LineDevices seen;
  double busy = 0;
  for (const DeviceRecord& device : devices) busy += Seconds(device.status.busy);
  for (const DeviceRecord& device : devices) {
    const DeviceStatus& status = device.status;
    if (status.state == DeviceState::disabled) continue;
    const bool absent = IsAbsent(status);
    ++seen.in_use;
    seen.absent += absent ? 1 : 0;
    if (!absent && MissedShare(device, now, started) >= kNotableShare) seen.misses = true;
    const double waste = busy > 0 ? Wasted(status) / busy : 0;
    if (absent ? waste < kNotableWaste : !FailsOften(status)) continue;
    if (seen.wasteful != nullptr) {
      // Probes of absent ones may have had idle time only.
      const bool other_absent = IsAbsent(seen.wasteful->status);
      if (absent != other_absent ? absent : waste <= seen.waste) continue;
    }
    seen.wasteful = &device;
    seen.waste = waste;
  }
  return seen;
}

}  // namespace baudgate::control
