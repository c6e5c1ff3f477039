// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/identification.h"

#include <gtest/gtest.h>

namespace baudgate::protocols::telegram {
namespace {

class TelegramIdentification : public ::testing::Test {
 protected:
  TelegramIdentification() {
    description_.telegrams.resize(2);
    description_.telegrams[1].send.emplace();
    description_.telegrams[1].identity = "name";
    identity_.names = {"ACME 7"};
    identity_.others = {{"ACME8", "acme_8"}};
  }

  static Reply Says(const std::string& name) { return {.fields = {{"name", {.text = name}}}}; }

  Description description_{""};
  config::Identity identity_;
};

TEST_F(TelegramIdentification, IsDueUntilTheNameIsKnownAndAgainBehindSilence) {
  Identification identification(description_, identity_);
  EXPECT_TRUE(identification.IsDue());
  identification.OnReply({.outcome = Outcome::busy});
  EXPECT_TRUE(identification.IsDue());
  identification.OnReply(Says("ACME 7"));
  EXPECT_FALSE(identification.IsDue());
  identification.OnLost();
  EXPECT_TRUE(identification.IsDue());
  identification.OnNoName();
  EXPECT_FALSE(identification.IsDue());
}

TEST_F(TelegramIdentification, IsDueAsLongAsAnotherDeviceAnswers) {
  Identification identification(description_, identity_);
  identification.OnReply(Says("ACME 8"));
  EXPECT_TRUE(identification.trouble());
  EXPECT_TRUE(identification.IsDue());
  identification.OnNoName();
  EXPECT_TRUE(identification.IsDue());
  identification.OnReply(Says("ACME 7"));
  EXPECT_FALSE(identification.trouble());
  EXPECT_FALSE(identification.IsDue());
}

TEST_F(TelegramIdentification, IsNeverDueWhereNoTelegramAsksForTheName) {
  description_.telegrams[1].identity.clear();
  EXPECT_FALSE(Identification(description_, identity_).IsDue());
}

}  // namespace
}  // namespace baudgate::protocols::telegram
