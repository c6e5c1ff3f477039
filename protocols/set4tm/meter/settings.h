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

// The enumerators of the enums below must be in the order of their words in the option table.

/// Whether the meter's floats are primary values (multiplied by its ratios) or secondary values
/// (not multiplied).
enum class Floats : std::uint8_t { primary, secondary };
enum class Snapshot : std::uint8_t { automatic, on, off };

/// Periods of billing readings. A billing reading has the energies at the beginning of a period.
enum class BillingPeriod : std::uint8_t { day, month };

struct Settings {
  Bytes password;  ///< six bytes
  /// Serial number of the meter that must answer; empty: any meter.
  std::optional<std::uint32_t> serial_number;
  std::optional<double> meter_constant;
  std::optional<double> voltage_ratio;
  std::optional<double> current_ratio;
  std::optional<double> power_coefficient;
  std::optional<double> current_coefficient;
  Checksum checksum = Checksum::crc;
  Floats floats = Floats::primary;
  Snapshot snapshot = Snapshot::automatic;
  std::optional<CivilZone> time_zone;  ///< time zone of the meter's clock
  /// The smallest drift that the gateway corrects; zero: it corrects none.
  Duration correct_clock{};
  Duration correct_clock_most{};  ///< the largest drift that the gateway corrects
  Duration latch{};  ///< period of the latch broadcast to the line; zero: no broadcasts
  int journal_records = 10;
  std::vector<unsigned> load_profiles;  ///< numbers of the load profiles to read, 1 to 3
  std::vector<BillingPeriod> billing;
  int billing_tariffs = 4;  ///< number of tariffs in billing readings, in addition to the sum
  int load_records = 8192;  ///< records in each load profile, hour headers included
  std::vector<std::uint8_t> types;

  /// Returns the constants that are set in the options; the meter need not be asked for them.
  Scale scale() const;
};

std::span<const OptionSpec> OptionTable();
Settings ReadSettings(const config::Options& options);
Status CheckSettings(const config::Options& options);

}  // namespace baudgate::protocols::set4tm
