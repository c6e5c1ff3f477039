// Tests the errors that `check` reports for a description: the place of each, and damaged texts.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>

#include "gateway/base/text.h"
#include "protocols/telegram/field.h"
#include "protocols/telegram/matching.h"
#include "tests/protocols/telegram/support.h"
#include "tests/support/file_cases.h"

namespace baudgate::protocols::telegram {
namespace {

constexpr char kGood[] = R"(device: d
telegrams:
  weight:
    send: 'S{address:02d}\r\n'
    receive: 'S{address:02d} {state:char} {weight:8decimal} {unit:word}{checksum:02X}\r\n'
    checksum: sum8
    codes: { state: { 'S': good, 'D': uncertain } }
    reads: yes
    example: { send: 'S01\r\n', receive: 'S01 S    12.50 kg8F\r\n', weight: 12.5, unit: kg }
points:
  - { name: weight, read: weight.weight, type: float32 }
)";

std::string Sentences(const config::LoadedProfile& loaded) {
  std::string text;
  for (const auto& problem : loaded.problems) text += ToString(problem) + "\n";
  return text;
}

TEST(TelegramDescription, AValidDescriptionHasNoProblem) {
  EXPECT_EQ(Sentences(LoadText(kGood)), "");
}

constexpr char kStatus[] = R"(device: d
telegrams:
  data:
    send: 'hex 10 {node:4text}'
    receive: 'hex 68 {flags:uint16_be} {state:byte} {checksum:03d}'
    checksum: sum8
    codes: { state: { '0x00': good, '\x01': fault } }
    reads: yes
    example: { send: 'hex 10 30 31 31 31', receive: 'hex 68 01 00 00 31 30 35', flags: 256, state: '0x00' }
points:
  - { name: flag, read: 'data(node=0111).flags[b15]', type: bool }
)";

TEST(TelegramDescription, EveryErrorIsReportedWithItsPlace) {
  EXPECT_EQ(Sentences(LoadText(kStatus)), "");
  const auto cases = ReadFileCases("tests/protocols/telegram/description.txt");
  EXPECT_GT(cases.size(), 40U);
  for (const FileCase& one : cases) {
    SCOPED_TRACE(one.place);
    const auto lines = [](std::string text) {
      for (const auto& [sign, meant] :
           {std::pair<std::string, const char*>("¶", "\n"), {"␣", " "}}) {
        for (std::size_t at = 0; (at = text.find(sign, at)) != std::string::npos;) {
          text.replace(at, sign.size(), meant);
        }
      }
      return text;
    };
    std::string text = one.head == "good" ? kGood : kStatus;
    const std::string was = lines(one.given.at(0));
    const std::size_t at = text.find(was);
    ASSERT_NE(at, std::string::npos) << was;
    text.replace(at, was.size(), lines(one.given.at(1)));
    const std::string said = Sentences(LoadText(text));
    EXPECT_NE(said.find(one.results.at(0).second), std::string::npos) << said;
  }
}

TEST(TelegramDescription, AReplyWithoutCheckValueNeedsPermission) {
  const auto said = [](const std::string& checksum, const std::string& receive) {
    return Sentences(LoadText(
        "device: d\ntelegrams:\n  a:\n    send: 'R{node:1text}{checksum:02X}'\n    checksum: " +
        checksum + "\n    receive: '" + receive +
        "'\n    example: { send: 'R163', receive: '\\x061' }\npoints: []\n"));
  };
  const std::string wrong = "has no {checksum}, but 'checksum' is xor8";
  EXPECT_NE(said("xor8", "\\x06{v:1d}").find(wrong), std::string::npos);
  EXPECT_EQ(said("xor8", "\\x061").find(wrong), std::string::npos);
  EXPECT_EQ(said("xor8", "\\x06{node:1text}").find(wrong), std::string::npos);
  EXPECT_EQ(said("{ kind: xor8, answers: no }", "\\x06{v:1d}").find(wrong), std::string::npos);
}

