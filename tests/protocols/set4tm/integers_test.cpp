// Integers in place of floats, for meters that have none.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/meter/plan.h"
#include "tests/protocols/set4tm/support.h"

namespace baudgate::protocols::set4tm {
namespace {

std::string IntegerOf(std::string_view read) {
  const auto field = ParseField(read);
  if (!field) return field.error();
  const auto integer = AsInteger(*field);
  return integer ? FieldText(*integer) : "";
}

/// Reference, 9.5 to 9.7: the same parameter byte, four values of three bytes in place of four.
TEST(Set4tmIntegers, StandAtTheSameParameter) {
  EXPECT_EQ(IntegerOf("08 1B 02 00 float_le@0"), "08 16 00 power_be@0");
  EXPECT_EQ(IntegerOf("08 1B 02 00 float_le@12"), "08 16 00 power_be@9");
  EXPECT_EQ(IntegerOf("08 1B 02 04 float_le@4"), "08 16 04 reactive_be@3");
  EXPECT_EQ(IntegerOf("08 1B 02 08 float_le@0"), "08 16 08 apparent_be@0");
  EXPECT_EQ(IntegerOf("08 1B 02 10 float_le@4"), "08 16 10 voltage_be@3");
  EXPECT_EQ(IntegerOf("08 1B 02 20 float_le@8"), "08 16 20 current_be@6");
  EXPECT_EQ(IntegerOf("08 1B 02 30 float_le@0"), "08 16 30 factor_be@0");
  EXPECT_EQ(IntegerOf("08 1B 00 40 float_le@0"), "08 11 40 hundredths_be@0");
  EXPECT_EQ(IntegerOf("08 1B 00 11 float_le@0"), "08 11 11 voltage_be@0");
  EXPECT_EQ(IntegerOf("08 1B 02 84 float_le@4"), "08 16 84 hundredths_be@3");
  EXPECT_EQ(IntegerOf("08 1B 00 70 float_le@0"), "08 01 i8@1");
}

TEST(Set4tmIntegers, WhatIsNoLiveFloatStays) {
  EXPECT_EQ(IntegerOf("08 1B 01 11 float_le@0"), "") << "latched";
  EXPECT_EQ(IntegerOf("08 16 10 voltage_be@3"), "");
  EXPECT_EQ(IntegerOf("05 00 00 energy@0"), "");
}

}  // namespace
}  // namespace baudgate::protocols::set4tm
