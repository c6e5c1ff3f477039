// `Settings` are the options of an SPA Bus device as a struct; OptionTable describes the options
// for users.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "config/model/options.h"
#include "protocols/options.h"
#include "protocols/spabus/clock.h"
#include "protocols/spabus/codec.h"

namespace baudgate::protocols::spabus {

/// The items of the password: V160 opens the password, V161 closes or changes it.
inline constexpr Range kPasswordItems{160, 161};

/// The part of a reply in several lines that its checksum covers (kCovers…). The enumerators are in
/// the order of the words in the option table.
enum class Continuation : std::uint8_t { learned, all, no_line_ends, characters, last_line };

struct Settings {
  std::size_t max_items = 8;
  std::size_t write_items = 1;
  std::int64_t password = 0;  ///< password of the device; 0: the device needs none
  bool send_wildcard = false;
  bool accept_wildcard = true;
  bool line_feed_in_checksum = false;
  Continuation continuation = Continuation::learned;
  Duration send_seconds{};
  Duration send_date{};
  Zone date_zone = Zone::local;
  Duration clock_delay{};
};

std::span<const OptionSpec> OptionTable();
Settings ReadSettings(const config::Options& options);

ClockSettings ClockSettingsOf(const Settings& settings);

int ChecksumBits(const Settings& settings);

}  // namespace baudgate::protocols::spabus
