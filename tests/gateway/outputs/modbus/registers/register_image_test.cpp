// Tests of `RegisterImage`, whose answers must equal those of a direct read, and of the contents of
// registers and events.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/registers/register_image.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <span>
#include <vector>

#include "gateway/outputs/modbus/registers/register_contents.h"
#include "tests/gateway/outputs/modbus/registers/points.h"
#include "tests/support/renew_store.h"
#include "tests/support/times.h"

namespace baudgate::modbus {
namespace {

using config::OnBad;
using config::Table;
using config::Type;

constexpr std::size_t kAll = 1000;  // a read of this many registers renews a stale image

struct Answer {
  ExceptionCode exception = kNoException;
  std::vector<int> words;
  bool operator==(const Answer&) const = default;
};

/// Registers: float 0-1, int16 2, text 3-4 (slow), uint16 6, write-only 7, uint16 8; bits 0, 1, 3.
class RegisterImageTest : public testing::TestWithParam<OnBad> {
 protected:
  RegisterImageTest() : config_(MakeConfig({MakeDevice(1, Points())})) {
    config_.lines[0].devices[0].on_bad = GetParam();
    map_.emplace(config_);
    store_.emplace(config_);
    image_.emplace(map_->unit(1));
  }

  static std::vector<config::Point> Points() {
    std::vector<config::Point> points = {
        MakePoint(Type::float32, 0),
        MakePoint(Type::int16, 2),
        MakeText(4, 3),
        MakePoint(Type::uint16, 6),
        MakePoint(Type::uint16, 7, config::Access::write),
        MakePoint(Type::uint16, 8),
        MakePoint(Type::boolean, 0),
        MakePoint(Type::boolean, 1),
        MakePoint(Type::boolean, 3),
    };
    points[2].group = config::Group::slow;
    return points;
  }

  void Update(std::uint32_t index, Value value, Quality quality = Quality::good,
              Instant at = kStart) {
    const bus::Sample sample{index, std::move(value), quality};
    store_->Update(0, std::span(&sample, 1), {at, {}}, 3ms);
  }
  void UpdateAll(Instant at = kStart) {
    const std::vector<Value> values = {123456.0,
                                       std::int64_t{-5},
                                       std::string("OK"),
                                       std::int64_t{6},
                                       std::int64_t{7},
                                       std::int64_t{8},
                                       true,
                                       false,
                                       true};
    for (std::uint32_t i = 0; i < values.size(); ++i) Update(i, values[i], Quality::good, at);
  }

  bool Refresh(Instant now, std::size_t asked = kAll) {
    bool fresh = false;
    store_->Read(
        0, [&](const bus::DeviceRecord& record) { fresh = image_->Refresh(record, now, asked); });
    return fresh;
  }

  template <typename Word>
  Answer Direct(Table table, std::uint16_t start, std::uint16_t count, Instant now) {
    std::vector<Word> out(count);
    std::vector<Piece> pieces;
    Answer answer;
    answer.exception = PlanRead(map_->unit(1), table, start, count, pieces);
    if (answer.exception != kNoException) return answer;
    store_->Read(0, [&](const bus::DeviceRecord& record) {
      if constexpr (std::is_same_v<Word, std::uint8_t>) {
        answer.exception = FillBits(record, pieces, now, out);
      } else {
        answer.exception = FillRegisters(record, pieces, now, out);
      }
    });
    if (answer.exception == kNoException) answer.words.assign(out.begin(), out.end());
    return answer;
  }

