// What turns a SET-4TM's counts into physical values: its build variant and its transformer ratios.
// Bytes come from replies to 08 12 and 08 02; the factors go to the decoders of points.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "gateway/base/bytes.h"
#include "protocols/common/clock.h"

namespace baudgate::protocols::set4tm {

/// Everything that an integer value may need; what is missing is not known (yet).
struct Scale {
  std::optional<double> meter_constant;       ///< A, impulses per kWh or kvarh
  std::optional<double> power_coefficient;    ///< Kc
  std::optional<double> current_coefficient;  ///< Ci
  std::optional<double> voltage_ratio;        ///< Kn
  std::optional<double> current_ratio;        ///< Kt

  // Floats are primary values by the ratios in the meter (reference, 9.7). Where others count, they
  // are divided by those and multiplied by these.
  bool convert_voltage = false;
  bool convert_current = false;
  std::optional<double> voltage_in_floats{};  ///< what the meter has multiplied them with already
  std::optional<double> current_in_floats{};

  std::optional<CivilZone> zone{};  ///< of the meter's clock
};

/// `first` wins where it says something, else `second`.
Scale Merge(const Scale& first, const Scale& second);

/// From the three data bytes of 08 12 (reference, 9.3 and 9.6). What the reference does not say for
/// this build stays empty.
Scale ParseVariant(View data);
/// From the ten data bytes of 08 02. A ratio of 0 is no ratio.
Scale ParseRatios(View data);

/// value = count * multiply / divide; kept apart so that 10001 / 10000 is exactly 1.0001.
struct Factor {
  double multiply = 1;
  double divide = 1;
};

/// What a count of this kind measures; decides which constants it needs.
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
/// Whether `measure` needs what 08 12 tells, and `scale` has not got it.
bool LacksVariant(Measure measure, const Scale& scale);
/// The same of 08 02.
bool LacksRatios(Measure measure, const Scale& scale);

}  // namespace baudgate::protocols::set4tm
