// Writes: one exchange without a password, three with one, and what happens when a step fails.
// SPDX-License-Identifier: Apache-2.0
#include "tests/protocols/spabus/support.h"

namespace baudgate::spabus {
namespace {

config::Device Device(std::int64_t password) {
  config::Device device = MakeDevice(
      {MakePoint("V150", Type::uint16, Group::slow, Access::read_write), MakePoint("I1")});
  device.options.Set("password", password);
  return device;
}

const Task kWrite = Talk::Write(0, Value(std::int64_t{1}));

std::string Body(const std::string& request) { return request.substr(0, request.rfind(':')); }

TEST(SpaWrite, WithoutPasswordIsOneExchange) {
  Talk talk(Device(0));
  EXPECT_EQ(Body(talk.Ask(kWrite)), ">1WV150:1");
  EXPECT_FALSE(talk.request().expect.repeatable);
  const Answer answer = talk.Hear(kWrite, "<1A:");
  EXPECT_EQ(answer.outcome, Outcome::ok);
  EXPECT_EQ(answer.then, Then::done);
}

TEST(SpaWrite, UsesTheWriteAddressWhereItDiffers) {
  config::Device device = Device(0);
  device.points[0].write = "S1";
  Talk talk(std::move(device));
  EXPECT_EQ(Body(talk.Ask(kWrite)), ">1WS1:1");
}

TEST(SpaWrite, RefusalNamesCodeAndMeaning) {
  Talk talk(Device(0));
  talk.Ask(kWrite);
  const Answer answer = talk.Hear(kWrite, "<1N:8:");
  EXPECT_EQ(answer.outcome, Outcome::refused);
  EXPECT_NE(answer.reason.find("NACK 8"), std::string::npos);
  talk.Ask(kWrite);
  EXPECT_EQ(talk.Hear(kWrite, "<1D:1:").outcome, Outcome::unexpected);
}

TEST(SpaWrite, BadValuesAndReadOnlyPointsNeverReachTheWire) {
  Talk talk(Device(345));
  EXPECT_TRUE(talk.Ask(Talk::Write(0, Value(std::int64_t{70000}))).starts_with("error"));
  EXPECT_TRUE(talk.Ask(Talk::Write(0, Value(0.5))).starts_with("error"));
  EXPECT_TRUE(talk.Ask(Talk::Write(1, Value(0.5))).starts_with("error: 'p_I1' is read-only"));
  EXPECT_TRUE(talk.Ask(Talk::Write(7, Value(0.5))).starts_with("error"));
}

TEST(SpaWrite, OpensWritesAndClosesWithTheSameValue) {
  Talk talk(Device(345));
  EXPECT_EQ(Body(talk.Ask(kWrite)), ">1WV160:345");
  EXPECT_FALSE(talk.request().expect.secrets.empty());
  EXPECT_EQ(talk.Hear(kWrite, "<1A:").then, Then::ask_again);
  EXPECT_EQ(Body(talk.Ask(kWrite)), ">1WV150:1");
  EXPECT_EQ(talk.Hear(kWrite, "<1A:").then, Then::ask_again);
  EXPECT_EQ(Body(talk.Ask(kWrite)), ">1WV161:345");
  const Answer answer = talk.Hear(kWrite, "<1A:");
  EXPECT_EQ(answer.outcome, Outcome::ok);
  EXPECT_EQ(answer.then, Then::done);
  EXPECT_EQ(Body(talk.Ask(kWrite)), ">1WV160:345") << "the next write starts from the beginning";
}

TEST(SpaWrite, ClosesAfterTheDeviceRefusedTheValue) {
  Talk talk(Device(345));
  talk.Ask(kWrite);
  talk.Hear(kWrite, "<1A:");
  talk.Ask(kWrite);
  EXPECT_EQ(talk.Hear(kWrite, "<1N:8:").then, Then::ask_again);
  EXPECT_EQ(Body(talk.Ask(kWrite)), ">1WV161:345");
  const Answer answer = talk.Hear(kWrite, "<1A:");
  EXPECT_EQ(answer.outcome, Outcome::refused) << "the last answer tells how the write ended";
  EXPECT_EQ(answer.then, Then::done);
}

TEST(SpaWrite, ClosesAfterSilence) {
  for (const int step : {0, 1}) {
    Talk talk(Device(345));
    talk.Ask(kWrite);
    if (step == 1) {
      talk.Hear(kWrite, "<1A:");
      talk.Ask(kWrite);
    }
    EXPECT_EQ(talk.Fail(kWrite, Outcome::no_reply), Then::ask_again) << step;
    EXPECT_EQ(Body(talk.Ask(kWrite)), ">1WV161:345") << step;
    const Answer answer = talk.Hear(kWrite, "<1A:");
    EXPECT_EQ(answer.outcome, Outcome::no_reply) << "unconfirmed is not written";
    EXPECT_EQ(talk.Fail(kWrite, answer.outcome), Then::done);
  }
}

TEST(SpaWrite, ClosesAfterAStrangersAnswer) {
  Talk talk(Device(345));
  talk.Ask(kWrite);
  EXPECT_EQ(talk.Fail(kWrite, Outcome::unexpected), Then::ask_again);
  EXPECT_EQ(Body(talk.Ask(kWrite)), ">1WV161:345");
}

TEST(SpaWrite, ClosesOnceMoreWhenTheClosingIsLost) {
  Talk talk(Device(345));
  for (int step = 0; step < 2; ++step) {
    talk.Ask(kWrite);
    talk.Hear(kWrite, "<1A:");
  }
  EXPECT_EQ(Body(talk.Ask(kWrite)), ">1WV161:345");
  EXPECT_EQ(talk.Fail(kWrite, Outcome::no_reply), Then::ask_again);
  EXPECT_EQ(Body(talk.Ask(kWrite)), ">1WV161:345");
  EXPECT_EQ(talk.Fail(kWrite, Outcome::no_reply), Then::done);
}

TEST(SpaWrite, ARefusedPasswordIsNeverSentAgain) {
  Talk talk(Device(345));
  talk.Ask(kWrite);
  const Answer answer = talk.Hear(kWrite, "<1N:7:");
  EXPECT_EQ(answer.outcome, Outcome::refused);
  EXPECT_EQ(answer.then, Then::done);
  for (int attempt = 0; attempt < 3; ++attempt) {
    EXPECT_TRUE(talk.Ask(kWrite).starts_with("error: the device refused the password"));
  }
  talk->OnReconnect();
  EXPECT_TRUE(talk.Ask(kWrite).starts_with("error: the device refused the password"));
}

TEST(SpaWrite, ABusyOrDisturbedDeviceHasNotRefusedThePassword) {
  for (const char* reply : {"<1N:0:", "<1N:1:", "<1N:2:"}) {
    Talk talk(Device(345));
    talk.Ask(kWrite);
    const Answer answer = talk.Hear(kWrite, reply);
    EXPECT_EQ(answer.then, Then::done);
    EXPECT_EQ(talk.Fail(kWrite, answer.outcome), Then::done);
    EXPECT_EQ(Body(talk.Ask(kWrite)), ">1WV160:345") << reply;
  }
}

TEST(SpaWrite, ADamagedWriteStillGetsBothClosings) {
  Talk talk(Device(345));
  talk.Ask(kWrite);
  talk.Hear(kWrite, "<1A:");
  talk.Ask(kWrite);
  const Answer damaged = talk.Hear(kWrite, "<1N:0:");
  EXPECT_EQ(talk.Fail(kWrite, damaged.outcome), Then::ask_again);
  EXPECT_EQ(Body(talk.Ask(kWrite)), ">1WV161:345");
  EXPECT_EQ(talk.Fail(kWrite, Outcome::no_reply), Then::ask_again);
  EXPECT_EQ(Body(talk.Ask(kWrite)), ">1WV161:345");
  const Answer closed = talk.Hear(kWrite, "<1A:");
  EXPECT_EQ(closed.outcome, Outcome::corrupt);
  EXPECT_EQ(closed.then, Then::done);
}

TEST(SpaWrite, NothingIsSentAfterTheLineWentDown) {
  Talk talk(Device(345));
  talk.Ask(kWrite);
  EXPECT_EQ(talk.Fail(kWrite, Outcome::line_down), Then::done);
}

}  // namespace
}  // namespace baudgate::spabus
