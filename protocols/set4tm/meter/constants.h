// The constants that convert a SET-4TM's counts to physical values: build variant (08 12) and
// transformer ratios (08 02). The decoders of points.h use the factors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "gateway/base/bytes.h"
#include "protocols/common/clock.h"

namespace baudgate::protocols::set4tm {

/// All constants that an integer value may need. Empty: unknown.
struct Scale {
  std::optional<double> meter_constant;       ///< A, impulses per kWh or kvarh
  std::optional<double> power_coefficient;    ///< Kc
  std::optional<double> current_coefficient;  ///< Ci
  std::optional<double> voltage_ratio;        ///< Kn
  std::optional<double> current_ratio;        ///< Kt

  // Floats are primary values by the ratios in the meter (reference, 9.7). To apply other ratios,
  // they are divided by `…_in_floats` and multiplied by the ratios above.
  bool convert_voltage = false;
  bool convert_current = false;
  std::optional<double> voltage_in_floats{};  ///< ratios already applied by the meter
  std::optional<double> current_in_floats{};

  std::optional<CivilZone> zone{};  ///< zone of the meter's clock
};

/// Returns the constants of `first`; those that are empty are taken from `second`.
Scale Merge(const Scale& first, const Scale& second);

/// Parses the data of 08 12 (reference, 9.3 and 9.6). Undefined constants stay empty.
Scale ParseVariant(View data);
/// Parses the ten data bytes of 08 02. A ratio of 0 stays empty.
Scale ParseRatios(View data);

/// value = count * multiply / divide; two numbers, so that 10001 / 10000 is exactly 1.0001.
struct Factor {
  double multiply = 1;
  double divide = 1;
};

/// The kind of quantity, which decides the constants that its conversion needs.
enum class Measure {
  plain,
  energy,
  voltage,
  current,
  power,
  hundredths,
  float_voltage,
  float_current,
  float_power
};

std::optional<Factor> FactorOf(Measure measure, const Scale& scale);
/// True if `measure` needs a constant of 08 12 that `scale` does not contain.
bool LacksVariant(Measure measure, const Scale& scale);
/// True if `measure` needs a ratio of 08 02 that `scale` does not contain.
bool LacksRatios(Measure measure, const Scale& scale);

}  // namespace baudgate::protocols::set4tm