TEST(TelegramDoubts, WarnOfBadOrShiftedValues) {
  const std::pair<const char*, const char*> kRows[] = {
      {"read: data(node=0111).flags, type: uint16", ""},
      {"read: data(node=0111).flags, type: int16", "has type int16, which cannot hold all"},
      {"read: data(node=0111).flags, type: int8", "up to 65535 on the line"},
      {"read: data(node=0111).flags, type: bool", "has type bool, which cannot hold all"},
      {"read: data(node=0111).flags, type: float32", ""},
      {"read: data(node=0111).flags, type: uint16, simulate: 200000",
       "has 'simulate' 200000, but its field 'flags' cannot hold this value"},
      {"read: 'data(node=0111).flags[b0-b7]', type: int8", "up to 255 on the line"},
      {"read: 'data(node=0111).flags[b0-b7]', type: uint8", ""},
  };
  for (const auto& [point, says] : kRows) {
    std::string text = kStatus;
    const auto at = text.find("read: 'data");
    text.replace(at, text.find(" }", at) - at, point);
    std::string said;
    for (const ConfigRemark& doubt : TelegramProtocol().doubts(Described(text)))
      said += doubt.text + "\n";
    EXPECT_EQ(said.empty(), std::string(says).empty()) << point << ": " << said;
    EXPECT_NE(said.find(says), std::string::npos) << point << ": " << said;
  }
}

TEST(TelegramDescription, AnErrorOfAllDevicesIsReportedOnceWithItsFile) {
  std::string text = kGood;
  text.replace(0, 10, "device: d\nparameters: { nod: 1 }\n");
  EXPECT_EQ(Sentences(LoadText(text)),
            "p.yaml:1:1: error: a device of this type has a parameter 'nod', which is not a field "
            "of any telegram\n");
  EXPECT_EQ(
      Sentences(LoadText("device: d\ntelegram: {}\npoints: []\n")).find("'telegrams'; describe"),
      std::string::npos);
}

TEST(TelegramDescription, AllErrorsAreReportedAtOnce) {
  std::string text = kGood;
  text.replace(text.find("sum8"), 4, "sum9");
  text.replace(text.find("good"), 4, "goood");
  text.replace(text.find("send: 'S{address:02d}"), 21, "send: 'S{address:02q}");
  EXPECT_GE(LoadText(text).problems.size(), 3U);
}

TEST(TelegramDescription, EveryMutationGivesErrorsAndNeverACrash) {
  std::vector<std::string> sources = {kGood};
  for (const auto& entry : std::filesystem::directory_iterator("config/profiles/telegram")) {
    std::ifstream file(entry.path());
    sources.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  }
  ASSERT_GE(sources.size(), 6U);
  constexpr std::string_view kPieces[] = {"{",           "}",
                                          "'",           "\\",
                                          ":",           "\\x",
                                          "hex ",        "{address:02X}",
                                          "{value}",     "{:bytes}",
                                          "[",           "]",
                                          "size: 9\n",   "size_at: 2\n",
                                          "listen: yes", "before: all",
                                          "99999999999", "-1",
                                          "\t",          "\xC3\xA9",
                                          "%s%n",        "checksum",
                                          "{password}",  "codes: {}"};
  std::mt19937 random(20261127);
  int refused = 0;
  for (int round = 0; round < 500; ++round) {
    std::string text = sources[random() % sources.size()];
    for (auto count = 1 + random() % 3; count > 0 && !text.empty(); --count) {
      const std::size_t at = random() % text.size();
      const std::size_t length = std::min<std::size_t>(random() % 12, text.size() - at);
      switch (random() % 4) {
        case 0:
          text.erase(at, length);
          break;
        case 1:
          text.insert(at, kPieces[random() % std::size(kPieces)]);
          break;
        case 2:
          text.replace(at, length, kPieces[random() % std::size(kPieces)]);
          break;
        default:
          text.insert(at, text.substr(random() % text.size(), length));
          break;
      }
    }
    const config::LoadedProfile loaded = LoadText(text);
    for (const auto& problem : loaded.problems) {
      const std::string sentence = ToString(problem);
      EXPECT_FALSE(problem.message.empty());
      EXPECT_EQ(sentence.find('\n'), std::string::npos) << sentence;
    }
    refused += loaded.ok() ? 0 : 1;
  }
  EXPECT_GT(refused, 200);
}

config::Loaded LoadConfig(const std::string& device) {
  config::Catalog catalog;
  catalog.protocols["telegram"] = &TelegramProtocol();
  catalog.profile_dirs = {"config/profiles"};
  return config::LoadText(
      "lines:\n  - name: bench\n    port: /dev/null\n    protocol: telegram\n    devices:\n      - "
      "{ " +
          device + " }\n",
      "c.yaml", catalog);
}

