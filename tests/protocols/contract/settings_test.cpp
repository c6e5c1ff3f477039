// SPDX-License-Identifier: Apache-2.0
#include "protocols/common/settings.h"

#include <gtest/gtest.h>

#include "protocols/frame_rule.h"

namespace baudgate {
namespace {

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

TEST(SettingsTable, AnOptionalNumberIsThereUnlessItIsZero) {
  config::Options options = SomeOptions();
  options.Set("ratio", 2.5);
  EXPECT_EQ(kTable.Read(options).ratio, 2.5);
}

TEST(SettingsTable, WhatAFunctionRefusesIsSaidByCheckAndLeftAsItWas) {
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

}  // namespace
}  // namespace baudgate
