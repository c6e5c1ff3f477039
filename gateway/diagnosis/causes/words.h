// Phrases and number formats for the sentences of `baudgate status`. Reasons from devices and
// protocols are shortened to fit into a sentence. No function does I/O.
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

/// Remedy for a device that refuses requests that it has answered before. Its profile must fit.
inline constexpr const char* kHasWorked =
    "it has answered before: check whether the device or its settings were changed, or restart it";
inline constexpr const char* kHearsItself =
    "a part of each request comes back before the reply. Switch the echo of the adapter off, or "
    "use an adapter with automatic direction control";

/// The remedy if replies come to requests that this gateway has not sent. `network`: a TCP
/// connection.
inline const char* RemoveOther(bool network) {
  return network ? "limit the server to one client" : "remove another master from the line";
}

/// True if the device is configured with the address to which every device of its protocol answers.
inline bool HasCommonAddress(const config::Device& device) {
  const std::string_view common = device.traits->common_address;
  return !common.empty() && device.address == common;
}

/// The remedy if two devices seem to have the same address.
inline std::string CheckAddress(const config::Device& device) {
  return HasCommonAddress(device)
             ? "give each device its own address, as every device answers to address " +
                   device.address
             : "check whether two devices have address " + device.address;
}

inline double Share(double part, double whole) { return whole > 0 ? part / whole : 0; }

inline double Seconds(Duration duration) { return std::chrono::duration<double>(duration).count(); }

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

/// Cuts a reason at its first semicolon; a long reason also at a colon or comma, or in a long
/// quotation.
std::string Shortened(const std::string& reason);
/// Returns the shortened cause of the finding, without its remedy.
std::string Brief(const Finding& finding);
/// Returns the remedy of the finding; if it has none, a general remedy.
std::string RemedyOf(const Finding& finding);
/// "cause. Remedy", or the cause alone.
std::string WithRemedy(const Finding& finding);
/// Begins a second sentence: ". Check its power" for "check its power".
std::string NextSentence(std::string text);
/// True if the remedy is to compare the profile with the device.
bool DoubtsProfile(const std::string& remedy);

}  // namespace baudgate::diagnosis
