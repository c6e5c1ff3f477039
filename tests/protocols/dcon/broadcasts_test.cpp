// Synchronised samples and the host watchdog: what is told to all modules of a line.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/conversation.h"
#include "tests/protocols/dcon/support.h"

namespace baudgate::protocols::dcon {
namespace {

using config::Type;

const std::int64_t kTwoSeconds = Duration(2s).count();

/// Two modules of one line: each has its conversation, both have its bus.
class DconLine : public ::testing::Test {
 protected:
  /// The readings of one poll; all requests go to both twins.
  Answer PollOf(std::size_t which, std::size_t query = 0) {
    Conversation& conversation = *conversations_[which];
    const Task task = baudgate::Poll(query);
    for (int step = 0; step < kMostSteps; ++step) {
      const auto request = conversation.Ask(task, now_);
      if (!request) return {Outcome::unsupported, request.error(), {}};
      asked_.emplace_back(AsText(request->bytes));
      Bytes reply;
      for (std::size_t i = 0; i < twins_.size(); ++i) {
        const Bytes said = deaf_ == i ? Bytes{} : twins_[i]->Answer(request->bytes, now_);
        if (!said.empty()) reply = said;
      }
      if (lost_) reply.clear();
      Answer answer;
      if (request->expect.reply == Expectation::Reply::none) {
        EXPECT_TRUE(reply.empty()) << "nobody answers a broadcast";
        answer.then = conversation.OnSent(task, *request, now_);
      } else if (reply.empty()) {
        answer.outcome = Outcome::no_reply;
        answer.then = conversation.OnFailure(task, *request, answer.outcome, now_);
      } else {
        answer = conversation.OnFrame(task, *request, reply, now_);
      }
      if (answer.then != Then::ask_again) return answer;
    }
    ADD_FAILURE() << "no end";
    return {};
  }

  void Add(config::Device device) {
    auto& kept = *devices_.emplace_back(std::make_unique<config::Device>(std::move(device)));
    auto& values = *values_.emplace_back(std::make_unique<FixedValues>());
    values.fallback = 0.0;
    twins_.push_back(DconProtocol().make_twin(kept, values));
    conversations_.push_back(MakeConversation(DconProtocol(), kept, bus_.get()));
  }

  void AddSampled(const std::string& address, bool checksum = false) {
    Add(MakeDevice({ReadPoint("a", "$4 value")}, {{"checksum", checksum}}, address));
  }
  void SetValue(std::size_t which, double value) { values_[which]->values[0] = value; }
  std::vector<std::string> TakeAsked() { return std::exchange(asked_, {}); }

