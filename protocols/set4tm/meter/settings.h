// The options of a SET-4TM meter: their table for users, and the same as a struct for the code.
// They come from the configuration and go to the conversation and the twin.
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

// The enumerators of choices stand in the order of their words in the table.

/// What the meter's floats are.
enum class Floats : std::uint8_t { primary, secondary };
/// Whether 08 23 is used.
enum class Snapshot : std::uint8_t { automatic, on, off };

/// Energies at its begin are a billing reading.
enum class BillingPeriod : std::uint8_t { day, month };

struct Settings {
  Bytes password;                              ///< six bytes
  std::optional<std::uint32_t> serial_number;  ///< the meter that must answer
  std::optional<double> meter_constant;
  std::optional<double> voltage_ratio;
  std::optional<double> current_ratio;
  std::optional<double> power_coefficient;
  std::optional<double> current_coefficient;
  Checksum checksum = Checksum::crc;
  Floats floats = Floats::primary;
  Snapshot snapshot = Snapshot::automatic;
  std::optional<CivilZone> time_zone;  ///< of its clock
  Duration correct_clock{};       ///< from such a drift on the gateway corrects it; zero: never
  Duration correct_clock_most{};  ///< up to such a one
  Duration latch{};               ///< how often all meters of the line are told to; zero: never
  int journal_records = 10;       ///< in each journal
  std::vector<unsigned> load_profiles;  ///< 1 to 3, that are read; empty: none is
  std::vector<BillingPeriod> billing;   ///< whose readings are kept; empty: none are
  int billing_tariffs = 4;              ///< of them, beside the sum
  int load_records = 8192;              ///< in the memory of each, hours' headers included
  std::vector<std::uint8_t> types;      ///< type codes of 08 12; empty: any

  /// What need not be asked of the meter.
  Scale scale() const;
};

std::span<const OptionSpec> OptionTable();
Settings ReadSettings(const config::Options& options);
/// Whether the password is one.
Status CheckSettings(const config::Options& options);

}  // namespace baudgate::protocols::set4tm
