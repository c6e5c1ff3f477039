// Several digital outputs of one module in one exchange.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/places.h"
#include "tests/protocols/dcon/support.h"

namespace baudgate::protocols::dcon {
namespace {

using config::Type;

/// Relays 0…3 at bits 0…3, inputs 0…3 at bits 8…11, as an I-7060.
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

TEST(DconOutputs, DifferentOutputsOfOneGroupGoTogether) {
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

TEST(DconOutputs, OfAnotherWordGroupOrPlaceDoNot) {
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

TEST(DconOutputs, TheOthersStayAsTheyAre) {
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

/// "0900" damaged to "0D00" would switch relay 2 on.
TEST(DconOutputs, WhatTheOthersAreCountsWhenTwoReadingsAgree) {
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

TEST(DconOutputs, NothingIsWrittenWhereTheyCanNotBeRead) {
  Talk talk(DconProtocol(), MakeDevice(Relays()));
  Exchange(talk, Poll(0), "!000900\r");
  const Task task = Several({{0, false}, {1, true}});
  EXPECT_EQ(Exchange(talk, task, "").outcome, Outcome::no_reply);
  EXPECT_EQ(talk.asked.size(), 2U);
  EXPECT_EQ(Asked(talk, task), "$016\r");
  EXPECT_EQ(talk->WritesTogether(std::vector<PointValue>{{0, true}, {1, true}}), 2U);
}

TEST(DconOutputs, AModuleThatDoesNotTakeThemTogetherGetsOneByOne) {
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

TEST(DconOutputs, TheTwinTakesThem) {
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
