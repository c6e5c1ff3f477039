// Tests how the gateway learns a device's identity from its replies.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/base/text.h"
#include "gateway/bus/replies/whose_reply.h"

namespace baudgate::bus {
namespace {

TEST(IdentityTest, IsTheFrameThatAnsweredTheIdentification) {
  Identity identity;
  EXPECT_FALSE(identity.known());
  EXPECT_FALSE(identity.IsAskedBy(ToBytes("N\r")));
  identity.Learn(ToBytes("N\r"), ToBytes("=A\r"), Outcome::ok);
  EXPECT_TRUE(identity.known());
  EXPECT_TRUE(identity.names());
  EXPECT_TRUE(identity.IsAskedBy(ToBytes("N\r")));
  EXPECT_FALSE(identity.IsAskedBy(ToBytes("?1\r")));
  EXPECT_TRUE(identity.Is(ToBytes("=A\r\n"))) << "the line end may differ";
  EXPECT_FALSE(identity.Is(ToBytes("=B\r")));
}

TEST(IdentityTest, ANewIdentityCountsWhenItComesTwiceInARow) {
  Identity identity;
  identity.Learn(ToBytes("N\r"), ToBytes("=A\r"), Outcome::ok);
  EXPECT_FALSE(identity.OnOther(ToBytes("=B\r")));
  EXPECT_FALSE(identity.OnOther(ToBytes("=C\r")));
  EXPECT_TRUE(identity.OnOther(ToBytes("=C\r\n")));
  EXPECT_FALSE(identity.OnOther(ToBytes("=D\r")));
  identity.OnSame();
  EXPECT_FALSE(identity.OnOther(ToBytes("=D\r")));
  identity.Learn(ToBytes("N\r"), ToBytes("=C\r"), Outcome::ok);
  EXPECT_FALSE(identity.OnOther(ToBytes("=D\r"))) << "that was before";
}

TEST(IdentityTest, ARefusalMatchesItselfButIsNoName) {
  Identity identity;
  identity.Learn(ToBytes("N\r"), ToBytes("?A\r"), Outcome::refused);
  EXPECT_TRUE(identity.Is(ToBytes("?A\r")));
  EXPECT_FALSE(identity.names());
}

}  // namespace
}  // namespace baudgate::bus
