// Date and time as meters lay them out in registers, to and from text. Registers come from values,
// in the order of the device's numbers.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "protocols/common/decoded.h"

namespace baudgate::protocols::modbus {

enum class DateForm : std::uint8_t {
  unix,       ///< seconds since 1970, two registers
  ti081,      ///< four registers, IEC 60870-5-4 as Schneider and others have it
  registers,  ///< year, month, day, hour, minute, second: six registers
  bytes,      ///< the same as bytes in three registers, year since 2000
  bcd,        ///< the same, two decimal digits a byte
};

std::optional<DateForm> DateFormNamed(std::string_view name);
std::size_t RegistersOf(DateForm form);

/// "2026-11-23 04:45:00", as the device has it; no such day: bad. `words`: RegistersOf(form).
Decoded DecodeDate(DateForm form, const std::vector<std::uint16_t>& words);
/// For twins. Empty: the text is no such date.
std::optional<std::vector<std::uint16_t>> EncodeDate(DateForm form, std::string_view text);

}  // namespace baudgate::protocols::modbus
