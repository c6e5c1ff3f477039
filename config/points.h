// Reads points of profiles and of a device's `points:`. ParseType parses the key `type`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/model/device.h"
#include "config/model/point.h"
#include "config/yaml/yaml_reader.h"
#include "gateway/base/result.h"
#include "protocols/protocol.h"

namespace baudgate::config {

struct TypeText {
  Type type = Type::float32;
  std::size_t text_length = 0;  ///< for string(n): length in bytes
  TimeType time_type = TimeType::none;
};

/// Parses "float32" or "string(16)", or an IEC 61131-3 type in capitals: "REAL", "STRING[16]".
Result<TypeText> ParseType(std::string_view text);

/// Returns "ms" for TIME and TOD, "s" for DATE and DT; else an empty text.
std::string_view UnitOf(TimeType type);

/// A point whose values have not been parsed. So the keys of a device can override the keys of its
/// profile one by one, and every value has the position where it was written.
struct RawPoint {
  std::string name;
  Mark mark;
  std::vector<Entry> keys;
};

inline constexpr std::size_t kMostPoints = 20'000;

/// Reads a list of points. Reports entries that are not points, invalid names, and names that occur
/// twice (compared without case).
std::vector<RawPoint> ReadRawPoints(const YamlNode& list, Problems& problems);

/// Returns `base` with the keys of `over` in place of the keys of points with the same name; new
/// points are appended. Reports changes to points that `base` does not contain.
std::vector<RawPoint> MergePoints(std::vector<RawPoint> base, const std::vector<RawPoint>& over,
                                  Problems& problems);

/// Parses `raw` into points. Reports the problems of all points, not only the first one. If
/// `protocol` is null, the protocol's own checks are left out. `recheck` is the default for points
/// without that key.
std::vector<Point> BuildPoints(const std::vector<RawPoint>& raw,
                               const protocols::Protocol* protocol, Problems& problems,
                               Recheck recheck = Recheck::off);

/// Sets `group` of each point that has its own `poll`, and collects the different periods in
/// `device.intervals`.
void AssignIntervals(Device& device, Problems& problems);

}  // namespace baudgate::config
