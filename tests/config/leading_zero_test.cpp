// A number with a leading zero is 10 to some readers and 8 to others: an error wherever numbers
// stand, and nowhere else.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "config/loader.h"
#include "gateway/base/decimal.h"
#include "tests/config/fake_protocol.h"
#include "tests/config/shipped.h"

namespace baudgate::testing {
namespace {

using ::testing::HasSubstr;

TEST(LeadingZero, NamesBothReadings) {
  EXPECT_EQ(WhyLeadingZero("010"),
            "has a leading zero: it is 10 in YAML 1.2, and 8 in YAML 1.1; write 10 or 8");
  EXPECT_THAT(WhyLeadingZero("-010"), HasSubstr("write -10 or -8"));
  EXPECT_EQ(WhyLeadingZero("01"), "has a leading zero; write 1");
  EXPECT_EQ(WhyLeadingZero("09"), "has a leading zero; write 9");
  EXPECT_EQ(WhyLeadingZero("00"), "has a leading zero; write 0");
  EXPECT_EQ(WhyLeadingZero("+00.5"), "has a leading zero; write 0.5");
  EXPECT_EQ(WhyLeadingZero("010ms"), "has a leading zero; write 10ms");
  for (const char* fine : {"0", "-0", "0.5", "10", "0x010", "1e05", "", "-", "a01", "0ms"}) {
    EXPECT_EQ(WhyLeadingZero(fine), "") << fine;
  }
}

}  // namespace
}  // namespace baudgate::testing
