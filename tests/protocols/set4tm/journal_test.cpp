// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/base/text.h"
#include "protocols/set4tm/archive/journals.h"
#include "tests/protocols/set4tm/support.h"

namespace baudgate::protocols::set4tm {
namespace {

const Journal& Numbered(std::uint8_t number) {
  for (const Journal& journal : Journals()) {
    if (journal.number == number) return journal;
  }
  ADD_FAILURE() << "no journal " << int{number};
  return Journals().front();
}

/// "E71 2002-09-02T12:30:31.000Z text".
std::vector<std::string> Told(const JournalReader& reader, std::uint8_t journal,
                              std::string_view record, std::string_view before = {}) {
  std::vector<std::string> told;
  const Bytes was = before.empty() ? Bytes() : Hex(before);
  for (const DeviceEvent& event : reader.EventsOf(Numbered(journal), Hex(record), was)) {
    std::string text = "E" + std::to_string(event.code);
    if (event.time) text += " " + FormatWallTime(WallTime(event.time->time)).substr(0, 19);
    told.push_back(text + (event.text.empty() ? "" : " " + event.text));
  }
  return told;
}

using Events = std::vector<std::string>;

// Reference, 8.1 and example 8: 15:30:31, Monday, 02.09.2002.
constexpr const char* kOpen = "31 30 15 01 02 09 02 00 00 00 00 00 00 00";
constexpr const char* kEnded = "31 30 15 01 02 09 02 12 32 15 01 02 09 02";

const JournalReader kMoscow{CivilZone::Parse("+03:00").value(), true};
const JournalReader kBerlin{CivilZone::Parse("+01:00 eu").value(), true};

TEST(Journal, AsksByTheShortFormWhereThatCanNameTheRecord) {
  EXPECT_EQ(ToHex(JournalRequest(Numbered(0x01), 0)), "04 10");
  EXPECT_EQ(ToHex(JournalRequest(Numbered(0x0A), 9)), "04 A9");
  EXPECT_EQ(ToHex(JournalRequest(Numbered(0x07), 19)), "09 07 13");
  EXPECT_EQ(ToHex(JournalRequest(Numbered(0x3C), 9)), "09 3C 09");
}

TEST(Journal, AnIntervalThatIsNotOverAndOneThatIs) {
  EXPECT_EQ(Told(kMoscow, 0x07, kOpen), Events{"E71 2002-09-02T12:30:31"});
  EXPECT_EQ(Told(kMoscow, 0x07, kEnded),
            (Events{"E71 2002-09-02T12:30:31", "E72 2002-09-02T12:32:12"}));
  ASSERT_TRUE(HasEnded(Hex(kOpen), Hex(kEnded)));
  EXPECT_EQ(Told(kMoscow, 0x07, kEnded, kOpen), Events{"E72 2002-09-02T12:32:12"});
}

TEST(Journal, EndedIsOnlyWhatHadNot) {
  EXPECT_FALSE(HasEnded(Hex(kEnded), Hex(kEnded)));
  EXPECT_FALSE(HasEnded(Hex(kOpen), Hex(kOpen)));
  EXPECT_FALSE(HasEnded(Hex(kOpen), Hex("32 30 15 01 02 09 02 12 32 15 01 02 09 02")));
  EXPECT_FALSE(HasEnded(Hex("31 30 15 01 02 09 02"), Hex("31 30 15 01 02 09 02")));
}

TEST(Journal, ACorrectionOfTheClockSaysByHowMuch) {
  EXPECT_EQ(Told(kMoscow, 0x02, kEnded), Events{"E22 2002-09-02T12:32:12 by +101 s"});
  EXPECT_EQ(Told(kMoscow, 0x02, "12 32 15 01 02 09 02 31 30 15 01 02 09 02"),
            Events{"E22 2002-09-02T12:30:31 by -101 s"});
}

TEST(Journal, OneTimeAndTheStatusWord) {
  EXPECT_EQ(Told(kMoscow, 0x05, "31 30 15 01 02 09 02"), Events{"E51 2002-09-02T12:30:31"});
  constexpr const char* kStatus = "31 30 15 01 02 09 02 00 00 11 00 00 00 80";
  EXPECT_EQ(Told(kMoscow, 0x3C, kStatus), Events{"E601 2002-09-02T12:30:31 E-01 E-05 E-40"});
  EXPECT_EQ(Told({kMoscow.zone, false}, 0x3C, kStatus),
            Events{"E601 2002-09-02T12:30:31 11 00 00 00 80"})
      << "flags of another type are not named";
}

TEST(Journal, WhatCanNotBeReadIsToldAsItIs) {
  EXPECT_EQ(Told(kMoscow, 0x05, "31 30 25 01 02 09 02"),
            Events{"E0 journal 05: 31 30 25 01 02 09 02"});
  EXPECT_EQ(Told(kMoscow, 0x05, "31 30 15 01 31 02 02"),
            Events{"E0 journal 05: 31 30 15 01 31 02 02"})
      << "there is no 31 February";
  EXPECT_EQ(Told(kMoscow, 0x07, "31 30 15 01 02 09 02 1A 32 15 01 02 09 02"),
            Events{"E0 journal 07: 31 30 15 01 02 09 02 1A 32 15 01 02 09 02"});
  EXPECT_EQ(Told(kMoscow, 0x05, "31 30"), Events{"E0 journal 05: 31 30"});
}

TEST(Journal, WithoutAZoneTheMetersTimeIsAText) {
  EXPECT_EQ(Told({}, 0x07, kEnded), (Events{"E71 2002-09-02T15:30:31 by its clock",
                                            "E72 2002-09-02T15:32:12 by its clock"}));
  EXPECT_EQ(Told({}, 0x02, kEnded), Events{"E22 2002-09-02T15:32:12 by its clock, by +101 s"});
}

/// 25.10.2026, Sunday: 02:00 to 03:00 comes twice; 29.03.2026: never.
TEST(Journal, BordersOfSummerTime) {
  EXPECT_EQ(Told(kBerlin, 0x05, "59 59 01 07 25 10 26"), Events{"E51 2026-10-24T23:59:59"});
  EXPECT_EQ(Told(kBerlin, 0x05, "00 30 02 07 25 10 26"),
            Events{"E51 2026-10-25T01:30:00 or an hour earlier"});
  EXPECT_EQ(Told(kBerlin, 0x05, "00 00 03 07 25 10 26"), Events{"E51 2026-10-25T02:00:00"});
  EXPECT_EQ(Told(kBerlin, 0x05, "59 59 01 07 29 03 26"), Events{"E51 2026-03-29T00:59:59"});
  EXPECT_EQ(Told(kBerlin, 0x05, "00 30 02 07 29 03 26"),
            Events{"E51 2026-03-29T01:30:00 its clock was not set to summer time"});
  EXPECT_EQ(Told(kBerlin, 0x05, "00 00 03 07 29 03 26"), Events{"E51 2026-03-29T01:00:00"});
  EXPECT_EQ(Told(kBerlin, 0x05, "59 59 23 04 31 12 26"), Events{"E51 2026-12-31T22:59:59"});
}

}  // namespace
}  // namespace baudgate::protocols::set4tm
