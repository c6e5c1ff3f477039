// The constants that convert the counts of a SET-4TM to physical values. They come from its build
// variant (08 12) and its transformer ratios (08 02). DecodeField (protocols/set4tm/meter/values.h)
// uses the factors.
#pragma once

#include <optional>

#include "gateway/base/bytes.h"
#include "protocols/common/clock.h"

namespace baudgate::protocols::set4tm {

/// All constants that the conversion of a value can need. An empty member is unknown.
struct Scale {
  std::optional<double> meter_constant;       ///< A: impulses per kWh or kvarh
  std::optional<double> power_coefficient;    ///< Kc: coefficient of powers
  std::optional<double> current_coefficient;  ///< Ci: coefficient of currents
  std::optional<double> voltage_ratio;        ///< Kn: ratio of the voltage transformers
  std::optional<double> current_ratio;        ///< Kt: ratio of the current transformers

  // Floats are mostly primary values: the meter has applied its own ratios (reference, 9.7). To
  // apply the ratios above instead, floats are divided by `…_in_floats` and multiplied by these
  // ratios.
  bool convert_voltage = false;
  bool convert_current = false;
  /// Ratios that the meter has already applied; 1 if its floats are secondary values.
  std::optional<double> voltage_in_floats{};
  std::optional<double> current_in_floats{};

  std::optional<CivilZone> zone{};  ///< time zone of the meter's clock
};

/// Returns the constants of `first`; a constant that is empty there is taken from `second`.
Scale Merge(const Scale& first, const Scale& second);

/// Parses the build variant, the data of 08 12 (reference, 9.3 and 9.6). Undefined constants stay
/// empty.
Scale ParseVariant(View data);
/// Parses the ratios, the ten data bytes of 08 02. A ratio of 0 stays empty.
Scale ParseRatios(View data);

/// A conversion: value = count * multiply / divide. It has two numbers so that the result is exact:
/// 10001 / 10000 gives 1.0001.
struct Factor {
  double multiply = 1;
  double divide = 1;
};

/// The kind of a quantity; it decides which constants the conversion needs.
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
