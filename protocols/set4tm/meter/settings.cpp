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
    if (!type) return Error{"types: \"" + word + "\" is not a type code; write 0 to F"};
    types.push_back(*type);
  }
  return types;
}

Result<std::vector<unsigned>> ParseLoads(const std::vector<std::string>& words) {
  std::vector<unsigned> profiles;
  for (const std::string& word : words) {
    const auto profile = ParseInteger<unsigned>(word);
    if (!profile || *profile < 1 || *profile > 3) {
      return Error{"load_profile: \"" + word + "\" is not a load profile; write 1, 2 or 3"};
    }
    if (std::ranges::count(profiles, *profile) > 0) {
      return Error{"load_profile: " + word + " occurs twice; remove one of the two"};
    }
    profiles.push_back(*profile);
  }
  return profiles;
}

Result<std::vector<BillingPeriod>> ParseBilling(const std::vector<std::string>& words) {
  std::vector<BillingPeriod> periods;
  for (const std::string& word : words) {
    if (word != "day" && word != "month") {
      return Error{"billing: \"" + word +
                   "\" is not a period of readings; write day, month or both"};
    }
    periods.push_back(word == "day" ? BillingPeriod::day : BillingPeriod::month);
    if (std::ranges::count(periods, periods.back()) > 1) {
      return Error{"billing: " + word + " occurs twice; remove one of the two"};
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
    Bind<&Settings::checksum>(
        option::Choice("checksum", "crc", "crc,ks",
                       "Check value at the end of a frame: CRC-16, or the one byte KS of meters "
                       ".01, and of .02 with firmware below 23.")),
    Bind<&Settings::serial_number>(
        option::Integer("serial_number", "0", 0, kLongNumber,
                        "Serial number of the meter: checked after every reconnect, and accepted "
                        "as extended address of replies; 0: not checked.")),
    Bind<&Settings::meter_constant>(
        option::Integer("meter_constant", "0", 0, 1'000'000,
                        "Impulses per kWh (A) for energy; 0: read from the meter.")),
    Bind<&Settings::voltage_ratio>(
        option::Real("voltage_ratio", "0", 0, 100'000,
                     "Voltage transformer ratio (Kn) for voltages, powers and energy, instead of "
                     "the meter's; 0: read from the meter.")),
    Bind<&Settings::current_ratio>(
        option::Real("current_ratio", "0", 0, 100'000,
                     "Current transformer ratio (Kt) for currents, powers and energy, instead of "
                     "the meter's; 0: read from the meter.")),
    Bind<&Settings::floats>(
        option::Choice("floats", "primary", "primary,secondary",
                       "primary: the meter's floats are already multiplied by its ratios, as in "
                       "its description; secondary: they are not.")),
    Bind<&Settings::power_coefficient>(
        option::Real("power_coefficient", "0", 0, 1000,
                     "Coefficient Kc of integer powers; 0: by the meter's build variant.")),
    Bind<&Settings::current_coefficient>(
        option::Real("current_coefficient", "0", 0, 1000,
                     "Coefficient Ci of integer currents; 0: by the meter's build variant.")),
    Bind<&Settings::snapshot>(
        option::Choice("snapshot", "auto", "auto,true,false",
                       "Read float values together by mask (08 23). auto: tried once; if the meter "
                       "refuses or is silent, 08 1B is used.")),
    Bind<&Settings::time_zone, ParseZone>(
        option::Text("time_zone", "",
                     "Time zone of the meter's clock: +03:00, or \"+01:00 eu\" if it follows "
                     "summer time. Without it, events do not have the meter's time.")),
    Bind<&Settings::correct_clock>(option::Time(
        kCorrectClock, "0s",
        "Drift at which the gateway corrects the meter's clock by itself, once a day; 0s: never. "
        "Needs time_zone and the points clock_drift and clock_correction.")),
    Bind<&Settings::correct_clock_most>(
        option::Time(kCorrectClockMost, "60s",
                     "Largest drift that is corrected; a larger drift is only reported. At most "
                     "120s, the limit of the meter.")),
    Bind<&Settings::latch>(
        option::Time("latch", "0s",
                     "Interval of the broadcast FE 03 08, with which all meters of the line latch "
                     "their values (1min to 24h, at whole multiples); a meter that missed it has "
                     "no latched values. 0s: never.")),
    Bind<&Settings::journal_records>(option::Integer(
        "journal_records", "10", 1, 20, "Records that the meter stores in each journal.")),
    Bind<&Settings::load_profiles, ParseLoads>(
        option::Texts("load_profile", "",
                      "Load profiles (1 to 3) whose records are stored, for 'baudgate history'; "
                      "needs time_zone and events.")),
    Bind<&Settings::billing, ParseBilling>(
        option::Texts("billing", "",
                      "Billing readings that are stored: energies at the begin of each day, month, "
                      "or both; needs time_zone and events.")),
    Bind<&Settings::billing_tariffs>(option::Integer(
        "billing_tariffs", "4", 0, 8, "Number of tariffs of billing readings, besides their sum.")),
    Bind<&Settings::load_records>(
        option::Integer("load_records", "8192", 64, 8192,
                        "Records of 8 bytes in the memory of each load profile.")),
    Bind<&Settings::types, ParseTypes>(
        option::Texts("types", "",
                      "Type codes (08 12, 0 to B) that the meter may have; with another code, no "
                      "value is good.")));

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
