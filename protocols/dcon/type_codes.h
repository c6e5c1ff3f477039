// Input ranges of analog modules by their type code, the first byte of what `$AA2` answers.
// Source: tables of ICP DAS I-7011/18 and I-7012/17 and Advantech ADAM-4000. The codes 30 to 35
// mean something else on output modules, 40 and above are no analog inputs.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace baudgate::protocols::dcon {

/// What numbers in engineering format count: "V", "mV", "mA", "degC"; empty: not known.
std::string_view UnitOfType(std::uint8_t type);

/// The unit in the spelling of UnitOfType, or "Hz". Letter case and blanks do not matter, so "volt"
/// is "V", "MV" is "mV" and "°C" is "degC". A unit of another kind ("bar", "uV") is returned as it
/// is written.
std::string_view PlainUnit(std::string_view unit);

/// What a number of a module of this type is multiplied with to be one in `unit`: 0.001 for mV
/// where V is wanted. Empty: such a module cannot measure that. A unit that no type has ("bar")
/// is the user's own, and takes the number as it is.
std::optional<double> FactorOfType(std::uint8_t type, std::string_view unit);

/// Whether it is the type of an analog output. 30, 31 and 33 are thermistors of ADAM-4015, which
/// takes no samples.
bool IsAnalogOutput(std::uint8_t type);

/// Whether some type measures in it, so that others contradict it: "V", "°C", not "bar".
bool IsUnitOfTypes(std::string_view unit);

}  // namespace baudgate::protocols::dcon
