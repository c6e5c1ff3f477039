// Which request an answer may belong to, against a device of known lag.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/poll/answer_order.h"

#include <gtest/gtest.h>

#include <deque>

namespace baudgate {
namespace {

constexpr AnswerOrder::Fingerprint kProbe = AnswerOrder::Probe(0);
constexpr AnswerOrder::Fingerprint kA = 100;
constexpr AnswerOrder::Fingerprint kB = 102;

void Answered(AnswerOrder& order, AnswerOrder::Fingerprint request) {
  order.OnSent(request);
  order.OnAnswer(kProbe, request == kProbe);
}

TEST(AnswerOrderTest, WhileAllIsAnsweredEverythingIsSafe) {
  AnswerOrder order;
  EXPECT_TRUE(order.IsSafe(kA));
  Answered(order, kA);
  EXPECT_TRUE(order.IsSafe(kB));
}

TEST(AnswerOrderTest, AfterSilenceOnlyTheSameRequestAndTheProbeAreSafe) {
  AnswerOrder order;
  order.OnSent(kA);
  order.OnSilence();
  EXPECT_TRUE(order.IsSafe(kA));
  EXPECT_FALSE(order.IsSafe(kB));
  Answered(order, kA);
  EXPECT_FALSE(order.IsSafe(kB)) << "that was the answer to the first, perhaps";
  Answered(order, kProbe);
  EXPECT_TRUE(order.IsSafe(kB)) << "a lag would have answered the probe with A";
}

TEST(AnswerOrderTest, AnAnswerThatCanNotBeItsOwnIsKnown) {
  AnswerOrder order;
  order.OnSent(kA);
  order.OnSilence();
  Answered(order, kA);
  order.OnSent(kProbe);
  order.OnAnswer(kProbe, false);
  EXPECT_FALSE(order.MayBeInStep());
}

TEST(AnswerOrderTest, ADeviceThatWasOnlyProbedMayBeAskedAnything) {
  AnswerOrder order;
  for (int i = 0; i < 100; ++i) {
    order.OnSent(kProbe);
    order.OnSilence();
  }
  Answered(order, kProbe);
  EXPECT_TRUE(order.IsSafe(kA));
  Answered(order, kA);
  EXPECT_TRUE(order.IsSafe(kB)) << "no lag answers the first read behind so many probes";
}

/// A device that answers every request with the reply to the one `lag` before it. Whatever is sent
/// as the order allows, no answer to B is taken for one to A.
TEST(AnswerOrderTest, NoLagPassesUnnoticed) {
  for (std::size_t lag = 0; lag < 12; ++lag) {
    AnswerOrder order;
    std::deque<AnswerOrder::Fingerprint> owed;
    int accepted = 0;
    for (int i = 0; i < 2000; ++i) {
      const AnswerOrder::Fingerprint wanted = i / 3 % 2 == 0 ? kA : kB;
      const AnswerOrder::Fingerprint sent = order.IsSafe(wanted) ? wanted : kProbe;
      order.OnSent(sent);
      owed.push_back(sent);
      if (owed.size() <= lag) {
        order.OnSilence();
        continue;
      }
      const AnswerOrder::Fingerprint answer = owed.front();
      owed.pop_front();
      order.OnAnswer(kProbe, answer == kProbe);
      if (answer == kProbe || sent == kProbe || !order.MayBeInStep()) continue;
      ++accepted;
      ASSERT_EQ(answer, sent) << "lag " << lag << ", request " << i;
    }
    if (lag == 0) {
      EXPECT_EQ(accepted, 2000);
    }
  }
}

}  // namespace
}  // namespace baudgate
