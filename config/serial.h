// Serial settings and named times, wherever they stand: line, device, profile.
// YAML nodes come from config/lines and config/profile.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/config.h"
#include "config/yaml_reader.h"
#include "gateway/base/result.h"

namespace baudgate::config {

/// "9600 7E1" put over `base`; what the text does not say stays.
Result<SerialSettings> ParseSerial(std::string_view text, SerialSettings base);

/// `serial:` as text or as a map { baud, data, parity, stop, … }, put over `base`.
SerialSettings ReadSerial(const YamlNode& node, const SerialSettings& base, Problems& problems);

/// What may stand beside `serial:` on a line: `parity: software`, `rs485: {…}`.
void ReadSerialExtras(MapReader& line, SerialSettings& serial);

Timing ReadTiming(const YamlNode& node, Problems& problems);

}  // namespace baudgate::config
