// Whether a device is still the one that has told its name.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/poll/identity.h"

#include <gtest/gtest.h>

namespace baudgate {
namespace {

Request Asking(std::string_view bytes) {
  Request request;
  request.bytes = ToBytes(bytes);
  return request;
}

class IdentityTest : public ::testing::Test {
 protected:
  bool Matches(const Request& request, std::string_view reply, Outcome outcome = Outcome::ok) {
    return identity_.Matches(request, ToBytes(reply), outcome);
  }

  const Request name_ = Asking("N\r");
  const Request read_ = Asking("?1\r");
  Identity identity_;
};

TEST_F(IdentityTest, IsTheFrameThatAnsweredTheProbe) {
  EXPECT_FALSE(identity_.known());
  identity_.Learn(name_, ToBytes("=A\r"));
  EXPECT_TRUE(identity_.known());
  EXPECT_TRUE(identity_.IsAskedBy(name_));
  EXPECT_TRUE(Matches(name_, "=A\r\n")) << "the line end may differ";
  EXPECT_TRUE(Matches(read_, "=A\r")) << "whatever was asked";
  EXPECT_FALSE(Matches(read_, "!5\r"));
  EXPECT_FALSE(Matches(name_, "!5\r", Outcome::unexpected));
}

TEST_F(IdentityTest, AnotherNameIsBelievedAfterSixteenInARow) {
  identity_.Learn(name_, ToBytes("=A\r"));
  for (int i = 1; i < 16; ++i) EXPECT_FALSE(Matches(name_, "=B\r")) << i;
  EXPECT_TRUE(Matches(name_, "=B\r"));
  EXPECT_FALSE(Matches(name_, "=A\r"));
}

TEST_F(IdentityTest, OtherRequestsBetweenBeginTheCountAnew) {
  identity_.Learn(name_, ToBytes("=A\r"));
  for (int i = 1; i < 16; ++i) Matches(name_, "=B\r");
  identity_.OnSent(read_);
  EXPECT_FALSE(Matches(name_, "=B\r"));
}

TEST_F(IdentityTest, IsForgottenWhenOnlyOtherProbesAreAnswered) {
  identity_.Learn(name_, ToBytes("=A\r"));
  identity_.OnProbeAnswered(read_);
  identity_.OnProbeAnswered(read_);
  identity_.OnProbeAnswered(name_);
  identity_.OnProbeAnswered(read_);
  identity_.OnProbeAnswered(read_);
  EXPECT_TRUE(identity_.known());
  identity_.OnProbeAnswered(read_);
  EXPECT_FALSE(identity_.known());
}

}  // namespace
}  // namespace baudgate
