// Tests the broadcast latch: when it is sent, how its receipt is checked, and two meters on a line.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/meter/latch.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "gateway/bus/poller/poller.h"
#include "tests/protocols/set4tm/support.h"
#include "tests/support/virtual_line.h"

namespace baudgate::protocols::set4tm {
namespace {

/// Noon as wall time. The monotonic clock has another zero.
constexpr WallTime kWall = WallTime(std::chrono::sys_days(std::chrono::year(2026) / 3 / 1)) + 12h;
Now SinceNoon(Duration since_noon) { return {Instant(1h) + since_noon, kWall + since_noon}; }

TEST(Latch, FramesMatchTheReference) {
  EXPECT_EQ(ToHex(MakeFrame(Bytes{kBroadcast}, LatchPdu())), "FE 03 08 55 AA 33 CC C0 74");
  EXPECT_TRUE(IsLatch(Hex("03 08 55 AA 33 CC")));
  EXPECT_TRUE(IsLatch(Hex("03 08 07 AA 33 CC"))) << "an id of a master";
  EXPECT_FALSE(IsLatch(Hex("03 08 55 AA 33")));
  for (const char* pdu : {"08 14 50", "08 14 F0", "08 14 00", "08 1B 01 11", "08 1B 03 00"}) {
    EXPECT_TRUE(ReadsLatched(Hex(pdu))) << pdu;
  }
  for (const char* pdu : {"08 1B 00 11", "08 1B 02 00", "08 11 00", "08 12", "04 00"}) {
    EXPECT_FALSE(ReadsLatched(Hex(pdu))) << pdu;
  }
}

TEST(LineLatch, IsDueAtWholeMultiples) {
  LineLatch latch;
  EXPECT_FALSE(latch.DueAt(15min)) << "what the clock shows is not known";
  latch.OnClock(SinceNoon(20s));
  EXPECT_EQ(latch.DueAt(15min), SinceNoon(15min).instant);
  EXPECT_EQ(latch.DueAt(1min), SinceNoon(1min).instant);
  latch.OnClock(SinceNoon(15min + 30ms));
  latch.OnSent();
  EXPECT_EQ(latch.number(), 1U);
  EXPECT_EQ(latch.sent_at(), SinceNoon(15min + 30ms).wall);
  EXPECT_EQ(latch.DueAt(15min), SinceNoon(30min).instant);
}

TEST(LineLatch, AfterAnOutageIsSentOnceAndThenOnScheduleAgain) {
  LineLatch latch;
  latch.OnClock(SinceNoon(20s));
  latch.OnClock(SinceNoon(100min));
  EXPECT_EQ(latch.DueAt(15min), SinceNoon(15min).instant) << "long due";
  latch.OnSent();
  EXPECT_EQ(latch.DueAt(15min), SinceNoon(105min).instant);
}

TEST(LineLatch, FollowsAClockStep) {
  LineLatch latch;
  latch.OnClock(SinceNoon(15min));
  latch.OnSent();
  const auto shows = [&](Duration since_noon, Duration shown) {
    latch.OnClock({SinceNoon(since_noon).instant, SinceNoon(shown).wall});
    return *latch.DueAt(15min);
  };
  EXPECT_EQ(shows(15min + 10s, 15min - 1ms), SinceNoon(30min + 10s + 1ms).instant) << "not twice";
  EXPECT_EQ(shows(16min, 26min), SinceNoon(20min).instant) << "ahead";
  EXPECT_EQ(shows(16min, -10h), SinceNoon(45min).instant)
      << "far back: in two periods at the latest";
}

TEST(MeterLatch, IsConfirmedByAChangedLatchTime) {
  MeterLatch latch;
  EXPECT_TRUE(latch.WantsTime(0));
  latch.OnTime(Hex("01"), 0);
  EXPECT_FALSE(latch.WantsTime(0));
  EXPECT_FALSE(latch.Heard(0)) << "what was before the first broadcast is nobody's";
  EXPECT_TRUE(latch.WantsTime(1));
  EXPECT_FALSE(latch.Heard(1)) << "not known yet";
  latch.OnTime(Hex("02"), 1);
  EXPECT_TRUE(latch.Heard(1));
  latch.OnTime(Hex("02"), 1);
  EXPECT_TRUE(latch.Heard(1));
  latch.OnTime(Hex("02"), 2);
  EXPECT_FALSE(latch.Heard(2));
  EXPECT_TRUE(latch.Missed(2));
  latch.OnTime(Hex("03"), 4);
  EXPECT_FALSE(latch.Heard(4)) << "it may have heard the third alone";
  EXPECT_FALSE(latch.Missed(4));
  latch.OnTime(Hex("04"), 5);
  ASSERT_TRUE(latch.Heard(5));
  latch.OnTime(Hex("05"), 5);
  EXPECT_FALSE(latch.Heard(5)) << "another master's";
  latch.OnFailure(6);
  EXPECT_FALSE(latch.WantsTime(6)) << "the next broadcast will tell";
  latch.OnTime(Hex("06"), 7);
  EXPECT_FALSE(latch.Heard(7));
  latch.OnTime(Hex("07"), 8);
  ASSERT_TRUE(latch.Heard(8));
  latch.Doubt();
  EXPECT_FALSE(latch.Heard(8));
  EXPECT_TRUE(latch.WantsTime(8));
  latch.OnTime(Hex("07"), 8);
  EXPECT_TRUE(latch.Heard(8)) << "it has still what it had";
  latch.Doubt();
  latch.OnTime(Hex("00"), 8);
  EXPECT_FALSE(latch.Heard(8)) << "it was without power";
  latch.Forget();
  EXPECT_FALSE(latch.Heard(8));
}

Settable Every(Duration period) {
  return {{"snapshot", std::string("false")}, {"latch", std::int64_t{period.count()}}};
}

TEST(Latch, ConfigurationIsChecked) {
  config::Device device = MakeDevice("5", {MakePoint("08 14 50 latched@0")}, Every(15min));
  const auto says = [&](Duration period) {
    device.options.Set("latch", std::int64_t{period.count()});
    const Status status = Set4tmProtocol().check_device(device);
    return status ? std::string() : status.error();
  };
  EXPECT_EQ(says(15min), "");
  EXPECT_NE(says(0s).find("'p' reads the time of the latch"), std::string::npos);
  EXPECT_NE(says(59s).find("1min to 24h"), std::string::npos);
  EXPECT_NE(says(25h).find("1min to 24h"), std::string::npos);
  EXPECT_TRUE(Set4tmProtocol().doubts(device).empty());
  device.points[0].read = kOneFloat;
  EXPECT_EQ(says(1min), "");
  EXPECT_EQ(Set4tmProtocol().doubts(device).size(), 1U) << "no point reads a latched value";
  EXPECT_FALSE(ParseField("08 14 F0 latched@0"));
  EXPECT_FALSE(ParseField("08 14 50 latched@1"));
}

class Deaf : public Twin {
 public:
  Deaf(std::unique_ptr<Twin> twin, const bool& deaf) : twin_(std::move(twin)), deaf_(deaf) {}
  Bytes Answer(View request, Instant now) override {
    return deaf_ && request[0] == kBroadcast ? Bytes() : twin_->Answer(request, now);
  }
  void ReplyAs(std::string_view address) override { twin_->ReplyAs(address); }

