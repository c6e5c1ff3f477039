// Tests which Modbus addresses values can have: 0 to 19999, except the status block.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "config/model/modbus.h"

namespace baudgate::config {
namespace {

TEST(ModbusAddresses, ValuesLieBelowAndAboveTheStatusBlock) {
  EXPECT_TRUE(IsValueArea(0, 0));
  EXPECT_TRUE(IsValueArea(8999, 8999));
  EXPECT_FALSE(IsValueArea(8999, 9000));
  EXPECT_FALSE(IsValueArea(9000, 9099));
  EXPECT_FALSE(IsValueArea(9099, 9100));
  EXPECT_FALSE(IsValueArea(8999, 9100)) << "around the block";
  EXPECT_TRUE(IsValueArea(9100, 19999));
  EXPECT_FALSE(IsValueArea(19999, 20000));
  EXPECT_FALSE(IsValueArea(65535, 65536));
  EXPECT_FALSE(IsValueArea(1, 0)) << "nothing";
}

}  // namespace
}  // namespace baudgate::config
