// Converts dates and times between text and the register layouts of meters. The registers are in
// the order ABCD: the high byte and the high register come first.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "protocols/common/decoded.h"

namespace baudgate::protocols::modbus {

enum class DateForm : std::uint8_t {
  unix,       ///< seconds since 1970 in two registers
  ti081,      ///< IEC 60870-5-4 as used by Schneider and others, four registers
  registers,  ///< year, month, day, hour, minute, second: one register each, six in all
  bytes,  ///< year since 2000, month, day, hour, minute, second: one byte each, in three registers
  bcd,    ///< as `bytes`, but with two decimal digits (BCD) in each byte
};

std::optional<DateForm> DateFormNamed(std::string_view name);
std::size_t RegistersOf(DateForm form);

/// Returns a text such as "2026-11-23 04:45:00" in the device's time; the quality is bad if the
/// date is impossible. `words` has RegistersOf(form) registers.
Decoded DecodeDate(DateForm form, const std::vector<std::uint16_t>& words);
/// Converts a text to registers, for simulated devices. Returns nothing if the text is not such a
/// date.
std::optional<std::vector<std::uint16_t>> EncodeDate(DateForm form, std::string_view text);

}  // namespace baudgate::protocols::modbus
