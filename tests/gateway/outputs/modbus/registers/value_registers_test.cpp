// Encodings with known bytes, and the rules of on_bad and on_fault.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "gateway/outputs/modbus/registers/register_map.h"
#include "tests/gateway/outputs/modbus/registers/points.h"

namespace baudgate::modbus {
namespace {

using config::OnBad;
using config::Type;
using config::WordOrder;
using Registers = std::vector<std::uint16_t>;

/// Empty when the value does not fit.
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

TEST(Encode, Numbers) {
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

TEST(Encode, WhatDoesNotFitIsRefusedAndNeverWraps) {
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

TEST(Decode, RefusesWhatIsNoValue) {
  EXPECT_FALSE(Decode(Type::boolean, {2}));
  EXPECT_FALSE(Decode(Type::float32, {0x7FC0, 0}));
  EXPECT_FALSE(Decode(Type::float64, {0x7FF0, 0, 0, 0}));
  EXPECT_FALSE(Decode(Type::float32, {0x47F1}));
  EXPECT_FALSE(Decode(Type::int16, {}));
}

TEST(EightBits, HaveARegisterOfTheirOwnAndTheirRange) {
  EXPECT_EQ(Encode(Type::int8, std::int64_t{-5}), Registers{0xFFFB});
  EXPECT_EQ(Encode(Type::uint8, std::int64_t{255}), Registers{255});
  EXPECT_TRUE(Encode(Type::int8, std::int64_t{128}).empty());
  EXPECT_TRUE(Encode(Type::uint8, std::int64_t{256}).empty());
  EXPECT_EQ(Decode(Type::int8, {0xFF80}), Value(std::int64_t{-128}));
  EXPECT_EQ(Decode(Type::uint8, {200}), Value(std::int64_t{200}));
  EXPECT_FALSE(Decode(Type::int8, {0x00FB})) << "251 is no SINT";
  EXPECT_FALSE(Decode(Type::uint8, {0x0100}));
}

TEST(NoValue, CanNotBeTakenForAReading) {
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

TEST(Shown, OnBadDecidesWhatIsTooOld) {
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

TEST(Shown, FaultsOfAChannelNeverSpoilABlock) {
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
