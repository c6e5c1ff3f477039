// The clock of a meter as a number.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <string>

#include "gateway/base/text.h"
#include "protocols/set4tm/meter/points.h"
#include "protocols/set4tm/meter/values.h"

namespace baudgate::protocols::set4tm {
namespace {

Scale In(std::string_view zone) {
  Scale scale;
  if (!zone.empty()) scale.zone = CivilZone::Parse(zone).value();
  return scale;
}

Decoded ReadClock(std::string_view data, std::string_view zone,
                  const char* read = "04 00 clock@0") {
  return DecodeField(ParseField(read).value(), ParseHex(data).value(), In(zone));
}

/// "2002-09-02T12:30:31".
std::string ShownUtc(const Decoded& decoded) {
  EXPECT_EQ(decoded.quality, Quality::good);
  const auto* seconds = std::get_if<std::uint64_t>(&decoded.value);
  if (seconds == nullptr) return "none";
  return FormatWallTime(WallTime(std::chrono::seconds(*seconds))).substr(0, 19);
}

// Reference, example 8.
constexpr const char* kSummer = "31 30 15 01 02 09 02 00";

TEST(MeterClock, IsUtcByItsZone) {
  EXPECT_EQ(ShownUtc(ReadClock(kSummer, "+03:00")), "2002-09-02T12:30:31");
  EXPECT_EQ(ShownUtc(ReadClock(kSummer, "+01:00 eu")), "2002-09-02T13:30:31");
  EXPECT_EQ(ShownUtc(ReadClock(kSummer, "+00:00", "09 00 00 clock@0")), "2002-09-02T15:30:31");
}

TEST(MeterClock, TellsTheTwoHoursOfAutumnApart) {
  EXPECT_EQ(ShownUtc(ReadClock("00 30 02 07 25 10 26 00", "+01:00 eu")), "2026-10-25T00:30:00");
  EXPECT_EQ(ShownUtc(ReadClock("00 30 02 07 25 10 26 01", "+01:00 eu")), "2026-10-25T01:30:00");
}

TEST(MeterClock, WithoutAZoneIsNoNumber) {
  const Decoded decoded = ReadClock(kSummer, "");
  EXPECT_FALSE(HasValue(decoded.value));
  EXPECT_EQ(decoded.quality, (Quality{Quality::bad_configuration, Reason::not_fitted}));
}

TEST(MeterClock, ThatCanNotBeIsNoNumber) {
  for (const char* data : {"31 30 25 01 02 09 02 00", "31 30 15 01 31 02 02 00",
                           "00 00 00 00 00 00 00 00", "31 30 15 01 02 09"}) {
    const Decoded decoded = ReadClock(data, "+03:00");
    EXPECT_FALSE(HasValue(decoded.value)) << data;
    EXPECT_TRUE(IsBad(decoded.quality)) << data;
  }
}

TEST(MeterClock, ComesBackAsItWasWritten) {
  const Field field = ParseField("04 00 clock@0").value();
  for (const char* zone : {"+03:00", "+01:00 eu", "-05:30"}) {
    for (std::uint64_t seconds = 1'790'000'000; seconds < 1'822'000'000; seconds += 1801) {
      Bytes data(8);
      ASSERT_TRUE(EncodeField(field, Value(seconds), In(zone), data));
      ASSERT_EQ(DecodeField(field, data, In(zone)).value, Value(seconds)) << zone;
    }
  }
}

TEST(MeterClock, StandsInTheAnswerToItsOwnRequestOnly) {
  EXPECT_FALSE(ParseField("09 01 09 clock@0"));
  EXPECT_FALSE(ParseField("04 00 clock@1"));
}

}  // namespace
}  // namespace baudgate::protocols::set4tm
