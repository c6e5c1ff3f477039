// Devices that are read in a session only, under virtual time.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <utility>

#include "tests/gateway/poll/poller_fixture.h"

namespace baudgate {
namespace {

TEST(Poller, SessionIsOpenedFirstAndAgainAfterTheDeviceForgotIt) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"S1"})}), {&ToyProtocol()});
  line.twin(0).values.Set(0, 8.0);
  line.Open();
  line.RunFor(2500ms);
  EXPECT_EQ(line.CountSent("OA"), 1U);
  EXPECT_EQ(line.CountSent("?A1"), 3U);
  bool closed = true;
  line.twin(0).manner.instead = [&](View request) -> std::optional<Bytes> {
    if (request[0] != '?' || !std::exchange(closed, false)) return std::nullopt;
    return ToyReply("A1~closed");
  };
  line.RunFor(1s);
  EXPECT_EQ(line.CountSent("OA"), 2U);
  EXPECT_EQ(line.CountSent("?A1"), 5U) << "within the same period";
  EXPECT_EQ(line.ValueOf(0, 0), Value(8.0));
}

TEST(Poller, AConversationThatGoesRoundInCirclesIsEnded) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"S1"}), ToyDevice("b", "B", {"1"})}),
                   {&ToyProtocol()});
  line.Open();
  line.RunFor(1500ms);
  Say(line.twin(0), "closed");
  const std::size_t before = line.CountSent("?A1") + line.CountSent("OA");
  line.RunFor(1s);
  EXPECT_LE(line.CountSent("?A1") + line.CountSent("OA") - before, 10U) << "10 steps make a task";
  EXPECT_EQ(line.QualityOf(1, 0), Quality::good);
}

TEST(Poller, BehindABroadcastTheTaskGoesOn) {
  std::size_t proofs[2] = {};
  for (const std::string read : {"1", "N1"}) {
    VirtualLine line(ToyLine({ToyDevice("a", "A", {read}), ToyDevice("b", "B", {"U1"})}),
                     {&ToyProtocol()});
    line.twin(0).values.Set(0, 8.0);
    line.Open();
    line.RunFor(3500ms);
    const bool announced = read == "N1";
    EXPECT_EQ(line.CountSent("QA1"), announced ? 5U : 0U) << "the first task begins anew";
    EXPECT_EQ(line.CountSent("?A1"), 4U);
    EXPECT_EQ(line.ValueOf(0, 0), Value(8.0));
    EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
    EXPECT_EQ(line.QualityOf(1, 0), Quality::good);
    EXPECT_EQ(line.StatusOf(0).retries, 0U);
    proofs[announced ? 1 : 0] = line.CountSent("P");
  }
  EXPECT_EQ(proofs[0], proofs[1]) << "nothing is owed to a broadcast";
}

TEST(Poller, ABroadcastIsNoProofBeforeTheFirstRead) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"N1"})}), {&ToyProtocol()});
  line.Open();
  line.RunFor(500ms);
  ASSERT_GE(line.sent.size(), 4U);
  EXPECT_EQ(line.sent[0].text.substr(0, 1), "Q");
  EXPECT_EQ(line.sent[1].text.substr(0, 1), "P") << "the read is the first that is answered";
  EXPECT_EQ(line.sent[line.sent.size() - 2].text.substr(0, 1), "Q");
  EXPECT_EQ(line.sent.back().text.substr(0, 3), "?A1");
  EXPECT_EQ(line.CountSent("?A1"), 1U);
}

TEST(Poller, ABroadcastOfADeviceThatIsAwayEndsNothing) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"N1"})}), {&ToyProtocol()});
  line.Open();
  line.RunFor(1500ms);
  line.twin(0).manner.dead = true;
  line.RunFor(1min);
  EXPECT_EQ(line.StatusOf(0).state, DeviceState::offline);
  line.twin(0).manner.dead = false;
  line.RunFor(1min);
  EXPECT_EQ(line.StatusOf(0).state, DeviceState::online);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
}

}  // namespace
}  // namespace baudgate
