// The options of a DCON device: OptionTable lists them for users, Settings contains their values.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "config/model/options.h"
#include "protocols/protocol.h"

namespace baudgate::protocols::dcon {

// The enumerators of the enums below must be in the order of their words in the option table.

/// Format of the numbers of analog modules: bits 1:0 of the module's format byte.
enum class Format : std::uint8_t { engineering, percent, hex };
/// Content of a reply of joined numbers for a channel that is disabled in the module.
enum class Disabled : std::uint8_t { missing, blank, zero };
/// Position of the checksum in a counter reply of I-7080.
enum class ChecksumPlace : std::uint8_t { either, end, front };

struct Settings {
  bool checksum = false;
  ChecksumPlace counter_checksum = ChecksumPlace::either;
  std::size_t width = 7;  ///< number of characters in a number, sign and point included; 0: any
  /// Number of values in the reply to `#AA`; 0: as many as the points need.
  std::size_t channels = 0;
  std::uint32_t enabled = 0xFFFF'FFFF;  ///< mask of the enabled channels; bit 0: channel 0
  Disabled disabled = Disabled::missing;
  Format format = Format::engineering;
  /// The value that hex 7FFF (FFFF with hex_unsigned) stands for; 0: no conversion.
  double full_scale = 0;
  bool hex_unsigned = false;
  std::vector<std::string> over;
  std::vector<std::string> under;
  std::vector<std::string> open;
  bool nines = false;        ///< true: five or more nines, with a point anywhere, mean out of range
  bool swap_bytes = false;   ///< true: swap the bytes of a 16-bit digital reply, before `invert`
  std::uint16_t invert = 0;  ///< mask of the bits of a 16-bit digital reply that are inverted
  bool data_address = false;  ///< true: replies with '>' also contain the address (TRP-C68)
  bool write_ack_address = false;
  bool identify = true;                         ///< true: the module supports `$AAM` and `$AA2`
  std::vector<std::string> types;               ///< allowed type codes in hex; empty: any
  std::uint64_t counter_maximum = 0xFFFF'FFFF;  ///< the last count before a counter rolls over to 0
  double count_rate = 100'000;                  ///< the maximum number of pulses per second; 0: any
  /// Period of the broadcast `~**` (the host is alive); zero: never sent.
  Duration host_watchdog{};
  /// True: each input has a type of its own; the type in `$AA2` does not apply.
  bool channel_types = false;
};

std::span<const OptionSpec> OptionTable();

Settings ReadSettings(const config::Options& options);

}  // namespace baudgate::protocols::dcon
