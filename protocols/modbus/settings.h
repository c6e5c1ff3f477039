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

/// The longest reply time by function code, for functions that need more than the device's.
using FunctionTimes = std::map<std::uint8_t, Duration>;

/// The texts of register codes, by table name.
using TextTables = std::map<std::string, std::map<std::uint16_t, std::string>, std::less<>>;

struct Settings {
  config::WordOrder order = config::WordOrder::abcd;  ///< for numbers in several registers
  std::size_t block = 120;  ///< most registers in one request; for bits 16 times as many
  std::size_t hole = 8;     ///< most unused registers between two points; for bits 16 times as many
  bool write_multiple = false;
  bool write_together = false;  ///< adjacent points of one command are written by one request
  bool bits_by_read = false;    ///< write bits of a register by read and write, not by mask write
  bool probe_by_loopback = false;  ///< probe by a loopback, else by a read
  bool missing_zero = false;       ///< for the twin: registers between points read 0
  TextTables texts;
  FunctionTimes reply_times;
};

std::span<const OptionSpec> OptionTable();
Settings ReadSettings(const config::Options& options);

/// Parses entries such as "fault 16=E.OC1". The error names the entry and what is wrong with it.
Result<TextTables> ParseTexts(const std::vector<std::string>& entries);

/// Parses entries such as "16=5s". The error names the entry and what is wrong with it.
Result<FunctionTimes> ParseReplyTimes(const std::vector<std::string>& entries);

std::optional<config::WordOrder> ParseOrder(std::string_view text);

}  // namespace baudgate::protocols::modbus
