// Serial settings, named times and periods, wherever they stand: gateway, line, profile, device.
// YAML nodes come from the readers of those; structs go back to them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/model/serial.h"
#include "config/model/timing.h"
#include "config/yaml/yaml_reader.h"
#include "gateway/base/result.h"

namespace baudgate::config {

/// "9600 7E1" put over `base`; what the text does not say stays.
Result<SerialSettings> ParseSerial(std::string_view text, SerialSettings base);

/// `serial:` as text or as a map { baud, data, parity, stop, … }, put over `base`.
SerialSettings ReadSerial(const YamlNode& node, const SerialSettings& base, Problems& problems);

/// What may stand beside `serial:` on a line: `parity: software`, `rs485: {…}`.
void ReadSerialExtras(MapReader& line, SerialSettings& serial);

/// `timing`, `retries`, `poll`, `slow`, `daily` and `recheck`, which may stand in every one of
/// these maps. `level`: whose map it is.
Pace ReadPace(MapReader& map, Level level);

}  // namespace baudgate::config
