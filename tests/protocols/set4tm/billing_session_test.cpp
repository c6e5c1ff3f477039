// Tests that each billing day and month is reported once, with the meter's values.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <memory>
#include <random>

#include "gateway/base/text.h"
#include "protocols/set4tm/archive/archive.h"
#include "protocols/set4tm/meter/clock.h"
#include "protocols/set4tm/meter/codec.h"
#include "protocols/set4tm/twin/twin_archive.h"

namespace baudgate::protocols::set4tm {
namespace {

constexpr auto kFirstDay = std::chrono::local_days(std::chrono::year(2026) / 2 / 27);

std::string Written(std::chrono::local_days day) {
  return FormatWallTime(WallTime(day.time_since_epoch())).substr(0, 10);
}

class BillingBench {
 public:
  explicit BillingBench(std::vector<BillingPeriod> periods = {BillingPeriod::day,
                                                              BillingPeriod::month}) {
    settings_.time_zone = *CivilZone::Parse("+03:00");
    settings_.billing = std::move(periods);
    settings_.billing_tariffs = 2;
    Restart();
  }

  void Restart() {
    session_ = std::make_unique<BillingSession>(settings_);
    EXPECT_FALSE(session_->due());
    session_->OnKept(said);
    last_.clear();
  }
  void Pass(Duration time) { now_ += time; }
  void Run(Duration time) {
    const Instant end = now_ + time;
    while (true) {
      const auto due = session_->due();
      if (!due || *due > end) break;
      now_ = std::max(now_, *due) + 1s;
      Task();
    }
    now_ = std::max(now_, end);
  }

  CivilZone::Civil civil() const {
    return kFirstDay + std::chrono::duration_cast<std::chrono::seconds>(now_ - Instant());
  }
  std::chrono::local_days today() const { return std::chrono::floor<std::chrono::days>(civil()); }
  BillingSession& session() { return *session_; }

  std::string said;
  std::map<std::string, std::vector<std::string>> told;
  std::vector<PastRecord> records;
  std::vector<std::string> asked;
  std::function<bool()> lost;
  std::function<bool()> late;
  std::function<bool()> dropped;
  std::function<bool(View pdu)> deaf;
  std::optional<std::chrono::local_days> installed;

 private:
  void Task() {
    const Bytes pdu = session_->Next(now_);
    asked.push_back(ToHex(pdu));
    if (lost && lost()) return session_->OnFailure(now_);
    if (deaf && deaf(pdu)) {
      Answer refusal;
      refusal.outcome = Outcome::unsupported;
      session_->TakeRefusal(refusal, now_);
      return;
    }
    Bytes data;
    if (pdu[0] == kJournal) {
      data = BytesOf(civil());
      data.push_back(1);
    } else {
      data = *TwinRegisters(pdu, civil());
      const Bytes whole = data;
      if (late && late() && !last_.empty()) data = last_;
      last_ = whole;
      // The meter constant A is 0.5, so one count is one kWh.
      const auto day =
          std::chrono::local_days(std::chrono::days((*ByteReader(data).U32Be(0) - 1) / 1000));
      if (installed && day < *installed) data.assign(16, 0);
    }
    Scale scale;
    scale.meter_constant = 0.5;
    scale.voltage_ratio = scale.current_ratio = 1;
    const Answer answer = session_->Take(data, scale, now_);
    if (answer.batch) Take(*answer.batch);
  }

  void Take(const EventBatch& batch) {
    ASSERT_EQ(batch.past.size(), 1U);
    if (dropped && dropped()) return Restart();
    const PastRecord& record = batch.past[0];
    EXPECT_EQ(record.span, Duration::zero());
    const auto begin = std::chrono::local_days(std::chrono::floor<std::chrono::days>(
        std::chrono::local_seconds(std::chrono::duration_cast<std::chrono::seconds>(record.begin)) +
        3h));
    told[record.series].push_back(Written(begin));
    for (unsigned tariff = 0; tariff <= 2; ++tariff) {
      for (std::size_t i = 0; i < 4; ++i) {
        const PastValue& value = record.values.at(4 * tariff + i);
        if (deaf && deaf(Bytes{kEnergyExtended, 0, 0, static_cast<std::uint8_t>(tariff), 0, 0})) {
          EXPECT_TRUE(IsBad(value.quality));
          continue;
        }
        ASSERT_EQ(value.value, Value(double(TwinCounts(begin, tariff)[i])))
            << record.series << ' ' << Written(begin) << ' ' << value.name;
      }
    }
    records.push_back(record);
    said = batch.said;
    session_->OnKept(said);
  }

