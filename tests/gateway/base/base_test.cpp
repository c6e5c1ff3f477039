// Tests of text, number, duration and checksum tools.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

#include "gateway/base/bytes.h"
#include "gateway/base/decimal.h"
#include "gateway/base/outcome.h"
#include "gateway/base/shown.h"
#include "gateway/base/text.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"

namespace baudgate {
namespace {

TEST(Hex, RoundTripGivesTheSameBytes) {
  const Bytes bytes = {0x3E, 0x00, 0xFF, 0x0A};
  EXPECT_EQ(ToHex(bytes), "3E 00 FF 0A");
  EXPECT_EQ(ParseHex("3E 00 FF 0A"), bytes);
  EXPECT_EQ(ParseHex("3e00ff0a"), bytes);
  EXPECT_EQ(ToHex({}), "");
  EXPECT_EQ(ParseHex(""), Bytes());
}

TEST(Hex, RefusesTextThatIsNotHex) {
  for (const char* text : {"3", "3E 0", "3E 0 0", "G0", "0x3E", "3E,00", "3 E"}) {
    EXPECT_FALSE(ParseHex(text)) << text;
  }
}

TEST(Integers, ParseOnlyAWholeText) {
  EXPECT_EQ(ParseInteger<int>("-17"), -17);
  EXPECT_EQ(ParseInteger<std::uint8_t>("255"), 255);
  EXPECT_EQ(ParseInteger<std::uint16_t>("FFFF", 16), 65535);
  for (const char* text : {"", "+1", " 1", "1 ", "1x", "256", "-1"}) {
    EXPECT_FALSE(ParseInteger<std::uint8_t>(text)) << text;
  }
}

TEST(Decimals, ParseOnlyPlainDecimals) {
  EXPECT_EQ(ParseDecimal("+1.25"), 1.25);
  EXPECT_EQ(ParseDecimal("-0.5"), -0.5);
  EXPECT_EQ(ParseDecimal("007"), 7.0);
  for (const char* text :
       {"", "+", "-", ".", "+-1", "--1", "1e3", "inf", "nan", "1,5", "1.2.3", "1-", " 1", "0x10"}) {
    EXPECT_FALSE(ParseDecimal(text)) << text;
  }
  EXPECT_FALSE(ParseDecimal(std::string(400, '9'))) << "beyond any double";
}

TEST(Decimals, FormatReadsBackExactly) {
  std::mt19937_64 random(5);
  for (int i = 0; i < 2000; ++i) {
    const double value = std::bit_cast<double>(random());
    if (!std::isfinite(value)) continue;
    const std::string text = FormatNumber(value);
    double back = 0;
    std::from_chars(text.data(), text.data() + text.size(), back);
    EXPECT_EQ(back, value) << text;
  }
  EXPECT_EQ(FormatNumber(0.1), "0.1");
  EXPECT_EQ(FormatNumber(std::nan("")), "nan");
}

TEST(Durations, ParseOnlyNumbersWithAUnit) {
  EXPECT_EQ(*ParseDuration("250ms"), 250ms);
  EXPECT_EQ(*ParseDuration("1.5h"), 90min);
  EXPECT_EQ(*ParseDuration("5 min"), 5min);
  EXPECT_EQ(*ParseDuration("20us"), 20us);
  EXPECT_EQ(*ParseDuration("0"), 0s);
  EXPECT_EQ(ParseDuration("1,5s").error(), "'1,5s' has a decimal comma; write 1.5s");
  for (const char* text :
       {"", "5", "ms", "-5ms", "5 m", "5sec", "1e3s", "1.2.3s", "nan s", "99999999999d", "5ms5"}) {
    const auto duration = ParseDuration(text);
    EXPECT_FALSE(duration) << text;
    if (!duration) {
      EXPECT_FALSE(duration.error().empty());
    }
  }
}

TEST(Durations, FormatReadsBackToTheSameValue) {
  std::mt19937_64 random(11);
  std::vector<Duration> all = {0s, 1ns, 999ns, 1us, 1234567us, 100'000s, 1'000'000s, 100'000h};
  for (int i = 0; i < 5000; ++i) {
    const auto scale =
        static_cast<std::int64_t>(std::pow(10.0, static_cast<double>(random() % 13)));
    all.emplace_back(static_cast<std::int64_t>(random() % 100'000) * scale / 1000);
  }
  for (const Duration duration : all) {
    const std::string text = FormatDuration(duration);
    const auto back = ParseDuration(text);
    ASSERT_TRUE(back) << text << ": " << back.error();
    EXPECT_EQ(back->count(), duration.count()) << text;
  }
  EXPECT_EQ(FormatDuration(250ms), "250ms");
  EXPECT_EQ(FormatDuration(1500ms), "1.5s");
  EXPECT_EQ(FormatDuration(60s), "1min");
}

TEST(WallTimes, AreShownInIsoFormWithMilliseconds) {
  EXPECT_EQ(FormatWallTime(WallTime(1s + 250ms)), "1970-01-01T00:00:01.250Z");
  EXPECT_EQ(FormatWallTime(WallTime(std::chrono::sys_days(std::chrono::year(2024) / 2 / 29)) + 23h +
                           59min + 59s + 999'999us),
            "2024-02-29T23:59:59.999Z");
}

TEST(Checksums, GiveThePublishedTestValues) {
  const Bytes digits = ToBytes("123456789");
  EXPECT_EQ(Crc16(digits), 0x4B37);
  EXPECT_EQ(Crc16({}), 0xFFFF);
  Bytes frame = {0xC8, 0x08, 0x1B, 0x00, 0x11};
  AppendCrc16(frame);
  EXPECT_EQ(ToHex(frame), "C8 08 1B 00 11 77 BB");
  EXPECT_TRUE(EndsInCrc16(frame));
  ++frame[3];
  EXPECT_FALSE(EndsInCrc16(frame));
  EXPECT_FALSE(EndsInCrc16(Bytes{0xFF, 0xFF})) << "a CRC over nothing";
  EXPECT_EQ(Sum8(digits), 0xDD);
  EXPECT_EQ(Xor8(digits), 0x31);
  EXPECT_EQ(Sum8(Bytes{0xFF, 0x02}), 0x01);
  EXPECT_EQ(Xor8({}), 0x00);
}

TEST(Reader, ReadsNothingBeyondTheEnd) {
  const Bytes bytes = {0x01, 0x02, 0x03, 0x04, 0x05};
  const ByteReader reader(bytes);
  EXPECT_EQ(reader.U8(4), 0x05);
  EXPECT_EQ(reader.U16Be(0), 0x0102);
  EXPECT_EQ(reader.U16Le(0), 0x0201);
  EXPECT_EQ(reader.U32Be(1), 0x02030405U);
  EXPECT_EQ(reader.U32Le(1), 0x05040302U);
  constexpr auto kHuge = std::numeric_limits<std::size_t>::max();
  for (const std::size_t at : {std::size_t{5}, std::size_t{6}, kHuge - 1, kHuge}) {
    EXPECT_FALSE(reader.U8(at));
    EXPECT_FALSE(reader.U16Be(at));
    EXPECT_FALSE(reader.U32Le(at));
    EXPECT_FALSE(reader.F32Le(at));
    EXPECT_FALSE(reader.Slice(at, 1));
  }
  EXPECT_FALSE(reader.U16Le(4));
  EXPECT_FALSE(reader.U32Be(2));
  EXPECT_FALSE(reader.Slice(1, kHuge)) << "offset and count may not wrap round";
  EXPECT_TRUE(reader.Slice(5, 0));
  EXPECT_FALSE(ByteReader({}).U8(0));
}

TEST(Reader, ReadsFloats) {
  EXPECT_EQ(ByteReader(Bytes{0x00, 0x00, 0x80, 0x3F}).F32Le(0), 1.0F);
  EXPECT_TRUE(std::isnan(*ByteReader(Bytes{0x00, 0x00, 0xC0, 0x7F}).F32Le(0)));
}

TEST(Text, SplitsTrimsAndEscapes) {
  EXPECT_EQ(Split("a,,b", ',').size(), 3U);
  EXPECT_EQ(Split("", ',').size(), 1U);
  EXPECT_EQ(Trim(" \t a b\r\n"), "a b");
  EXPECT_EQ(Trim(" \r\n"), "");
  EXPECT_EQ(Printable(Bytes{'A', '\r', '\n', 0x00, 0xE9}), "A\\r\\n\\x00\\xE9");
}

TEST(Text, FindsAndReplacesInvalidUtf8) {
  EXPECT_EQ(FirstNotUtf8("A \xC2\xB0 \xE2\x82\xAC \xF0\x9F\x98\x80"), std::string::npos);
  // In this order: a lone continuation byte, two overlong forms, a surrogate, a code point beyond
  // U+10FFFF, a sequence that is cut short, a byte that UTF-8 never uses.
  for (const std::string_view bad : {"\x80", "\xC0\x80", "\xE0\x9F\x80", "\xED\xA0\x80",
                                     "\xF4\x90\x80\x80", "\xE2\x82", "\xFF"}) {
    EXPECT_EQ(FirstNotUtf8("ab" + std::string(bad)), 2U) << ToHex(ToBytes(bad));
  }
  EXPECT_EQ(FirstNotUtf8(std::string_view("a\0b", 3)), 1U);
  EXPECT_EQ(Harmless("A\xFF\x80\xC3("),
            "A?"
            "?"
            "?(");
  EXPECT_EQ(Harmless("\x1B[2J \xC2\x9B \xC2\xB0"), "?[2J ? \xC2\xB0");
}

TEST(Values, ConvertToNumberAndText) {
  EXPECT_EQ(ToDouble(true), 1.0);
  EXPECT_TRUE(std::isnan(ToDouble(std::string("5"))));
  EXPECT_TRUE(std::isnan(ToDouble({})));
  EXPECT_EQ(ToText(std::numeric_limits<std::uint64_t>::max()), "18446744073709551615");
  EXPECT_EQ(ToText(0.52), "0.52");
  EXPECT_EQ(ToText({}), "");
}

TEST(Shown, NumbersHaveFourDigitsOrTheGivenDecimals) {
  EXPECT_EQ(ShownNumber(0), "0.000");
  EXPECT_EQ(ShownNumber(-0.0), "0.000");
  EXPECT_EQ(ShownNumber(0.5), "0.5000");
  EXPECT_EQ(ShownNumber(-12.25), "-12.25");
  EXPECT_EQ(ShownNumber(9.9996), "10.00");
  EXPECT_EQ(ShownNumber(400), "400.0");
  EXPECT_EQ(ShownNumber(1234.56), "1235");
  EXPECT_EQ(ShownNumber(999999.9), "1000000");
  EXPECT_EQ(ShownNumber(0.0001), "0.0001000");
  EXPECT_EQ(ShownNumber(0.00001234), "1.234e-05");
  EXPECT_EQ(ShownNumber(1e15), "1.000e+15");
  EXPECT_EQ(ShownNumber(999999999999999), "999999999999999");
  EXPECT_EQ(ShownNumber(12.256, 2), "12.26");
  EXPECT_EQ(ShownNumber(-0.001, 2), "0.00");
  EXPECT_EQ(ShownNumber(0.35, 1), "0.4") << "halves are rounded in decimal, away from zero";
  EXPECT_EQ(ShownNumber(static_cast<double>(0.35F), 1), "0.4");
  EXPECT_EQ(ShownNumber(-0.35, 1), "-0.4");
  EXPECT_EQ(ShownNumber(2.5, 0), "3");
  EXPECT_EQ(ShownNumber(1.005, 2), "1.01");
  EXPECT_EQ(ShownNumber(9.9995), "10.00");
  EXPECT_EQ(ShownNumber(0.99995), "1.000");
  EXPECT_EQ(ShownNumber(99999999999999.5, 9), "99999999999999.500000000");
  EXPECT_EQ(ShownNumber(3.4e38, 2), "3.400e+38");
  EXPECT_EQ(ShownNumber(std::numeric_limits<double>::quiet_NaN()), "");
  EXPECT_EQ(ShownNumber(std::numeric_limits<double>::infinity(), 1), "");
}

TEST(Csv, EscapesFormulasAndChangesNoOtherCell) {
  const std::pair<const char*, const char*> rows[] = {
      {"=1+1", "'=1+1"},        {"@SUM(A1)", "'@SUM(A1)"},
      {"+A1", "'+A1"},          {"-cmd|' /C x'!A0", "'-cmd|' /C x'!A0"},
      {"-5+A1", "'-5+A1"},      {"\t=1", "'\t=1"},
      {"-5.2 kW", "-5.2 kW"},   {"-", "-"},
      {"- 7", "- 7"},           {"a\tb", "a\tb"},
      {"-1.5e-05", "-1.5e-05"}, {"+2E+3", "+2E+3"},
      {"-1e400", "-1e400"},     {"-inf", "'-inf"},
      {"a\nb", "\"a\nb\""},     {"a\"b", "\"a\"\"b\""},
      {"1,5", "\"1,5\""},       {"", ""},
  };
  for (const auto& [text, cell] : rows) EXPECT_EQ(CsvCell(text), cell);
  const std::string cells[] = {"", "=1+1", "-5", "a,b", ""};
  EXPECT_EQ(CsvLine(cells), ",'=1+1,-5,\"a,b\",\r\n");
}

constexpr std::uint64_t kMost = std::numeric_limits<std::uint64_t>::max();
constexpr std::int64_t kLeast = std::numeric_limits<std::int64_t>::min();

Decimal Number(std::string_view text) { return Decimal::Parse(text).value_or(-999); }

TEST(Decimals, AreReadAndWritten) {
  struct Case {
    const char* text;
    const char* shown;
  };
  for (const auto& [text, shown] : {Case{"0", "0"},
                                    {"-0.0", "0"},
                                    {"+7", "7"},
                                    {"007", "7"},
                                    {"100", "100"},
                                    {"-12.50", "-12.5"},
                                    {"0.001", "0.001"},
                                    {".5", "0.5"},
                                    {"18446744073709551615", "18446744073709551615"},
                                    {"-9223372036854775808", "-9223372036854775808"},
                                    {"9007199254740993", "9007199254740993"},
                                    {"0.1234567890123456789", "0.1234567890123456789"},
                                    {"123456789012345678901", "123456789012345678900"},
                                    {"1e3", "1000"},
                                    {"-1.5E-3", "-0.0015"},
                                    {"9.91e+37", "991e35"},
                                    {"0xFFFF", "65535"},
                                    {"0xffffffffffffffff", "18446744073709551615"}}) {
    const auto number = Decimal::Parse(text);
    ASSERT_TRUE(number) << text;
    EXPECT_EQ(number->ToText(), shown) << text;
  }
  for (const char* text : {"", "-", ".", "e3", "1e", "1e+-3", "1e400", "1e3e3", "1,5", "0x",
                           "0x1FFFFFFFFFFFFFFFF", "nan", "1 "}) {
    EXPECT_FALSE(Decimal::Parse(text)) << text;
  }
}

TEST(Decimals, AreTheShortestDecimalOfADouble) {
  EXPECT_EQ(Decimal(0.57), Number("0.57"));
  EXPECT_EQ(Decimal(-0.0), 0);
  EXPECT_EQ(Decimal(1e300).ToDouble(), 1e300);
  EXPECT_EQ(Decimal(5e-324).ToDouble(), 5e-324);
  EXPECT_EQ(Decimal(400.0), 400);
  for (const double number : {0.1, 1.0 / 3, 227.99999999999997, 1.7976931348623157e308}) {
    EXPECT_EQ(Decimal(number).ToDouble(), number);
  }
}

TEST(Decimals, MultiplyExactlyWithinTheirDigits) {
  EXPECT_EQ((Decimal(0.57) * 400).ToDouble(), 228.0);
  EXPECT_EQ(Number("0.1") * 3, Number("0.3"));
  EXPECT_EQ(Decimal(kMost) * 1, kMost);
  EXPECT_EQ(Decimal(kLeast) * Number("-0.1"), Number("922337203685477580.8"));
  EXPECT_EQ(Number("1152921504606846977") * 10, Number("11529215046068469770"));
  EXPECT_EQ((Decimal(kMost) * kMost).ToDouble(), 3.4028236692093846e38);
}

TEST(Decimals, AddAndCompareExactly) {
  EXPECT_EQ(Decimal(kMost) + kLeast, (std::uint64_t{1} << 63U) - 1);
  EXPECT_EQ(Decimal(kMost) - kMost, 0);
  EXPECT_EQ(Number("0.1") + Number("0.2"), Number("0.3"));
  EXPECT_EQ(Decimal(1e300) + 1, Decimal(1e300));
  EXPECT_EQ(Number("18446744073709551615") + Number("0.25"), kMost) << "20 digits, and no more";
  EXPECT_LT(Decimal(kMost - 1), kMost);
  EXPECT_GT(Number("9007199254740993"), std::int64_t{9007199254740992});
  EXPECT_LT(Decimal(-1), 1);
  EXPECT_LT(Decimal(-2), -1);
  EXPECT_LT(Number("0.0000001"), Number("0.1"));
  EXPECT_GT(Decimal(1e300), Decimal(1e-300));
}

TEST(Decimals, DivideWithMoreDigitsThanADouble) {
  EXPECT_EQ(Decimal(228) / 400, Number("0.57"));
  EXPECT_EQ((Decimal(1) / 3).ToDouble(), 1.0 / 3);
  EXPECT_EQ((Decimal(2) / -3).ToDouble(), -2.0 / 3);
  EXPECT_EQ(Number("11529215046068469770") / 10, Number("1152921504606846977"));
  EXPECT_EQ(Decimal(0) / 7, 0);
}

TEST(Decimals, RoundHalvesAwayFromZero) {
  EXPECT_EQ(Number("0.5").ToInt64(), 1);
  EXPECT_EQ(Number("-0.5").ToInt64(), -1);
  EXPECT_EQ(Number("0.49999").ToInt64(), 0);
  EXPECT_EQ(Number("2.5").ToUint64(), 3U);
  EXPECT_EQ(Number("-0.4").ToUint64(), 0U);
  EXPECT_EQ(Number("-0.5").ToUint64(), std::nullopt);
  EXPECT_EQ(Decimal(kLeast).ToInt64(), kLeast);
  EXPECT_EQ((Decimal(kLeast) - 1).ToInt64(), std::nullopt);
  EXPECT_EQ(Decimal(kMost).ToUint64(), kMost);
  EXPECT_EQ(Decimal(kMost).ToInt64(), std::nullopt);
  EXPECT_EQ(Decimal(1e300).ToUint64(), std::nullopt);
  EXPECT_EQ(Decimal(1e-300).ToUint64(), 0U);
}

TEST(Decimals, AreMultiplesOfAStep) {
  EXPECT_TRUE(Number("0.3").IsMultipleOf(Number("0.1")));
  EXPECT_TRUE(Decimal(20).IsMultipleOf(10));
  EXPECT_TRUE(Decimal(0).IsMultipleOf(7));
  EXPECT_TRUE(Decimal(1e300).IsMultipleOf(Number("0.1")));
  EXPECT_TRUE(Decimal(1000).IsMultipleOf(8));
  EXPECT_FALSE(Decimal(25).IsMultipleOf(10));
  EXPECT_FALSE(Number("0.25").IsMultipleOf(Number("0.1")));
  EXPECT_FALSE(Number("9007199254740993").IsMultipleOf(2));
  EXPECT_TRUE(Number("9007199254740994").IsMultipleOf(2));
  EXPECT_FALSE(Decimal(5).IsMultipleOf(0));
}

TEST(Decimals, ConvertToAndFromValues) {
  EXPECT_EQ(Decimal(kMost).ToValue(), Value(kMost));
  EXPECT_EQ(Decimal(-5).ToValue(), Value(std::int64_t{-5}));
  EXPECT_EQ(Number("0.57").ToValue(), Value(0.57));
  EXPECT_EQ(Decimal::Of(Value(true)), Decimal(1));
  EXPECT_EQ(Decimal::Of(Value(std::string("5"))), std::nullopt);
  EXPECT_EQ(Decimal::Of(Value(std::numeric_limits<double>::quiet_NaN())), std::nullopt);
  EXPECT_EQ(Decimal::Of(Value()), std::nullopt);
}

TEST(Since, ReadsWholeAndShortenedTimes) {
  const WallTime day = std::chrono::sys_days(std::chrono::year(2026) / 11 / 21);
  EXPECT_EQ(ParseWallTime("2026-11-21").value(), day);
  EXPECT_EQ(ParseWallTime("2026-11-21T01:14").value(), day + 1h + 14min);
  EXPECT_EQ(ParseWallTime("2026-11-21 01:14:31Z").value(), day + 1h + 14min + 31s);
  const WallTime whole = day + 1h + 14min + 31s + 250ms;
  EXPECT_EQ(ParseWallTime(FormatWallTime(whole)).value(), whole);
}

TEST(Since, RefusesTextThatIsNoTime) {
  for (const char* text :
       {"", "Z", "2026", "2026-11", "2026-13-01", "2026-02-30", "2026-11-21T", "2026-11-21T01",
        "2026-11-21T24:00", "2026-11-21T01:60", "2026-11-21T01:14:31.2", "2026-11-21x",
        "-026-11-21", "2026-11-21T01:14:31.250ZZ", "1969-12-31", "2026-+1-21"}) {
    EXPECT_FALSE(ParseWallTime(text)) << text;
  }
}

TEST(Since, ASpanIsBeforeNow) {
  const WallTime now = WallTime(100h);
  EXPECT_EQ(ParseSince("2h", now).value(), now - 2h);
  EXPECT_EQ(ParseSince("1970-01-02", now).value(), WallTime(24h));
  EXPECT_FALSE(ParseSince("yesterday", now));
  EXPECT_EQ(ParseSince("99999999d", now).error(), "'99999999d' is too long");
  EXPECT_EQ(ParseSince("1,5h", now).error(), "'1,5h' has a decimal comma; write 1.5h");
}

TEST(WriteResult, EachPointOfACommandHasItsOwnResult) {
  const WriteResult whole{.end = WriteEnd::refused, .reason = "no", .written = 1, .tried = 3};
  EXPECT_EQ(ResultOf(whole, 0).end, WriteEnd::ok);
  EXPECT_EQ(ResultOf(whole, 1).end, WriteEnd::refused);
  EXPECT_EQ(ResultOf(whole, 2).end, WriteEnd::refused) << "in the same exchange";
  EXPECT_EQ(ResultOf(whole, 3).end, WriteEnd::not_sent);
  EXPECT_EQ(ResultOf({.end = WriteEnd::denied}, 5).end, WriteEnd::denied);
}

constexpr Instant kNow{1h};

TEST(Deadline, TheSoonestOfSeveralDeadlinesIsFound) {
  EXPECT_EQ(Soonest({kNow + 2s, std::nullopt, kNow + 1s}), kNow + 1s);
  EXPECT_EQ(Soonest({std::nullopt, std::nullopt}), std::nullopt);
}

TEST(Deadline, HasPassedAtItsExactTimeAndNeverWhenItIsEmpty) {
  EXPECT_TRUE(HasCome(kNow, kNow));
  EXPECT_FALSE(HasCome(kNow + 1ns, kNow));
  EXPECT_FALSE(HasCome(std::nullopt, kNow));
}

}  // namespace
}  // namespace baudgate
