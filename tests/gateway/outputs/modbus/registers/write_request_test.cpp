// Tests how write requests become points and values.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/outputs/modbus/registers/register_map.h"
#include "tests/gateway/outputs/modbus/registers/points.h"

namespace baudgate::modbus {
namespace {

using config::Access;
using config::Type;

class WriteRequestTest : public testing::Test {
 protected:
  // Registers: int16 0, float 1-2, text 3-4, read-only 9. Bits: 0…9; the point of bit 3 is an
  // integer, the other points are booleans.
  WriteRequestTest() {
    std::vector<config::Point> points = {MakePoint(Type::int16, 0, Access::read_write),
                                         MakePoint(Type::float32, 1, Access::read_write),
                                         MakeText(4, 3, Access::write), MakePoint(Type::int16, 9)};
    for (std::uint16_t bit = 0; bit < 10; ++bit) {
      points.push_back(MakePoint(Type::boolean, bit, Access::read_write));
    }
    points[7].type = Type::int16;
    config_ = MakeConfig({MakeDevice(1, points)});
    config_.lines[0].devices[0].word_order = config::WordOrder::cdab;
  }

  ExceptionCode Decode(const std::string& pdu) {
    const RegisterMap map(config_);
    const Bytes frame = Frame(1, pdu);
    ModbusRequest request;
    EXPECT_EQ(ParseRequest(frame, request), kNoException);
    ConvertedWrite converted = ConvertWrites(map.unit(1), config_.lines[0].devices[0], request);
    parts_ = std::move(converted.parts);
    return converted.exception;
  }

  config::Config config_;
  std::vector<bus::WriteAsk::Part> parts_;
};

TEST_F(WriteRequestTest, ABadValueRefusesAllValues) {
  EXPECT_EQ(Decode("10 00 00 00 03 06 00 07 00 00 7F C0"), kIllegalValue);
  EXPECT_TRUE(parts_.empty());
}

TEST_F(WriteRequestTest, WritesASingleRegister) {
  ASSERT_EQ(Decode("06 00 00 FF FE"), kNoException);
  ASSERT_EQ(parts_.size(), 1U);
  EXPECT_EQ(parts_[0].point, 0U);
  EXPECT_EQ(parts_[0].value, Value(std::int64_t{-2}));
}

TEST_F(WriteRequestTest, WritesSeveralPointsInTheirOrderAndWordOrder) {
  ASSERT_EQ(Decode("10 00 00 00 05 0A 00 07 20 00 47 F1 4F 4B 00 00"), kNoException);
  ASSERT_EQ(parts_.size(), 3U);
  EXPECT_EQ(parts_[0].value, Value(std::int64_t{7}));
  EXPECT_EQ(parts_[1].value, Value(123456.0));
  EXPECT_EQ(parts_[2].value, Value(std::string("OK")));
}

TEST_F(WriteRequestTest, RefusesHalfAValueReadOnlyAndUnmappedRegisters) {
  EXPECT_EQ(Decode("06 00 01 00 00"), kIllegalValue);
  EXPECT_EQ(Decode("10 00 00 00 02 04 00 00 00 00"), kIllegalValue);
  EXPECT_EQ(Decode("06 00 08 00 00"), kIllegalAddress);
  EXPECT_EQ(Decode("06 4E 20 00 00"), kIllegalAddress);
  EXPECT_EQ(Decode("05 00 0A FF 00"), kIllegalAddress);
}

TEST_F(WriteRequestTest, AFloatThatIsNoNumberIsRefused) {
  EXPECT_EQ(Decode("10 00 01 00 02 04 00 00 7F C0"), kIllegalValue);
}

TEST_F(WriteRequestTest, WritesCoils) {
  ASSERT_EQ(Decode("05 00 02 FF 00"), kNoException);
  EXPECT_EQ(parts_[0].point, 6U);
  EXPECT_EQ(parts_[0].value, Value(true));
  ASSERT_EQ(Decode("05 00 02 00 00"), kNoException);
  EXPECT_EQ(parts_[0].value, Value(false));
  ASSERT_EQ(Decode("0F 00 01 00 09 02 04 01"), kNoException);
  ASSERT_EQ(parts_.size(), 9U);
  EXPECT_EQ(parts_[0].value, Value(false));
  EXPECT_EQ(parts_[2].value, Value(std::int64_t{1})) << "a number in the bit table";
  EXPECT_EQ(parts_[8].value, Value(true));
}

class SelectRequestTest : public WriteRequestTest {
 protected:
  SelectRequestTest() {
    for (const std::size_t point : {std::size_t{0}, std::size_t{5}}) {
      config_.lines[0].devices[0].points[point].writing.select = true;
    }
  }
  std::optional<std::uint32_t> Selected(const std::string& pdu) {
    const RegisterMap map(config_);
    frame_ = Frame(1, pdu);
    EXPECT_EQ(ParseRequest(frame_, request_), kNoException);
    return SelectedPoint(map.unit(1), request_);
  }
  Bytes frame_;
  ModbusRequest request_;
};

TEST_F(SelectRequestTest, TheRegisterOfAPointIs60000Beyond) {
  EXPECT_EQ(Selected("06 EA 60 C0 DE"), 0U);
  EXPECT_TRUE(IsSelectKey(request_));
  EXPECT_EQ(Selected("10 EA 61 00 01 02 C0 DE"), 5U) << "a coil at 1";
  EXPECT_TRUE(IsSelectKey(request_));
  EXPECT_EQ(Selected("06 EA 60 C0 DF"), 0U);
  EXPECT_FALSE(IsSelectKey(request_));
}

TEST_F(SelectRequestTest, OtherWritesDoNotSelect) {
  EXPECT_EQ(Selected("06 EA 62 C0 DE"), std::nullopt) << "its point needs no selection";
  EXPECT_EQ(Selected("06 00 00 C0 DE"), std::nullopt);
  EXPECT_EQ(Selected("05 EA 60 FF 00"), std::nullopt);
  EXPECT_EQ(Selected("10 EA 60 00 02 04 C0 DE C0 DE"), std::nullopt);
  config_.lines[0].devices[0].points[0].writing.allowed = false;
  EXPECT_EQ(Selected("06 EA 60 C0 DE"), std::nullopt);
}

}  // namespace
}  // namespace baudgate::modbus
