// Tests the journals of a SET-4TM meter: records, and sessions that read them.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <memory>
#include <random>
#include <set>

#include "gateway/base/text.h"
#include "protocols/set4tm/archive/journals.h"
#include "protocols/set4tm/meter/codec.h"
#include "protocols/set4tm/twin/twin_archive.h"
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

/// Returns the events of a record as text. Example: "E71 2002-09-02T12:30:31.000Z text".
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

// SET-4TM reference, 8.1 and example 8: 15:30:31, Monday, 02.09.2002.
constexpr const char* kOpen = "31 30 15 01 02 09 02 00 00 00 00 00 00 00";
constexpr const char* kEnded = "31 30 15 01 02 09 02 12 32 15 01 02 09 02";

const JournalReader kMoscow{CivilZone::Parse("+03:00").value(), true};
const JournalReader kBerlin{CivilZone::Parse("+01:00 eu").value(), true};

TEST(Journal, UsesTheShortRequestWherePossible) {
  EXPECT_EQ(ToHex(JournalRequest(Numbered(0x01), 0)), "04 10");
  EXPECT_EQ(ToHex(JournalRequest(Numbered(0x0A), 9)), "04 A9");
  EXPECT_EQ(ToHex(JournalRequest(Numbered(0x07), 19)), "09 07 13");
  EXPECT_EQ(ToHex(JournalRequest(Numbered(0x3C), 9)), "09 3C 09");
}

TEST(Journal, OpenAndEndedIntervalsAreDecoded) {
  EXPECT_EQ(Told(kMoscow, 0x07, kOpen), Events{"E71 2002-09-02T12:30:31"});
  EXPECT_EQ(Told(kMoscow, 0x07, kEnded),
            (Events{"E71 2002-09-02T12:30:31", "E72 2002-09-02T12:32:12"}));
  ASSERT_TRUE(HasEnded(Hex(kOpen), Hex(kEnded)));
  EXPECT_EQ(Told(kMoscow, 0x07, kEnded, kOpen), Events{"E72 2002-09-02T12:32:12"});
}

TEST(Journal, HasEndedNeedsAnEarlierOpenInterval) {
  EXPECT_FALSE(HasEnded(Hex(kEnded), Hex(kEnded)));
  EXPECT_FALSE(HasEnded(Hex(kOpen), Hex(kOpen)));
  EXPECT_FALSE(HasEnded(Hex(kOpen), Hex("32 30 15 01 02 09 02 12 32 15 01 02 09 02")));
  EXPECT_FALSE(HasEnded(Hex("31 30 15 01 02 09 02"), Hex("31 30 15 01 02 09 02")));
}

TEST(Journal, AClockCorrectionIncludesItsAmount) {
  EXPECT_EQ(Told(kMoscow, 0x02, kEnded), Events{"E22 2002-09-02T12:32:12 by +101 s"});
  EXPECT_EQ(Told(kMoscow, 0x02, "12 32 15 01 02 09 02 31 30 15 01 02 09 02"),
            Events{"E22 2002-09-02T12:30:31 by -101 s"});
}

TEST(Journal, SingleTimesAndStatusWordsAreDecoded) {
  EXPECT_EQ(Told(kMoscow, 0x05, "31 30 15 01 02 09 02"), Events{"E51 2002-09-02T12:30:31"});
  constexpr const char* kStatus = "31 30 15 01 02 09 02 00 00 11 00 00 00 80";
  EXPECT_EQ(Told(kMoscow, 0x3C, kStatus), Events{"E601 2002-09-02T12:30:31 E-01 E-05 E-40"});
  EXPECT_EQ(Told({kMoscow.zone, false}, 0x3C, kStatus),
            Events{"E601 2002-09-02T12:30:31 11 00 00 00 80"})
      << "flags of another type are not named";
}

TEST(Journal, AnUndecodableRecordIsReportedInHex) {
  EXPECT_EQ(Told(kMoscow, 0x05, "31 30 25 01 02 09 02"),
            Events{"E0 journal 05: 31 30 25 01 02 09 02"});
  EXPECT_EQ(Told(kMoscow, 0x05, "31 30 15 01 31 02 02"),
            Events{"E0 journal 05: 31 30 15 01 31 02 02"})
      << "there is no 31 February";
  EXPECT_EQ(Told(kMoscow, 0x07, "31 30 15 01 02 09 02 1A 32 15 01 02 09 02"),
            Events{"E0 journal 07: 31 30 15 01 02 09 02 1A 32 15 01 02 09 02"});
  EXPECT_EQ(Told(kMoscow, 0x05, "31 30"), Events{"E0 journal 05: 31 30"});
}

