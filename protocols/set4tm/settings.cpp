// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/settings.h"

#include "protocols/common/settings.h"
#include "protocols/set4tm/codec.h"

namespace baudgate::protocols::set4tm {
namespace {

constexpr double kLongNumber = 4294967295.0;

constexpr auto kTable = SettingsTable(
    Bind<&Settings::password, ParsePassword>(option::Secret(
        option::Text("password", "000000",
                     "Password of the channel: 6 ASCII characters, or hex:01 02 03 04 05 06."))),
    Bind<&Settings::serial_number>(option::Integer(
        "serial_number", "0", 0, kLongNumber,
        "The meter that must answer: checked after every reconnect, and accepted as "
        "extended address of replies; 0: not checked.")),
    Bind<&Settings::meter_constant>(option::Integer(
        "meter_constant", "0", 0, 1'000'000, "Impulses per kWh (A) for energy; 0: ask the meter.")),
    Bind<&Settings::voltage_ratio>(option::Real(
        "voltage_ratio", "0", 0, 100'000,
        "Voltage transformer ratio (Kn) in place of the meter's, for energy and integer "
        "values; 0: ask the meter.")),
    Bind<&Settings::current_ratio>(option::Real(
        "current_ratio", "0", 0, 100'000,
        "Current transformer ratio (Kt) in place of the meter's, for energy and integer "
        "values; 0: ask the meter.")),
    Bind<&Settings::power_coefficient>(
        option::Real("power_coefficient", "0", 0, 1000,
                     "Coefficient Kc of integer powers; 0: by the meter's build variant.")),
    Bind<&Settings::current_coefficient>(
        option::Real("current_coefficient", "0", 0, 1000,
                     "Coefficient Ci of integer currents; 0: by the meter's build variant.")),
    Bind<&Settings::snapshot>(option::Flag(
        "snapshot", "false",
        "Read float values together by mask (08 23); falls back to 08 1B on status 01.")));

}  // namespace

Scale Settings::scale() const {
  return {meter_constant, power_coefficient, current_coefficient, voltage_ratio, current_ratio};
}

std::span<const OptionSpec> OptionTable() { return kTable.specs(); }

Settings ReadSettings(const config::Options& options) { return kTable.Read(options); }

Status CheckSettings(const config::Options& options) { return kTable.Check(options); }

}  // namespace baudgate::protocols::set4tm
