// The values of a point's keys that have a form of their own: type, sentinels, on_fault, simulate.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "config/model/point.h"
#include "config/yaml/yaml_reader.h"
#include "gateway/base/result.h"

namespace baudgate::config {

struct TypeText {
  Type type = Type::float32;
  std::size_t text_length = 0;  ///< of string(n)
  TimeType time_type = TimeType::none;
};

/// "float32", "string(16)"; or as IEC 61131-3 says it, in capitals: "REAL", "STRING[16]".
Result<TypeText> ParseType(std::string_view text);

/// "ms" of a time, "s" of a date; else nothing.
std::string_view UnitOf(TimeType type);

/// { 999: sensor_failure, 0x8000: out_of_service }: a quality by its name without "bad" or
/// "uncertain", or its code in hex. What they stand for in this device: ResolveSentinels.
std::vector<Sentinel> ReadSentinels(const YamlNode& node, Problems& problems);

/// nan, hold or a number.
std::optional<OnFault> ReadOnFault(const YamlNode& node, Problems& problems);

/// [low, high], or one value that stays; of a string point the text.
std::optional<Simulate> ReadSimulate(const YamlNode& node, Type type, Problems& problems);

/// off, jump or always, of gateway, line, profile, device or point.
std::optional<Recheck> ReadRecheck(MapReader& map);

}  // namespace baudgate::config