  /// Compares the image with a direct read, for all ranges of up to twelve words. The image must
  /// know exactly the ranges that a direct read can read.
  template <typename Word>
  std::size_t CompareTable(Table table, Instant now) {
    std::size_t found = 0;
    for (const std::uint16_t base : {std::uint16_t{0}, kQualityOffset}) {
      for (std::uint16_t start = base; start < base + 12; ++start) {
        for (std::uint16_t count = 1; count <= 12; ++count) {
          const auto place = image_->Find(table, start, count);
          if (table == Table::bits && count == 1 && base == 0) {
            EXPECT_FALSE(place);
            continue;
          }
          const Answer direct = Direct<Word>(table, start, count, now);
          EXPECT_EQ(place.has_value(),
                    direct.exception == kNoException || direct.exception == kNoTarget)
              << start << '+' << count;
          if (!place) continue;
          ++found;
          std::vector<Word> out(count);
          Answer image{image_->Copy(*place, std::span(out)), {}};
          if (image.exception == kNoException) image.words.assign(out.begin(), out.end());
          EXPECT_EQ(image, direct) << start << '+' << count;
        }
      }
    }
    return found;
  }

  void Compare(Instant now) {
    ASSERT_TRUE(Refresh(now));
    EXPECT_GT(CompareTable<std::uint16_t>(Table::registers, now), 20U);
    EXPECT_GT(CompareTable<std::uint8_t>(Table::bits, now), 4U);
  }

  config::Config config_;
  std::optional<RegisterMap> map_;
  std::optional<bus::PointStore> store_;
  std::optional<RegisterImage> image_;
};

TEST_P(RegisterImageTest, MatchesADirectReadForEveryQuality) {
  Compare(kStart);
  UpdateAll();
  Compare(kStart);
  for (const Quality quality :
       {Quality::uncertain, Quality::uncertain_last_usable, Quality::uncertain_sub_normal,
        Quality::bad, Quality::bad_configuration, Quality::bad_not_connected,
        Quality::bad_device_failure, Quality::bad_sensor_failure, Quality::bad_last_known,
        Quality::bad_communication, Quality::bad_out_of_service, Quality::bad_waiting}) {
    for (const std::uint32_t point : {0U, 1U, 2U, 5U, 6U}) {
      Update(point, Value(), quality);
      Compare(kStart);
      Update(point, std::int64_t{1});
    }
  }
}

TEST_P(RegisterImageTest, MatchesADirectReadForValuesThatDoNotFit) {
  UpdateAll();
  Update(1, std::int64_t{40000});
  Update(6, std::numeric_limits<double>::quiet_NaN());
  Compare(kStart);
}

TEST_P(RegisterImageTest, AgeingMakesTheImageStaleWhenAQualityChanges) {
  UpdateAll();
  Update(1, std::int64_t{1}, Quality::good, kStart + 500ms);
  ASSERT_TRUE(Refresh(kStart));
  EXPECT_TRUE(Refresh(kStart + 3s, 0));
  for (const Duration age : {3s + 1ns, 3s + 500ms + 1ns, 9s + 1ns, 9s + 500ms + 1ns}) {
    EXPECT_FALSE(Refresh(kStart + age, 0)) << FormatDuration(age);
    Compare(kStart + age);
    EXPECT_TRUE(Refresh(kStart + age, 0));
  }
  EXPECT_FALSE(Refresh(kStart, 0)) << "it says nothing about the time before it was made";
}

TEST_P(RegisterImageTest, EveryChangeMakesTheImageStale) {
  UpdateAll();
  Compare(kStart);
  Update(3, std::int64_t{66});
  EXPECT_FALSE(Refresh(kStart, 0));
  Compare(kStart);
  for (const bus::Override why :
       {bus::Override(Quality::bad_out_of_service), bus::Override(Quality::bad_not_connected),
        bus::Override(Quality::bad_communication), bus::Override(QualityOfDevice(Reason::swapped)),
        bus::Override()}) {
    store_->SetOverride(0, why);
    EXPECT_FALSE(Refresh(kStart, 0));
    Compare(kStart);
    Compare(kStart + 4s);
    ASSERT_TRUE(Refresh(kStart));
  }
  store_->SetLineCycle(0, 60s, kStart);
  EXPECT_FALSE(Refresh(kStart, 0));
  Compare(kStart + 100s);
  store_->SetLineCycle(0, 1ms, kStart);
  Compare(kStart + 100s);
}

TEST_P(RegisterImageTest, AChangeOfNoValueKeepsTheImageFresh) {
  UpdateAll();
  Compare(kStart);
  store_->UpdateStatus(0, [](bus::DeviceStatus& status) { ++status.exchanges; });
  store_->SetLineCycle(0, 1ms, kStart);
  EXPECT_TRUE(Refresh(kStart, 0));
}

TEST_P(RegisterImageTest, AStaleImageIsRebuiltAfterItsSizeHasBeenRead) {
  UpdateAll();
  constexpr std::size_t kWords = 7 + 3;
  EXPECT_FALSE(Refresh(kStart, kWords - 1));
  EXPECT_TRUE(Refresh(kStart, 1));
  Update(0, 1.0);
  EXPECT_FALSE(Refresh(kStart, kWords - 1)) << "the count begins again";
}

INSTANTIATE_TEST_SUITE_P(OnBad, RegisterImageTest,
                         testing::Values(OnBad::exception, OnBad::hold, OnBad::nan));

using Registers = std::vector<std::uint16_t>;

constexpr auto kTarget = kNoTarget;

/// A device with a float at 0-1, an int16 at 2, a text at 3-4, and bits at 0 and 1.
class RegisterContentsTest : public testing::Test {
 protected:
  explicit RegisterContentsTest(OnBad on_bad = OnBad::exception)
      : config_(MakeConfig(
            {MakeDevice(1, {MakePoint(Type::float32, 0), MakePoint(Type::int16, 2), MakeText(4, 3),
                            MakePoint(Type::boolean, 0), MakePoint(Type::boolean, 1)})})) {
    config_.lines[0].devices[0].on_bad = on_bad;
    map_.emplace(config_);
    store_.emplace(config_);
  }

