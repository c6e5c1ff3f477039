// Tests of `ClockCorrector`: when it corrects a clock, and what it sends and reports.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/clocks/clock_corrector.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/support/renew_store.h"

namespace baudgate::daemon {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

/// 2026-07-01, 12:10:00 at +03:00
constexpr WallTime kTenPast{std::chrono::sys_days(std::chrono::year(2026) / 7 / 1) +
                            std::chrono::hours(9) + std::chrono::minutes(10)};

config::Config MeterConfig() {
  config::Config config;
  config::Device device;
  device.name = "m1";
  device.options.Set("time_zone", std::string("+03:00"));
  device.options.Set(protocols::kCorrectClock, std::int64_t{Duration(5s).count()});
  device.options.Set(protocols::kCorrectClockMost, std::int64_t{Duration(60s).count()});
  device.slow = 1min;
  config::Point drift;
  drift.name = "clock_drift";
  drift.type = config::Type::float64;
  drift.group = config::Group::slow;
  config::Point correction;
  correction.name = "clock_correction";
  correction.type = config::Type::boolean;
  correction.access = config::Access::write;
  correction.writing.allowed = true;
  device.points = {drift, correction};
  config::Line line;
  line.name = "meters";
  line.devices = {device};
  config.lines = {line};
  return config;
}

class ClockCorrectorTest : public ::testing::Test, private bus::CommandSink {
 protected:
  ClockCorrectorTest() {
    std::filesystem::remove_all(file_);
    Restart();
  }

  void Restart() {
    corrector_.reset();
    corrector_ = std::make_unique<ClockCorrector>(ClockCorrector::Links{
        store_, *this,
        [this](const config::Config& config) {
          auto tries = std::make_unique<records::DeviceMemory>(
              file_, config, [](const std::string&) {}, [](const std::string&) {});
          tries_ = tries.get();
          return tries;
        },
        [this](std::uint32_t, bool corrected, const std::string& text, Now) {
          told_.push_back((corrected ? "corrected: " : "left: ") + text);
        },
        [this](const std::string& text) { told_.push_back(text); }});
    corrector_->OnReload(config_);
    corrector_->OnHostClock(true);
  }
  void Show(double drift, Quality quality = Quality::good) {
    const bus::Sample sample{0, drift, quality};
    store_.Update(0, std::span(&sample, 1), now_, 1ms);
  }
  void Pass(Duration time) {
    now_.instant += time;
    now_.wall += time;
    corrector_->Tick(now_);
  }
  void AnswerRead(double drift) {
    ASSERT_THAT(asked_, SizeIs(1));
    ASSERT_THAT(asked_[0].reads(), ElementsAre(0U));
    Show(drift);
    std::exchange(asked_, {})[0].done({.read_back = true});
    Pass(1s);
    while (tries_->kept() == records::DeviceMemory::Kept::waits) std::this_thread::yield();
    Pass(1s);
  }
  void AnswerWrite(const WriteResult& result) {
    ASSERT_THAT(asked_, SizeIs(1));
    ASSERT_THAT(asked_[0].writes(), SizeIs(1));
    EXPECT_EQ(asked_[0].client, "gateway");
    EXPECT_EQ(asked_[0].writes()[0].point, 1U);
    EXPECT_EQ(asked_[0].writes()[0].raw, Value(true));
    std::exchange(asked_, {})[0].done(result);
    Pass(1s);
  }

  const std::filesystem::path file_ =
      std::filesystem::path(::testing::TempDir()) /
      ("baudgate-clocks-" +
       std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()) + ".json");
  config::Config config_ = MeterConfig();
  bus::PointStore store_{config_};
  Now now_{Instant(1000h), kTenPast};
  std::vector<bus::WriteCommand> asked_;
  std::vector<bus::DeniedWrite> denied_;
  std::vector<std::string> told_;
  records::DeviceMemory* tries_ = nullptr;
  std::unique_ptr<ClockCorrector> corrector_;

 private:
  bool Submit(bus::WriteCommand command) override {
    asked_.push_back(std::move(command));
    return true;
  }
  void OnNotTaken(const bus::DeniedWrite& denied) override { denied_.push_back(denied); }
};

TEST_F(ClockCorrectorTest, ReadsTheClockAgainAndCorrectsIt) {
  Show(12.3);
  Pass(1s);
  AnswerRead(12.4);
  AnswerWrite({});
  EXPECT_THAT(told_, ElementsAre("corrected: it was 12.4 s ahead"));
  Show(12.4);
  Pass(10min);
  EXPECT_THAT(asked_, IsEmpty()) << "once a day";
}

TEST_F(ClockCorrectorTest, TriesOnceADayWhateverTheOutcome) {
  for (const WriteEnd end : {WriteEnd::refused, WriteEnd::not_sent, WriteEnd::unknown}) {
    Show(-12.3);
    Pass(1s);
    AnswerRead(-12.3);
    AnswerWrite({.end = end, .reason = "why"});
    ASSERT_THAT(told_, SizeIs(1));
    EXPECT_THAT(told_[0], HasSubstr("left: it was 12.3 s behind"));
    EXPECT_THAT(told_[0], HasSubstr("why"));
    told_.clear();
    Pass(std::chrono::hours(24));
    Show(-12.3);
    Pass(1s);
    EXPECT_THAT(asked_, IsEmpty());
    Pass(std::chrono::hours(1));
  }
}

