// What a device's record looks like in registers and bits, good, bad, aged and never read.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/registers/register_contents.h"

#include <gtest/gtest.h>

#include "tests/gateway/outputs/modbus/registers/points.h"
#include "tests/support/times.h"

namespace baudgate::modbus {
namespace {

using config::OnBad;
using config::Table;
using config::Type;
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
    const Sample sample{index, std::move(value), quality};
    store_->Update(0, std::span(&sample, 1), {kStart, {}}, 3ms);
  }
  void UpdateAll() {
    Update(0, 123456.0);
    Update(1, std::int64_t{-5});
    Update(2, std::string("OK"));
    Update(3, true);
    Update(4, false);
  }

  /// The registers, or nothing and `exception_`.
  Registers Read(std::uint16_t start, std::uint16_t count, Instant now = kStart) {
    Registers out(count, 0xEEEE);
    std::vector<Piece> pieces;
    exception_ = PlanRead(map_->unit(1), Table::registers, start, count, pieces);
    if (exception_ == kNoException) {
      store_->Read(0, [&](const DeviceRecord& record) {
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
      store_->Read(
          0, [&](const DeviceRecord& record) { exception_ = FillBits(record, pieces, now, out); });
    }
    if (exception_ != kNoException) return {};
    return {out.begin(), out.end()};
  }

  config::Config config_;
  std::optional<RegisterMap> map_;
  std::optional<PointStore> store_;
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

TEST_F(RegisterContentsTest, GoodValuesStandSideBySide) {
  UpdateAll();
  EXPECT_EQ(Read(0, 5), (Registers{0x47F1, 0x2000, 0xFFFB, 0x4F4B, 0}));
  EXPECT_EQ(ReadBits(0, 2), (std::vector{1, 0}));
}

TEST_F(RegisterContentsTest, NeverReadIsAnExceptionButItsQualityAndAgeAreNot) {
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

TEST_F(RegisterContentsTest, AgeingIsUncertainFirstAndThenAnException) {
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
  const std::pair<Override, std::uint16_t> cases[] = {
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

TEST_F(RegisterContentsTest, AFaultBeforeTheFirstValueShowsNoNumberThatLooksReal) {
  Update(1, Value(), Quality::bad_sensor_failure);
  EXPECT_EQ(Read(2, 1), Registers{0x8000});
}

TEST_F(RegisterContentsTest, ABitThatWasNeverReadIsNoZeroWhenAskedForAlone) {
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

TEST_F(RegisterContentsTest, ASubstituteThatDoesNotFitIsNoValue) {
  point(1).on_fault = {config::OnFault::Kind::value, 99999};
  Update(1, Value(), Quality::bad_sensor_failure);
  EXPECT_EQ(Read(2, 1), Registers{0x8000});
}

TEST_F(RegisterContentsTest, AGoodValueThatDoesNotFitIsAFaultAndSaysSo) {
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

TEST_F(NanImageTest, FloatsAndTextsHaveOneIntegersHaveNot) {
  UpdateAll();
  store_->SetOverride(0, Quality::bad_not_connected);
  EXPECT_EQ(Read(0, 2), (Registers{0x7FC0, 0}));
  EXPECT_EQ(Read(3, 2), (Registers{0, 0}));
  Read(2, 1);
  EXPECT_EQ(exception_, kTarget);
  ReadBits(0, 1);
  EXPECT_EQ(exception_, kTarget);
}

TEST_F(RegisterContentsTest, StatusBlockIsServedWhateverTheDeviceDoes) {
  EXPECT_EQ(Read(9000, 4), (Registers{0, 0, 0xFFFF, 0xFFFF}));
  store_->UpdateStatus(0, [](DeviceStatus& status) {
    status.state = DeviceState::degraded;
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

TEST(GatewayBlock, CountsAndSaturates) {
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
  store_->Read(0, [&](const DeviceRecord& record) {
    EXPECT_EQ(FillRegisters(record, std::span(&hole, 1), kStart, out), kNoException);
  });
  EXPECT_EQ(out, (std::vector<std::uint16_t>{0xEEEE, 0, 0}));
  std::vector<std::uint8_t> bits(3, 0xEE);
  store_->Read(0, [&](const DeviceRecord& record) {
    EXPECT_EQ(FillBits(record, std::span(&hole, 1), kStart, bits), kNoException);
  });
  EXPECT_EQ(bits, (std::vector<std::uint8_t>{0xEE, 0, 0}));
}

}  // namespace
}  // namespace baudgate::modbus
