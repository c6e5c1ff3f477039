// Tests broadcasts to all modules of a line: synchronised samples and the host watchdog.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/conversation.h"
#include "protocols/dcon/places.h"
#include "tests/protocols/dcon/support.h"

namespace baudgate::protocols::dcon {
namespace {

using config::Type;

const std::int64_t kTwoSeconds = Duration(2s).count();

/// Two modules of one line. Each has its own conversation; both share the data of the line
/// (protocols::Bus).
class DconLine : public ::testing::Test {
 protected:
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
  std::optional<std::size_t> deaf_;
  bool lost_ = false;
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
  SetValue(1, 9.5);
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

TEST_F(DconSamples, TheFirstSampleIsIgnored) {
  AddSampled("1");
  const Answer answer = PollOf(0);
  EXPECT_EQ(answer.outcome, Outcome::ok);
  EXPECT_TRUE(answer.readings.empty());
}

TEST_F(DconSamples, AnUnsentFetchIsRepeated) {
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

TEST_F(DconSamples, AModuleThatMissedTheBroadcastShowsNoOldSample) {
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

/// The last sample of module 2 was not fetched, so it reports this old sample until it is fetched.
TEST_F(DconSamples, AfterALostReplyTheNextSampleMustBeProven) {
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
  PollOf(0);
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

TEST_F(DconSamples, ModulesOfAnotherChecksumModeAreASeparateGroup) {
  AddSampled("1");
  AddSampled("12", true);
  PollOf(0);
  PollOf(1);
  EXPECT_EQ(TakeAsked(), (std::vector<std::string>{"#**\r", "$014\r", "#**77\r", "$0C4CB\r"}));
}

TEST_F(DconSamples, ATooRarelyPolledModuleIsReported) {
  AddSampled("1");
  AddSampled("2");
  for (int i = 0; i < 4; ++i) {
    for (int fast = 0; fast < 10; ++fast, now_ += 500ms) PollOf(0);
    EXPECT_TRUE(PollOf(1).readings.empty());
  }
  EXPECT_NE(conversations_[1]->WhatIsLearned().find("the same poll"), std::string::npos);
  EXPECT_TRUE(conversations_[0]->WhatIsLearned().empty());
}

TEST_F(DconSamples, DigitalModulesReturnTheirInputs) {
  Add(MakeDevice({ReadPoint("a", "$4[b0] status", Type::boolean),
                  ReadPoint("b", "$4[b9] status", Type::boolean)}));
  values_[0]->values = {{0, true}, {1, true}};
  PollOf(0);
  const Answer answer = PollOf(0);
  ASSERT_EQ(answer.readings.size(), 2U) << answer.reason;
  EXPECT_EQ(answer.readings[0].value, Value{true});
  EXPECT_EQ(answer.readings[1].value, Value{true});
}

/// `$AA4` makes an output module store its output in a memory that wears.
TEST_F(DconSamples, AnOutputModuleIsNeverSampled) {
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

TEST_F(DconWatchdog, HostOkIsBroadcastOncePerPeriod) {
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

TEST_F(DconWatchdog, HostOkIsAlsoSentBeforeWritesAndProbes) {
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

TEST_F(DconWatchdog, ATooRarelyPolledDeviceIsWarnedAbout) {
  config::Device device = MakeDevice({ReadPoint("a", "#0")}, {{"host_watchdog", kTwoSeconds}});
  EXPECT_TRUE(DconProtocol().doubts(device).empty());
  device.poll = 5s;
  ASSERT_EQ(DconProtocol().doubts(device).size(), 1U);
  EXPECT_NE(DconProtocol().doubts(device)[0].text.find("polled every 5s"), std::string::npos);
}

/// DCON reference, chapter 14: `~AA3EVV` sets the watchdog, a tripped module ignores writes, `~AA1`
/// clears the trip.
TEST_F(DconWatchdog, ATrippedModuleHoldsItsOutputsUntilItIsCleared) {
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

/// Returns relays 0…3 at bits 0…3, and inputs 0…3 at bits 8…11, as in an I-7060.
std::vector<config::Point> Relays() {
  std::vector<config::Point> points;
  for (int i = 0; i < 4; ++i) {
    const std::string n = std::to_string(i);
    points.push_back(WritePoint("relay_" + n, "$6[b" + n + "]", "#1" + n + "{bit}", Type::boolean));
  }
  points.push_back(ReadPoint("input", "$6[b8]", Type::boolean));
  points.push_back(WritePoint("all", "$6[low]", "#00{hex2}", Type::uint16));
  return points;
}

Task Several(std::vector<PointValue> writes) {
  Task task = Write(writes.front().point, writes.front().value);
  task.also.assign(writes.begin() + 1, writes.end());
  return task;
}

std::string Sent(const Talk& talk, std::size_t at) {
  return std::string(AsText(talk.asked.at(at)));
}

TEST(DconOutputs, DifferentOutputsOfAGroupAreWrittenTogether) {
  Talk talk(DconProtocol(), MakeDevice(Relays()));
  const auto together = [&](std::vector<PointValue> writes) {
    return talk->WritesTogether(writes);
  };
  EXPECT_EQ(together({{0, true}, {2, false}, {3, true}}), 3U);
  EXPECT_EQ(together({{0, true}, {0, false}}), 1U) << "one after the other";
  EXPECT_EQ(together({{0, true}, {5, 3.0}, {1, true}}), 1U);
  EXPECT_EQ(together({{5, 3.0}, {0, true}}), 1U);
  EXPECT_EQ(together({{3, true}}), 1U);
}

TEST(DconOutputs, OutputsOfAnotherWordGroupOrPlaceAreWrittenSeparately) {
  const auto together = [](const std::string& read, const std::string& write,
                           const Settable& options = {}) {
    Talk talk(DconProtocol(), MakeDevice({WritePoint("a", "$6[b0]", "#10{bit}", Type::boolean),
                                          WritePoint("b", read, write, Type::boolean)},
                                         options));
    return talk->WritesTogether(std::vector<PointValue>{{0, true}, {1, true}});
  };
  EXPECT_EQ(together("$6[b1]", "#11{bit}"), 2U);
  EXPECT_EQ(together("@[b1]", "#11{bit}"), 1U);
  EXPECT_EQ(together("$6[b8]", "#B0{bit}"), 1U);
  EXPECT_EQ(together("$6[b9]", "#11{bit}"), 1U) << "its bit stands elsewhere";
  EXPECT_EQ(together("", "#11{bit}"), 1U) << "it cannot be read";
  EXPECT_EQ(together("$6[b1]", "#11{bit}", {{"invert", std::int64_t{3840}}}), 2U) << "of inputs";
  EXPECT_EQ(together("$6[b1]", "#11{bit}", {{"invert", std::int64_t{1}}}), 1U);
}

TEST(DconOutputs, OtherOutputsStayUnchanged) {
  Talk talk(DconProtocol(), MakeDevice(Relays()));
  EXPECT_EQ(Exchange(talk, Poll(0), "!010900\r").outcome, Outcome::ok);
  const Task task = Several({{0, false}, {1, true}});
  EXPECT_EQ(Asked(talk, task), "$016\r");
  EXPECT_TRUE(talk.request().prepares) << "nothing is written yet";
  EXPECT_EQ(talk.Reply(task, ToBytes("!010900\r")).then, Then::ask_again);
  EXPECT_EQ(Asked(talk, task), "#01000A\r") << "0 off, 1 on, 3 still on";
  EXPECT_FALSE(talk.request().prepares);
  EXPECT_TRUE(talk.request().expect.repeatable);
  const Answer done = talk.Reply(task, ToBytes(">\r"));
  EXPECT_EQ(done.outcome, Outcome::ok);
  EXPECT_EQ(done.then, Then::done);
  EXPECT_EQ(Asked(talk, task), "$016\r") << "each write reads anew";
}

/// If the reading "0900" is damaged to "0D00", the write would switch relay 2 on.
TEST(DconOutputs, OtherOutputsAreReadUntilTwoReadingsAgree) {
  Talk talk(DconProtocol(), MakeDevice(Relays()));
  Exchange(talk, Poll(0), "!000900\r");
  const Task task = Several({{0, false}, {1, true}});
  std::vector<std::string> replies = {"!000D00", "!000900", "!010900", ">"};
  const Answer answer = talk.Run(task, [&](View) {
    const std::string reply = replies.front();
    replies.erase(replies.begin());
    return ToBytes(reply + "\r");
  });
  EXPECT_EQ(answer.outcome, Outcome::ok);
  ASSERT_EQ(talk.asked.size(), 5U);
  EXPECT_EQ(Sent(talk, 3), "$016\r");
  EXPECT_EQ(Sent(talk, 4), "#01000A\r") << "an input may change meanwhile";
}

TEST(DconOutputs, TheHighGroupHasItsOwnCommand) {
  Talk talk(DconProtocol(), MakeDevice({WritePoint("a", "@[b8]", "#B0{bit}", Type::boolean),
                                        WritePoint("b", "@[b15]", "#B7{bit}", Type::boolean)}));
  Exchange(talk, Poll(0), ">1234\r");
  talk.Run(Several({{0, true}, {1, true}}),
           [](View request) { return ToBytes(request[0] == '@' ? ">1234\r" : ">\r"); });
  EXPECT_EQ(Sent(talk, 2), "#010B93\r");
}

TEST(DconOutputs, NothingIsWrittenIfTheOutputsCannotBeRead) {
  Talk talk(DconProtocol(), MakeDevice(Relays()));
  Exchange(talk, Poll(0), "!000900\r");
  const Task task = Several({{0, false}, {1, true}});
  EXPECT_EQ(Exchange(talk, task, "").outcome, Outcome::no_reply);
  EXPECT_EQ(talk.asked.size(), 2U);
  EXPECT_EQ(Asked(talk, task), "$016\r");
  EXPECT_EQ(talk->WritesTogether(std::vector<PointValue>{{0, true}, {1, true}}), 2U);
}

TEST(DconOutputs, AModuleThatRefusesAGroupWriteGetsSingleWrites) {
  for (const char* reply : {"?01\r", ""}) {
    Talk talk(DconProtocol(), MakeDevice(Relays()));
    Exchange(talk, Poll(0), "!000900\r");
    const Task task = Several({{0, false}, {1, true}});
    Exchange(talk, task, "!000900\r");
    Exchange(talk, task, reply);
    const std::vector<PointValue> both = {{0, true}, {1, true}};
    EXPECT_EQ(talk->WritesTogether(both), 1U);
    talk->OnReconnect();
    EXPECT_EQ(talk->WritesTogether(both), 2U);
  }
  Talk talk(DconProtocol(), MakeDevice(Relays()));
  Exchange(talk, Poll(0), "!000900\r");
  const Task task = Several({{0, false}, {1, true}});
  Exchange(talk, task, "!000900\r");
  EXPECT_EQ(Exchange(talk, task, "!\r").outcome, Outcome::refused);
  EXPECT_EQ(talk->WritesTogether(std::vector<PointValue>{{0, true}, {1, true}}), 2U)
      << "the host watchdog had tripped";
}

TEST(DconOutputs, TheTwinAcceptsAGroupWrite) {
  std::vector<config::Point> relays = Relays();
  relays.pop_back();
  const config::Device device = MakeDevice(relays);
  FixedValues values;
  values.fallback = false;
  values.values[3] = true;
  DconTwin twin(device, values);
  Talk talk(DconProtocol(), device);
  talk.Run(Poll(0), twin);
  const Answer answer = talk.Run(Several({{0, true}, {2, true}, {3, false}}), twin);
  EXPECT_EQ(answer.outcome, Outcome::ok) << answer.reason;
  EXPECT_EQ(Sent(talk, 2), "#010005\r");
  EXPECT_EQ(values.values[0], Value{true});
  EXPECT_EQ(values.values[1], Value{false});
  EXPECT_EQ(values.values[2], Value{true});
  EXPECT_EQ(values.values[3], Value{false});
}

}  // namespace
}  // namespace baudgate::protocols::dcon
