// The options of a SET-4TM meter: OptionTable lists them for users, Settings contains their values.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "config/model/options.h"
#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "protocols/common/clock.h"
#include "protocols/options.h"
#include "protocols/set4tm/meter/codec.h"
#include "protocols/set4tm/meter/constants.h"

namespace baudgate::protocols::set4tm {

// The enumerators must be in the order of their words in the option table.

/// Whether the meter's floats are primary or secondary values.
enum class Floats : std::uint8_t { primary, secondary };
/// Whether masked reads (08 23) are used.
enum class Snapshot : std::uint8_t { automatic, on, off };

/// A billing reading contains the energies at the beginning of each period.
enum class BillingPeriod : std::uint8_t { day, month };

struct Settings {
  Bytes password;                              ///< six bytes
  std::optional<std::uint32_t> serial_number;  ///< serial number of the meter that must answer
  std::optional<double> meter_constant;
  std::optional<double> voltage_ratio;
  std::optional<double> current_ratio;
  std::optional<double> power_coefficient;
  std::optional<double> current_coefficient;
  Checksum checksum = Checksum::crc;
  Floats floats = Floats::primary;
  Snapshot snapshot = Snapshot::automatic;
  std::optional<CivilZone> time_zone;   ///< zone of the meter's clock
  Duration correct_clock{};             ///< smallest drift that the gateway corrects; zero: never
  Duration correct_clock_most{};        ///< largest drift that the gateway corrects
  Duration latch{};                     ///< time between latch broadcasts to the line; zero: never
  int journal_records = 10;             ///< number of records in each journal
  std::vector<unsigned> load_profiles;  ///< load profiles to read, 1 to 3; empty: none
  std::vector<BillingPeriod> billing;   ///< periods whose billing readings are read; empty: none
  int billing_tariffs = 4;              ///< tariffs in billing readings, in addition to the sum
  int load_records = 8192;              ///< records per load profile, hour headers included
  std::vector<std::uint8_t> types;      ///< allowed type codes of 08 12; empty: any

  /// Returns the constants in the options, which need not be asked from the meter.
  Scale scale() const;
};

std::span<const OptionSpec> OptionTable();
Settings ReadSettings(const config::Options& options);
/// Checks options such as the password, types and time zone.
Status CheckSettings(const config::Options& options);

}  // namespace baudgate::protocols::set4tm
