// Reads the section `lines`: lines, their devices, and their profiles. ReadName and ReadSerial read
// single keys.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "config/catalog/catalog.h"
#include "config/checks/uniques.h"
#include "config/model/line.h"
#include "config/model/serial.h"
#include "config/model/timing.h"
#include "config/profile.h"
#include "config/yaml/yaml_reader.h"
#include "gateway/base/result.h"

namespace baudgate::config {

/// Reads and checks the mandatory key `name` of a line or device. From then on, messages of `map`
/// contain the name.
std::optional<std::string> ReadName(MapReader& map, std::string_view example);

/// Parses "9600 7E1". Settings that the text does not contain are those of `base`.
Result<SerialSettings> ParseSerial(std::string_view text, SerialSettings base);

/// Reads `serial:`, a text or a map { baud, data, parity, stop, … }. Settings that are absent are
/// those of `base`.
SerialSettings ReadSerial(const YamlNode& node, const SerialSettings& base, Problems& problems);

/// Reads the keys of a line beside `serial:`: `parity: software`, `rs485: {…}`.
void ReadSerialExtras(MapReader& line, SerialSettings& serial);

/// Reads `timing`, `retries`, `poll`, `slow`, `daily` and `recheck`, which are allowed in gateway,
/// line, profile and device. `level` says which of these four contains the map.
Pace ReadPace(MapReader& map, Level level);

/// The readers of one configuration share this state.
struct LoadContext {
  LoadContext(const Catalog& catalog, std::filesystem::path base, Problems& problems)
      : catalog(catalog), base(std::move(base)), problems(problems), uniques(problems) {}

  const Catalog& catalog;
  std::filesystem::path base;  ///< the base of relative profile paths
  Problems& problems;
  Uniques uniques;
  Pace pace;            ///< the gateway's settings for all lines
  AlarmSetting alarms;  ///< the gateway's settings for all lines
  bool events = false;  ///< the gateway has the key `events:`
  std::map<std::pair<std::string, std::string>, RawProfile> profiles;  ///< key: protocol and path
  /// Key: protocol. Value: names of device types, each with the profile that lists it.
  std::map<std::string, std::map<std::string, std::string>> listed_names;
  /// Profile files whose errors have already been reported at a device that uses them.
  std::set<std::string> bad_profiles;
  /// Number of points of all devices so far. It is limited, because YAML aliases can make a small
  /// file huge.
  std::size_t points = 0;
};

std::vector<Line> ReadLines(const YamlNode& list, LoadContext& context);

}  // namespace baudgate::config
