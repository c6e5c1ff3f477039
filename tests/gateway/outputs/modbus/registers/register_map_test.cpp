// Tests of `RegisterMap`, and of the encoding of values.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/registers/register_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/gateway/outputs/modbus/registers/points.h"

namespace baudgate::modbus {
namespace {

using config::Access;
using config::Table;
using config::Type;

constexpr auto kNone = kNoException;

class RegisterMapTest : public testing::Test {
 protected:
  // Registers: int16 0, float 1, int64 3, int16 8 (rw), float 9 (rw), write-only 11, int16 8999,
  // 9100 and 19999; bits 0, 1 (rw), 5.
  RegisterMapTest()
      : config_(MakeConfig(
            {MakeDevice(5, {}),
             MakeDevice(
                 7, {MakePoint(Type::int16, 0), MakePoint(Type::float32, 1),
                     MakePoint(Type::int64, 3), MakePoint(Type::int16, 8, Access::read_write),
                     MakePoint(Type::float32, 9, Access::read_write),
                     MakePoint(Type::int16, 11, Access::write), MakePoint(Type::boolean, 0),
                     MakePoint(Type::boolean, 1, Access::read_write), MakePoint(Type::boolean, 5),
                     MakePoint(Type::int16, 8999), MakePoint(Type::int16, 9100),
                     MakePoint(Type::int16, 19999)})})),
        map_(config_) {}

  ExceptionCode Read(std::uint16_t start, std::uint16_t count, Table table = Table::registers) {
    return PlanRead(map_.unit(7), table, start, count, pieces_);
  }
  ExceptionCode ReadOver(std::uint16_t start, std::uint16_t count) {
    return PlanRead(map_.unit(7), Table::registers, start, count, pieces_, Holes::zero);
  }
  ExceptionCode Write(std::uint16_t start, std::uint16_t count, Table table = Table::registers) {
    return PlanWrite(map_.unit(7), table, start, count, pieces_);
  }