TEST(TelegramConfig, ParametersOfADeviceOverrideItsProfile) {
  const config::Loaded loaded = LoadConfig(
      "name: meter, address: 1, profile: scpi-instrument, parameters: { query: \"FETC?\" }");
  for (const auto& problem : loaded.problems) ADD_FAILURE() << ToString(problem);
  Talk talk(TelegramProtocol(), loaded.config.lines[0].devices[0]);
  ASSERT_TRUE(talk.Ask(Poll(0)));
  EXPECT_EQ(AsText(talk.request().bytes), "*IDN?\n") << "who it is goes first";
  talk.Reply(Poll(0), ToBytes("HEWLETT-PACKARD,34401A,0,11-5-2\r\n"));
  EXPECT_EQ(AsText(talk.Ask(Poll(0))->bytes), "FETC?\n");
}

TEST(TelegramConfig, AnUnknownParameterIsReportedAtItsDevice) {
  const config::Loaded loaded = LoadConfig(
      "name: meter, address: 1, profile: scpi-instrument, parameters: { qury: \"FETC?\" }");
  std::string said;
  for (const auto& problem : loaded.problems) said += ToString(problem) + "\n";
  EXPECT_EQ(said,
            "c.yaml:6:9: error: device 'meter' has a parameter 'qury', which is not a field of any "
            "telegram; did you mean 'query'? fields that are sent: query\n");
}

TEST(TelegramConfig, OnlyAnAddressedDeviceNeedsAnAddress) {
  const config::Loaded sics = LoadConfig("name: balance, profile: mt-sics");
  for (const auto& problem : sics.problems) ADD_FAILURE() << ToString(problem);
  EXPECT_EQ(sics.config.lines[0].devices[0].address, kNoAddress);
  const config::Loaded owen = LoadConfig("name: tank, profile: owen-mv110-8a-telegrams");
  ASSERT_FALSE(owen.problems.empty());
  EXPECT_NE(ToString(owen.problems[0]).find("set 'address' at the device"), std::string::npos)
      << ToString(owen.problems[0]);
}

TEST(TelegramConfig, EqualDescriptionsHaveEqualOptions) {
  const auto options = [](const std::string& device) {
    return LoadConfig(device).config.lines.at(0).devices.at(0).options;
  };
  const std::string sics = "name: a, address: 1, profile: mt-sics";
  EXPECT_EQ(options(sics), options(sics));
  EXPECT_FALSE(options(sics) == options("name: a, address: 1, profile: lauda-thermostat"));
}

Format FormatOf(const std::string& text) {
  const auto format = ParseFormat(text);
  EXPECT_TRUE(format) << text << ": " << (format ? "" : format.error());
  return format ? *format : Format{};
}

struct TextRow {
  const char* format;
  const char* text;
  const char* value;  ///< empty: the text is not a number
};

