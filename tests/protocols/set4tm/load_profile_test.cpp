// The bytes of load profiles: golden ones of the manufacturer's description, seasons, powers.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/archive/load_profile.h"

#include <gtest/gtest.h>

#include "gateway/base/text.h"
#include "protocols/set4tm/twin/twin_archive.h"
#include "tests/protocols/set4tm/support.h"

namespace baudgate::protocols::set4tm {
namespace {

CivilZone Zone(std::string_view text) { return *CivilZone::Parse(text); }

std::string Shown(CivilZone::Utc utc) { return FormatWallTime(WallTime(utc)).substr(0, 16); }

/// MFR 2.4.4.1: 14 h of 14.08.02, summer, 2 min.
TEST(LoadProfile, HeaderOfTheDescription) {
  const Bytes bytes = Hex("14 14 08 02 00 02 34 37");
  const auto header = ParseLoadHeader(bytes);
  ASSERT_TRUE(header);
  EXPECT_EQ(Shown(UtcOf(*header, CivilZone())), "2002-08-14T14:00");
  EXPECT_TRUE(header->summer);
  EXPECT_EQ(header->minutes, 2U);
  EXPECT_EQ(header->slices(), 30U);
  Bytes again = BytesOf(*header);
  again[7] = 0x37;
  EXPECT_EQ(again, bytes);
}

TEST(LoadProfile, AHeaderNeedsItsSumAndADate) {
  EXPECT_FALSE(ParseLoadHeader(Hex("00 00 00 00 00 00 00 00"))) << "zeros have a good sum";
  EXPECT_FALSE(ParseLoadHeader(Hex("14 14 08 02 00 02 35 37")));
  EXPECT_FALSE(ParseLoadHeader(Hex("24 14 08 02 00 02 44 00"))) << "24 h";
  EXPECT_FALSE(ParseLoadHeader(Hex("14 31 02 02 00 1E 67 00"))) << "31.02.";
  EXPECT_FALSE(ParseLoadHeader(Hex("14 14 08 02 02 02 36 37"))) << "season 2";
  EXPECT_FALSE(ParseLoadHeader(Hex("14 14 08 02 00 07 39 37"))) << "7 min do not fill an hour";
  EXPECT_FALSE(ParseLoadHeader(Hex("14 14 08 02 00 02 34")));
}

/// MFR 2.4.3.5: 11:35 of 08.09.99, 0658.
TEST(LoadProfile, PointerOfTheDescription) {
  const auto pointer = ParseLoadPointer(Hex("35 11 08 09 99 06 58"));
  ASSERT_TRUE(pointer);
  EXPECT_EQ(pointer->minute, 35U);
  EXPECT_FALSE(pointer->wrapped);
  EXPECT_EQ(pointer->address, 0x0658U);
  EXPECT_EQ((LoadRing{65536, 5}.HourOf(*pointer)->address), 0x0658U - 64)
      << "the eighth slice of 5 min";
  EXPECT_EQ((LoadRing{65536, 30}.HourOf(*pointer)->address), 0x0658U - 16)
      << "within the second of 30 min";
  EXPECT_EQ((LoadRing{65536, 30}.HourOf(*pointer)->finished), 1U);
  EXPECT_EQ((LoadRing{65536, 30}.HourBehind(*pointer)->address), 0x0658U);
  EXPECT_EQ((LoadRing{0x0660, 30}.HourBehind(*pointer)->address), 0U) << "it does not fit in";
  EXPECT_TRUE(ParseLoadPointer(Hex("B5 11 08 09 99 06 58"))->wrapped);
  EXPECT_FALSE(ParseLoadPointer(Hex("65 11 08 09 99 06 58")));
  EXPECT_FALSE((LoadRing{65536, 30}.HourOf({.minute = 35, .address = 8})));
}

TEST(LoadProfile, AnHourThatDoesNotFitInStandsAtTheBegin) {
  const LoadRing half{65536, 30};
  EXPECT_EQ(half.Next(0), 24U);
  EXPECT_EQ(half.Next(2728 * 24), 2729U * 24);
  EXPECT_EQ(half.Next(2729 * 24), 0U) << "16 bytes are left";
  EXPECT_EQ((LoadRing{64, 60}.Next(48)), 0U);
  EXPECT_EQ((LoadRing{64, 60}.Next(32)), 48U) << "to the last byte";
}

TEST(LoadProfile, MeanPowersInKilowatts) {
  const LoadSlice slice = ParseLoadSlice(Hex("00 64 00 00 80 0A 7F FF"));
  const auto header = ParseLoadHeader(Hex("14 14 08 02 00 1E 50 00"));
  ASSERT_TRUE(header);
  Scale scale;
  scale.meter_constant = 5000;
  scale.voltage_ratio = 100;
  scale.current_ratio = 20;
  const PastRecord record = RecordOf(1, *header, 1, slice, Zone("+04:00"), scale);
  EXPECT_EQ(record.series, "load_1");
  EXPECT_EQ(record.span, 30min);
  EXPECT_EQ(Shown(CivilZone::Utc(std::chrono::duration_cast<std::chrono::seconds>(record.begin))),
            "2002-08-14T10:30");
  ASSERT_EQ(record.values.size(), 4U);
  EXPECT_EQ(record.values[0].name, "active_import");
  EXPECT_EQ(record.values[0].value, Value(40.0)) << "100 / 10000 kWh in half an hour, times 2000";
  EXPECT_TRUE(IsGood(record.values[0].quality));
  EXPECT_EQ(record.values[1].value, Value(0.0));
  EXPECT_EQ(record.values[2].value, Value(4.0));
  EXPECT_TRUE(IsUncertain(record.values[2].quality)) << "incomplete";
  EXPECT_TRUE(IsGood(record.values[3].quality));
  const PastRecord unknown = RecordOf(1, *header, 0, slice, CivilZone(), Scale());
  EXPECT_TRUE(IsBad(unknown.values[0].quality));
  EXPECT_EQ(unknown.values[0].value, Value());
}

/// 2026-10-25: 02:00 comes twice.
TEST(LoadProfile, TheSeasonTellsTwoHoursApart) {
  const CivilZone zone = Zone("+01:00 eu");
  const auto begin = std::chrono::local_days(std::chrono::year(2026) / 10 / 25) + 2h;
  EXPECT_EQ(Shown(UtcOf({begin, true, 30}, zone)), "2026-10-25T00:00");
  EXPECT_EQ(Shown(UtcOf({begin, false, 30}, zone)), "2026-10-25T01:00");
}

TEST(LoadProfile, ATwinSaysWhatTheDescriptionSays) {
  const CivilZone::Utc begin = std::chrono::sys_days(std::chrono::year(2026) / 11 / 1);
  TwinLoad twin(Zone("+03:00"), 30, 65536, begin);
  twin.Advance(begin + 75min);
  EXPECT_EQ(ToHex(twin.Pointer()), "00 04 01 11 26 00 20") << "04:00 local, behind its header";
  twin.Advance(begin + 90min);
  EXPECT_EQ(ToHex(twin.Pointer()), "30 04 01 11 26 00 28");
  const auto header = ParseLoadHeader(*twin.Memory(24, 8));
  ASSERT_TRUE(header);
  EXPECT_EQ(UtcOf(*header, Zone("+03:00")), begin + 1h);
}

TEST(LoadPlace, IsTheSameAsText) {
  const LoadPlace place{0x0658, Hex("14 14 08 02 00 02 34 37"), 12};
  EXPECT_EQ(place.Text(), "0658:1414080200023437:12");
  const auto again = LoadPlace::Parse(place.Text());
  ASSERT_TRUE(again);
  EXPECT_EQ(again->Text(), place.Text());
  for (const char* text : {"", "0658", "0658:1414080200023437", "0658:1414080200023437:31",
                           "0658:1414080200023537:1", "x:1414080200023437:1", "0658::1"}) {
    EXPECT_FALSE(LoadPlace::Parse(text)) << text;
  }
}

}  // namespace
}  // namespace baudgate::protocols::set4tm
