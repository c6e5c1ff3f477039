// What is wrong between the points of a device and its telegrams. WrongUnit compares units, and
// DoubtsOf finds what hardly anybody means.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
#include <vector>

#include "config/model/device.h"
#include "protocols/protocol.h"
#include "protocols/telegram/description.h"

namespace baudgate::protocols::telegram {

// Units that come with a number: "S S     100.00 g". The codes of a unit's field say which texts
// are good, and a point that reads the number has to name the same unit.

/// True if a field of this name is a unit: "unit", "weight_unit", "unit_1".
bool IsUnit(std::string_view name);

/// True if a point with this unit may show a number that comes with `text`. Blanks and letter case
/// do not matter ("KG", "kg"), except for milli and mega ("mPa" is not "MPa"). "C" and "F" are
/// degrees ("°C", "degC"); the letters of NMEA 0183 are "kn", "km/h", "m/s" and "mph".
bool IsSameUnit(std::string_view text, std::string_view unit);

// What hardly anybody means: values that would be wrong or bad without a word.

std::vector<ConfigRemark> DoubtsOf(const config::Device& device);

/// What numbers the field of the point can say.
config::RawNumbers NumbersOf(const config::Device& device, const config::Point& point);

/// What can be seen of the whole device only: telegrams that are not described, fields that no
/// answer has, parameters that nobody gives.
std::vector<ConfigRemark> FaultsOf(const config::Device& device);

}  // namespace baudgate::protocols::telegram