  Settings settings_;
  Instant now_{10h};
  std::unique_ptr<BillingSession> session_;
  Bytes last_;
};

std::vector<std::string> Days(std::chrono::local_days first, std::chrono::local_days last) {
  std::vector<std::string> days;
  for (; first <= last; first += std::chrono::days(1)) days.push_back(Written(first));
  return days;
}

std::vector<std::string> Months(int year, unsigned month, int count) {
  std::vector<std::string> all;
  auto date = std::chrono::year(year) / std::chrono::month(month) / 1;
  for (; count > 0; --count, date += std::chrono::months(1)) {
    all.push_back(Written(std::chrono::local_days(date)));
  }
  return all;
}

TEST(BillingSession, ReadsTheHistoryAndThenEachDayAndMonth) {
  BillingBench bench;
  bench.Run(5h);
  EXPECT_EQ(bench.told["month"], Months(2025, 3, 12));
  EXPECT_EQ(bench.told["day"], Days(kFirstDay - std::chrono::days(27), kFirstDay));
  bench.Run(40 * 24h);
  EXPECT_EQ(bench.told["month"], Months(2025, 3, 14));
  EXPECT_EQ(bench.told["day"], Days(kFirstDay - std::chrono::days(27), bench.today()));
  EXPECT_EQ(bench.session().Shown(),
            "billing readings of each day are read up to 2026-04-08, billing readings of each "
            "month are read up to 2026-04-01");
  EXPECT_EQ(bench.said, "day 2026-04-08;month 2026-04-01");
}

TEST(BillingSession, RequestsMatchTheReference) {
  BillingBench bench({BillingPeriod::month});
  bench.Run(20min);
  ASSERT_GT(bench.asked.size(), 8U);
  EXPECT_EQ(bench.asked[0], "04 00");
  EXPECT_EQ(bench.asked[1], "0A 83 03 00 0F 00");
  EXPECT_EQ(bench.asked[2], "0A 83 03 01 0F 00");
  EXPECT_EQ(bench.asked[3], "0A 83 03 02 0F 00");
  EXPECT_EQ(bench.asked[4], "0A 83 03 02 0F 00") << "and back";
  EXPECT_EQ(bench.asked[6], "0A 83 03 00 0F 00");
  EXPECT_EQ(bench.asked[7], "04 00");
}

TEST(BillingSession, AnOutageIsFilledFromTheMemoryOfTheMeter) {
  BillingBench bench;
  bench.Run(5h);
  bench.Pass(90 * 24h);
  bench.Restart();
  bench.Run(5h);
  EXPECT_EQ(bench.told["month"], Months(2025, 3, 15));
  auto days = Days(kFirstDay - std::chrono::days(27), kFirstDay);
  for (const auto& day : Days(bench.today() - std::chrono::days(27), bench.today())) {
    days.push_back(day);
  }
  EXPECT_EQ(bench.told["day"], days);
}

TEST(BillingSession, DaysBeforeTheInstallationAreOmitted) {
  BillingBench bench;
  bench.installed = kFirstDay - std::chrono::days(10);
  bench.Run(5h);
  EXPECT_EQ(bench.told["month"], std::vector<std::string>());
  EXPECT_EQ(bench.told["day"], Days(*bench.installed, kFirstDay));
  bench.Run(3 * 24h);
  EXPECT_EQ(bench.told["month"], Months(2026, 3, 1));
}

TEST(BillingSession, AMeterWithoutCalendarDaysIsReadForToday) {
  BillingBench bench({BillingPeriod::day});
  bench.deaf = [](View pdu) {
    return pdu[0] == kEnergyExtended && (pdu[1] == 0x86 || pdu[3] == 2);
  };
  bench.Run(3 * 24h);
  EXPECT_EQ(bench.told["day"], Days(kFirstDay, bench.today()));
}

TEST(BillingSession, AMeterThatRefusesAllIsNotAskedAgain) {
  BillingBench bench;
  bench.deaf = [](View pdu) { return pdu[0] == kEnergyExtended; };
  bench.Run(3h);
  EXPECT_FALSE(bench.session().due());
  EXPECT_EQ(bench.session().Shown(),
            "billing readings of each day are not read, because the meter refuses the request, "
            "billing readings "
            "of each month are not read, because the meter refuses the request");
}

TEST(BillingSession, EachReadingIsReportedOnceInSpiteOfDisturbances) {
  for (unsigned seed = 1; seed <= 30 && !testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const auto one_in = [&random](unsigned n) { return random() % n == 0; };
    BillingBench bench;
    bench.lost = [&] { return one_in(40); };
    bench.late = [&] { return one_in(40); };
    bench.dropped = [&] { return one_in(10); };
    for (int round = 0; round < 20; ++round) {
      bench.Run(std::chrono::minutes(random() % 6000));
      if (one_in(2)) bench.Pass(std::chrono::minutes(random() % 9000));
      if (one_in(3)) bench.Restart();
      if (one_in(3)) bench.session().OnReconnect();
    }
    bench.lost = bench.late = bench.dropped = [] { return false; };
    bench.Run(8h);
    EXPECT_EQ(bench.told["day"], Days(kFirstDay - std::chrono::days(27), bench.today()));
    const auto months = bench.told["month"];
    EXPECT_EQ(months, Months(2025, 3, static_cast<int>(months.size())));
    EXPECT_EQ(months.back().substr(0, 7), Written(bench.today()).substr(0, 7));
  }
}

}  // namespace
}  // namespace baudgate::protocols::set4tm