constexpr TextRow kTexts[] = {
    {"decimal", "12.5", "12.5"},
    {"decimal", "  -12.5", "-12.5"},
    {"decimal", "- 5", ""},
    {"decimal", "+  12.35", ""},
    {"8decimal", "+  12.35", "12.35"},
    {"8decimal", " - 12.35", ""},
    {"decimal", "5 ", ""},
    {"4decimal", "5   ", "5"},
    {"4decimal", " 5  ", ""},
    {"4integer", "-5  ", "-5"},
    {"4decimal", "12. ", ""},  // a blank in place of a digit
    {"05integer", "  123", ""},
    {"05integer", "123  ", ""},
    {"05integer", "00123", "123"},
    {"+07.3f", "+  1.250", ""},
    {"4hex", "  0C", ""},
    {"4hex", "0C  ", ""},
    {"4hex", "1A2 ", ""},
    {"4hex", " 0C ", ""},
    {"4hex", "1 A2", ""},
    {"4hex", "+1A2", ""},
    {"04X", " 1A2", ""},
    {"04X", "01A2", "418"},
    {"decimal", "5.", "5"},
    {"decimal", ".5", "0.5"},
    {"decimal", "", ""},
    {"decimal", "   ", ""},
    {"decimal", ".", ""},
    {"decimal", "12,5", ""},
    {"decimal", "12.5-", ""},
    {"decimal", "12.5 -", ""},
    {"decimal", "-", ""},
    {"decimal", "--5", ""},
    {"decimal", "+-5", ""},
    {"decimal", "1 2.5", ""},
    {"decimal", "1.2.5", ""},
    {"decimal", "12.5kg", ""},
    {"decimal", "1e5", ""},
    {"decimal", "inf", ""},
    {"decimal", "nan", ""},
    {"decimal", "0x10", ""},
    {"+decimal", "+12.5", "12.5"},
    {"+decimal", "12.5", ""},
    {".2decimal", "12.50", "12.5"},
    {".2decimal", "12.5", ""},
    {".2decimal", "12", ""},
    {".decimal", "12", ""},
    {"integer", "12", "12"},
    {"integer", "-0012", "-12"},
    {"integer", "12.0", ""},
    {"integer", "18446744073709551615", "18446744073709551615"},
    {"integer", "18446744073709551616", ""},
    {"integer", "-9223372036854775808", ""},
    {"hex", "0C", "12"},
    {"hex", "0c", "12"},
    {"hex", "-1", ""},
    {"hex", "0G", ""},
    {"hex", "FFFFFFFFFFFFFFFFF", ""},
    {"scientific", "+1.25E+01", "12.5"},
    {"scientific", "-1e-3", "-0.001"},
    {"scientific", "1E5", "100000"},
    {"scientific", "12.5", ""},
    {"scientific", "1.25E+", ""},
    {"scientific", ".25E+01", ""},
    {"scientific", "1.E+01", ""},
    {"9scientific", "1.25E+0  ", ""},
    {"9scientific", "  1.25E+0", "1.25"},
    {"+.scientific", "+1.25", ""},
    {"+.scientific", "+1.25E03", ""},
    {"+.scientific", "+1E+03", ""},
    {"+.scientific", "+1.25E-3", "0.00125"},
    {"scientific", "1E", ""},
    {"scientific", "E5", ""},
    {"scientific", "1E+999", ""},
    {"word", " kg ", "kg"},
    {"char", " ", " "},
};

TEST(TelegramField, ATextMustBeANumberCompletely) {
  for (const TextRow& row : kTexts) {
    const Value value = DecodeField(FormatOf(row.format), ToBytes(row.text));
    EXPECT_EQ(ToText(value), row.value) << row.format << " '" << row.text << "'";
  }
}

struct ByteRow {
  const char* format;
  const char* bytes;
  const char* value;
};

constexpr ByteRow kBytes[] = {
    {"byte", "1A", "0x1A"},
    {"uint8", "FF", "255"},
    {"int8", "FF", "-1"},
    {"uint16_be", "12 34", "4660"},
    {"uint16_le", "12 34", "13330"},
    {"int16_le", "FE FF", "-2"},
    {"int24_be", "80 00 00", "-8388608"},
    {"uint40_le", "01 00 00 00 01", "4294967297"},
    {"uint64_be", "FF FF FF FF FF FF FF FF", "18446744073709551615"},
    {"int64_le", "FF FF FF FF FF FF FF FF", "-1"},
    {"float32_be", "41 20 00 00", "10"},
    {"float32_le", "00 00 20 41", "10"},
    {"float32_be", "7F C0 00 00", ""},
    {"float32_be", "7F 80 00 00", ""},
    {"float64_be", "40 24 00 00 00 00 00 00", "10"},
    {"bcd2_be", "12 34", "1234"},
    {"bcd2_le", "34 12", "1234"},
    {"bcd2_be", "12 3A", ""},
    {"bcd8", "99 99 99 99 99 99 99 99", "9999999999999999"},
};

TEST(TelegramField, BytesAreNumbersInBothOrders) {
  for (const ByteRow& row : kBytes) {
    const Format format = FormatOf(row.format);
    const Bytes bytes = *ParseHex(row.bytes);
    const Value value = DecodeField(format, bytes);
    EXPECT_EQ(ToText(value), row.value) << row.format << " " << row.bytes;
    if (!HasValue(value)) continue;
    const auto back = EncodeField(format, value);
    ASSERT_TRUE(back) << row.format << ": " << back.error();
    EXPECT_EQ(*back, bytes) << row.format;
  }
}

struct WrittenRow {
  const char* format;
  Value value;
  const char* text;  ///< empty: the format cannot represent the value
};

