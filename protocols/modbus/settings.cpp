// SPDX-License-Identifier: Apache-2.0
#include "protocols/modbus/settings.h"

#include <algorithm>

#include "gateway/base/text.h"
#include "protocols/common/settings.h"
#include "protocols/modbus/codec.h"

namespace baudgate::protocols::modbus {
namespace {

using config::WordOrder;

constexpr Duration kLeastReplyTime = 20ms;
constexpr Duration kMostReplyTime = 1min;

constexpr auto kTable = SettingsTable(
    Bind<&Settings::order>(
        option::Choice("order", "ABCD", "ABCD,CDAB,BADC,DCBA,CDABGHEF",
                       "Byte order of the device's numbers in two and four registers; word_order "
                       "is the byte order of the gateway's registers.")),
    Bind<&Settings::block>(option::Integer("block", "120", 1, 125,
                                           "Largest number of registers in one request, or of "
                                           "bits: 16 for each register. A point is never split.")),
    Bind<&Settings::hole>(
        option::Integer("hole", "8", 0, 124,
                        "Largest gap between two points that one request reads together, in "
                        "registers, or in bits: 16 for each register.")),
    Bind<&Settings::write_multiple>(option::Choice(
        "write_function", "auto", "auto,multiple",
        "auto writes one register with function 06 and one coil with 05; multiple always with "
        "16 and 15.")),
    Bind<&Settings::write_together>(
        option::Flag("write_together", "false",
                     "Adjacent points of one write command are written by one request (16, 15).")),
    Bind<&Settings::bits_by_read>(option::Choice(
        "bit_write", "mask", "mask,read_write",
        "mask changes bits of a register with function 22; read_write reads the register twice "
        "and writes it with the bits changed, for devices without function 22.")),
    Bind<&Settings::probe_by_loopback>(option::Choice(
        "probe", "read", "read,loopback",
        "Request that reveals late replies and finds a silent device again: a read with a length "
        "that no poll uses, or loopback (function 08), which many devices do not know.")),
    Bind<&Settings::missing_zero>(
        option::Choice("missing", "exception", "exception,zero",
                       "Simulated device only: registers without a point. exception: answered by "
                       "exception 02. zero: read as 0 if the request also contains points.")),
    Bind<&Settings::texts, ParseTexts>(option::Texts(
        "texts", "", "Meanings of codes for text(NAME), each as \"NAME CODE=TEXT\".")),
    Bind<&Settings::reply_times, ParseReplyTimes>(option::Texts(
        "reply_times", "",
        "Reply timeout of functions that need longer than timing.reply, each as \"16=5s\".")));

}  // namespace

std::span<const OptionSpec> OptionTable() { return kTable.specs(); }

std::optional<WordOrder> ParseOrder(std::string_view text) {
  for (const WordOrder order :
       {WordOrder::abcd, WordOrder::cdab, WordOrder::badc, WordOrder::dcba, WordOrder::cdabghef}) {
    if (text == Name(order)) return order;
  }
  return std::nullopt;
}

Result<TextTables> ParseTexts(const std::vector<std::string>& entries) {
  TextTables tables;
  for (const std::string& entry : entries) {
    const auto wrong = [&](const std::string& why) {
      return Error{"texts: '" + entry + "' " + why + "; write \"NAME CODE=TEXT\", as in " +
                   "\"fault 16=overcurrent\""};
    };
    const auto equals = entry.find('=');
    const auto blank = entry.find(' ');
    if (blank == std::string::npos || equals == std::string::npos || blank > equals) {
      return wrong("has no name, or no code");
    }
    const std::string_view view = entry;
    const auto code = ParseNumber(Trim(view.substr(blank, equals - blank)));
    if (!code) return wrong("has a code that is not 0...65535");
    const std::string text(Trim(view.substr(equals + 1)));
    if (text.empty()) return wrong("has no text");
    const bool is_new = tables[entry.substr(0, blank)].emplace(*code, text).second;
    if (!is_new) return wrong("repeats a code");
  }
  return tables;
}

Result<FunctionTimes> ParseReplyTimes(const std::vector<std::string>& entries) {
  FunctionTimes times;
  for (const std::string& entry : entries) {
    const auto wrong = [&](const std::string& why) {
      return Error{"reply_times: '" + entry + "' " + why +
                   "; write \"FUNCTION=TIME\", as in \"16=5s\""};
    };
    const std::string_view view = entry;
    const auto equals = view.find('=');
    const auto function = ParseNumber(Trim(view.substr(0, equals)));
    if (!function || !IsFunction(static_cast<std::uint8_t>(std::min<unsigned>(*function, 0xFF)))) {
      return wrong("has no function code 1...127");
    }
    if (equals == std::string_view::npos) return wrong("has no time");
    const auto time = ParseDuration(Trim(view.substr(equals + 1)));
    if (!time || *time < kLeastReplyTime || *time > kMostReplyTime) {
      return wrong("needs a time of 20ms to 1min");
    }
    const bool is_new = times.emplace(static_cast<std::uint8_t>(*function), *time).second;
    if (!is_new) return wrong("repeats a function");
  }
  return times;
}

Settings ReadSettings(const config::Options& options) { return kTable.Read(options); }

}  // namespace baudgate::protocols::modbus
