// The named times of a line and of its devices (docs/timeouts.md), and who decides them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "gateway/base/time.h"

namespace baudgate::config {

/// The named times of a line (docs/timeouts.md). Nothing = decided one level up.
struct Timing {
  std::optional<Duration> quiet;    ///< silence before sending
  std::optional<Duration> reply;    ///< end of request to first byte of the reply
  std::optional<Duration> gap;      ///< longest silence inside a frame
  std::optional<Duration> ceiling;  ///< whole exchange, from the end of the request
  std::optional<Duration> drain;    ///< silence that ends a drain
};

/// `first` wins where it says something, else `second`.
Timing Merge(const Timing& first, const Timing& second);

/// What a device is really timed with: `given` over `fallback`, which has every field. Who allows
/// more time to begin a reply but does not say how long the whole exchange may take, lengthens that
/// alike; and it is never shorter than reply and gap.
Timing Resolve(const Timing& given, const Timing& fallback);

/// What gateway, line, profile and device may each say about times. Nothing = decided one level up.
struct Pace {
  Timing timing;
  std::optional<int> retries;
  std::optional<Duration> poll;
  std::optional<Duration> slow;
  std::optional<Duration> daily;
};

/// Key by key: `first` wins where it says something, else `second`.
Pace Merge(const Pace& first, const Pace& second);

}  // namespace baudgate::config
