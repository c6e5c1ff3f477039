// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/meter/settings.h"

#include <algorithm>

#include "gateway/base/text.h"
#include "protocols/common/settings.h"
#include "protocols/set4tm/meter/identification.h"

namespace baudgate::protocols::set4tm {
namespace {

constexpr double kLongNumber = 4294967295.0;

Result<std::vector<std::uint8_t>> ParseTypes(const std::vector<std::string>& words) {
  std::vector<std::uint8_t> types;
  for (const std::string& word : words) {
    const auto type = ParseType(word);
    if (!type) return Error{"types: \"" + word + "\" is no type code; give 0 to F"};
    types.push_back(*type);
  }
  return types;
}

Result<std::vector<unsigned>> ParseLoads(const std::vector<std::string>& words) {
  std::vector<unsigned> profiles;
  for (const std::string& word : words) {
    const auto profile = ParseInteger<unsigned>(word);
    if (!profile || *profile < 1 || *profile > 3) {
      return Error{"load_profile: \"" + word + "\" is no load profile; give 1, 2 or 3"};
    }
    if (std::ranges::count(profiles, *profile) > 0) {
      return Error{"load_profile: " + word + " stands twice"};
    }
    profiles.push_back(*profile);
  }
  return profiles;
}

Result<std::vector<BillingPeriod>> ParseBilling(const std::vector<std::string>& words) {
  std::vector<BillingPeriod> periods;
  for (const std::string& word : words) {
    if (word != "day" && word != "month") {
      return Error{"billing: \"" + word + "\" is no period of readings; give day, month or both"};
    }
    periods.push_back(word == "day" ? BillingPeriod::day : BillingPeriod::month);
    if (std::ranges::count(periods, periods.back()) > 1) {
      return Error{"billing: " + word + " stands twice"};
    }
  }
  return periods;
}

Result<std::optional<CivilZone>> ParseZone(const std::string& text) {
  if (text.empty()) return std::optional<CivilZone>();
  const auto zone = CivilZone::Parse(text);
  if (!zone) return Error{"time_zone: " + zone.error()};
  return std::optional(*zone);
}

constexpr auto kTable = SettingsTable(
    Bind<&Settings::password, ParsePassword>(option::Secret(
        option::Text("password", "000000",
                     "Password of the channel: 6 ASCII characters, or hex:01 02 03 04 05 06."))),
    Bind<&Settings::checksum>(option::Choice(
        "checksum", "crc", "crc,ks",
        "What ends a frame: CRC-16, or the one byte KS of meters .01, and .02 with firmware below "
        "23.")),
    Bind<&Settings::serial_number>(option::Integer(
        "serial_number", "0", 0, kLongNumber,
        "The meter that must answer: checked after every reconnect, and accepted as "
        "extended address of replies; 0: not checked.")),
    Bind<&Settings::meter_constant>(option::Integer(
        "meter_constant", "0", 0, 1'000'000, "Impulses per kWh (A) for energy; 0: ask the meter.")),
    Bind<&Settings::voltage_ratio>(option::Real(
        "voltage_ratio", "0", 0, 100'000,
        "Voltage transformer ratio (Kn) in place of the meter's, for voltages, powers and "
        "energy; 0: ask the meter.")),
    Bind<&Settings::current_ratio>(option::Real(
        "current_ratio", "0", 0, 100'000,
        "Current transformer ratio (Kt) in place of the meter's, for currents, powers and "
        "energy; 0: ask the meter.")),
    Bind<&Settings::floats>(option::Choice("floats", "primary", "primary,secondary",
                                           "Whether the meter's floats are already multiplied by "
                                           "its ratios, as its description says.")),
    Bind<&Settings::power_coefficient>(
        option::Real("power_coefficient", "0", 0, 1000,
                     "Coefficient Kc of integer powers; 0: by the meter's build variant.")),
    Bind<&Settings::current_coefficient>(
        option::Real("current_coefficient", "0", 0, 1000,
                     "Coefficient Ci of integer currents; 0: by the meter's build variant.")),
    Bind<&Settings::snapshot>(option::Choice(
        "snapshot", "auto", "auto,true,false",
        "Read float values together by mask (08 23). auto: tried once, 08 1B where the meter "
        "refuses or is silent.")),
    Bind<&Settings::time_zone, ParseZone>(option::Text(
        "time_zone", "",
        "Of the meter's clock: +03:00, or \"+01:00 eu\" if it follows summer time. For the times "
        "of events; without it they have none of the meter's.")),
    Bind<&Settings::correct_clock>(
        option::Time(kCorrectClock, "0s",
                     "The drift from which the gateway corrects the meter's clock by itself, once "
                     "a day; 0s: never. Needs time_zone and the points clock_drift and "
                     "clock_correction.")),
    Bind<&Settings::correct_clock_most>(
        option::Time(kCorrectClockMost, "60s",
                     "A larger drift is only reported; at most 120s, the meter's own limit.")),
    Bind<&Settings::latch>(option::Time(
        "latch", "0s",
        "How often the broadcast FE 03 08 tells all meters of the line to keep the values of that "
        "moment (1min to 24h, at whole multiples of it); kept values are served only of meters "
        "that have heard it. 0s: never.")),
    Bind<&Settings::journal_records>(option::Integer(
        "journal_records", "10", 1, 20, "Records that the meter keeps in each journal.")),
    Bind<&Settings::load_profiles, ParseLoads>(
        option::Texts("load_profile", "",
                      "Load profiles (1 to 3) whose records are kept, for 'baudgate history'; "
                      "needs time_zone and "
                      "events.")),
    Bind<&Settings::billing, ParseBilling>(option::Texts(
        "billing", "",
        "Billing readings that are kept: energies at the begin of each day, month, or both; needs "
        "time_zone and events.")),
    Bind<&Settings::billing_tariffs>(option::Integer(
        "billing_tariffs", "4", 0, 8, "Tariffs of billing readings, beside the sum of all.")),
    Bind<&Settings::load_records>(
        option::Integer("load_records", "8192", 64, 8192,
                        "Records of 8 bytes in the memory of each load profile.")),
    Bind<&Settings::types, ParseTypes>(option::Texts(
        "types", "",
        "Type codes (08 12, 0 to B) that the meter may have; of another one no value is good.")));

}  // namespace

Scale Settings::scale() const {
  Scale scale = {meter_constant, power_coefficient, current_coefficient, voltage_ratio,
                 current_ratio};
  const bool secondary = floats == Floats::secondary;
  scale.zone = time_zone;
  scale.convert_voltage = secondary || voltage_ratio;
  scale.convert_current = secondary || current_ratio;
  if (secondary) scale.voltage_in_floats = scale.current_in_floats = 1;
  return scale;
}

std::span<const OptionSpec> OptionTable() { return kTable.specs(); }

Settings ReadSettings(const config::Options& options) { return kTable.Read(options); }

Status CheckSettings(const config::Options& options) { return kTable.Check(options); }

}  // namespace baudgate::protocols::set4tm
