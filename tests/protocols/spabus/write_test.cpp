// Writes: one exchange without a password, three with one, and what happens when a step fails.
// SPDX-License-Identifier: Apache-2.0
#include "tests/protocols/spabus/support.h"

namespace baudgate::protocols::spabus {
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

TEST(SpaWrite, ClosesWhenItsTimeWasOverBeforeTheValueWasSent) {
  Talk talk(Device(345));
  talk.Ask(kWrite);
  talk.Hear(kWrite, "<1A:");
  talk.Ask(kWrite);
  EXPECT_EQ(talk.Fail(kWrite, Outcome::busy), Then::ask_again);
  EXPECT_EQ(Body(talk.Ask(kWrite)), ">1WV161:345");
  const Answer answer = talk.Hear(kWrite, "<1A:");
  EXPECT_EQ(answer.outcome, Outcome::busy) << "an answer, and no reason to wait for another";
  EXPECT_NE(answer.reason.find("before it was sent"), std::string::npos);
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

TEST(SpaWrite, OnlyTheClosingHasToBeSentWhateverHappens) {
  Talk talk(Device(345));
  for (const bool closes : {false, false, true}) {
    const std::string asked = talk.Ask(kWrite);
    EXPECT_EQ(talk.request().closes, closes) << asked;
    talk.Hear(kWrite, "<1A:");
  }
  Talk open(Device(0));
  open.Ask(kWrite);
  EXPECT_FALSE(open.request().closes);
}

// ---------------------------------------------------------------- left open

const Task kPoll = Talk::Poll(0);

/// A relay that asks for a password, behind a line that is lost after so many steps of a write.
struct Interrupted {
  explicit Interrupted(int steps) {
    values.fallback = std::int64_t{0};
    for (int step = 0; step < steps; ++step) Exchange(talk, kWrite, *twin);
    talk.Ask(kWrite);
    talk.Fail(kWrite, Outcome::line_down);
    talk->OnReconnect();
  }
  bool is_open() const {
    const Bytes reply = twin->Answer(ToBytes(">1WV150:0:XX\r"), {});
    return AsText(reply).find("<1A:") != std::string_view::npos;
  }

  config::Device device = Device(345);
  FixedValues values;
  std::unique_ptr<Twin> twin = SpabusProtocol().make_twin(device, values);
  Talk talk{device};
};

TEST(SpaWrite, APasswordLeftOpenIsClosedBeforeTheFirstPoll) {
  for (const int steps : {1, 2}) {
    Interrupted relay(steps);
    ASSERT_TRUE(relay.is_open()) << steps;
    const Answer closed = Exchange(relay.talk, kPoll, *relay.twin);
    EXPECT_TRUE(relay.talk.request().closes);
    EXPECT_EQ(closed.then, Then::ask_again);
    EXPECT_TRUE(closed.readings.empty());
    EXPECT_FALSE(relay.is_open()) << steps;
    const Answer read = Exchange(relay.talk, kPoll, *relay.twin);
    EXPECT_EQ(read.outcome, Outcome::ok);
    EXPECT_EQ(read.readings.size(), 1U);
    EXPECT_EQ(Body(relay.talk.Ask(kPoll)).find("V161"), std::string::npos) << "once";
  }
}

TEST(SpaWrite, ARefusedClosingMeansThatNothingIsOpen) {
  Interrupted relay(0);
  ASSERT_FALSE(relay.is_open()) << "the password was sent and did not arrive";
  EXPECT_EQ(Exchange(relay.talk, kPoll, *relay.twin).then, Then::ask_again);
  EXPECT_EQ(Exchange(relay.talk, kPoll, *relay.twin).readings.size(), 1U);
  EXPECT_FALSE(relay.talk.request().closes);
  EXPECT_EQ(relay.talk->Queries().size(), 2U) << "V161 was not taken for a point";
}

TEST(SpaWrite, AnUnansweredClosingDoesNotKeepThePollsAway) {
  Interrupted relay(1);
  for (const bool closes : {true, true, false, false}) {
    relay.talk.Ask(kPoll);
    EXPECT_EQ(relay.talk.request().closes, closes);
    const Then then = relay.talk.Fail(kPoll, Outcome::no_reply);
    EXPECT_EQ(then, closes ? Then::ask_again : Then::done);
  }
  relay.talk->OnReconnect();
  Finish(relay.talk, kPoll, *relay.twin);
  EXPECT_FALSE(relay.is_open()) << "it has come back";
}

TEST(SpaWrite, ProbesAndTheNextWriteGoAheadOfTheClosing) {
  Interrupted relay(1);
  const Task probe{Task::Kind::probe, 0, kNoPoint, {}};
  EXPECT_TRUE(relay.talk.Ask(probe).starts_with(">1RF:"));
  EXPECT_EQ(Finish(relay.talk, kWrite, *relay.twin).outcome, Outcome::ok);
  EXPECT_FALSE(relay.is_open());
  relay.talk.Ask(kPoll);
  EXPECT_FALSE(relay.talk.request().closes);
}

TEST(SpaWrite, LostClosingsAreMadeUpForByTheNextPoll) {
  Talk talk(Device(345));
  talk.Ask(kWrite);
  for (int closing = 0; closing < 2; ++closing) {
    talk.Fail(kWrite, Outcome::no_reply);
    talk.Ask(kWrite);
  }
  EXPECT_EQ(talk.Fail(kWrite, Outcome::no_reply), Then::done);
  EXPECT_EQ(Body(talk.Ask(kPoll)), ">1WV161:345");
  EXPECT_EQ(talk.Hear(kPoll, "<1A:").then, Then::ask_again);
  EXPECT_EQ(Body(talk.Ask(kPoll)).substr(0, 3), ">1R");
}

TEST(SpaWrite, ARefusedPasswordIsNotClosedEither) {
  Talk talk(Device(345));
  talk.Ask(kWrite);
  talk.Hear(kWrite, "<1N:7:");
  EXPECT_EQ(Body(talk.Ask(kPoll)).substr(0, 3), ">1R");
}

}  // namespace
}  // namespace baudgate::protocols::spabus