 private:
  std::unique_ptr<Twin> twin_;
  const bool& deaf_;
};

class LatchLine : public ::testing::Test {
 protected:
  static constexpr std::uint32_t kLatched = 0;
  static constexpr std::uint32_t kLive = 1;
  static constexpr std::uint32_t kSentAt = 2;

  static config::Device Meter(const std::string& name, const std::string& address) {
    config::Device device =
        MakeDevice(address,
                   {MakePoint("08 1B 03 00 float_le@0", config::Group::slow),
                    MakePoint("08 1B 02 00 float_le@0"), MakePoint("08 14 50 latched@0")},
                   Every(1min));
    device.name = name;
    device.protocol = "set4tm";
    device.poll = 1s;
    device.slow = 1min;
    return device;
  }
  LatchLine() {
    config::Line its;
    its.name = "meters";
    its.protocol = "set4tm";
    its.serial = {.baud = 9600, .data_bits = 8, .parity = config::Parity::odd};
    its.devices = {Meter("m1", "5"), Meter("m2", "6")};
    line = std::make_unique<VirtualLine>(std::move(its), std::vector{&Set4tmProtocol()});
    for (std::uint32_t i = 0; i < 2; ++i) {
      line->twin(i).twin->SetClock(line->now());
      line->twin(i).twin = std::make_unique<Deaf>(std::move(line->twin(i).twin), deaf[i]);
    }
    Show(100);
    line->Open();
  }
  void Show(double watts) {
    for (std::uint32_t i = 0; i < 2; ++i) {
      line->twin(i).values.Set(kLatched, watts + i);
      line->twin(i).values.Set(kLive, watts + i);
    }
  }
  std::vector<Duration> Latches() const {
    std::vector<Duration> times;
    for (const Sent& sent : line->sent) {
      if (static_cast<std::uint8_t>(sent.text[0]) == kBroadcast)
        times.push_back(sent.at - Instant(1h));
    }
    return times;
  }
  double Said(std::uint32_t device, std::uint32_t point) const {
    return ToDouble(line->ValueOf(device, point));
  }
  bool Good(std::uint32_t device, std::uint32_t point) const {
    return IsGood(line->QualityOf(device, point));
  }

