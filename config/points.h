// Points as they stand in profiles and under a device's `points:`. YAML nodes come from
// config/profile and config/lines; finished points go to config::Device. ParseType reads the key
// `type`.
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

// The key `type` of a point.
struct TypeText {
  Type type = Type::float32;
  std::size_t text_length = 0;  ///< of string(n)
  TimeType time_type = TimeType::none;
};

/// "float32", "string(16)"; or as IEC 61131-3 says it, in capitals: "REAL", "STRING[16]".
Result<TypeText> ParseType(std::string_view text);

/// "ms" of a time, "s" of a date; else nothing.
std::string_view UnitOf(TimeType type);

/// A point before its values are read: merging a device's own keys over those of its profile is
/// then a matter of keys, and every value keeps the place where it was written.
struct RawPoint {
  std::string name;
  Mark mark;
  std::vector<Entry> keys;
};

inline constexpr std::size_t kMostPoints = 20'000;

/// A list of points. Reports what is no point, has no usable name, or has a name twice (case does
/// not tell names apart).
std::vector<RawPoint> ReadRawPoints(const YamlNode& list, Problems& problems);

/// `base` with the keys of `over` put over points of the same name, and its new points at the end.
std::vector<RawPoint> MergePoints(std::vector<RawPoint> base, const std::vector<RawPoint>& over,
                                  Problems& problems);

/// The values of `raw`, one point each, with every problem that a point can have by itself or with
/// the others of its device. Without a protocol its own checks are left out. `recheck`: of points
/// that do not say it themselves.
std::vector<Point> BuildPoints(const std::vector<RawPoint>& raw,
                               const protocols::Protocol* protocol, Problems& problems,
                               Recheck recheck = Recheck::off);

/// Gives each point with a `poll` of its own its place among the device's intervals.
void AssignIntervals(Device& device, Problems& problems);

}  // namespace baudgate::config
