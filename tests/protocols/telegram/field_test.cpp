// Fields: a number is taken whole or not at all, and what is written reads back as the same.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/field.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "gateway/base/text.h"
#include "protocols/telegram/matching.h"

namespace baudgate::protocols::telegram {
namespace {

Format FormatOf(const std::string& text) {
  const auto format = ParseFormat(text);
  EXPECT_TRUE(format) << text << ": " << (format ? "" : format.error());
  return format ? *format : Format{};
}

struct TextRow {
  const char* format;
  const char* text;
  const char* value;  ///< empty: no number
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
    {"scientific", "12.5", ""},  // it has lost its exponent
    {"scientific", "1.25E+", ""},
    {"scientific", ".25E+01", ""},
    {"scientific", "1.E+01", ""},
    {"9scientific", "1.25E+0  ", ""},
    {"9scientific", "  1.25E+0", "1.25"},
    {"+.scientific", "+1.25", ""},
    {"+.scientific", "+1.25E03", ""},  // and the sign of its exponent
    {"+.scientific", "+1E+03", ""},
    {"+.scientific", "+1.25E-3", "0.00125"},
    {"scientific", "1E", ""},
    {"scientific", "E5", ""},
    {"scientific", "1E+999", ""},
    {"word", " kg ", "kg"},
    {"char", " ", " "},
};

TEST(TelegramField, ATextIsANumberWholeOrNotAtAll) {
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

TEST(TelegramField, BytesAreNumbersInEitherOrder) {
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
  const char* text;  ///< empty: it cannot be written so
};

TEST(TelegramField, AValueIsWrittenAsTheFormatSays) {
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

TEST(TelegramField, ATwinSaysTheNearestThatTheFieldCanSay) {
  const std::tuple<const char*, double, double> kRows[] = {
      {".2decimal", 24.96451, 24.96},       {"int16_be", 12.5, 13},
      {"decimal", 24.123456789012, 24.123}, {"decimal", 0.0012345678901, 0.00123457},
      {"decimal", 24.96451, 24.96451},      {"+7.decimal", 123.45678, 123.46}};
  for (const auto& [format, value, nearest] : kRows) {
    EXPECT_EQ(ToDouble(Nearest(FormatOf(format), value)), nearest) << format << " " << value;
  }
}

TEST(TelegramField, NoFormatOfPrintfIsOne) {
  for (const char* text : {"s",
                           "n",
                           "%d",
                           "{}",
                           "*d",
                           "-5d",
                           "+",
                           "99999999999999999999d",
                           "5.99f",
                           "300text",
                           "uint12",
                           "uint72",
                           "uint0",
                           "float16",
                           "bcd9",
                           "bcd",
                           "2char",
                           "+word",
                           "+X",
                           "05text",
                           "2byte",
                           "int",
                           "decimal decimal"}) {
    const auto format = ParseFormat(text);
    ASSERT_FALSE(format) << text;
    EXPECT_FALSE(format.error().empty());
  }
}

TEST(TelegramChecksum, HasThePrintedValues) {
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
