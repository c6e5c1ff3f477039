// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "gateway/diagnosis/causes/diagnose_parts.h"
#include "gateway/diagnosis/causes/evidence.h"
#include "gateway/diagnosis/causes/words.h"

namespace baudgate::control {
namespace {

constexpr int kMinutes = 5;
/// Fewer missed periods are a hiccup, as at a start.
constexpr std::uint32_t kNotableMisses = 3;
constexpr double kNotableMissed = 0.02;
/// From here on failures are what the line's time goes to.
constexpr double kMuchWaste = 0.2;
/// So much of it is enough for periods to be missed meanwhile.
constexpr double kSomeWaste = 0.03;
/// And good exchanges are.
constexpr double kFull = 0.8;
constexpr double kBusy = 0.5;
constexpr double kMuchOfOne = 0.4;
/// The longest silence that a protocol needs before a request is shorter.
constexpr Duration kLongQuiet = 50ms;
/// A device stands out if it takes this many times its even share.
constexpr double kMoreThanOthers = 1.25;

/// The time that the last minutes have had so far.
double Watched(Now now, Instant started) {
  const Duration of_minute = now.instant.time_since_epoch() % 1min;
  return Seconds(std::min<Duration>(now.instant - started, of_minute + (kMinutes - 1) * 1min));
}

/// The characters take most of the time, and not the thinking of the devices.
bool IsWireTime(const LineStatus& status, const config::Line& line) {
  const auto characters = static_cast<std::int64_t>(status.bytes_in + status.bytes_out);
  return 2 * characters * line.serial.CharacterTime() > status.busy;
}

/// The silence that is configured takes as long as the exchanges behind it.
bool IsQuietTime(std::span<const DeviceRecord> devices) {
  return std::ranges::all_of(devices, [](const DeviceRecord& one) {
    const std::optional<Duration>& quiet = one.status.timing.quiet;
    return quiet && *quiet >= kLongQuiet && *quiet > one.status.round_trips.mean();
  });
}

bool FailsOften(const DeviceRecord& record) { return FailedOf(record.status) >= kNotableFailures; }

}  // namespace

double MissedShare(const DeviceRecord& device, Now now, Instant started) {
  const MinuteCounts tally = device.status.hour.Sum(now.instant, kMinutes - 1);
  if (tally.missed < kNotableMisses) return 0;
  const double periods = Watched(now, started) / Seconds(device.device->poll);
  const double share = periods > 0 ? std::min(tally.missed / periods, 1.0) : 0;
  return share < kNotableMissed ? 0 : share;
}

std::string WhyNoTime(const LineStatus& line, std::span<const DeviceRecord> devices,
                      const DeviceRecord* device, Now now, Instant started) {
  const double watched = std::max(Watched(now, started), 1e-3);
  const DeviceRecord* wasteful = nullptr;
  const DeviceRecord* busiest = nullptr;
  double waste = 0;
  double most = 0;
  double served = 0;
  for (const DeviceRecord& one : devices) {
    const MinuteCounts tally = one.status.hour.Sum(now.instant, kMinutes - 1);
    served += Seconds(tally.served) / watched;
    if (const double its = Seconds(tally.wasted) / watched; its > waste) {
      waste = its;
      wasteful = &one;
    }
    if (const double its = Seconds(tally.served) / watched; its > most) {
      most = its;
      busiest = &one;
    }
  }
  const auto name = [device](const DeviceRecord& one) {
    return device != nullptr && one.device == device->device ? "it" : one.device->name;
  };
  const bool disturbed = std::ranges::any_of(devices, [](const DeviceRecord& one) {
    const Findings& findings = one.status.findings;
    return findings.Count(Symptom::other_master) + findings.Count(Symptom::master_beside) > 1;
  });
  if (disturbed) return {};  // and the line has a sentence about that
  // The device has a sentence about its own failures.
  if (device != nullptr && FailsOften(*device)) return {};
  // It has a sentence of its own, and so needs no other.
  if (waste >= kMuchWaste && (device == nullptr || wasteful->device == device->device)) return {};
  // Stray bytes beside good replies take time as well, and there is no failure to mend.
  if (waste >= kMuchWaste && !FailsOften(*wasteful)) return {};
  if (waste >= kMuchWaste) {
    return fmt::format("{} takes {} of the line's time with exchanges that fail: mend that first",
                       name(*wasteful), Percent(waste));
  }
  // One that is late says so itself, and what to do.
  if (device == nullptr && busiest != nullptr && busiest->status.patience > Duration()) return {};
  const bool wire = !devices.empty() && IsWireTime(line, *devices.front().line);
  const char* const ask_less =
      wire ? "ask for fewer points, or raise the bit rate" : "ask for fewer points";
  const bool stands_out = most * static_cast<double>(devices.size()) > kMoreThanOthers * served;
  if (most >= kMuchOfOne && devices.size() > 1 && stands_out) {
    const auto each = busiest->status.round_trips.mean();
    return fmt::format("{} takes {} of the line's time, {} ms an exchange: raise its poll, or {}",
                       name(*busiest), Percent(most), Milliseconds(each), ask_less);
  }
  if (served >= kFull && IsQuietTime(devices)) {
    return fmt::format(
        "more is asked than fits, half of the time is silence before requests: "
        "lower timing.quiet ({}), or raise poll",
        FormatDuration(*devices.front().status.timing.quiet));
  }
  if (served >= kFull) {
    return fmt::format(
        "more is asked than fits, good exchanges take {} of the time: raise poll, {}",
        Percent(served), ask_less);
  }
  if (served < kBusy || waste >= kSomeWaste) return {};
  return fmt::format("a round takes longer than its period: raise poll, {}", ask_less);
}

}  // namespace baudgate::control
