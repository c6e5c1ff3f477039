// Tests rules that hold for every protocol of the list in protocols/CMakeLists.txt.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <string_view>

#include "config/catalog/option_values.h"
#include "gateway/base/text.h"
#include "protocols/all_protocols.h"
#include "protocols/common/settings.h"
#include "protocols/frame_rule.h"
#include "protocols/protocol.h"

namespace baudgate::protocols {
namespace {

class Descriptor : public ::testing::TestWithParam<const Protocol*> {};

TEST_P(Descriptor, IsComplete) {
  const Protocol& protocol = *GetParam();
  EXPECT_FALSE(protocol.name.empty());
  EXPECT_FALSE(protocol.title.empty());
  EXPECT_FALSE(protocol.decoders.empty());
  EXPECT_NE(protocol.canonical_address, nullptr);
  EXPECT_NE(protocol.check_point, nullptr);
  EXPECT_NE(protocol.request_rule, nullptr);
  EXPECT_NE(protocol.reply_rule, nullptr);
  EXPECT_NE(protocol.expect, nullptr);
  EXPECT_NE(protocol.make_conversation, nullptr);
  EXPECT_NE(protocol.make_twin, nullptr);
  EXPECT_EQ(protocol.parse == nullptr, protocol.options.empty()) << "who has options parses them";
  EXPECT_GE(protocol.serial.data_bits, protocol.data_bits);
  EXPECT_EQ(FindProtocol(protocol.name), &protocol);
  EXPECT_EQ(protocol.tcp, !protocol.traits.service.empty()) << "the status names what it speaks";
  const std::string_view other = protocol.traits.counterpart;
  EXPECT_TRUE(other.empty() || FindProtocol(other)->tcp != protocol.tcp) << other;
}

TEST_P(Descriptor, HasOptionsWithValidFallbacks) {
  std::set<std::string_view> names;
  for (const OptionSpec& spec : GetParam()->options) {
    EXPECT_TRUE(names.insert(spec.name).second) << spec.name << " stands twice";
    const auto value = config::ParseOption(spec, spec.fallback);
    EXPECT_TRUE(value) << spec.name << ": " << (value ? "" : value.error());
    EXPECT_TRUE(spec.help.ends_with(".")) << spec.name;
  }
}

TEST_P(Descriptor, HasOneSpellingForEveryAddress) {
  int valid = 0;
  for (const char* text : {"1", "2", "15", "0x0F", "200", "9020001", "sn:9020001", "sn:5"}) {
    const auto canonical = GetParam()->canonical_address(text);
    if (!canonical) {
      EXPECT_FALSE(canonical.error().empty());
      continue;
    }
    ++valid;
    const auto again = GetParam()->canonical_address(*canonical);
    ASSERT_TRUE(again) << *canonical;
    EXPECT_EQ(*again, *canonical);
  }
  EXPECT_GE(valid, 2);
  EXPECT_FALSE(GetParam()->canonical_address("no address"));
}

TEST_P(Descriptor, HasConsistentTimes) {
  for (const int baud : {300, 9600, 115200}) {
    config::SerialSettings serial = GetParam()->serial;
    serial.baud = baud;
    const config::Timing timing = GetParam()->timing(serial);
    EXPECT_GT(*timing.quiet, Duration::zero());
    EXPECT_GE(*timing.ceiling, *timing.reply + *timing.gap);
    EXPECT_GE(*timing.drain, *timing.gap);
  }
}

INSTANTIATE_TEST_SUITE_P(Every, Descriptor, ::testing::ValuesIn(AllProtocols()),
                         [](const auto& info) { return std::string(info.param->name); });

TEST(Descriptors, CanonicalAddressesDistinguishDevices) {
  const auto same = [](std::string_view protocol, const char* first, const char* second) {
    const auto canonical = FindProtocol(protocol)->canonical_address;
    return *canonical(first) == *canonical(second);
  };
  EXPECT_TRUE(same("dcon", "0x4A", "74"));
  EXPECT_TRUE(same("modbus_rtu", "0x14", "20"));
  EXPECT_TRUE(same("set4tm", "9020001", "sn:9020001"));
  EXPECT_FALSE(same("set4tm", "5", "sn:5"));
  EXPECT_TRUE(same("spabus", "007", "7"));
}

TEST(Descriptors, ExactlyOneProtocolServesMastersOfEachFraming) {
  for (const auto framing : {baudgate::modbus::Framing::rtu, baudgate::modbus::Framing::ascii}) {
    const auto serves = [framing](const Protocol* protocol) {
      return protocol->carrier != nullptr && protocol->carrier->framing == framing;
    };
    EXPECT_EQ(std::ranges::count_if(AllProtocols(), serves), 1) << Title(framing);
  }
}

enum class Format : std::uint8_t { decimal, hex };

struct Settings {
  bool checksum = false;
  std::size_t width = 0;
  std::optional<double> ratio;
  Format format = Format::decimal;
  bool by_read = false;
  Duration pause{};
  std::vector<std::string> words;
  int password = -1;
};

Result<int> FourDigits(std::string_view text) {
  if (text.size() != 4) return Error{"the password has four digits"};
  return std::stoi(std::string(text));
}

constexpr auto kTable = SettingsTable(
    Bind<&Settings::checksum>(option::Flag("checksum", "false", "…")),
    Bind<&Settings::width>(option::Integer("width", "7", 0, 32, "…")),
    Bind<&Settings::ratio>(option::Real("ratio", "0", 0, 100, "…")),
    Bind<&Settings::format>(option::Choice("format", "decimal", "decimal,hex", "…")),
    Bind<&Settings::by_read>(option::Choice("probe", "loopback", "loopback,read", "…")),
    Bind<&Settings::pause>(option::Time("pause", "5ms", "…")),
    Bind<&Settings::words>(option::Texts("words", "a,b", "…")),
    Bind<&Settings::password, FourDigits>(option::Secret(option::Text("password", "0000", "…"))));

config::Options SomeOptions() {
  config::Options options;
  options.Set("checksum", true);
  options.Set("width", std::int64_t{9});
  options.Set("ratio", 0.0);
  options.Set("format", std::string("hex"));
  options.Set("probe", std::string("read"));
  options.Set("pause", Duration(20ms).count());
  options.Set("words", std::vector<std::string>{"x"});
  options.Set("password", std::string("0042"));
  return options;
}

Settings ReadSome(const config::Options& options) { return kTable.Read(options); }

Expectation ExpectWidth(View request, const Settings& settings) {
  return {.shapes = {}, .max_bytes = settings.width + request.size()};
}

TEST(SettingsTable, FillsEveryMemberFromItsOption) {
  const Settings settings = kTable.Read(SomeOptions());
  EXPECT_TRUE(settings.checksum);
  EXPECT_EQ(settings.width, 9U);
  EXPECT_FALSE(settings.ratio) << "0 is nothing";
  EXPECT_EQ(settings.format, Format::hex);
  EXPECT_TRUE(settings.by_read) << "the second of two words";
  EXPECT_EQ(settings.pause, 20ms);
  EXPECT_EQ(settings.words, std::vector<std::string>{"x"});
  EXPECT_EQ(settings.password, 42);
}

TEST(SettingsTable, AnOptionalNumberIsSetUnlessItIsZero) {
  config::Options options = SomeOptions();
  options.Set("ratio", 2.5);
  EXPECT_EQ(kTable.Read(options).ratio, 2.5);
}

TEST(SettingsTable, ARefusedOptionIsReportedByCheckAndLeftUnchanged) {
  config::Options options = SomeOptions();
  EXPECT_TRUE(kTable.Check(options));
  options.Set("password", std::string("42"));
  EXPECT_EQ(kTable.Check(options).error(), "the password has four digits");
  EXPECT_EQ(kTable.Read(options).password, -1);
  EXPECT_EQ(kTable.Read(options).width, 9U);
}

TEST(SettingsTable, ParsedOptionsReachTheFunctionsOfTheProtocol) {
  constexpr auto kParse = ParseWith<ReadSome>;
  constexpr auto kExpect = kWithSettings<ExpectWidth>;
  EXPECT_EQ(kExpect(Bytes{1, 2}, kParse(SomeOptions())).max_bytes, 9U + 2);
}

TEST(SettingsTable, ShowsItsRowsToTheConfiguration) {
  ASSERT_EQ(kTable.specs().size(), 8U);
  EXPECT_EQ(kTable.specs()[1].name, "width");
  EXPECT_TRUE(kTable.specs()[7].secret);
}

/// Returns settings with 10 bits for each character (8N1). At 10,000 bit/s a character takes 1 ms.
config::SerialSettings At(int baud) { return {.baud = baud}; }

TEST(TimingRule, ASpanIsTheLongerOfTimeAndCharacters) {
  const TimingRule::Span span = {.least = 5ms, .characters = 3.5, .plus = 1ms};
  EXPECT_EQ(span.At(1ms), 5ms);
  EXPECT_EQ(span.At(2ms), 8ms);
  EXPECT_EQ(TimingRule::Span{}.At(2ms), Duration::zero());
}

TEST(TimingRule, TheCeilingIncludesTheLongestReplyAndItsGaps) {
  const TimingRule rule = {.quiet = {.least = 2ms},
                           .reply = {.least = 100ms},
                           .gap = {.characters = 20},
                           .drain = {.least = 50ms},
                           .longest = 200,
                           .gaps = 2};
  const config::Timing timing = rule(At(10'000));
  EXPECT_EQ(timing.quiet, 2ms);
  EXPECT_EQ(timing.reply, 100ms);
  EXPECT_EQ(timing.gap, 20ms);
  EXPECT_EQ(timing.drain, 50ms);
  EXPECT_EQ(timing.ceiling, 100ms + 200ms + 2 * 20ms);
}

TEST(TimingRule, TheTimeOfTheLongestReplyMayBeBounded) {
  const TimingRule rule = {
      .longest = 4000, .gaps = 0, .longest_time = {.least = 1s, .characters = 500}};
  EXPECT_EQ(rule(At(100'000)).ceiling, 400ms) << "short enough";
  EXPECT_EQ(rule(At(10'000)).ceiling, 1s) << "1 s in place of 4 s";
  EXPECT_EQ(rule(At(1'000)).ceiling, 5s) << "500 characters take longer than 1 s";
}

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
  const char* sent;
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

TEST(Telegram, IsCompletedAndClassifiedAsReadOrWrite) {
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

TEST(Telegram, OptionsOfTheDeviceDetermineItsChecksum) {
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

TEST(Telegram, AnInvalidTelegramIsExplained) {
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

TEST(Telegram, LeadCharactersAreUniqueToAProtocol) {
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
}  // namespace baudgate::protocols
