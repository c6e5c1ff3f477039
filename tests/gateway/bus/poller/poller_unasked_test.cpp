// Tests of tasks for which a device has no request, of `TurnLimit`, and of replies that a job
// accepts or refuses.
#include <gtest/gtest.h>

#include <algorithm>
#include <string_view>
#include <vector>

#include "gateway/bus/jobs/poll.h"
#include "gateway/bus/jobs/probe.h"
#include "gateway/bus/poller/poller.h"
#include "gateway/bus/schedule/turns.h"
#include "tests/gateway/bus/poller/part_fixture.h"
#include "tests/support/times.h"
#include "tests/support/virtual_line.h"

namespace baudgate::bus {
namespace {

bool WasOnline(const VirtualLine& line, std::uint32_t device) {
  return std::ranges::any_of(line.states, [device](const StateChange& change) {
    return change.device == device && change.to == DeviceState::online;
  });
}

class PollerUnasked : public ::testing::Test {
 protected:
  VirtualLine line_{ToyLine({ToyDevice("a", "A", {"V1"}), ToyDevice("b", "B", {"1"})}),
                    {&ToyProtocol()}};
};

TEST_F(PollerUnasked, AWriteToADeviceThatCannotBeProbedIsSent) {
  line_.Open();
  line_.RunFor(2s);
  ASSERT_TRUE(line_.Write(0, 0, 7.0));
  line_.RunFor(2s);
  EXPECT_EQ(line_.ends, std::vector{WriteEnd::ok});
  EXPECT_EQ(line_.CountSent("WA1=7"), 1U);
  EXPECT_EQ(line_.StatusOf(0).state, DeviceState::online);
}

TEST_F(PollerUnasked, ASilentDeviceIsNotOnlineAndItsNextWriteIsSent) {
  line_.twin(0).manner.dead = true;
  line_.Open();
  ASSERT_TRUE(line_.Write(0, 0, 7.0));
  line_.RunFor(5min);
  EXPECT_EQ(line_.ends, std::vector{WriteEnd::unknown});
  EXPECT_FALSE(WasOnline(line_, 0)) << "nothing was heard of it";
  EXPECT_FALSE(Answers(line_.StatusOf(0).state));
  EXPECT_GE(line_.CountSent("?B1"), 299U) << "time goes on";
  EXPECT_EQ(line_.QualityOf(1, 0), Quality::good);
  line_.twin(0).manner.dead = false;
  ASSERT_TRUE(line_.Write(0, 0, 7.0));
  line_.RunFor(5s);
  EXPECT_EQ(line_.ends.back(), WriteEnd::ok);
  EXPECT_EQ(line_.StatusOf(0).state, DeviceState::online);
  EXPECT_TRUE(line_.warnings.empty());
}

TEST_F(PollerUnasked, WithoutAProofAnAmbiguousReplyConfirmsNoWrite) {
  line_.Open();
  ASSERT_TRUE(line_.Write(0, 0, 7.0));
  line_.RunFor(2s);
  line_.twin(0).manner.dead = true;
  ASSERT_TRUE(line_.Write(0, 0, 8.0));
  line_.RunFor(10s);
  line_.twin(0).manner.dead = false;
  ASSERT_TRUE(line_.Write(0, 0, 9.0));
  line_.RunFor(10s);
  EXPECT_EQ(line_.ends, (std::vector{WriteEnd::ok, WriteEnd::unknown, WriteEnd::unknown}));
}

class Stubborn final : public protocols::Conversation {
 public:
  std::span<const protocols::Query> Queries() const override { return queries_; }
  std::optional<Instant> BackgroundDue() const override { return Instant{}; }
  Result<protocols::Request> Ask(const protocols::Task&, Instant) override {
    return Error{"it will not"};
  }
  protocols::Answer OnFrame(const protocols::Task&, const protocols::Request&, View,
                            Instant) override {
    return {};
  }
  Outcome Check(View, View) const override { return Outcome::unexpected; }
  protocols::Answer Interpret(View, View) override { return {}; }

 private:
  std::vector<protocols::Query> queries_;
};

class Forgetful final : public protocols::Conversation {
 public:
  std::span<const protocols::Query> Queries() const override { return queries_; }
  Result<protocols::Request> Ask(const protocols::Task&, Instant) override {
    queries_.clear();
    return Error{"it has forgotten"};
  }
  protocols::Answer OnFrame(const protocols::Task&, const protocols::Request&, View,
                            Instant) override {
    return {};
  }
  Outcome Check(View, View) const override { return Outcome::unexpected; }
  protocols::Answer Interpret(View, View) override { return {}; }

