// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/meter/constants.h"

#include <array>

namespace baudgate::protocols::set4tm {
namespace {

template <typename T>
std::optional<T> Either(const std::optional<T>& first, const std::optional<T>& second) {
  return first ? first : second;
}

/// Sets the coefficients Kc and Ci by type, nominal voltage and current (reference, 9.6). They stay
/// empty for types without documented coefficients, and for types whose code different meters
/// share.
void SetCoefficients(unsigned type, bool mains_voltage, unsigned current_code, bool one_phase,
                     Scale& scale) {
  switch (type) {
    case 0x0:    // SET-4TM.02; with one phase SET-1M.01
    case 0x1:    // SET-4TM.03
    case 0x3:    // PSCH-4TM.05
    case 0x6:    // PSCH-4TM.05M
    case 0x8: {  // SET-4TM.02M, .03M
      scale.current_coefficient = 1;
      const bool set1m = type == 0 && one_phase;
      const bool doubled = mains_voltage && current_code == 0 && !set1m;
      // For .03 meters of 120-230 V and 1(10) A the code of the nominal current is uncertain, so no
      // power coefficient is set.
      if (type == 1 && mains_voltage && current_code != 0) return;
      scale.power_coefficient = doubled ? 2 : 1;
      return;
    }
    case 0x5:  // PSCH-3TM.05
    case 0x7:  // PSCH-3TM.05M
      scale.power_coefficient = 20;
      scale.current_coefficient = 1;
      return;
    case 0x2:  // SEB-1TM.01, .02
    case 0x9:  // SEB-1TM.02D
      scale.power_coefficient = 10;
      scale.current_coefficient = 10;
      return;
    default:
      return;
  }
}

}  // namespace

Scale Merge(const Scale& first, const Scale& second) {
  return {Either(first.meter_constant, second.meter_constant),
          Either(first.power_coefficient, second.power_coefficient),
          Either(first.current_coefficient, second.current_coefficient),
          Either(first.voltage_ratio, second.voltage_ratio),
          Either(first.current_ratio, second.current_ratio),
          first.convert_voltage || second.convert_voltage,
          first.convert_current || second.convert_current,
          Either(first.voltage_in_floats, second.voltage_in_floats),
          Either(first.current_in_floats, second.current_in_floats),
          Either(first.zone, second.zone)};
}

Scale ParseVariant(View data) {
  constexpr std::array<double, 7> kConstants = {5000, 25000, 1250, 6250, 500, 250, 6400};
  Scale scale;
  if (data.size() < 3) return scale;
  const unsigned constant = data[1] & 0x0FU;
  if (constant < kConstants.size()) scale.meter_constant = kConstants[constant];
  const bool mains_voltage = ((data[0] >> 2U) & 3U) == 1;
  const bool one_phase = ((data[1] >> 4U) & 3U) == 1;
  SetCoefficients(data[2] >> 4U, mains_voltage, data[0] & 3U, one_phase, scale);
  return scale;
}

Scale ParseRatios(View data) {
  const ByteReader reader(data);
  Scale scale;
  if (const auto kn = reader.U16Be(0); kn && *kn > 0) scale.voltage_ratio = *kn;
  if (const auto kt = reader.U16Be(2); kt && *kt > 0) scale.current_ratio = *kt;
  scale.voltage_in_floats = scale.voltage_ratio;
  scale.current_in_floats = scale.current_ratio;
  return scale;
}

namespace {

/// Returns the factor that converts a float from the ratios that the meter has applied to the
/// ratios of `scale`; 1 if the ratios that the meter has applied are to be kept.
Factor FloatFactor(bool voltage, bool current, const Scale& scale) {
  Factor factor;
  if (voltage && scale.convert_voltage) {
    factor.multiply *= *scale.voltage_ratio;
    factor.divide *= *scale.voltage_in_floats;
  }
  if (current && scale.convert_current) {
    factor.multiply *= *scale.current_ratio;
    factor.divide *= *scale.current_in_floats;
  }
  return factor;
}

bool LacksFloatRatios(bool voltage, bool current, const Scale& scale) {
  return (voltage && scale.convert_voltage && (!scale.voltage_ratio || !scale.voltage_in_floats)) ||
         (current && scale.convert_current && (!scale.current_ratio || !scale.current_in_floats));
}

}  // namespace

std::optional<Factor> FactorOf(Measure measure, const Scale& scale) {
  if (LacksVariant(measure, scale) || LacksRatios(measure, scale)) return std::nullopt;
  switch (measure) {
    case Measure::plain:
      return Factor{};
    case Measure::hundredths:
      return Factor{1, 100};
    case Measure::energy:
      return Factor{*scale.voltage_ratio * *scale.current_ratio, 2 * *scale.meter_constant};
    case Measure::voltage:
      return Factor{*scale.voltage_ratio, 100};
    case Measure::current:
      return Factor{*scale.current_coefficient * *scale.current_ratio, 10'000};
    case Measure::power:
      return Factor{*scale.power_coefficient * *scale.voltage_ratio * *scale.current_ratio, 1000};
    case Measure::float_voltage:
      return FloatFactor(true, false, scale);
    case Measure::float_current:
      return FloatFactor(false, true, scale);
    case Measure::float_power:
      return FloatFactor(true, true, scale);
  }
  return std::nullopt;
}

bool LacksVariant(Measure measure, const Scale& scale) {
  switch (measure) {
    case Measure::energy:
      return !scale.meter_constant;
    case Measure::current:
      return !scale.current_coefficient;
    case Measure::power:
      return !scale.power_coefficient;
    default:
      return false;
  }
}

bool LacksRatios(Measure measure, const Scale& scale) {
  switch (measure) {
    case Measure::energy:
    case Measure::power:
      return !scale.voltage_ratio || !scale.current_ratio;
    case Measure::voltage:
      return !scale.voltage_ratio;
    case Measure::current:
      return !scale.current_ratio;
    case Measure::float_voltage:
      return LacksFloatRatios(true, false, scale);
    case Measure::float_current:
      return LacksFloatRatios(false, true, scale);
    case Measure::float_power:
      return LacksFloatRatios(true, true, scale);
    default:
      return false;
  }
}

}  // namespace baudgate::protocols::set4tm
