// A reply that comes behind other requests tells by its number how late it is.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/diagnosis/damage/earlier_replies.h"
#include "tests/gateway/bus/poller/part_fixture.h"
#include "tests/support/times.h"

namespace baudgate {
namespace {

class NumberedRequestsTest : public ::testing::Test, protected ToyMembers {
 protected:
  NumberedRequestsTest() {
    numbered_.tcp = true;
    a.protocol = &numbered_;
  }
  void Send(std::uint8_t number, Instant now, Duration reply_time = {}) {
    Request request;
    request.bytes = {0, number, 3};
    request.reply = reply_time;
    sent_.OnSent(a, request, now);
  }
  std::optional<Duration> Lateness(std::uint8_t number, Instant came) const {
    const auto late = sent_.Find(Bytes{0, number, 9, 9}, came);
    return late ? std::optional(late->after) : std::nullopt;
  }

  Protocol numbered_ = ToyProtocol();
  NumberedRequests sent_;
};

TEST_F(NumberedRequestsTest, TellTheTimeSinceTheFirstTry) {
  Send(1, kStart);
  EXPECT_EQ(Lateness(1, kStart + 2s), std::nullopt) << "nothing was asked since";
  Send(1, kStart + 1s);  // a retry
  Send(2, kStart + 2s);
  EXPECT_EQ(Lateness(1, kStart + 3s), 3s);
  sent_.OnAnswered(Bytes{0, 1, 9});
  EXPECT_EQ(Lateness(1, kStart + 3s), 2s) << "the other try";
  EXPECT_EQ(Lateness(1, kStart + 1100ms), 1100ms) << "that one's reply would not be late";
  sent_.OnAnswered(Bytes{0, 1, 9});
  EXPECT_EQ(Lateness(1, kStart + 4s), std::nullopt) << "both tries are answered: it is no reply";
  EXPECT_EQ(Lateness(2, kStart + 3s), std::nullopt);
  EXPECT_EQ(Lateness(7, kStart + 3s), std::nullopt) << "nobody here has asked that";
  EXPECT_FALSE(sent_.Find(Bytes{0}, kStart + 3s));
}

TEST_F(NumberedRequestsTest, WithATimeOfTheirOwnAreDueLater) {
  Send(1, kStart);
  Send(2, kStart, 2s);
  Send(3, kStart);
  EXPECT_EQ(sent_.Find(Bytes{0, 1, 9}, kStart + 1500ms)->lateness, 1300ms);
  EXPECT_EQ(sent_.Find(Bytes{0, 2, 9}, kStart + 1500ms)->lateness, -500ms);
}

TEST_F(NumberedRequestsTest, KeepTheLatest) {
  for (std::uint8_t number = 0; number < 200; ++number) Send(number, kStart);
  EXPECT_EQ(Lateness(190, kStart + 1s), 1s);
  EXPECT_EQ(Lateness(100, kStart + 1s), std::nullopt);
}

TEST_F(NumberedRequestsTest, WithoutANumberTellNothing) {
  numbered_.tcp = false;
  Send(1, kStart);
  Send(2, kStart + 1s);
  EXPECT_EQ(Lateness(1, kStart + 2s), std::nullopt);
}

}  // namespace
}  // namespace baudgate