  bool deaf[2] = {};
  std::unique_ptr<VirtualLine> line;
};

TEST_F(LatchLine, BothMetersShowTheSameMoment) {
  line->RunFor(39s);
  EXPECT_TRUE(Latches().empty());
  EXPECT_EQ(line->QualityOf(0, kLatched), Quality(Quality::bad_waiting, Reason::not_ready));
  EXPECT_TRUE(Good(0, kLive));
  line->RunFor(2s);
  ASSERT_EQ(Latches().size(), 1U);
  EXPECT_GE(Latches()[0], 40s - 30ms);
  EXPECT_LT(Latches()[0], 41s);
  Show(200);
  line->RunFor(5s);
  for (std::uint32_t i = 0; i < 2; ++i) {
    EXPECT_TRUE(Good(i, kLatched));
    EXPECT_EQ(Said(i, kLatched), 100 + i);
    EXPECT_EQ(Said(i, kLive), 200 + i);
  }
  EXPECT_EQ(Said(0, kSentAt), Said(1, kSentAt));
  EXPECT_NEAR(Said(0, kSentAt), 1'790'000'040, 1);
  line->RunFor(60s);
  EXPECT_EQ(Latches().size(), 2U);
  EXPECT_EQ(Said(1, kLatched), 201);
}

/// A meter returns the new latch time (`08 14 50`) at once, but its latched power is read up to a
/// minute later.
TEST_F(LatchLine, NoValueIsShownWithTheTimeOfAnother) {
  for (int second = 0; second < 200; ++second) {
    Show(second < 45 ? 100 : second < 105 ? 200 : 300);
    line->RunFor(1s);
    for (std::uint32_t i = 0; i < 2; ++i) {
      if (!Good(i, kLatched) || !Good(i, kSentAt)) continue;
      const double broadcasts = std::round((Said(i, kSentAt) - 1'790'000'040) / 60) + 1;
      EXPECT_EQ(Said(i, kLatched), 100 * broadcasts + i) << second;
    }
  }
  EXPECT_EQ(Said(0, kLatched), 300);
}

TEST_F(LatchLine, AMeterThatMissedABroadcastShowsNoLatchedValue) {
  line->RunFor(45s);
  ASSERT_TRUE(Good(1, kLatched));
  deaf[1] = true;
  line->RunFor(60s);
  EXPECT_TRUE(Good(0, kLatched));
  EXPECT_EQ(line->QualityOf(1, kLatched), Quality(Quality::bad_waiting, Reason::not_ready));
  EXPECT_TRUE(IsBad(line->QualityOf(1, kSentAt)));
  EXPECT_TRUE(Good(1, kLive));
  EXPECT_NE(line->StatusOf(1).learned.find("missed the latest latch broadcast"), std::string::npos);
  deaf[1] = false;
  line->RunFor(60s);
  EXPECT_TRUE(Good(1, kLatched));
  EXPECT_EQ(line->StatusOf(1).learned, "");
}

TEST_F(LatchLine, AMeterThatWasAbsentWaitsForTheNextBroadcast) {
  line->RunFor(45s);
  line->twin(1).manner.dead = true;
  deaf[1] = true;
  line->RunFor(50s);
  EXPECT_TRUE(IsBad(line->QualityOf(1, kLatched)));
  line->RunFor(10s);
  line->twin(1).manner.dead = false;
  deaf[1] = false;
  line->RunUntil([&] { return Good(1, kLive); }, 60s);
  EXPECT_FALSE(Good(1, kLatched));
  line->RunFor(130s);
  EXPECT_TRUE(Good(1, kLatched));
}

TEST_F(LatchLine, AMeterWithoutLatchTimeHasNoGoodLatchedValue) {
  line->twin(1).manner.instead = [](View request) -> std::optional<Bytes> {
    const auto parts = SplitFrame(request);
    if (!parts || !std::ranges::equal(parts->body, AskLatchTime())) return std::nullopt;
    return MakeFrame(parts->address, Bytes{1});
  };
  line->RunFor(70s);
  EXPECT_TRUE(Good(0, kLatched));
  EXPECT_TRUE(IsBad(line->QualityOf(1, kLatched)));
  EXPECT_TRUE(Good(1, kLive));
  EXPECT_NE(line->StatusOf(1).learned.find("does not report the time"), std::string::npos);
}

TEST_F(LatchLine, AnUnansweredLatchTimeGivesNoLatchedValue) {
  line->twin(1).manner.distort = [](Bytes reply) { return reply.size() == 10 ? Bytes() : reply; };
  line->RunFor(70s);
  EXPECT_FALSE(Good(1, kLatched));
  EXPECT_TRUE(Good(0, kLatched));
  const std::size_t broadcasts = Latches().size();
  EXPECT_EQ(broadcasts, 1U);
}

}  // namespace
}  // namespace baudgate::protocols::set4tm
