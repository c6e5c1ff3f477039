// Checks the points of a device against its telegrams: FaultsOf finds errors, DoubtsOf finds
// settings that are hardly intended, and WrongUnit compares units.
#pragma once

#include <string_view>
#include <vector>

#include "config/model/device.h"
#include "protocols/protocol.h"
#include "protocols/telegram/description.h"

namespace baudgate::protocols::telegram {

// Some numbers come with a unit: "S S     100.00 g". The codes of the unit field list its good
// texts, and a point that reads the number must have the same unit.

/// True if a field with this name contains a unit: "unit", "weight_unit", "unit_1".
bool IsUnit(std::string_view name);

/// True if `text`, the unit that comes with a number, is the unit of a point. Blanks and letter
/// case do not matter ("KG", "kg"), except for milli and mega ("mPa" is not "MPa"). "C" and "F" are
/// degrees ("°C", "degC"); the letters N, K, M and S of NMEA 0183 are "kn", "km/h", "m/s" and
/// "mph".
bool IsSameUnit(std::string_view text, std::string_view unit);

// Returns warnings for settings that are probably mistakes: values would be wrong or bad, and
// nothing else would tell the reason.

std::vector<ConfigRemark> DoubtsOf(const config::Device& device);

config::RawNumbers NumbersOf(const config::Device& device, const config::Point& point);

/// Returns errors that only show when the whole device is known: telegrams that are not described,
/// fields that no answer has, parameters without a value.
std::vector<ConfigRemark> FaultsOf(const config::Device& device);

}  // namespace baudgate::protocols::telegram