  config::Point& point(std::size_t index) { return config_.lines[0].devices[0].points[index]; }

  void Update(std::uint32_t index, Value value, Quality quality = Quality::good) {
    Renew(*store_, config_);
    const bus::Sample sample{index, std::move(value), quality};
    store_->Update(0, std::span(&sample, 1), {kStart, {}}, 3ms);
  }
  void UpdateAll() {
    Update(0, 123456.0);
    Update(1, std::int64_t{-5});
    Update(2, std::string("OK"));
    Update(3, true);
    Update(4, false);
  }

  Registers Read(std::uint16_t start, std::uint16_t count, Instant now = kStart) {
    Registers out(count, 0xEEEE);
    std::vector<Piece> pieces;
    exception_ = PlanRead(map_->unit(1), Table::registers, start, count, pieces);
    if (exception_ == kNoException) {
      store_->Read(0, [&](const bus::DeviceRecord& record) {
        exception_ = FillRegisters(record, pieces, now, out);
      });
    }
    if (exception_ != kNoException) out.clear();
    return out;
  }

  std::vector<int> ReadBits(std::uint16_t start, std::uint16_t count, Instant now = kStart) {
    std::vector<std::uint8_t> out(count, 0xEE);
    std::vector<Piece> pieces;
    exception_ = PlanRead(map_->unit(1), Table::bits, start, count, pieces);
    if (exception_ == kNoException) {
      store_->Read(0, [&](const bus::DeviceRecord& record) {
        exception_ = FillBits(record, pieces, now, out);
      });
    }
    if (exception_ != kNoException) return {};
    return {out.begin(), out.end()};
  }

