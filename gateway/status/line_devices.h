// What the devices of one line are like together, so that none is blamed for another. Pure; for
// gateway/status/diagnose.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

#include "gateway/store/point_store.h"

namespace baudgate::control {

/// Rarer trouble of a device that answers is not worth a sentence.
inline constexpr double kNotableShare = 0.01;
/// From here on a device that fails is what the line's time goes to.
inline constexpr double kBigPart = 0.25;

struct LineDevices {
  std::size_t in_use = 0;
  std::size_t absent = 0;  ///< of those in use: asked and without an answer, or offline
  bool misses = false;     ///< one that answers misses poll periods
  /// The one that wastes most: it fails often at present, or, where none does, is absent and takes
  /// a notable part of the time. Null: none does.
  const DeviceRecord* wasteful = nullptr;
  double waste = 0;  ///< its failures' part of the line's busy time since the start
};

/// `devices`: all of one line; they outlive the answer. `started`: when the gateway began to poll.
LineDevices LookAt(std::span<const DeviceRecord> devices, Now now, Instant started);

/// Asked, and not there.
bool IsAbsent(const DeviceStatus& status);

/// Of the latest exchanges, those without an answer that could be read.
std::size_t RecentFailures(const DeviceStatus& status);

/// The part of its poll periods that it has missed since `started`.
double MissedShare(const DeviceRecord& device, Now now, Instant started);

}  // namespace baudgate::control
