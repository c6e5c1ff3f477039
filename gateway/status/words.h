// Numbers as the sentences of `baudgate status` say them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <string>
#include <string_view>

#include "config/model/device.h"
#include "gateway/base/time.h"

namespace baudgate::control {

/// A device refuses what it has answered before, so its profile still fits.
inline constexpr const char* kHasWorked =
    "it has answered before: another device, other settings or a fault: look at it, restart it";
inline constexpr const char* kProfileFits = "does the profile fit";

/// Why replies come that nobody asked for here. `network`: over a connection.
inline const char* AnotherAsksIt(bool network) {
  return network ? "another client of the server asks it (let the server serve one client only)"
                 : "another master asks it (take it away)";
}

/// Every device of its protocol answers to its address.
inline bool HasCommonAddress(const config::Device& device) {
  const std::string_view common = device.traits->common_address;
  return !common.empty() && device.address == common;
}

/// Why more than one device answers to its address.
inline std::string TwoDevices(const config::Device& device) {
  return HasCommonAddress(device)
             ? "every device answers to address " + device.address + ": give each its own"
             : "two devices have its address (" + device.address + "; unplug one)";
}

/// 0 of nothing.
inline double Share(double part, double whole) { return whole > 0 ? part / whole : 0; }

inline double Seconds(Duration duration) { return std::chrono::duration<double>(duration).count(); }

/// "0.4 %", "62 %".
inline std::string Percent(double share) {
  const double percent = 100 * share;
  return percent < 9.95 ? fmt::format("{:.1f} %", percent) : fmt::format("{:.0f} %", percent);
}

inline std::string Times(std::uint64_t count) {
  return count == 1 ? "once" : fmt::format("{} times", count);
}

inline std::int64_t Milliseconds(Duration duration) {
  return std::chrono::ceil<std::chrono::milliseconds>(duration).count();
}

}  // namespace baudgate::control
