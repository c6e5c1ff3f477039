// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/identification.h"

#include <gtest/gtest.h>

#include "tests/protocols/telegram/support.h"
#include "tests/support/times.h"

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
  EXPECT_TRUE(identification.IsDue(kStart));
  identification.OnReply({.outcome = Outcome::busy});
  EXPECT_TRUE(identification.IsDue(kStart));
  identification.OnReply(Says("ACME 7"));
  EXPECT_FALSE(identification.IsDue(kStart));
  identification.OnLost();
  EXPECT_TRUE(identification.IsDue(kStart));
  identification.OnNoName(kStart);
  EXPECT_FALSE(identification.IsDue(kStart));
}

/// Many devices of a kind do not know the question.
TEST_F(TelegramIdentification, WhoDoesNotTellItsNameIsAskedLessAndLessOften) {
  Identification identification(description_, identity_);
  int asked = 0;
  for (Instant now = kStart; now < kStart + 24h; now += 1s) {
    if (!identification.IsDue(now)) continue;
    ++asked;
    identification.OnNoName(now);
    identification.OnLost();
  }
  EXPECT_GT(asked, 20);
  EXPECT_LT(asked, 30);
  EXPECT_FALSE(identification.trouble()) << "unknown, not wrong";
}

TEST_F(TelegramIdentification, IsDueAsLongAsAnotherDeviceAnswers) {
  Identification identification(description_, identity_);
  identification.OnReply(Says("ACME 8"));
  EXPECT_TRUE(identification.trouble());
  EXPECT_TRUE(identification.IsDue(kStart));
  identification.OnNoName(kStart);
  EXPECT_TRUE(identification.IsDue(kStart));
  identification.OnReply(Says("ACME 7"));
  EXPECT_FALSE(identification.trouble());
  EXPECT_FALSE(identification.IsDue(kStart));
}

TEST_F(TelegramIdentification, IsNeverDueWhereNoTelegramAsksForTheName) {
  description_.telegrams[1].identity.clear();
  EXPECT_FALSE(Identification(description_, identity_).IsDue(kStart));
}

constexpr char kResettable[] = R"(
device: resettable
identity: [ "ACME 7" ]
telegrams:
  name: { send: 'N\r', receive: 'ID {name:text}\r', reads: yes, identity: name, example: { send: 'N\r', receive: 'ID ACME 7\r' } }
  reset: { send: 'R\r', receive: 'OK\r', example: { send: 'R\r', receive: 'OK\r' } }
points: [ { name: reset, write: reset, access: w, type: bool } ]
)";

TEST(TelegramIdentity, AnotherDeviceIsNotWrittenTo) {
  config::Device device = Described(kResettable);
  device.identity.others = {{"ACME8", "acme_8"}};
  Talk talk(TelegramProtocol(), device);
  const auto other = [](View request) {
    return ToBytes(AsText(request) == "N\r" ? "ID ACME 8\r" : "OK\r");
  };
  EXPECT_EQ(talk.Run(Write(0, true), other).outcome, Outcome::refused);
  EXPECT_EQ(talk.asked, std::vector<Bytes>{ToBytes("N\r")});
}

}  // namespace
}  // namespace baudgate::protocols::telegram
