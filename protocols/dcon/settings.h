// The options of a DCON device: their table for users, and the same as a struct for the code.
// They come from the configuration and go to the codec, the conversation and the twin.
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

// The enumerators of choices stand in the order of their words in the table.

/// How numbers of analog modules are written: bits 1:0 of the module's format byte.
enum class Format : std::uint8_t { engineering, percent, hex };
/// What stands in a joined reply for a channel that is disabled in the module.
enum class Disabled : std::uint8_t { missing, blank, zero };
/// Where the checksum of an I-7080 counter reply stands.
enum class ChecksumPlace : std::uint8_t { either, end, front };

struct Settings {
  bool checksum = false;
  ChecksumPlace counter_checksum = ChecksumPlace::either;
  std::size_t width = 7;     ///< characters of a number, sign and point included; 0 = any
  std::size_t channels = 0;  ///< values of `#AA`; 0 = as many as the points ask for
  std::uint32_t enabled = 0xFFFF'FFFF;  ///< bit 0 = channel 0
  Disabled disabled = Disabled::missing;
  Format format = Format::engineering;
  double full_scale = 0;  ///< of hex numbers; 0 = the bare number
  bool hex_unsigned = false;
  std::vector<std::string> over;
  std::vector<std::string> under;
  std::vector<std::string> open;
  bool nines = false;         ///< all digits nine, with a point anywhere, is a fault, too
  bool swap_bytes = false;    ///< of a digital reply of 16 bits, before anything else
  std::uint16_t invert = 0;   ///< over the 16 bits of a digital reply
  bool data_address = false;  ///< replies with '>' carry the address too (TRP-C68)
  bool write_ack_address = false;
  bool identify = true;                         ///< the module knows `$AAM` and `$AA2`
  std::vector<std::string> types;               ///< its type codes in hex; empty: any
  std::uint64_t counter_maximum = 0xFFFF'FFFF;  ///< of a counter, behind which 0 comes
  double count_rate = 100'000;                  ///< pulses a second at most; 0 = any
  Duration host_watchdog{};                     ///< period of `~**`; zero: never
  bool channel_types = false;  ///< each input has its own, and that of `$AA2` says nothing
};

std::span<const OptionSpec> OptionTable();

Settings ReadSettings(const config::Options& options);

}  // namespace baudgate::protocols::dcon
