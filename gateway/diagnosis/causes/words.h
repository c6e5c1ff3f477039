// Words and numbers of the sentences of `baudgate status`: what devices and protocols say of a
// failure, cut to what a first sentence has room for. Pure.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <string>
#include <string_view>

#include "config/model/device.h"
#include "gateway/base/finding.h"
#include "gateway/base/time.h"

namespace baudgate::diagnosis {

/// A device refuses what it has answered before, so its profile still fits.
inline constexpr const char* kHasWorked =
    "it has answered before: another device, other settings or a fault: look at it, restart it";
inline constexpr const char* kHearsItself =
    "a part of each request comes back in front of the reply: the adapter hears itself (echo): "
    "switch its echo off, or use one with automatic direction";
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

/// Up to its first semicolon; of a long one the first part, and of a long quotation the beginning.
std::string Shortened(const std::string& reason);
/// What a device has said in place of values, without its own advice.
std::string Brief(const Finding& finding);
/// What to do about it.
std::string RemedyOf(const Finding& finding);
/// "slave 7 answers …: check the address …".
std::string WithRemedy(const Finding& finding);

}  // namespace baudgate::diagnosis
