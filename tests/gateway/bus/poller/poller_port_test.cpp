// A port that closes, is lost at any moment and opens again, under virtual time.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/bus/poller/poller.h"
#include "tests/gateway/bus/poller/poller_fixture.h"

namespace baudgate {
namespace {

TEST(Poller, NothingIsOnlineBehindAClosedPort) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
  line.Open();
  line.RunFor(3s);
  ASSERT_EQ(line.StatusOf(0).state, DeviceState::online);
  line.Close();
  EXPECT_EQ(line.StatusOf(0).state, DeviceState::offline);
  EXPECT_EQ(line.StatusOf(0).last_outcome, Outcome::line_down);
  line.Open();
  line.RunFor(3s);
  EXPECT_EQ(line.StatusOf(0).state, DeviceState::online);
}

/// The port goes away at every millisecond of a second's work, in whatever state that is.
TEST(Poller, PortLostAtAnyMomentAndReopened) {
  for (Duration lost = 0ms; lost < 700ms; lost += 7ms) {
    config::Device slow = ToyDevice("c", "C", {"1"});
    VirtualLine line(ToyLine({ToyDevice("a", "A", {"1", "S2"}), ToyDevice("b", "B", {"L1"}), slow}),
                     {&ToyProtocol()});
    line.twin(1).manner.dead = true;
    Say(line.twin(2), "busy");
    line.Open();
    line.RunFor(2s);
    line.Write(0, 0, 5.0);
    line.RunFor(lost);
    line.Close();
    EXPECT_FALSE(line.poller().Deadline());
    EXPECT_EQ(line.ends.size(), 1U) << "answered exactly once, at the latest now";
    EXPECT_EQ(line.QualityOf(0, 0), Quality::bad_not_connected);
    const std::size_t sent = line.sent.size();
    line.RunFor(10s);
    EXPECT_EQ(line.sent.size(), sent) << "nothing is sent into a closed port";
    line.Open();
    line.RunFor(2s);
    EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
    EXPECT_EQ(line.QualityOf(0, 1), Quality::good);
    EXPECT_EQ(line.ends.size(), 1U);
  }
}

struct EndTap : Tap {
  void OnSent(std::uint32_t, const Request&, Now) override { ++sent; }
  void OnReceived(View, Now) override {}
  void OnExchangeEnd(std::uint32_t, const ExchangeEnd& end, Now) override { ends.push_back(end); }
  void OnDeviceState(std::uint32_t, DeviceState, const std::string&, Now) override {}
  std::size_t sent = 0;
  std::vector<ExchangeEnd> ends;
};

TEST(Poller, AnExchangeThatIsCutOffIsCountedAndHasItsEnd) {
  for (Duration lost = 0ms; lost < 1s; lost += 7ms) {
    SCOPED_TRACE(FormatDuration(lost));
    VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
    EndTap tap;
    line.poller().Attach(tap);
    line.Open();
    line.RunFor(2s + lost);
    const bool cut_off = line.asking();
    line.Close();
    EXPECT_EQ(tap.ends.size(), tap.sent);
    EXPECT_EQ(tap.ends.back().outcome == Outcome::line_down, cut_off);
    const LineCounters& counters = line.poller().accounts().line.counters();
    EXPECT_EQ(counters.exchanges, tap.sent);
    EXPECT_EQ(counters.Count(Outcome::line_down), cut_off ? 1U : 0U);
    EXPECT_EQ(line.StatusOf(0).Count(Outcome::line_down), cut_off ? 1U : 0U);
    EXPECT_EQ(line.StatusOf(0).recent.Count(Outcome::line_down), 0U) << "it says nothing of a";
  }
}

TEST(Poller, MessagesOfAnotherProtocolAreFound) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
  EndTap tap;
  line.poller().Attach(tap, {[](View heard) -> std::optional<std::string> {
                         if (AsText(heard).find("@@@@") == std::string_view::npos) return {};
                         return "messages of another protocol come";
                       }});
  line.Open();
  line.RunFor(2500ms);
  line.Inject(ToBytes("@@@@"));
  line.RunFor(1s);
  EXPECT_EQ(line.StatusOf(0).findings.Count(Symptom::master_beside), 1U);
}

TEST(Poller, WhatOfARequestHasNotLeftIsDroppedWhenNobodyAnswers) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
  line.Open();
  line.RunFor(2500ms);
  EXPECT_EQ(line.dropped, 0U);
  line.twin(0).manner.dead = true;
  line.RunFor(1s);
  const std::size_t failed =
      line.poller().accounts().line.counters().outcomes[static_cast<std::size_t>(
          Outcome::no_reply)];
  EXPECT_GT(failed, 0U);
  EXPECT_EQ(line.dropped, failed);
  line.Close();
  EXPECT_EQ(line.dropped, failed) << "a closed port has nothing to drop";
}

TEST(Poller, OpeningTwiceIsOpeningAnew) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
  line.Open();
  line.RunFor(3ms);
  line.Open();
  line.RunFor(5s);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
}

}  // namespace
}  // namespace baudgate