TEST(Journal, WithoutAZoneTheTimeOfTheMeterIsAText) {
  EXPECT_EQ(Told({}, 0x07, kEnded), (Events{"E71 2002-09-02T15:30:31 by its clock",
                                            "E72 2002-09-02T15:32:12 by its clock"}));
  EXPECT_EQ(Told({}, 0x02, kEnded), Events{"E22 2002-09-02T15:32:12 by its clock, by +101 s"});
}

/// 25.10.2026, Sunday: 02:00 to 03:00 comes twice. 29.03.2026: 02:00 to 03:00 does not exist.
TEST(Journal, BeginAndEndOfSummerTimeAreDecoded) {
  EXPECT_EQ(Told(kBerlin, 0x05, "59 59 01 07 25 10 26"), Events{"E51 2026-10-24T23:59:59"});
  EXPECT_EQ(Told(kBerlin, 0x05, "00 30 02 07 25 10 26"),
            Events{"E51 2026-10-25T01:30:00 the true time may be an hour earlier"});
  EXPECT_EQ(Told(kBerlin, 0x05, "00 00 03 07 25 10 26"), Events{"E51 2026-10-25T02:00:00"});
  EXPECT_EQ(Told(kBerlin, 0x05, "59 59 01 07 29 03 26"), Events{"E51 2026-03-29T00:59:59"});
  EXPECT_EQ(Told(kBerlin, 0x05, "00 30 02 07 29 03 26"),
            Events{"E51 2026-03-29T01:30:00 the meter's clock was not set to summer time"});
  EXPECT_EQ(Told(kBerlin, 0x05, "00 00 03 07 29 03 26"), Events{"E51 2026-03-29T01:00:00"});
  EXPECT_EQ(Told(kBerlin, 0x05, "59 59 23 04 31 12 26"), Events{"E51 2026-12-31T22:59:59"});
}

// ---------------- Journals that grow and wrap, with wrong replies, lost batches and restarts: each
// record is reported once and in order.

constexpr std::size_t kRecords = 10;

using History = std::map<std::uint32_t, std::vector<std::pair<std::uint32_t, std::int64_t>>>;

class JournalBench {
 public:
  JournalBench() { Restart(); }

  void Restart() {
    session_ = std::make_unique<JournalSession>(true, kRecords);
    EXPECT_FALSE(session_->has_events()) << "nobody knows what was told";
    session_->OnKept(said);
    session_->OnMeter(meter);
    last_reply_.clear();
  }

  void Raise(std::uint32_t code) {
    ASSERT_TRUE(twin.Raise({0, code, {}, {}}, wall()));
    raised[code / 10].emplace_back(code, wall().time_since_epoch() / 1s);
  }

  void Run(int tasks) {
    for (int i = 0; i < tasks; ++i) Task();
  }

  void Task() {
    now_ += 1s;
    for (int step = 0; step < kMostSteps; ++step) {
      Bytes pdu;
      for (int times = 0; times < asks; ++times) pdu = session_->Next(now_);
      asked.push_back(ToHex(pdu));
      if (deaf.count(pdu[0] == kJournal ? pdu[1] >> 4U : pdu[1]) > 0) {
        Answer refusal;
        refusal.outcome = Outcome::unsupported;
        if (session_->TakeRefusal(refusal, now_).then == Then::ask_again) continue;
        return;
      }
      Bytes reply = twin.Record(pdu).value_or(Bytes(*LengthOfData(pdu)));
      const Bytes whole = reply;
      if (late && late() && last_reply_.size() == reply.size()) reply = last_reply_;
      last_reply_ = whole;
      const Answer answer = session_->Take(reply, reader_, now_);
      if (answer.batch) return Take(*answer.batch);
      if (answer.then != Then::ask_again) return;
    }
    ADD_FAILURE() << "the task does not end";
  }