  config::Config config_;
  RegisterMap map_;
  std::vector<Piece> pieces_;
};

TEST_F(RegisterMapTest, UnitsAreMappedToTheirDevices) {
  EXPECT_EQ(map_.unit(5).device, 0U);
  EXPECT_EQ(map_.unit(7).device, 1U);
  EXPECT_EQ(map_.unit(7).kind, UnitMap::Kind::device);
  EXPECT_EQ(map_.unit(6).kind, UnitMap::Kind::unmapped);
  EXPECT_EQ(map_.unit(0).kind, UnitMap::Kind::gateway);
  EXPECT_EQ(map_.unit(255).kind, UnitMap::Kind::gateway);
}

TEST_F(RegisterMapTest, DevicesWithoutAUnitAreCountedInDeviceNumbers) {
  config::Config config = MakeConfig({MakeDevice(1, {}), MakeDevice(2, {})});
  config.lines[0].devices[0].unit.reset();
  config.lines.push_back(MakeConfig({MakeDevice(3, {})}).lines[0]);
  const RegisterMap map(config);
  EXPECT_EQ(map.unit(1).kind, UnitMap::Kind::unmapped);
  EXPECT_EQ(map.unit(2).device, 1U);
  EXPECT_EQ(map.unit(3).device, 2U);
}

TEST_F(RegisterMapTest, ARangeIsDividedIntoItsValues) {
  ASSERT_EQ(Read(0, 7), kNone);
  ASSERT_EQ(pieces_.size(), 3U);
  EXPECT_EQ(pieces_[1].index, 1U);
  EXPECT_EQ(pieces_[1].offset, 1);
  EXPECT_EQ(pieces_[1].count, 2);
  EXPECT_EQ(pieces_[2].offset, 3);
  EXPECT_EQ(pieces_[2].count, 4);
}

TEST_F(RegisterMapTest, AnUnmappedAddressRefusesTheWholeRange) {
  EXPECT_EQ(Read(7, 1), kIllegalAddress);
  EXPECT_EQ(Read(3, 6), kIllegalAddress);
  EXPECT_EQ(Read(2, 6), kIllegalAddress) << "unmapped counts before cut";
  EXPECT_EQ(Read(12, 1), kIllegalAddress);
  EXPECT_EQ(Read(65535, 1), kIllegalAddress);
}

TEST_F(RegisterMapTest, AReadOfHalfAValueIsRefused) {
  EXPECT_EQ(Read(1, 1), kIllegalValue);
  EXPECT_EQ(Read(2, 1), kIllegalValue);
  EXPECT_EQ(Read(0, 2), kIllegalValue);
  EXPECT_EQ(Read(4, 2), kIllegalValue);
  EXPECT_EQ(Read(2, 5), kIllegalValue);
}

TEST_F(RegisterMapTest, WriteOnlyPointsCanNotBeRead) {
  EXPECT_EQ(Read(11, 1), kIllegalAddress);
  EXPECT_EQ(Read(20011, 1), kIllegalAddress);
  EXPECT_EQ(Write(11, 1), kNone);
}

TEST_F(RegisterMapTest, MirrorsMayBeReadInParts) {
  EXPECT_EQ(Read(20002, 1), kNone);
  ASSERT_EQ(Read(20002, 2), kNone);
  ASSERT_EQ(pieces_.size(), 2U);
  EXPECT_EQ(pieces_[0].area, Area::quality);
  EXPECT_EQ(pieces_[0].index, 1U);
  EXPECT_EQ(pieces_[1].index, 2U);
  ASSERT_EQ(Read(40001, 2), kNone);
  EXPECT_EQ(pieces_[0].area, Area::age);
  EXPECT_EQ(Read(20007, 1), kIllegalAddress);
  EXPECT_EQ(Read(40007, 1), kIllegalAddress);
  EXPECT_EQ(Read(29000, 1), kIllegalAddress) << "the status block has no quality";
}

TEST_F(RegisterMapTest, AdjacentAreasAreReadTogether) {
  EXPECT_EQ(Read(8999, 1), kNone);
  EXPECT_EQ(Read(9100, 1), kNone);
  EXPECT_EQ(Read(19999, 1), kNone);
  ASSERT_EQ(Read(19999, 2), kNone) << "the last value and the quality of the first";
  EXPECT_EQ(pieces_[1].area, Area::quality);
  EXPECT_EQ(Read(39999, 2), kNone) << "the last quality and the first age";
  EXPECT_EQ(Read(59999, 1), kNone);
  EXPECT_EQ(Read(59999, 2), kIllegalAddress);
}

TEST_F(RegisterMapTest, TheStatusBlockIsReadInWholeFields) {
  ASSERT_EQ(Read(9000, 16), kNone);
  EXPECT_EQ(pieces_[0].area, Area::status);
  EXPECT_EQ(Read(9004, 4), kNone);
  EXPECT_EQ(Read(9015, 1), kNone);
  EXPECT_EQ(Read(9002, 1), kIllegalValue);
  EXPECT_EQ(Read(9003, 1), kIllegalValue);
  EXPECT_EQ(Read(8999, 2), kNone) << "a value and the status block in one range";
  EXPECT_EQ(Read(9000, 1, Table::bits), kIllegalAddress);
  EXPECT_EQ(Write(9000, 1), kIllegalAddress);
  EXPECT_EQ(PlanRead(map_.unit(5), Table::registers, 9000, 16, pieces_), kNone);
  EXPECT_EQ(PlanRead(map_.unit(255), Table::registers, 9000, 12, pieces_), kNone);
  EXPECT_EQ(PlanRead(map_.unit(255), Table::registers, 0, 1, pieces_), kIllegalAddress);
}

TEST_F(RegisterMapTest, TheEventBlockIsReadInWholeFields) {
  const struct {
    std::uint16_t start;
    std::uint16_t count;
    ExceptionCode expected;
  } cases[] = {
      {9016, 80, kNone},          {9016, 81, kIllegalAddress},
      {9016, 10, kNone},          {9016, 2, kNone},
      {9016, 1, kIllegalValue},   {9017, 1, kIllegalValue},
      {9017, 2, kIllegalValue},   {9018, 2, kNone},
      {9024, 1, kNone},           {9025, 1, kNone},
      {9026, 10, kNone},          {9026, 2, kNone},
      {9026, 1, kIllegalValue},   {9027, 9, kIllegalValue},
      {9030, 1, kNone},           {9033, 1, kIllegalValue},
      {9033, 2, kNone},           {9035, 1, kNone},
      {9086, 10, kNone},          {9094, 2, kIllegalValue},
      {9095, 1, kNone},           {9095, 2, kIllegalAddress},
      {9096, 1, kIllegalAddress}, {9000, 96, kNone},
      {9000, 18, kNone},          {9000, 17, kIllegalValue},
      {9099, 1, kIllegalAddress},
  };
  for (const auto& c : cases) {
    EXPECT_EQ(Read(c.start, c.count), c.expected) << c.start << ", " << c.count;
    EXPECT_EQ(Read(c.start, c.count, Table::bits), kIllegalAddress);
    EXPECT_EQ(Write(c.start, c.count), kIllegalAddress);
  }
  ASSERT_EQ(Read(9014, 4), kNone);
  ASSERT_EQ(pieces_.size(), 2U);
  EXPECT_EQ(pieces_[1].area, Area::events);
  EXPECT_EQ(pieces_[1].index, 0U);
  EXPECT_EQ(pieces_[1].offset, 2);
  EXPECT_EQ(PlanRead(map_.unit(255), Table::registers, 9016, 80, pieces_), kNone);
  EXPECT_EQ(PlanRead(map_.unit(255), Table::registers, 9000, 96, pieces_), kIllegalAddress);
  EXPECT_EQ(PlanRead(map_.unit(255), Table::registers, 9000, 96, pieces_, Holes::zero), kNone);
}

TEST_F(RegisterMapTest, BitsHaveTheirOwnTable) {
  EXPECT_EQ(Read(0, 2, Table::bits), kNone);
  EXPECT_EQ(Read(0, 3, Table::bits), kIllegalAddress);
  EXPECT_EQ(Read(20005, 1, Table::bits), kNone);
  EXPECT_EQ(Read(20006, 1, Table::bits), kIllegalAddress);
  EXPECT_EQ(Read(40005, 1, Table::bits), kIllegalAddress) << "bits have no age";
}

TEST_F(RegisterMapTest, WritesCoverWholePoints) {
  EXPECT_EQ(Write(8, 1), kNone);
  EXPECT_EQ(Write(8, 4), kNone);
  EXPECT_EQ(pieces_.size(), 3U);
  EXPECT_EQ(Write(7, 1), kIllegalAddress) << "no point";
  EXPECT_EQ(Write(9, 1), kIllegalValue);
  EXPECT_EQ(Write(8, 2), kIllegalValue);
  EXPECT_EQ(Write(20008, 1), kIllegalAddress);
  EXPECT_EQ(Write(1, 1, Table::bits), kNone);
  EXPECT_EQ(Write(1, 2, Table::bits), kIllegalAddress);
}

TEST(RegisterMap, PointsAtReservedAddressesAreNotServed) {
  const config::Config config =
      MakeConfig({MakeDevice(1, {MakePoint(Type::int16, 1), MakePoint(Type::float32, 0),
                                 MakePoint(Type::float32, 8999), MakePoint(Type::int16, 9050),
                                 MakePoint(Type::float32, 19999), MakePoint(Type::int16, 30000)})});
  const RegisterMap map(config);
  ASSERT_EQ(map.unit(1).registers.size(), 1U);
  EXPECT_EQ(map.unit(1).registers[0].point, 0U);
}

TEST_F(RegisterMapTest, EachHoleIsOnePieceWhereTheListenerAllowsHoles) {
  EXPECT_EQ(ReadOver(3, 6), kNone) << "int64 at 3, nothing at 7, int16 at 8";
  ASSERT_EQ(pieces_.size(), 3U);
  EXPECT_EQ(pieces_[1].area, Area::hole);
  EXPECT_EQ(pieces_[1].offset, 4);
  EXPECT_EQ(pieces_[1].count, 1);
  EXPECT_EQ(ReadOver(11, 1), kIllegalAddress) << "nothing but a hole: a point that is only written";
  EXPECT_EQ(ReadOver(4000, 100), kIllegalAddress);
  EXPECT_EQ(ReadOver(8, 100), kNone);
  EXPECT_EQ(pieces_.back().count, 97) << "behind the float at 9";
  EXPECT_EQ(ReadOver(7, 3), kIllegalValue) << "half a float stays an error";
  EXPECT_EQ(ReadOver(8990, 20), kNone) << "a hole, a value, the status block";
  EXPECT_EQ(pieces_.size(), 3U);
}

using config::OnBad;
using config::WordOrder;
using Registers = std::vector<std::uint16_t>;

Registers Encode(Type type, const Value& value, WordOrder order = WordOrder::abcd) {
  const config::Point point = MakePoint(type, 0);
  Registers out(config::RegisterCount(point));
  if (!EncodeRegisters(point, order, value, out)) out.clear();
  return out;
}

std::optional<Value> Decode(Type type, const Registers& registers,
                            WordOrder order = WordOrder::abcd) {
  return DecodeRegisters(MakePoint(type, 0), order, registers);
}

TEST(Encode, Float32InEveryOrder) {
  EXPECT_EQ(Encode(Type::float32, 123456.0, WordOrder::abcd), (Registers{0x47F1, 0x2000}));
  EXPECT_EQ(Encode(Type::float32, 123456.0, WordOrder::cdab), (Registers{0x2000, 0x47F1}));
  EXPECT_EQ(Encode(Type::float32, 123456.0, WordOrder::badc), (Registers{0xF147, 0x0020}));
  EXPECT_EQ(Encode(Type::float32, 123456.0, WordOrder::dcba), (Registers{0x0020, 0xF147}));
}

TEST(Encode, SixtyFourBitsInEveryOrder) {
  const Value value = std::uint64_t{0x1122334455667788};
  EXPECT_EQ(Encode(Type::uint64, value, WordOrder::abcd),
            (Registers{0x1122, 0x3344, 0x5566, 0x7788}));
  EXPECT_EQ(Encode(Type::uint64, value, WordOrder::cdab),
            (Registers{0x7788, 0x5566, 0x3344, 0x1122}));
  EXPECT_EQ(Encode(Type::uint64, value, WordOrder::badc),
            (Registers{0x2211, 0x4433, 0x6655, 0x8877}));
  EXPECT_EQ(Encode(Type::uint64, value, WordOrder::dcba),
            (Registers{0x8877, 0x6655, 0x4433, 0x2211}));
}

TEST(Encode, SixteenBitsHaveNoWordOrder) {
  for (const auto order : {WordOrder::abcd, WordOrder::cdab, WordOrder::badc, WordOrder::dcba}) {
    EXPECT_EQ(Encode(Type::int16, std::int64_t{0x1234}, order), Registers{0x1234});
    EXPECT_EQ(Decode(Type::int16, {0x1234}, order), Value(std::int64_t{0x1234}));
  }
}

TEST(Encode, NumbersOfEveryType) {
  EXPECT_EQ(Encode(Type::int16, std::int64_t{-2}), Registers{0xFFFE});
  EXPECT_EQ(Encode(Type::int32, std::int64_t{-2}), (Registers{0xFFFF, 0xFFFE}));
  EXPECT_EQ(Encode(Type::int64, std::int64_t{-2}), (Registers{0xFFFF, 0xFFFF, 0xFFFF, 0xFFFE}));
  EXPECT_EQ(Encode(Type::float64, 1.0), (Registers{0x3FF0, 0, 0, 0}));
  EXPECT_EQ(Encode(Type::uint64, std::numeric_limits<std::uint64_t>::max()),
            (Registers{0xFFFF, 0xFFFF, 0xFFFF, 0xFFFF}));
  EXPECT_EQ(Encode(Type::boolean, true), Registers{1});
  EXPECT_EQ(Encode(Type::int16, 12.5), Registers{13}) << "rounded, as a scaled integer is";
  EXPECT_EQ(Encode(Type::uint16, true), Registers{1});
}

TEST(Encode, RefusesNumbersThatDoNotFit) {
  EXPECT_TRUE(Encode(Type::int16, std::int64_t{32768}).empty());
  EXPECT_TRUE(Encode(Type::int16, std::int64_t{-32769}).empty());
  EXPECT_TRUE(Encode(Type::uint16, std::int64_t{-1}).empty());
  EXPECT_TRUE(Encode(Type::uint16, 65535.6).empty());
  EXPECT_TRUE(Encode(Type::uint32, std::int64_t{1} << 32).empty());
  EXPECT_TRUE(Encode(Type::int64, std::uint64_t{1} << 63).empty());
  EXPECT_TRUE(Encode(Type::uint64, std::int64_t{-1}).empty());
  EXPECT_TRUE(Encode(Type::uint64, 18446744073709551616.0).empty());
  EXPECT_TRUE(Encode(Type::int32, std::nan("")).empty());
  EXPECT_TRUE(Encode(Type::float32, 1e39).empty());
  EXPECT_TRUE(Encode(Type::float32, Value()).empty());
  EXPECT_TRUE(Encode(Type::float32, std::string("12")).empty());
  EXPECT_TRUE(Encode(Type::boolean, std::nan("")).empty());
}

TEST(Encode, TextsAreHighByteFirstAndPadded) {
  const config::Point point = MakeText(5, 0);
  Registers out(3, 0xEEEE);
  ASSERT_TRUE(EncodeRegisters(point, WordOrder::dcba, std::string("ABC"), out));
  EXPECT_EQ(out, (Registers{0x4142, 0x4300, 0}));
  ASSERT_TRUE(EncodeRegisters(point, WordOrder::abcd, std::string("ABCDEFGH"), out));
  EXPECT_EQ(out, (Registers{0x4142, 0x4344, 0x4500}));
  EXPECT_EQ(DecodeRegisters(point, WordOrder::abcd, Registers{0x4142, 0x4300, 0}),
            Value(std::string("ABC")));
}

TEST(Decode, ReversesEveryEncoding) {
  const std::vector<std::pair<Type, Value>> values = {
      {Type::int16, std::int64_t{-12345}},
      {Type::uint16, std::int64_t{65535}},
      {Type::int32, std::int64_t{-70000}},
      {Type::uint32, std::int64_t{0xFEDCBA98}},
      {Type::int64, std::int64_t{-1} << 40},
      {Type::uint64, std::uint64_t{0xFEDCBA9876543210}},
      {Type::float32, 123456.0},
      {Type::float64, -1.0e300},
      {Type::boolean, true}};
  for (const auto order : {WordOrder::abcd, WordOrder::cdab, WordOrder::badc, WordOrder::dcba}) {
    for (const auto& [type, value] : values) {
      EXPECT_EQ(Decode(type, Encode(type, value, order), order), value) << config::Name(type);
    }
  }
}

TEST(Decode, RefusesInvalidRegisters) {
  EXPECT_FALSE(Decode(Type::boolean, {2}));
  EXPECT_FALSE(Decode(Type::float32, {0x7FC0, 0}));
  EXPECT_FALSE(Decode(Type::float64, {0x7FF0, 0, 0, 0}));
  EXPECT_FALSE(Decode(Type::float32, {0x47F1}));
  EXPECT_FALSE(Decode(Type::int16, {}));
}

TEST(EightBits, HaveTheirOwnRegisterAndRange) {
  EXPECT_EQ(Encode(Type::int8, std::int64_t{-5}), Registers{0xFFFB});
  EXPECT_EQ(Encode(Type::uint8, std::int64_t{255}), Registers{255});
  EXPECT_TRUE(Encode(Type::int8, std::int64_t{128}).empty());
  EXPECT_TRUE(Encode(Type::uint8, std::int64_t{256}).empty());
  EXPECT_EQ(Decode(Type::int8, {0xFF80}), Value(std::int64_t{-128}));
  EXPECT_EQ(Decode(Type::uint8, {200}), Value(std::int64_t{200}));
  EXPECT_FALSE(Decode(Type::int8, {0x00FB})) << "251 is no SINT";
  EXPECT_FALSE(Decode(Type::uint8, {0x0100}));
}

TEST(NoValue, IsAnImpossibleReadingOfEachType) {
  const auto no_value = [](Type type) {
    const config::Point point = MakePoint(type, 0);
    Registers out(config::RegisterCount(point), 0xEEEE);
    EncodeNoValue(point, WordOrder::abcd, out);
    return out;
  };
  EXPECT_EQ(no_value(Type::float32), (Registers{0x7FC0, 0}));
  EXPECT_EQ(no_value(Type::float64), (Registers{0x7FF8, 0, 0, 0}));
  EXPECT_EQ(no_value(Type::int16), Registers{0x8000});
  EXPECT_EQ(no_value(Type::uint16), Registers{0xFFFF});
  EXPECT_EQ(no_value(Type::int32), (Registers{0x8000, 0}));
  EXPECT_EQ(no_value(Type::uint32), (Registers{0xFFFF, 0xFFFF}));
  EXPECT_EQ(no_value(Type::int64), (Registers{0x8000, 0, 0, 0}));
}

TEST(Bits, NumbersAreTrueUnlessZero) {
  EXPECT_EQ(EncodeBit(true), true);
  EXPECT_EQ(EncodeBit(std::int64_t{0}), false);
  EXPECT_EQ(EncodeBit(2.5), true);
  EXPECT_FALSE(EncodeBit(std::string("on")));
  EXPECT_FALSE(EncodeBit(Value()));
}

constexpr Quality kTooOld[] = {Quality::bad_not_connected, Quality::bad_last_known,
                               Quality::bad_communication, Quality::bad_out_of_service,
                               Quality::bad_waiting,       Quality::bad};
constexpr Quality kFaults[] = {Quality::bad_configuration, Quality::bad_device_failure,
                               Quality::bad_sensor_failure};

TEST(Shown, GoodAndUncertainValuesAreServed) {
  for (const auto on_bad : {OnBad::exception, OnBad::hold, OnBad::nan}) {
    for (const auto quality : {Quality::good, Quality::uncertain, Quality::uncertain_last_usable,
                               Quality::uncertain_sub_normal}) {
      EXPECT_EQ(Show(MakePoint(Type::float32, 0), on_bad, quality, true), Shown::held);
      EXPECT_EQ(Show(MakePoint(Type::float32, 0), on_bad, quality, false), Shown::exception);
    }
  }
}

TEST(Shown, OnBadDecidesHowAnExpiredValueIsShown) {
  config::Point with_value = MakePoint(Type::int16, 0);
  with_value.on_fault = {config::OnFault::Kind::value, -1};
  for (const Quality quality : kTooOld) {
    for (const Type type : {Type::float32, Type::int16, Type::boolean}) {
      const config::Point point = MakePoint(type, 0);
      EXPECT_EQ(Show(point, OnBad::exception, quality, true), Shown::exception);
      EXPECT_EQ(Show(point, OnBad::hold, quality, true), Shown::held);
      EXPECT_EQ(Show(point, OnBad::hold, quality, false), Shown::exception);
    }
    EXPECT_EQ(Show(MakePoint(Type::float64, 0), OnBad::nan, quality, true), Shown::no_value);
    EXPECT_EQ(Show(MakeText(4, 0), OnBad::nan, quality, true), Shown::no_value);
    EXPECT_EQ(Show(MakePoint(Type::int16, 0), OnBad::nan, quality, true), Shown::exception);
    EXPECT_EQ(Show(MakePoint(Type::boolean, 0), OnBad::nan, quality, true), Shown::exception);
    EXPECT_EQ(Show(with_value, OnBad::nan, quality, true), Shown::substitute);
    EXPECT_EQ(Show(with_value, OnBad::exception, quality, true), Shown::exception);
  }
}

TEST(Shown, AFaultOfAChannelIsNoExceptionForItsBlock) {
  using Kind = config::OnFault::Kind;
  const auto show = [](Type type, Kind kind, Quality quality, bool held) {
    config::Point point = MakePoint(type, 0);
    point.on_fault.kind = kind;
    return Show(point, OnBad::exception, quality, held);
  };
  for (const Quality quality : kFaults) {
    EXPECT_EQ(show(Type::float32, Kind::automatic, quality, true), Shown::no_value);
    EXPECT_EQ(show(Type::int16, Kind::automatic, quality, true), Shown::held);
    EXPECT_EQ(show(Type::int16, Kind::automatic, quality, false), Shown::no_value);
    EXPECT_EQ(show(Type::float32, Kind::hold, quality, true), Shown::held);
    EXPECT_EQ(show(Type::float32, Kind::hold, quality, false), Shown::no_value);
    EXPECT_EQ(show(Type::int16, Kind::nan, quality, true), Shown::no_value);
    EXPECT_EQ(show(Type::int16, Kind::value, quality, true), Shown::substitute);
  }
}

}  // namespace
}  // namespace baudgate::modbus
