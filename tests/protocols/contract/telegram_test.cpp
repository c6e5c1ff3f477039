// Telegrams by hand: what is made of what a person writes, and which of them are reads for certain.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <map>
#include <string>
#include <string_view>

#include "config/catalog/option_values.h"
#include "gateway/base/text.h"
#include "protocols/all_protocols.h"

namespace baudgate {
namespace {

/// A telegram as it is written: hex where it can be read so.
Bytes Written(const std::string& text) {
  const auto hex = ParseHex(text);
  return hex ? *hex : ToBytes(text);
}

ParsedOptions OptionsWith(const Protocol& protocol, const std::string& key,
                          const std::string& text) {
  config::Options options = config::DefaultOptions(protocol);
  for (const OptionSpec& spec : protocol.options) {
    if (spec.name == key) options.Set(key, *config::ParseOption(spec, text));
  }
  return ParseOptions(protocol, options);
}

struct Row {
  const char* protocol;
  const char* written;
  const char* sent;  ///< as text or hex
  bool reads;
};

constexpr Row kRows[] = {
    {"spabus", ">1RF:", ">1RF:21\r", true},
    {"spabus", ">1RF:XX", ">1RF:21\r", true},
    {"spabus", ">1RF:21", ">1RF:21\r", true},
    {"spabus", "3E 31 52 46 3A", ">1RF:21\r", true},
    {"spabus", ">2RI1/5:XX", ">2RI1/5:06\r", true},
    {"spabus", ">1RB:XX", ">1RB:25\r", true},
    {"spabus", ">1RL:XX", ">1RL:2B\r", false},
    {"spabus", ">1WC:0:XX", ">1WC:0:2B\r", false},
    {"spabus", ">1WV160:1:XX", ">1WV160:1:08\r", false},
    {"spabus", ">900RF:XX", ">900RF:29\r", false},
    {"spabus", ">1RF:22", ">1RF:22\r", false},
    {"dcon", "$01M", "$01M\r", true},
    {"dcon", "$01MXX", "$01MD2\r", true},
    {"dcon", "$012XX", "$012B7\r", true},
    {"dcon", "#01", "#01\r", false},
    {"dcon", "@01", "@01\r", false},
    {"dcon", "$015XX", "$015BA\r", false},
    {"dcon", "#**", "#**\r", false},
    {"dcon", "%0102080600", "%0102080600\r", false},
    {"set4tm", "C8 08 1B 00 11", "C8 08 1B 00 11 77 BB", true},
    {"set4tm", "C8 08 1B 00 11 77 BB", "C8 08 1B 00 11 77 BB", true},
    {"set4tm", "05 08 12", "05 08 12 E6 0C", true},
    {"set4tm", "00 00", "00 00 01 B0", true},
    {"modbus_rtu", "01 03 00 00 00 01", "01 03 00 00 00 01 84 0A", true},
    {"modbus_rtu", "01 03 00 00 00 01 84 0A", "01 03 00 00 00 01 84 0A", true},
    {"modbus_ascii", ":010300000001", ":010300000001FB\r\n", true},
    {"modbus_ascii", ":010300000001XX", ":010300000001FB\r\n", true},
    {"modbus_ascii", ":010300000001FB", ":010300000001FB\r\n", true},
};

TEST(Telegram, IsCompletedAndJudged) {
  for (const Row& row : kRows) {
    const Protocol& protocol = *FindProtocol(row.protocol);
    const ParsedOptions options = ParseOptions(protocol, config::DefaultOptions(protocol));
    const auto sent = protocol.telegram->complete(Written(row.written), options);
    ASSERT_TRUE(sent) << row.written << ": " << sent.error();
    EXPECT_EQ(ToHex(*sent), ToHex(Written(row.sent))) << row.protocol << " " << row.written;
    EXPECT_EQ(protocol.telegram->is_read(*sent, options), row.reads)
        << row.protocol << " " << row.written;
  }
}

TEST(Telegram, WritesAndSessionsAreNoReads) {
  const std::pair<const char*, const char*> kWrites[] = {
      {"modbus_rtu", "01 05 00 00 FF 00"},
      {"modbus_rtu", "01 06 00 00 00 01"},
      {"modbus_rtu", "01 10 00 00 00 01 02 00 01"},
      {"modbus_rtu", "00 03 00 00 00 01"},
      {"modbus_rtu", "01 08 00 01 00 00"},
      {"modbus_rtu", "01 41 01"},
      {"modbus_rtu", "01 17 00 00 00 01 00 00 00 01 02 00 01"},
      {"set4tm", "C8 01 30 30 30 30 30 30"},
      {"set4tm", "C8 02"},
      {"set4tm", "C8 03 27 01"},
      {"set4tm", "FE 08 00"},
      {"set4tm", "C8 07 00 00 00 01 00"},
      {"set4tm", "C8 08 00 00 00 00 00 00"}};
  for (const auto& [name, written] : kWrites) {
    const Protocol& protocol = *FindProtocol(name);
    const ParsedOptions options = ParseOptions(protocol, config::DefaultOptions(protocol));
    const auto sent = protocol.telegram->complete(Written(written), options);
    ASSERT_TRUE(sent) << written;
    EXPECT_FALSE(protocol.telegram->is_read(*sent, options)) << name << " " << written;
  }
}

TEST(Telegram, OptionsOfTheDeviceDecideItsChecksum) {
  const Protocol& dcon = *FindProtocol("dcon");
  const auto named =
      dcon.telegram->complete(ToBytes("$01M"), OptionsWith(dcon, "checksum", "true"));
  ASSERT_TRUE(named);
  EXPECT_EQ(AsText(*named), "$01MD2\r");
  const Protocol& meter = *FindProtocol("set4tm");
  const auto old = meter.telegram->complete(Bytes{0, 0}, OptionsWith(meter, "checksum", "ks"));
  ASSERT_TRUE(old);
  EXPECT_EQ(ToHex(*old), "00 00 FF");
  const Protocol& relay = *FindProtocol("spabus");
  const auto wild =
      relay.telegram->complete(ToBytes(">1RF:"), OptionsWith(relay, "send_xx", "true"));
  ASSERT_TRUE(wild);
  EXPECT_EQ(AsText(*wild), ">1RF:XX\r");
}

TEST(Telegram, WhatIsNoneIsToldInASentence) {
  for (const auto& [name, written] : {std::pair("spabus", "1RF:"),
                                      {"dcon", "01M"},
                                      {"dcon", "$0"},
                                      {"modbus_ascii", "0103"},
                                      {"modbus_ascii", ":01zz"},
                                      {"modbus_rtu", "01"},
                                      {"set4tm", "C8"}}) {
    const Protocol& protocol = *FindProtocol(name);
    const auto sent = protocol.telegram->complete(
        Written(written), ParseOptions(protocol, config::DefaultOptions(protocol)));
    ASSERT_FALSE(sent) << name << " " << written;
    EXPECT_NE(sent.error().find(", as in '"), std::string::npos) << sent.error();
  }
}

/// `ask` tells the protocol by the first character.
TEST(Telegram, TheLeadsOfEachProtocolAreItsOwn) {
  std::map<char, std::string_view> owners;
  for (const Protocol* protocol : AllProtocols()) {
    if (protocol->telegram == nullptr) continue;
    for (const char lead : protocol->telegram->leads) {
      const auto [owner, fresh] = owners.emplace(lead, protocol->name);
      EXPECT_TRUE(fresh) << lead << " of " << owner->second << " and " << protocol->name;
    }
  }
  EXPECT_EQ(owners['>'], "spabus");
  EXPECT_EQ(owners['$'], "dcon");
  EXPECT_EQ(owners[':'], "modbus_ascii");
}

}  // namespace
}  // namespace baudgate