  config::Config config_;
  std::optional<RegisterMap> map_;
  std::optional<bus::PointStore> store_;
  ExceptionCode exception_ = kNoException;
};

class HoldContentsTest : public RegisterContentsTest {
 protected:
  HoldContentsTest() : RegisterContentsTest(OnBad::hold) {}
};

class NanImageTest : public RegisterContentsTest {
 protected:
  NanImageTest() : RegisterContentsTest(OnBad::nan) {}
};

TEST_F(RegisterContentsTest, AdjacentGoodValuesAreReadTogether) {
  UpdateAll();
  EXPECT_EQ(Read(0, 5), (Registers{0x47F1, 0x2000, 0xFFFB, 0x4F4B, 0}));
  EXPECT_EQ(ReadBits(0, 2), (std::vector{1, 0}));
}

TEST_F(RegisterContentsTest, AnUnreadValueIsAnExceptionButItsQualityAndAgeAreReadable) {
  Update(1, std::int64_t{7});
  EXPECT_EQ(Read(2, 1), Registers{7});
  Read(0, 3);
  EXPECT_EQ(exception_, kTarget) << "one value that was never read spoils the whole request";
  EXPECT_EQ(Read(20000, 3), (Registers{0x20, 0x20, 0xC0}));
  EXPECT_EQ(Read(40000, 3), (Registers{0xFFFF, 0xFFFF, 0}));
  ReadBits(0, 1);
  EXPECT_EQ(exception_, kTarget);
  EXPECT_EQ(ReadBits(20000, 2), (std::vector{0, 0}));
}

TEST_F(RegisterContentsTest, AnAgeingValueBecomesUncertainAndThenAnException) {
  UpdateAll();
  EXPECT_EQ(Read(2, 1, kStart + 4s), Registers{0xFFFB});
  EXPECT_EQ(Read(20002, 1, kStart + 4s), Registers{0x44});
  EXPECT_EQ(Read(40002, 1, kStart + 4s), Registers{40});
  EXPECT_EQ(ReadBits(20000, 1, kStart + 4s), std::vector{0}) << "uncertain is not good";
  EXPECT_EQ(ReadBits(0, 1, kStart + 4s), std::vector{1});
  Read(2, 1, kStart + 10s);
  EXPECT_EQ(exception_, kTarget);
  EXPECT_EQ(Read(20002, 1, kStart + 10s), Registers{0x18});
  EXPECT_EQ(Read(40002, 1, kStart + 7000s), Registers{0xFFFF});
  EXPECT_EQ(Read(40002, 1, kStart - 1s), Registers{0}) << "read between clock and lock";
}

TEST_F(RegisterContentsTest, EveryOverrideIsAnException) {
  UpdateAll();
  const std::pair<bus::Override, std::uint16_t> cases[] = {
      {Quality(Quality::bad_out_of_service), 0x1C},
      {Quality(Quality::bad_not_connected), 0x08},
      {Quality(Quality::bad_communication), 0x18},
      {QualityOfDevice(Reason::other_module), 0x0804},
      {QualityOfDevice(Reason::swapped), 0x090C}};
  for (const auto& [why, quality] : cases) {
    store_->SetOverride(0, why);
    Read(0, 2);
    EXPECT_EQ(exception_, kTarget);
    EXPECT_EQ(Read(20000, 1), Registers{quality});
  }
}

TEST_F(RegisterContentsTest, FaultsOfOneChannelLeaveTheOthersReadable) {
  UpdateAll();
  Update(0, Value(), Quality::bad_sensor_failure);
  Update(1, Value(), Quality::bad_device_failure);
  EXPECT_EQ(Read(0, 5), (Registers{0x7FC0, 0, 0xFFFB, 0x4F4B, 0}));
  EXPECT_EQ(Read(20000, 4), (Registers{0x10, 0x10, 0x0C, 0xC0}));
  Update(3, Value(), Quality::bad_sensor_failure);
  EXPECT_EQ(ReadBits(0, 2), (std::vector{1, 0})) << "held";
  EXPECT_EQ(ReadBits(20000, 2), (std::vector{0, 1}));
}

TEST_F(RegisterContentsTest, AFaultBeforeTheFirstValueShowsNoPlausibleNumber) {
  Update(1, Value(), Quality::bad_sensor_failure);
  EXPECT_EQ(Read(2, 1), Registers{0x8000});
}

TEST_F(RegisterContentsTest, AnUnreadBitIsAnExceptionWhenReadAlone) {
  Update(3, Value(), Quality(Quality::bad_configuration, Reason::not_fitted));
  Update(4, true);
  EXPECT_EQ(ReadBits(0, 2), (std::vector{0, 1})) << "a block is not spoiled";
  EXPECT_EQ(ReadBits(20000, 2), (std::vector{0, 1}));
  ReadBits(0, 1);
  EXPECT_EQ(exception_, kTarget);
}

TEST_F(RegisterContentsTest, OnFaultMayNameAValue) {
  point(0).on_fault = point(1).on_fault = {config::OnFault::Kind::value, -999};
  point(3).on_fault = {config::OnFault::Kind::value, 1};
  UpdateAll();
  Update(0, Value(), Quality::bad_sensor_failure);
  Update(1, Value(), Quality::bad_sensor_failure);
  Update(3, false);
  Update(3, Value(), Quality::bad_sensor_failure);
  EXPECT_EQ(Read(0, 3), (Registers{0xC479, 0xC000, 0xFC19}));
  EXPECT_EQ(ReadBits(0, 1), std::vector{1});
}

TEST_F(RegisterContentsTest, ASubstituteThatDoesNotFitIsShownAsNoValue) {
  point(1).on_fault = {config::OnFault::Kind::value, 99999};
  Update(1, Value(), Quality::bad_sensor_failure);
  EXPECT_EQ(Read(2, 1), Registers{0x8000});
}

TEST_F(RegisterContentsTest, AGoodValueThatDoesNotFitIsShownAsAFault) {
  UpdateAll();
  Update(1, std::int64_t{40000});
  EXPECT_EQ(Read(1 + 1, 1), Registers{0x8000});
  EXPECT_EQ(Read(20002, 1), Registers{0x0D04});
}

TEST_F(HoldContentsTest, TheLastValueStaysWhateverTheTrouble) {
  UpdateAll();
  store_->SetOverride(0, Quality::bad_communication);
  EXPECT_EQ(Read(0, 3), (Registers{0x47F1, 0x2000, 0xFFFB}));
  EXPECT_EQ(ReadBits(0, 1), std::vector{1});
  EXPECT_EQ(Read(20000, 1), Registers{0x18});
}

TEST_F(HoldContentsTest, NothingToHoldIsAnException) {
  Read(0, 2);
  EXPECT_EQ(exception_, kTarget);
}

TEST_F(NanImageTest, FloatsAndTextsHaveANoValuePatternAndIntegersDoNot) {
  UpdateAll();
  store_->SetOverride(0, Quality::bad_not_connected);
  EXPECT_EQ(Read(0, 2), (Registers{0x7FC0, 0}));
  EXPECT_EQ(Read(3, 2), (Registers{0, 0}));
  Read(2, 1);
  EXPECT_EQ(exception_, kTarget);
  ReadBits(0, 1);
  EXPECT_EQ(exception_, kTarget);
}

TEST_F(RegisterContentsTest, TheStatusBlockIsServedInEveryDeviceState) {
  EXPECT_EQ(Read(9000, 4), (Registers{0, 0, 0xFFFF, 0xFFFF}));
  store_->UpdateStatus(0, [](bus::DeviceStatus& status) {
    status.state = bus::DeviceState::degraded;
    status.last_outcome = Outcome::corrupt;
    status.last_ok = kStart - 70s;
    status.exchanges = 0x10002;
    status.outcomes = {0, 5, 6, 7, 8};
    status.retries = 9;
    status.round_trips.Add(10ms);
    status.round_trips.Add(30ms);
  });
  EXPECT_EQ(Read(9000, 16), (Registers{2, 4, 1, 4464, 1, 2, 0, 5, 0, 6, 0, 8, 0, 9, 30, 20}));
  EXPECT_EQ(Read(9002, 2, kStart + std::chrono::hours(2000)), (Registers{0xFFFF, 0xFFFF}));
}

TEST(GatewayBlock, CountersSaturate) {
  const GatewayFigures info{1, 2, 3, 70000s, 4, 3, 70000, 12};
  ModbusCounters counters;
  counters.clients = 5;
  counters.requests = 0x10007;
  counters.exceptions = 9;
  EXPECT_EQ(GatewayBlockOf(info, counters),
            (GatewayBlock{10203, 4, 1, 4464, 0xFFFF, 12, 5, 3, 1, 7, 0, 9}));
}

TEST_F(RegisterContentsTest, HolesReadZero) {
  UpdateAll();
  std::vector<std::uint16_t> out(3, 0xEEEE);
  const Piece hole{Area::hole, 0, 1, 2};
  store_->Read(0, [&](const bus::DeviceRecord& record) {
    EXPECT_EQ(FillRegisters(record, std::span(&hole, 1), kStart, out), kNoException);
  });
  EXPECT_EQ(out, (std::vector<std::uint16_t>{0xEEEE, 0, 0}));
  std::vector<std::uint8_t> bits(3, 0xEE);
  store_->Read(0, [&](const bus::DeviceRecord& record) {
    EXPECT_EQ(FillBits(record, std::span(&hole, 1), kStart, bits), kNoException);
  });
  EXPECT_EQ(bits, (std::vector<std::uint8_t>{0xEE, 0, 0}));
}

using ::testing::Each;
using ::testing::ElementsAreArray;

std::vector<std::uint16_t> Part(const EventBlock& block, std::size_t from, std::size_t count) {
  return {block.begin() + static_cast<std::ptrdiff_t>(from),
          block.begin() + static_cast<std::ptrdiff_t>(from + count)};
}

TEST(EventBlockTest, HasItsFieldsAtTheDocumentedRegisters) {
  events::EventFeed::Page shown{.newest = 0x12345, .oldest = 0x10002, .lost = 0x30004};
  auto& event = shown.events.emplace_back();
  event.seq = 0x10003;
  event.device_time = WallTime(std::chrono::seconds(0x6A2B3C4D) + 678ms + 999us);
  event.clock = events::ClockQuality::minute_guessed;
  event.channel = 2;
  event.code = 0x70008;
  event.state = config::EventState::message;
  const EventBlock block = EventBlockOf(shown, 0x10003);
  const std::uint16_t head[] = {1, 3, 1, 0x2345, 1, 2, 3, 4, 1, 0};
  EXPECT_THAT(Part(block, 0, 10), ElementsAreArray(head));
  const std::uint16_t record[] = {1, 3, 0x6A2B, 0x3C4D, 678, 3, 2, 7, 8, 2};
  EXPECT_THAT(Part(block, 10, 10), ElementsAreArray(record));
  EXPECT_THAT(Part(block, 20, 60), Each(0));
}

TEST(EventBlockTest, HasAtMostSevenRecords) {
  events::EventFeed::Page shown;
  for (std::int64_t seq = 1; seq <= 9; ++seq) shown.events.emplace_back().seq = seq;
  const EventBlock block = EventBlockOf(shown, 0);
  EXPECT_EQ(block[8], 7);
  for (std::size_t i = 0; i < 7; ++i) EXPECT_EQ(block[11 + 10 * i], i + 1);
}

TEST(EventBlockTest, ClampsFieldsThatDoNotFit) {
  events::EventFeed::Page shown{.newest = (std::int64_t{1} << 32) + 5, .lost = ~0ULL};
  auto& event = shown.events.emplace_back();
  event.seq = shown.newest;
  event.device_time = WallTime(-5s);
  event.channel = 70000;
  event.state = config::EventState::on;
  const EventBlock block = EventBlockOf(shown, 0xFFFFFFFF);
  const std::uint16_t expected[] = {0xFFFF, 0xFFFF, 0, 5, 0, 0, 0xFFFF, 0xFFFF, 1, 0,
                                    0,      5,      0, 0, 0, 0, 0xFFFF, 0,      0, 1};
  EXPECT_THAT(Part(block, 0, 20), ElementsAreArray(expected));
}

}  // namespace
}  // namespace baudgate::modbus
