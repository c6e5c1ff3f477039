// Members of a request, and how one is refused.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

#include "gateway/base/time.h"
#include "gateway/outputs/status/status_json.h"

namespace baudgate::control {

// Why a request is refused.
inline constexpr std::string_view kUsage = "usage";
inline constexpr std::string_view kUnknown = "unknown";
inline constexpr std::string_view kUnavailable = "unavailable";
inline constexpr std::string_view kNoEvents =
    "no device of this gateway is asked for events: write 'events: {}' into its configuration, for "
    "all whose profiles say what their events mean, or 'events: on' at one device";

inline Json ErrorJson(std::string_view kind, std::string_view message) {
  return {{"error", kind}, {"message", message}};
}

/// What is no text, or not there, is empty.
inline std::string TextOf(const Json& request, const char* key) {
  const auto found = request.find(key);
  return found != request.end() && found->is_string() ? found->get<std::string>() : std::string();
}

/// Nothing where it is absent, or no whole number.
inline std::optional<std::int64_t> NumberOf(const Json& request, const char* key) {
  const auto found = request.find(key);
  if (found == request.end() || !found->is_number_integer()) return std::nullopt;
  return found->get<std::int64_t>();
}

inline std::optional<WallTime> TimeOf(const Json& request, const char* key) {
  const auto time = NumberOf(request, key);
  if (!time) return std::nullopt;
  constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max() / 1'000'000;
  return WallTime(std::chrono::milliseconds(std::clamp(*time, -kMost, kMost)));
}

}  // namespace baudgate::control
