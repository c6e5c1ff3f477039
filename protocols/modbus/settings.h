// The options of a Modbus device: OptionTable lists them for users, Settings contains their values.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "config/model/device.h"
#include "protocols/protocol.h"

namespace baudgate::protocols::modbus {

/// For functions that need more time: the maximum reply time by function code.
using FunctionTimes = std::map<std::uint8_t, Duration>;

/// Texts of register codes: the first key is the name of a table of texts, the second key the code.
using TextTables = std::map<std::string, std::map<std::uint16_t, std::string>, std::less<>>;

struct Settings {
  /// Word order of numbers in several registers.
  config::WordOrder order = config::WordOrder::abcd;
  /// Maximum number of registers in one request; for bits 16 times as many.
  std::size_t block = 120;
  /// Maximum number of unused registers between two points of a request; for bits 16 times as many.
  std::size_t hole = 8;
  bool write_multiple = false;
  /// True: adjacent points that one command writes are written by one request.
  bool write_together = false;
  /// True: bits of a register are written by two reads and a write of the whole register. False: by
  /// mask write (function 22).
  bool bits_by_read = false;
  bool probe_by_loopback = false;
  /// For the simulated device; true: registers without a point read 0; false: reading them gives an
  /// exception.
  bool missing_zero = false;
  TextTables texts;
  FunctionTimes reply_times;
};

std::span<const OptionSpec> OptionTable();
Settings ReadSettings(const config::Options& options);

/// Parses entries such as "fault 16=E.OC1" (table, code, text). The error contains the entry and
/// its fault.
Result<TextTables> ParseTexts(const std::vector<std::string>& entries);

/// Parses entries such as "16=5s" (function code, time). The error contains the entry and its
/// fault.
Result<FunctionTimes> ParseReplyTimes(const std::vector<std::string>& entries);

std::optional<config::WordOrder> ParseOrder(std::string_view text);

}  // namespace baudgate::protocols::modbus