 private:
  std::vector<protocols::Query> queries_{{config::Group::once, {0}}, {config::Group::once, {1}}};
};

template <typename Talk>
protocols::Protocol Talking(const char* name) {
  protocols::Protocol protocol = ToyProtocol();
  protocol.name = name;
  protocol.make_conversation = [](const config::Device&, const protocols::ParsedOptions&,
                                  protocols::Bus*) {
    return std::unique_ptr<protocols::Conversation>(std::make_unique<Talk>());
  };
  return protocol;
}

config::Line LineWith(const protocols::Protocol& protocol) {
  config::Device device = ToyDevice("a", "A", {"1", "2"});
  device.protocol = std::string(protocol.name);
  device.slow = Duration::zero();
  config::Line line = ToyLine({device});
  line.protocol = std::string(protocol.name);
  return line;
}

TEST(PollerUnaskedBackground, ABackgroundTaskIsNotChosenTwiceAtTheSameTime) {
  const protocols::Protocol protocol = Talking<Stubborn>("stubborn");
  VirtualLine line(LineWith(protocol), {&protocol});
  line.Open();
  line.RunFor(10s);
  EXPECT_EQ(line.elapsed(), 10s);
  EXPECT_TRUE(line.warnings.empty()) << line.warnings.front();
}

TEST(PollerTurns, ALineThatLoopsWithoutTimePassingPausesAndWarnsOnce) {
  const protocols::Protocol protocol = Talking<Forgetful>("forgetful");
  VirtualLine line(LineWith(protocol), {&protocol});
  line.Open();
  line.RunFor(10s);
  EXPECT_EQ(line.elapsed(), 10s);
  ASSERT_EQ(line.warnings.size(), 1U) << "once, not every second";
  EXPECT_EQ(line.warnings[0], TurnLimit::kWarning);
}

TEST(TurnLimitTest, TurnsAtOneTimeAreLimited) {
  TurnLimit limit;
  for (int i = 0; i < TurnLimit::kMost; ++i) ASSERT_EQ(limit.Take(kStart), TurnLimit::Turn::take);
  EXPECT_EQ(limit.Take(kStart), TurnLimit::Turn::rest_and_tell);
  EXPECT_EQ(limit.Take(kStart), TurnLimit::Turn::rest);
  EXPECT_EQ(limit.RestsUntil(kStart), kStart + TurnLimit::kRest);
  EXPECT_EQ(limit.Take(kStart + TurnLimit::kRest - 1ms), TurnLimit::Turn::rest);
  EXPECT_EQ(limit.Take(kStart + TurnLimit::kRest), TurnLimit::Turn::take);
  EXPECT_FALSE(limit.RestsUntil(kStart + TurnLimit::kRest));
}

TEST(TurnLimitTest, TurnsAtDifferentTimesAreNotLimited) {
  TurnLimit limit;
  for (int i = 0; i < 2 * TurnLimit::kMost; ++i) {
    ASSERT_EQ(limit.Take(kStart + i * 1us), TurnLimit::Turn::take);
  }
}

class ReplyTest : public ::testing::Test, protected PollerListener {
 protected:
  void OnDeviceState(std::uint32_t, DeviceState, DeviceState, const std::string&, Now) override {}
  void OnWarning(std::uint32_t, const std::string&) override {}

  config::Config config_ = ToyConfig();
  PointStore store_{config_};
  LineContext line_{config_.lines[0], 0,
                    [](const std::string&) -> const protocols::Protocol& { return ToyProtocol(); },
                    store_, *this};
  Device& a_ = line_.roster.device(0);
};

TEST_F(ReplyTest, AReplyEqualToItsRequestIsRefusedOnAnEchoingBus) {
  for (const bool echoes : {false, true}) {
    EchoWatch echo(config::Echo::off);
    const protocols::Request read = AskFor("?A1\r");
    echo.OnSent(read.bytes);
    if (echoes) echo.OnReceived(read.bytes, &read);
    ExchangeEnd end;
    end.outcome = Outcome::no_reply;
    echo.OnExchangeEnd(read, end);
    PollJob write(a_, Schedule::Pick{}, kStart);
    write.step.request = AskFor("!A1=7\r");
    write.step.request.expect.mirrors = true;
    const Bytes frame = write.step.request.bytes;
    echo.OnSent(frame);
    EXPECT_EQ(echo.OnReceived(frame, &write.step.request).bytes, frame) << "it may be the reply";
    write.Judge(line_, frame, echo, kStart + 1s);
    EXPECT_EQ(write.attempt.answer.reason.find("echoes requests") != std::string::npos, echoes);
  }
}

TEST_F(ReplyTest, AProbeWithoutNameGivesNoReadingsOfANamedDevice) {
  const EchoWatch echo(config::Echo::off);
  const auto readings = [&](std::string_view bytes, std::string_view reply) {
    ProbeJob probe(a_, kStart);
    probe.step.request = AskFor(bytes);
    probe.step.request.steady = bytes[0] == 'P';
    line_.owed.whose.OnSent(probe.asked(), kStart);
    EXPECT_EQ(probe.Judge(line_, ToyReply(reply), echo, kStart), Outcome::ok);
    return probe.attempt.answer.readings.size();
  };
  EXPECT_EQ(readings("?A1\r", "A1=5"), 1U) << "it has no name yet";
  EXPECT_EQ(readings("PA0\r", "A0"), 0U);
  EXPECT_EQ(readings("?A1\r", "A1=5"), 0U);
}

}  // namespace
}  // namespace baudgate::bus
