// Devices that are read in a session only, under virtual time.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <utility>

#include "tests/gateway/bus/poller/poller_fixture.h"

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

/// Silence to one request of a task, and to those behind it answers another device: what it says
/// never stands beside what the first one has said.
TEST(Poller, WhoAnswersBehindALostRequestIsAskedForItsName) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"S1", "2"})}), {&ToyProtocol()});
  line.twin(0).values.Set(0, 1001.0);
  line.twin(0).values.Set(1, 1002.0);
  line.Open();
  line.RunFor(2500ms);
  ASSERT_EQ(line.QualityOf(0, 1), Quality::good);
  bool closed = true;
  bool other = false;
  line.twin(0).manner.instead = [&](View request) -> std::optional<Bytes> {
    if (request[0] == '?' && std::exchange(closed, false)) return ToyReply("A1~closed");
    if (request[0] == 'O' && !std::exchange(other, true)) {
      line.twin(0).values.Set(0, 2001.0);
      line.twin(0).values.Set(1, 2002.0);
      return Bytes();
    }
    return request[0] == 'P' && other ? std::optional(ToyReply("A0=9")) : std::nullopt;
  };
  line.always = [&] {
    const bool both =
        line.QualityOf(0, 0) == Quality::good && line.QualityOf(0, 1) == Quality::good;
    if (both && line.ValueOf(0, 0) == Value(2001.0)) {
      EXPECT_EQ(line.ValueOf(0, 1), Value(2002.0));
    }
  };
  line.RunFor(3s);
  EXPECT_TRUE(other);
  EXPECT_EQ(line.ValueOf(0, 0), Value(2001.0));
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
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
