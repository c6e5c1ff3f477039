// What `decode` has to know of a line to say what its bytes mean: comments on top of a trace and of
// a recording. Written by the gateway, read back by gateway/tools/cli/offline.
//
//   # line bay-1, port /dev/ttyUSB0 9600 7E1, protocol spabus
//   # device feeder-1, protocol spabus, profile spaj140c, set checksum=off
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/model/line.h"

namespace baudgate {

/// What `decode` is told of one device.
struct TracedDevice {
  std::string name{};
  std::string protocol{};
  std::string profile{};           ///< empty: none
  std::vector<std::string> set{};  ///< options that were given, "key=value"; never a secret
  bool operator==(const TracedDevice&) const = default;
};

std::vector<std::string> TraceHead(const config::Line& line);
/// Nothing where the line is no such comment.
std::optional<TracedDevice> ReadTracedDevice(std::string_view line);

}  // namespace baudgate
