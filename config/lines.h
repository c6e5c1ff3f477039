// The section lines: lines, their devices, and what profiles add to them.
// YAML nodes come from config/loader; structs go to config::Config. ReadName and ReadSerial read
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

// The key `name` of lines and devices.

/// The `name` that a line or device must have, checked; messages call it so from now on.
std::optional<std::string> ReadName(MapReader& map, std::string_view example);

// Serial settings, named times and periods, wherever they stand: gateway, line, profile, device.
// YAML nodes come from the readers of those; structs go back to them.

/// "9600 7E1" put over `base`; what the text does not say stays.
Result<SerialSettings> ParseSerial(std::string_view text, SerialSettings base);

/// `serial:` as text or as a map { baud, data, parity, stop, … }, put over `base`.
SerialSettings ReadSerial(const YamlNode& node, const SerialSettings& base, Problems& problems);

/// Reads the keys beside `serial:` of a line: `parity: software`, `rs485: {…}`.
void ReadSerialExtras(MapReader& line, SerialSettings& serial);

/// `timing`, `retries`, `poll`, `slow`, `daily` and `recheck`, which may stand in every one of
/// these maps. `level`: whose map it is.
Pace ReadPace(MapReader& map, Level level);

/// What the readers of one file share.
struct LoadContext {
  LoadContext(const Catalog& catalog, std::filesystem::path base, Problems& problems)
      : catalog(catalog), base(std::move(base)), problems(problems), uniques(problems) {}

  const Catalog& catalog;
  std::filesystem::path base;  ///< what relative profile paths are relative to
  Problems& problems;
  Uniques uniques;
  Pace pace;            ///< what the gateway says for all lines
  AlarmSetting alarms;  ///< the same
  bool events = false;  ///< it has the key events:
  std::map<std::pair<std::string, std::string>, RawProfile> profiles;  ///< by protocol and path
  /// By protocol: names of devices, and the profile that lists them.
  std::map<std::string, std::map<std::string, std::string>> listed_names;
  std::set<std::string> bad_profiles;  ///< files whose first user has been told
  std::size_t points = 0;              ///< of all devices so far; bounds what aliases can multiply
};

std::vector<Line> ReadLines(const YamlNode& list, LoadContext& context);

}  // namespace baudgate::config
