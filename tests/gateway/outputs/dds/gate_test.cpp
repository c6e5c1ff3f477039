// The known attacks as datagrams to a gateway and a subscriber that are at work: none of them
// reaches the DDS library, and samples keep coming.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <malloc.h>

#include "gateway/outputs/dds/fast/participant.h"
#include "tests/gateway/outputs/dds/at_work.h"

namespace baudgate::dds {
namespace {

using testing::AnnouncementOf;
using testing::Gap;
using testing::Heartbeat;
using testing::kFar;
using testing::kPublications;
using testing::Rtps;

/// Samples go on while something is waited for.
class GateTest : public testing::AtWork {
 protected:
  /// Each round sends a sample and waits for it.
  bool Until(const std::function<bool(const DatagramCounters&)>& holds) {
    const Instant deadline = std::chrono::steady_clock::now() + 20s;
    while (!holds(subscriber_->datagrams())) {
      if (std::chrono::steady_clock::now() > deadline || !SampleArrives()) return false;
    }
    return SampleArrives();
  }
  bool Refuses(Refusal reason, const Bytes& datagram) {
    const std::uint64_t before = subscriber_->datagrams().Refused(reason);
    attacker_.Send(datagram);
    return Until([&](const DatagramCounters& now) { return now.Refused(reason) > before; });
  }
  /// Invented participants, let in or not.
  bool Announce(std::uint16_t first, std::uint16_t count, std::uint32_t lease_seconds) {
    const DatagramCounters before = subscriber_->datagrams();
    for (std::uint16_t i = 0; i < count; ++i) {
      attacker_.Send(AnnouncementOf(static_cast<std::uint16_t>(first + i), lease_seconds));
    }
    return Until([&](const DatagramCounters& now) {
      return now.passed + now.AllRefused() >= before.passed + before.AllRefused() + count;
    });
  }
};

TEST_F(GateTest, AFragmentWithoutPayload) {
  EXPECT_TRUE(
      Refuses(Refusal::fragment,
              Rtps("16 03 24 00 00 00 1C 00 00 01 00 C7 00 01 00 C2 00 00 00 00 01 00 00 00 "
                   "01 00 00 00 01 00 04 00 04 00 00 00 01 00 00 00")));
}

TEST_F(GateTest, StatisticsThatWereMadeUp) {
  ASSERT_TRUE(Announce(1, 1, 20));
  const std::uint64_t before = subscriber_->datagrams().passed;
  std::uint64_t bytes = 1000;
  for (const std::uint64_t sequence : {10, 11, 5, 3}) {
    Bytes body(40);
    testing::Append32(body, static_cast<std::uint32_t>(sequence));
    testing::Append32(body, 0);
    testing::Append32(body, static_cast<std::uint32_t>(bytes /= 7));
    body.resize(56);
    Bytes datagram = Rtps("", 1);
    Append(datagram, View(testing::Submessage(0x80, 0, body)));
    attacker_.Send(datagram);
  }
  EXPECT_TRUE(Until([&](const DatagramCounters& now) { return now.passed >= before + 4; }));
}

TEST_F(GateTest, AHugeSecurityToken) {
  EXPECT_TRUE(Refuses(
      Refusal::security,
      AnnouncementOf(1, 20, "01 10 10 00 02 00 00 00 61 00 00 00 00 00 00 10 00 00 00 10")));
}

TEST_F(GateTest, HeartbeatAndGapFarAway) {
  ASSERT_TRUE(Announce(1, 1, 20));
  EXPECT_TRUE(Refuses(Refusal::window, Heartbeat(1, kPublications, kFar, kFar)));
  EXPECT_TRUE(Refuses(Refusal::window, Gap(1, kPublications, 1, kFar)));
}

TEST_F(GateTest, ThreeHundredInventedParticipants) {
  ASSERT_TRUE(Announce(1, 100, 0x7FFFFFFF));
  const std::size_t memory = mallinfo2().uordblks;
  ASSERT_TRUE(Announce(101, 200, 0x7FFFFFFF));
  EXPECT_TRUE(Until([](const DatagramCounters& now) { return now.Refused(Refusal::address) > 0; }));
  EXPECT_LE(subscriber_->datagrams().participants, 128U) << "all have the same address";
  EXPECT_LT(mallinfo2().uordblks, memory + (8U << 20)) << "those that came last cost nothing";
  // The others are still heard.
  EXPECT_TRUE(SampleArrives());
}

}  // namespace
}  // namespace baudgate::dds
