// Converts dates and times between text and the register layouts of meters, in the order ABCD.
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
  ti081,      ///< IEC 60870-5-4 as used by Schneider and others, four registers
  registers,  ///< year, month, day, hour, minute, second: six registers
  bytes,      ///< the same as one byte each in three registers, year since 2000
  bcd,        ///< as `bytes`, with two decimal digits per byte
};

std::optional<DateForm> DateFormNamed(std::string_view name);
std::size_t RegistersOf(DateForm form);

/// Returns "2026-11-23 04:45:00" in the device's time; bad: an impossible date. `words`:
/// RegistersOf(form) registers.
Decoded DecodeDate(DateForm form, const std::vector<std::uint16_t>& words);
/// For twins. Returns nothing if the text is no such date.
std::optional<std::vector<std::uint16_t>> EncodeDate(DateForm form, std::string_view text);

}  // namespace baudgate::protocols::modbus