  WallTime wall() const { return WallTime(1'790'000'000s) + now_.time_since_epoch(); }
  JournalSession& session() { return *session_; }

  std::uint32_t meter = kMeter;
  TwinJournals twin{CivilZone(), kRecords};
  History raised;
  History told;
  std::vector<std::string> asked;
  int asks = 1;
  std::string said;
  std::function<bool()> late;
  std::function<bool()> dropped;
  std::set<unsigned> deaf;
  std::vector<std::string> gaps;

 private:
  void Take(const EventBatch& batch) {
    ASSERT_FALSE(batch.events.empty());
    if (dropped && dropped()) return session_->OnReconnect();
    for (const DeviceEvent& event : batch.events) {
      if (event.code % 10 == 9) {
        gaps.push_back(event.text);
        continue;
      }
      ASSERT_TRUE(event.time) << event.text;
      told[event.code / 10].emplace_back(event.code, event.time->time / 1s);
    }
    said = batch.said;
    session_->OnKept(said);
  }

  Instant now_{1h};
  std::unique_ptr<JournalSession> session_;
  const JournalReader reader_{CivilZone(), true};
  Bytes last_reply_;
};

TEST(JournalSession, ReportsTheWholeHistoryOnce) {
  JournalBench bench;
  for (const std::uint32_t code : {71, 72, 11, 12, 22, 51, 51, 601, 101, 61}) bench.Raise(code);
  bench.Run(500);
  EXPECT_EQ(bench.told, bench.raised);
  bench.Run(4000);
  bench.Restart();
  bench.Run(500);
  EXPECT_EQ(bench.told, bench.raised);
  EXPECT_TRUE(bench.gaps.empty());
}

TEST(JournalSession, UrgentJournalsAreReadFirstAndEverySecondTime) {
  JournalBench bench;
  bench.Run(500);
  EXPECT_EQ(bench.asked.front(), "04 10");
  const std::vector<std::string> latest(bench.asked.end() - 100, bench.asked.end());
  const auto urgent = std::ranges::count_if(latest, [](const std::string& pdu) {
    return pdu.starts_with("04 1") || pdu.starts_with("04 7") || pdu.starts_with("04 8") ||
           pdu.starts_with("04 9");
  });
  EXPECT_EQ(urgent, 50);
}

TEST(JournalSession, ARequestIsKeptUntilItIsAnswered) {
  JournalBench bench;
  JournalBench twice;
  twice.asks = 2;
  for (JournalBench* one : {&bench, &twice}) {
    one->Run(500);
    one->Raise(81);
    one->Run(100);
    EXPECT_EQ(one->told, one->raised);
  }
  EXPECT_EQ(twice.asked, bench.asked);
}

TEST(JournalSession, ATaskWithoutNewsIsOneExchange) {
  JournalBench bench;
  bench.Run(500);
  const std::size_t before = bench.asked.size();
  bench.Run(100);
  EXPECT_EQ(bench.asked.size(), before + 100);
}

TEST(JournalSession, ALostAndRestoredPhaseIsTwoEvents) {
  JournalBench bench;
  bench.Run(500);
  bench.Raise(81);
  bench.Run(30);
  EXPECT_EQ(bench.told, bench.raised) << "soon";
  bench.Raise(82);
  bench.Restart();
  bench.Run(500);
  EXPECT_EQ(bench.told, bench.raised);
}

TEST(JournalSession, AnOverwrittenJournalReportsAGap) {
  JournalBench bench;
  for (int i = 0; i < 10; ++i) bench.Raise(51);
  bench.Run(500);
  ASSERT_EQ(bench.told, bench.raised);
  for (int i = 0; i < 13; ++i) bench.Raise(51);
  bench.Restart();
  bench.Run(500);
  ASSERT_EQ(bench.gaps.size(), 1U);
  EXPECT_NE(bench.gaps[0].find("journal 05, energy reset"), std::string::npos);
  EXPECT_EQ(bench.told[5].size(), 20U) << "what is left of them is told";
  bench.Restart();
  bench.Run(500);
  EXPECT_EQ(bench.gaps.size(), 1U);
}

TEST(JournalSession, AnOverlapOfOneRecordProvesThatNothingIsMissing) {
  JournalBench bench;
  bench.Run(500);
  for (int i = 0; i < 10; ++i) {
    bench.Raise(51);
    bench.Run(60);
  }
  for (int i = 0; i < 9; ++i) bench.Raise(51);
  bench.Run(500);
  EXPECT_TRUE(bench.gaps.empty());
  EXPECT_EQ(bench.told, bench.raised);
}

TEST(JournalSession, AnotherMeterHasItsOwnHistory) {
  JournalBench bench;
  bench.Raise(71);
  bench.Run(500);
  EXPECT_EQ(bench.told[7].size(), 1U);
  bench.meter = kMeter + 1;
  bench.Restart();
  bench.Run(500);
  EXPECT_EQ(bench.told[7].size(), 2U);
  bench.Restart();
  bench.Run(500);
  EXPECT_EQ(bench.told[7].size(), 2U);
}

TEST(JournalSession, UnsupportedJournalsAreOmitted) {
  JournalBench bench;
  bench.deaf = {8, 9, 0x3C};
  bench.Raise(51);
  bench.Run(500);
  EXPECT_EQ(bench.told, bench.raised);
  EXPECT_TRUE(bench.session().has_events());
  bench.asked.clear();
  bench.Run(500);
  for (const std::string& pdu : bench.asked) EXPECT_FALSE(pdu.starts_with("04 8")) << pdu;
}

TEST(JournalSession, AMeterWithoutJournalsIsNotAskedAgain) {
  JournalBench bench;
  bench.deaf = {1, 2, 5, 6, 7, 8, 9, 0x0A, 0x3C};
  bench.Run(200);
  EXPECT_FALSE(bench.session().has_events());
  EXPECT_TRUE(bench.session().has_refused());
}

/// A damaged reply can look like a refusal.
TEST(JournalSession, ARefusalOfAKnownJournalIsTemporary) {
  JournalBench bench;
  bench.Raise(11);
  bench.Run(500);
  bench.deaf = {1};
  bench.Run(2);
  bench.deaf = {};
  bench.Raise(12);
  bench.Run(500);
  EXPECT_EQ(bench.told, bench.raised);
}

TEST(JournalSession, AnUnansweredJournalIsSkipped) {
  JournalSession session(true, kRecords);
  session.OnKept({});
  Instant now{1h};
  const Bytes first = session.Next(now);
  for (int i = 0; i < JournalSession::kMostFailures; ++i) {
    EXPECT_EQ(session.Next(now), first);
    session.OnFailure(Outcome::no_reply, now);
  }
  EXPECT_NE(session.Next(now)[1] >> 4U, first[1] >> 4U);
}

TEST(JournalSession, InvalidStoredTextIsIgnored) {
  for (const char* said : {"", "x", "9020001", "9020001 ", "9020001 05:zz", "-1 05:-", "9020001 05",
                           "9020001 ;;:", "9020001 0G:31301501020902"}) {
    JournalBench bench;
    bench.said = said;
    bench.Restart();
    bench.Raise(51);
    bench.Run(500);
    EXPECT_EQ(bench.told, bench.raised) << said;
  }
}

TEST(JournalSession, EachRecordIsReportedOnceInSpiteOfDisturbances) {
  std::size_t told = 0;
  for (unsigned seed = 1; seed <= 60 && !testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const auto one_in = [&random](unsigned n) { return random() % n == 0; };
    JournalBench bench;
    bench.late = [&] { return one_in(20); };
    bench.dropped = [&] { return one_in(4); };
    std::map<std::uint32_t, bool> lost;
    bench.Run(600);
    for (int round = 0; round < 30; ++round) {
      for (std::size_t i = random() % 6; i > 0; --i) {
        constexpr std::uint32_t kMoments[] = {22, 51, 61, 601};
        if (one_in(2)) {
          bench.Raise(kMoments[random() % 4]);
        } else {
          constexpr std::uint32_t kIntervals[] = {11, 71, 81, 91, 101};
          const std::uint32_t code = kIntervals[random() % 5];
          bench.Raise(code + (lost[code] ? 1 : 0));
          lost[code] = !lost[code];
        }
        bench.Run(static_cast<int>(random() % 3));
      }
      bench.Run(static_cast<int>(100 + random() % 150));
      if (one_in(4)) bench.Restart();
    }
    bench.late = bench.dropped = [] { return false; };
    bench.session().OnReconnect();
    bench.Run(600);
    ASSERT_EQ(bench.told, bench.raised);
    ASSERT_TRUE(bench.gaps.empty());
    for (const auto& [journal, events] : bench.told) told += events.size();
  }
  EXPECT_GT(told, 2000U);
}

}  // namespace
}  // namespace baudgate::protocols::set4tm