  std::unique_ptr<Bus> bus_ = MakeBus(DconProtocol());
  std::vector<std::unique_ptr<config::Device>> devices_;
  std::vector<std::unique_ptr<FixedValues>> values_;
  std::vector<std::unique_ptr<Twin>> twins_;
  std::vector<std::unique_ptr<Conversation>> conversations_;
  std::vector<std::string> asked_;
  std::optional<std::size_t> deaf_;  ///< this module hears nothing
  bool lost_ = false;                ///< replies are
  Instant now_{1h};
};

using DconSamples = DconLine;
using DconWatchdog = DconLine;

TEST_F(DconSamples, OneBroadcastServesAllModulesOfARound) {
  AddSampled("1");
  AddSampled("2");
  PollOf(0);
  PollOf(1);
  EXPECT_EQ(TakeAsked(), (std::vector<std::string>{"#**\r", "$014\r", "$024\r"}));
  now_ += 1s;
  SetValue(0, 1.5);
  SetValue(1, 2.5);
  const Answer first = PollOf(0);
  SetValue(1, 9.5);  // behind the sample
  const Answer second = PollOf(1);
  EXPECT_EQ(TakeAsked(), (std::vector<std::string>{"#**\r", "$014\r", "$024\r"}));
  ASSERT_EQ(first.readings.size(), 1U) << first.reason;
  ASSERT_EQ(second.readings.size(), 1U) << second.reason;
  EXPECT_EQ(first.readings[0].value, Value{1.5});
  EXPECT_EQ(second.readings[0].value, Value{2.5});
  now_ += 1s;
  EXPECT_EQ(PollOf(1).readings.size(), 1U);
  EXPECT_EQ(PollOf(0).readings.size(), 1U);
  EXPECT_EQ(TakeAsked(), (std::vector<std::string>{"#**\r", "$024\r", "$014\r"}))
      << "whoever comes first";
}

TEST_F(DconSamples, TheFirstMayBeOlderThanTheGatewayAndDoesNotCount) {
  AddSampled("1");
  const Answer answer = PollOf(0);
  EXPECT_EQ(answer.outcome, Outcome::ok);
  EXPECT_TRUE(answer.readings.empty());
}

/// It waits behind a probe, and is asked for again.
TEST_F(DconSamples, AFetchThatWasNotSentTakesNoSample) {
  AddSampled("1");
  PollOf(0);
  now_ += 1s;
  Conversation& module = *conversations_[0];
  const auto broadcast = module.Ask(Poll(0), now_);
  twins_[0]->Answer(broadcast->bytes, now_);
  module.OnSent(Poll(0), *broadcast, now_);
  EXPECT_EQ(AsText(module.Ask(Poll(0), now_)->bytes), "$014\r");
  module.Ask(Probe(), now_);
  TakeAsked();
  EXPECT_EQ(PollOf(0).readings.size(), 1U);
  EXPECT_EQ(TakeAsked(), (std::vector<std::string>{"$014\r"}));
}

TEST_F(DconSamples, AModuleThatHasNotHeardTheBroadcastShowsNoOldSample) {
  AddSampled("1");
  AddSampled("2");
  for (int round = 0; round < 2; ++round, now_ += 1s) {
    PollOf(0);
    PollOf(1);
  }
  deaf_ = 1;
  EXPECT_EQ(PollOf(0).readings.size(), 1U);
  deaf_.reset();
  const Answer old = PollOf(1);
  EXPECT_EQ(old.outcome, Outcome::ok);
  EXPECT_TRUE(old.readings.empty()) << "its digit is 0";
}

/// It holds a sample that nobody has fetched, so that its digit says 1 of it for ever.
TEST_F(DconSamples, AfterALostReplyTheNextSampleIsProvenAnew) {
  AddSampled("1");
  AddSampled("2");
  for (int round = 0; round < 2; ++round, now_ += 1s) {
    PollOf(0);
    PollOf(1);
  }
  SetValue(1, 3.5);
  PollOf(0);
  deaf_ = 1;
  EXPECT_EQ(PollOf(1).outcome, Outcome::no_reply);
  now_ += 1s;
  SetValue(1, 4.5);
  PollOf(0);  // module 2 does not hear the broadcast either
  deaf_.reset();
  EXPECT_TRUE(PollOf(1).readings.empty()) << "1+03.500, of the broadcast before";
  now_ += 1s;
  PollOf(0);
  const Answer answer = PollOf(1);
  ASSERT_EQ(answer.readings.size(), 1U);
  EXPECT_EQ(answer.readings[0].value, Value{4.5});
}

TEST_F(DconSamples, AnOldSampleIsNotFetched) {
  AddSampled("1");
  AddSampled("2");
  PollOf(0);
  PollOf(1);
  now_ += 1s;
  PollOf(0);
  now_ += 5s;
  TakeAsked();
  PollOf(1);
  EXPECT_EQ(TakeAsked(), (std::vector<std::string>{"#**\r", "$024\r"}));
}

TEST_F(DconSamples, ModulesOfAnotherChecksumModeAreAGroupOfTheirOwn) {
  AddSampled("1");
  AddSampled("12", true);
  PollOf(0);
  PollOf(1);
  EXPECT_EQ(TakeAsked(), (std::vector<std::string>{"#**\r", "$014\r", "#**77\r", "$0C4CB\r"}));
}

TEST_F(DconSamples, WhoIsPolledTooRarelyIsToldSo) {
  AddSampled("1");
  AddSampled("2");
  for (int i = 0; i < 4; ++i) {
    for (int fast = 0; fast < 10; ++fast, now_ += 500ms) PollOf(0);
    EXPECT_TRUE(PollOf(1).readings.empty());
  }
  EXPECT_NE(conversations_[1]->WhatIsLearned().find("the same poll"), std::string::npos);
  EXPECT_TRUE(conversations_[0]->WhatIsLearned().empty());
}

TEST_F(DconSamples, DigitalModulesTellTheirInputs) {
  Add(MakeDevice({ReadPoint("a", "$4[b0] status", Type::boolean),
                  ReadPoint("b", "$4[b9] status", Type::boolean)}));
  values_[0]->values = {{0, true}, {1, true}};
  PollOf(0);
  const Answer answer = PollOf(0);
  ASSERT_EQ(answer.readings.size(), 2U) << answer.reason;
  EXPECT_EQ(answer.readings[0].value, Value{true});
  EXPECT_EQ(answer.readings[1].value, Value{true});
}

/// `$AA4` of an output module stores what it puts out, in a memory that wears.
TEST_F(DconSamples, AnOutputModuleIsNeverAsked) {
  const config::Device device = MakeDevice({ReadPoint("a", "$4 value")}, {{"identify", true}});
  Talk talk(DconProtocol(), device);
  talk.Run(baudgate::Poll(0), [](View request) {
    const std::string_view text = AsText(request);
    EXPECT_NE(text, "$014\r");
    if (text == "$01M\r") return ToBytes("!017021\r");
    return text == "$012\r" ? ToBytes("!01320600\r") : Bytes{};
  });
  EXPECT_EQ(talk->trouble().reason, Reason::other_module);
  EXPECT_NE(talk->trouble().text.find("type 32 is an analog output"), std::string::npos)
      << talk->trouble().text;
}

TEST_F(DconWatchdog, TheHostSaysThatItIsThereOnceAPeriodForAllModules) {
  for (const char* address : {"1", "2"}) {
    Add(MakeDevice({ReadPoint("a", "#0")}, {{"host_watchdog", kTwoSeconds}}, address));
  }
  for (int round = 0; round < 4; ++round, now_ += 1s) {
    PollOf(0);
    PollOf(1);
  }
  EXPECT_EQ(TakeAsked(),
            (std::vector<std::string>{"~**\r", "#010\r", "#020\r", "#010\r", "#020\r", "~**\r",
                                      "#010\r", "#020\r", "#010\r", "#020\r"}));
}

TEST_F(DconWatchdog, ItIsToldInFrontOfWritesAndProbesToo) {
  const config::Device device =
      MakeDevice({WritePoint("relay", "$6[b0]", "#10{bit}", Type::boolean)},
                 {{"host_watchdog", kTwoSeconds}, {"checksum", true}});
  Talk talk(DconProtocol(), device);
  for (const Task& task : {Write(0, true), Probe()}) {
    talk.now += 3s;
    const auto request = talk.Ask(task);
    ASSERT_TRUE(request);
    EXPECT_EQ(AsText(request->bytes), "~**D2\r");
    EXPECT_EQ(request->expect.reply, Expectation::Reply::none);
    EXPECT_TRUE(request->prepares) << "it writes nothing";
    EXPECT_EQ(talk.Reply(task, {}).then, Then::ask_again);
    EXPECT_NE(Asked(talk, task).substr(0, 3), "~**");
  }
}

TEST_F(DconWatchdog, ADeviceThatIsPolledTooRarelyIsDoubted) {
  config::Device device = MakeDevice({ReadPoint("a", "#0")}, {{"host_watchdog", kTwoSeconds}});
  EXPECT_TRUE(DconProtocol().doubts(device).empty());
  device.poll = 5s;
  ASSERT_EQ(DconProtocol().doubts(device).size(), 1U);
  EXPECT_NE(DconProtocol().doubts(device)[0].text.find("polled every 5s"), std::string::npos);
}

/// The reference, 14: `~AA3EVV`, trips, ignores writes, `~AA1`.
TEST_F(DconWatchdog, AModuleThatMissesTheHostHoldsItsOutputsUntilItIsCleared) {
  std::vector<config::Point> points = {
      WritePoint("relay", "$6[b0]", "#10{bit}", Type::boolean),
      ReadPoint("state", "~0", Type::uint16),
      WritePoint("setting", "~2", "~3{hex3}", Type::uint16),
      WritePoint("clear", "", "~1{clear}", Type::boolean),
  };
  Talk talk(DconProtocol(), MakeDevice(points));
  FixedValues values;
  values.fallback = 0.0;
  const config::Device device = MakeDevice(points);
  DconTwin twin(device, values);
  const auto state = [&] { return ToDouble(talk.Run(Poll(1), twin).readings.at(0).value); };
  EXPECT_EQ(talk.Run(Write(2, 0x10A), twin).outcome, Outcome::ok) << "on, a second";
  EXPECT_EQ(AsText(talk.asked.back()), "~01310A\r");
  EXPECT_EQ(talk.Run(Write(0, true), twin).outcome, Outcome::ok);
  EXPECT_EQ(state(), 0);
  talk.now += 2s;
  const Answer ignored = talk.Run(Write(0, false), twin);
  EXPECT_EQ(ignored.outcome, Outcome::refused);
  EXPECT_NE(ignored.reason.find("host watchdog"), std::string::npos);
  EXPECT_EQ(state(), 4);
  EXPECT_EQ(talk.Run(Write(3, true), twin).outcome, Outcome::ok);
  EXPECT_EQ(AsText(talk.asked.back()), "~011\r");
  EXPECT_EQ(state(), 0);
  EXPECT_EQ(talk.Run(Write(0, false), twin).outcome, Outcome::ok);
}

}  // namespace
}  // namespace baudgate::protocols::dcon
