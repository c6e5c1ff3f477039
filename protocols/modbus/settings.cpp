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
    Bind<&Settings::order>(option::Choice(
        "order", "ABCD", "ABCD,CDAB,BADC,DCBA,CDABGHEF",
        "Order of the bytes in the device's numbers of two and four registers; word_order is "
        "that of the gateway's own registers.")),
    Bind<&Settings::block>(option::Integer(
        "block", "120", 1, 125,
        "Most registers in one request; bits: sixteen for each. A point is never split.")),
    Bind<&Settings::hole>(option::Integer(
        "hole", "8", 0, 124,
        "Most registers between two points that are read along with them; bits: sixteen for "
        "each.")),
    Bind<&Settings::write_multiple>(option::Choice(
        "write_function", "auto", "auto,multiple",
        "auto writes one register with function 06 and one coil with 05; multiple always with "
        "16 and 15.")),
    Bind<&Settings::write_together>(option::Flag(
        "write_together", "false",
        "Points of one command that lie side by side are written by one request (16, 15).")),
    Bind<&Settings::bits_by_read>(option::Choice(
        "bit_write", "mask", "mask,read_write",
        "mask changes bits of a register with function 22; read_write reads the register twice "
        "and writes it with the bits changed, for devices without function 22.")),
    Bind<&Settings::probe_by_loopback>(
        option::Choice("probe", "read", "read,loopback",
                       "The request that proves whose reply it is, and finds a silent device: a "
                       "read of a length that no "
                       "poll has, or loopback (function 08), which many devices do not know.")),
    Bind<&Settings::missing_zero>(option::Choice(
        "missing", "exception", "exception,zero",
        "Of a simulated device: registers without a point answer exception 02, or read 0 "
        "beside others.")),
    Bind<&Settings::texts, ParseTexts>(option::Texts(
        "texts", "", "Meanings of codes for text(NAME), each as \"NAME CODE=TEXT\".")),
    Bind<&Settings::reply_times, ParseReplyTimes>(option::Texts(
        "reply_times", "",
        "How long the device may take for a function, where longer than timing.reply, each as "
        "\"16=5s\".")));

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
    if (!is_new) return wrong("gives its code a second time");
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
      return wrong("has no time of 20ms to 1min");
    }
    const bool is_new = times.emplace(static_cast<std::uint8_t>(*function), *time).second;
    if (!is_new) return wrong("gives its function a second time");
  }
  return times;
}

Settings ReadSettings(const config::Options& options) { return kTable.Read(options); }

}  // namespace baudgate::protocols::modbus
