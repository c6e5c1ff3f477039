// The options of a Modbus device: their table for users, and the same as a struct for the code.
// They come from the configuration and go to planning, values, the conversation and the twin.
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

/// How long a device may take for a function, where that is longer than its reply time.
using FunctionTimes = std::map<std::uint8_t, Duration>;

/// Codes of a register and what they mean, by the table's name.
using TextTables = std::map<std::string, std::map<std::uint16_t, std::string>, std::less<>>;

struct Settings {
  config::WordOrder order = config::WordOrder::abcd;  ///< of numbers of several registers
  std::size_t block = 120;  ///< most registers in one request; bits: 16 for each
  std::size_t hole = 8;     ///< most registers read along between two points; bits alike
  bool write_multiple = false;
  bool write_together = false;     ///< adjacent points of one command by one request
  bool bits_by_read = false;       ///< bits of a register without mask write
  bool probe_by_loopback = false;  ///< else by a read
  bool missing_zero = false;       ///< twin: registers between points read 0
  TextTables texts;
  FunctionTimes reply_times;
};

std::span<const OptionSpec> OptionTable();
Settings ReadSettings(const config::Options& options);

/// "fault 16=E.OC1". An error says what is wrong with which entry.
Result<TextTables> ParseTexts(const std::vector<std::string>& entries);

/// "16=5s". An error as above.
Result<FunctionTimes> ParseReplyTimes(const std::vector<std::string>& entries);

std::optional<config::WordOrder> ParseOrder(std::string_view text);

}  // namespace baudgate::protocols::modbus