TEST_F(ClockCorrectorTest, DoesNotTryAgainAfterARestartOnTheSameDay) {
  Show(12.3);
  Pass(1s);
  AnswerRead(12.3);
  ASSERT_THAT(asked_, SizeIs(1));
  asked_.clear();
  Restart();
  Show(12.3);
  Pass(1s);
  EXPECT_THAT(asked_, IsEmpty());
  Pass(std::chrono::hours(25));
  Show(12.3);
  Pass(1s);
  EXPECT_THAT(asked_, SizeIs(1));
}

TEST_F(ClockCorrectorTest, DoesNotTryWhenTheAttemptCannotBeStored) {
  std::filesystem::create_directories(file_ / "in the way");
  Show(12.3);
  Pass(1s);
  AnswerRead(12.3);
  EXPECT_THAT(asked_, IsEmpty());
  ASSERT_THAT(told_, SizeIs(1));
  EXPECT_THAT(told_[0], HasSubstr("left: it is 12.3 s ahead; the attempt cannot be saved"));
}

TEST_F(ClockCorrectorTest, ReportsTheOutcomeAfterAReload) {
  Show(12.3);
  Pass(1s);
  AnswerRead(12.3);
  store_.Retire(0);
  store_.Forget(0);
  AnswerWrite({});
  EXPECT_THAT(told_, ElementsAre("corrected: it was 12.3 s ahead"));
  Pass(std::chrono::hours(26));
  EXPECT_THAT(asked_, IsEmpty()) << "its number is nobody's now";
}

TEST_F(ClockCorrectorTest, ReportsADriftBeyondTheLimitWithoutCorrectingIt) {
  Show(300);
  Pass(1s);
  AnswerRead(300);
  EXPECT_THAT(asked_, IsEmpty());
  ASSERT_THAT(told_, SizeIs(1));
  EXPECT_THAT(told_[0], HasSubstr("left: it is 300.0 s ahead, more than correct_clock_most"));
  Show(300);
  Pass(11min);
  EXPECT_THAT(told_, SizeIs(1)) << "once a day";
}

TEST_F(ClockCorrectorTest, NeedsASynchronisedHostClock) {
  corrector_->OnHostClock(false);
  Show(12.3);
  Pass(1s);
  EXPECT_THAT(asked_, IsEmpty());
  corrector_->OnHostClock(true);
  Pass(1s);
  ASSERT_THAT(asked_, SizeIs(1));
  corrector_->OnHostClock(false);
  AnswerRead(12.3);
  EXPECT_THAT(asked_, IsEmpty()) << "it is not any more";
}

TEST_F(ClockCorrectorTest, NeedsAGoodAndLargeEnoughDrift) {
  Show(12.3, Quality::uncertain_sub_normal);
  Pass(1s);
  Show(4.9);
  Pass(1s);
  EXPECT_THAT(asked_, IsEmpty());
}

TEST_F(ClockCorrectorTest, NeedsTwoReadingsThatAgree) {
  Show(12.3);
  Pass(1s);
  AnswerRead(20);
  EXPECT_THAT(asked_, IsEmpty());
  EXPECT_THAT(told_, IsEmpty());
  Pass(ClockCorrector::kBetweenReads);
  Show(20);
  Pass(1s);
  AnswerRead(20);
  AnswerWrite({});
  EXPECT_THAT(told_, ElementsAre("corrected: it was 20.0 s ahead"));
}

TEST_F(ClockCorrectorTest, IsRefusedAPointThatIsNotWritable) {
  config_.lines[0].devices[0].points[1].writing.allowed = false;
  Renew(store_, config_);
  Show(12.3);
  Pass(1s);
  AnswerRead(12.3);
  EXPECT_THAT(asked_, IsEmpty());
  ASSERT_THAT(denied_, SizeIs(1));
  EXPECT_EQ(denied_[0].client, "gateway");
  ASSERT_THAT(told_, SizeIs(1));
  EXPECT_THAT(told_[0], HasSubstr("write"));
}

TEST_F(ClockCorrectorTest, StartsNoCorrectionWhenTheGatewayStops) {
  corrector_->Stop();
  Show(12.3);
  Pass(1s);
  EXPECT_THAT(asked_, IsEmpty());
}

TEST(ClockCare, AvoidsHalfHoursAndMidnight) {
  const protocols::CivilZone zone = protocols::CivilZone::Parse("+03:00").value();
  const WallTime noon = kTenPast - std::chrono::minutes(10);
  const auto may = [&](int minutes) {
    return MayCorrectAt(noon + std::chrono::minutes(minutes), zone);
  };
  EXPECT_FALSE(may(0));
  EXPECT_FALSE(may(4));
  EXPECT_TRUE(may(5));
  EXPECT_TRUE(may(24));
  EXPECT_FALSE(may(25));
  EXPECT_FALSE(may(34));
  EXPECT_TRUE(may(35));
  EXPECT_FALSE(may(55));
  EXPECT_TRUE(may(11 * 60 + 20)) << "23:20";
  EXPECT_FALSE(may(11 * 60 + 40)) << "23:40";
  EXPECT_FALSE(may(12 * 60 + 20)) << "00:20";
  EXPECT_TRUE(may(12 * 60 + 40)) << "00:40";
}

}  // namespace
}  // namespace baudgate::daemon