TEST(TelegramField, AValueIsEncodedByItsFormat) {
  const WrittenRow kRows[] = {
      {"02X", std::int64_t{10}, "0A"},
      {"02x", std::int64_t{10}, "0a"},
      {"4hex", std::int64_t{418}, "01A2"},
      {"02X", std::int64_t{256}, ""},
      {"02X", std::int64_t{-1}, ""},
      {"03d", std::int64_t{7}, "007"},
      {"5integer", std::int64_t{-7}, "   -7"},
      {"+07.3f", 7.331, "+07.331"},
      {"+7.decimal", 1038.9, "+1038.9"},
      {"+7.decimal", -7.331, "-7.3310"},
      {"+7.decimal", 123456.0, ""},
      {".2decimal", 30.5, "30.50"},
      {".2decimal", 30.005, ""},
      {".1decimal", -0.04, ""},
      {".1decimal", 24.96, ""},
      {".1decimal", 0.1 + 0.2, "0.3"},
      {"3d", 12.3, ""},
      {"02X", 12.3, ""},
      {"int16_be", 12.3, ""},
      {"bcd2", 12.3, ""},
      {"float32_be", std::int64_t{16777217}, ""},
      {".2scientific", 1.234, ""},
      {".scientific", 1e37, "1.0E+37"},
      {"+7.decimal", 123.4567, ""},
      {"byte", std::string("0x1"), ""},
      {"byte", std::string("0x4A"), "J"},
      {"10decimal", 100.5, "     100.5"},
      {"decimal", 0.25, "0.25"},
      {"decimal", std::nan(""), ""},
      {"+.8scientific", 0.00123456789, "+1.23456789E-03"},
      {"word", std::string("kg"), "kg"},
      {"word", std::string("k g"), ""},
      {"8text", std::string("abc"), "abc     "},
      {"2text", std::string("abc"), ""},
      {"text", std::string("a\rb"), ""},
      {"text", std::string("\x1B[2J"), ""},
      {"decimal", std::string("12.5"), "12.5"},
      {"decimal", std::string("12;DROP"), ""},
  };
  for (const WrittenRow& row : kRows) {
    const auto written = EncodeField(FormatOf(row.format), row.value);
    EXPECT_EQ(written ? std::string(AsText(*written)) : "", row.text)
        << row.format << " " << ToText(row.value);
    if (!written) {
      EXPECT_EQ(Printable(ToBytes(written.error())), written.error());
    }
  }
}

TEST(TelegramField, ATwinSendsTheNearestValueOfTheField) {
  const std::tuple<const char*, double, double> kRows[] = {
      {".2decimal", 24.96451, 24.96},       {"int16_be", 12.5, 13},
      {"decimal", 24.123456789012, 24.123}, {"decimal", 0.0012345678901, 0.00123457},
      {"decimal", 24.96451, 24.96451},      {"+7.decimal", 123.45678, 123.46}};
  for (const auto& [format, value, nearest] : kRows) {
    EXPECT_EQ(ToDouble(Nearest(FormatOf(format), value)), nearest) << format << " " << value;
  }
}

TEST(TelegramField, FormatsOfPrintfAreRefused) {
  for (const std::string_view text :
       Split("s|n|%d|{}|*d|-5d|+|99999999999999999999d|5.99f|300text|uint12|uint72|uint0|"
             "float16|bcd9|bcd|2char|+word|+X|05text|2byte|int|decimal decimal",
             '|')) {
    const auto format = ParseFormat(text);
    ASSERT_FALSE(format) << text;
    EXPECT_FALSE(format.error().empty());
  }
}

TEST(TelegramChecksum, MatchesThePublishedValues) {
  const Bytes nine = ToBytes("123456789");
  const std::pair<const char*, std::uint32_t> kValues[] = {
      {"sum8", 0xDD},           {"sum16", 0x1DD},
      {"xor8", 0x31},           {"lrc", 0x23},
      {"crc16_modbus", 0x4B37}, {"crc16_ccitt", 0x29B1},
      {"crc16_xmodem", 0x31C3}, {"crc32", 0xCBF43926}};
  for (const auto& [name, value] : kValues) {
    const auto kind = std::ranges::find(ChecksumKinds(), name, &ChecksumKind::name);
    ASSERT_NE(kind, ChecksumKinds().end()) << name;
    EXPECT_EQ(kind->compute(nine), value) << name;
  }
  EXPECT_EQ(std::size(kValues), ChecksumKinds().size());
}

}  // namespace
}  // namespace baudgate::protocols::telegram
