// Tests writes: one exchange without a password, three with a password, and failing steps.
// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "tests/protocols/spabus/support.h"

namespace baudgate::protocols::spabus {
namespace {

config::Device Device(std::int64_t password) {
  config::Device device = MakeDevice(
      {MakePoint("V150", Type::uint16, Group::slow, Access::read_write), MakePoint("I1")});
  device.options.Set("password", password);
  return device;
}

const Task kWrite = Write(0, Value(std::int64_t{1}));

TEST(SpaWrite, WithoutPasswordIsOneExchange) {
  Talk talk(SpabusProtocol(), Device(0));
  EXPECT_EQ(Body(Asked(talk, kWrite)), ">1WV150:1");
  EXPECT_FALSE(talk.request().expect.repeatable);
  const Answer answer = Hear(talk, kWrite, "<1A:");
  EXPECT_EQ(answer.outcome, Outcome::ok);
  EXPECT_EQ(answer.then, Then::done);
}

TEST(SpaWrite, UsesTheWriteAddressOfThePoint) {
  config::Device device = Device(0);
  device.points[0].write = "S1";
  Talk talk(SpabusProtocol(), std::move(device));
  EXPECT_EQ(Body(Asked(talk, kWrite)), ">1WS1:1");
}

TEST(SpaWrite, ARefusalIsReportedWithCodeAndMeaning) {
  Talk talk(SpabusProtocol(), Device(0));
  Asked(talk, kWrite);
  const Answer answer = Hear(talk, kWrite, "<1N:8:");
  EXPECT_EQ(answer.outcome, Outcome::refused);
  EXPECT_NE(answer.reason.find("NACK 8"), std::string::npos);
  Asked(talk, kWrite);
  EXPECT_EQ(Hear(talk, kWrite, "<1D:1:").outcome, Outcome::unexpected);
}

TEST(SpaWrite, BadValuesAndReadOnlyPointsNeverReachTheWire) {
  Talk talk(SpabusProtocol(), Device(345));
  EXPECT_TRUE(Asked(talk, Write(0, Value(std::int64_t{70000}))).starts_with("error"));
  EXPECT_TRUE(Asked(talk, Write(0, Value(0.5))).starts_with("error"));
  EXPECT_TRUE(Asked(talk, Write(1, Value(0.5))).starts_with("error: 'p_I1' is read-only"));
}

TEST(SpaWrite, OpensWritesAndClosesWithTheSameValue) {
  Talk talk(SpabusProtocol(), Device(345));
  EXPECT_EQ(Body(Asked(talk, kWrite)), ">1WV160:345");
  EXPECT_FALSE(talk.request().expect.secrets.empty());
  EXPECT_EQ(Hear(talk, kWrite, "<1A:").then, Then::ask_again);
  EXPECT_EQ(Body(Asked(talk, kWrite)), ">1WV150:1");
  EXPECT_EQ(Hear(talk, kWrite, "<1A:").then, Then::ask_again);
  EXPECT_EQ(Body(Asked(talk, kWrite)), ">1WV161:345");
  const Answer answer = Hear(talk, kWrite, "<1A:");
  EXPECT_EQ(answer.outcome, Outcome::ok);
  EXPECT_EQ(answer.then, Then::done);
  EXPECT_EQ(Body(Asked(talk, kWrite)), ">1WV160:345") << "the next write starts from the beginning";
}

TEST(SpaWrite, ClosesAfterTheDeviceRefusedTheValue) {
  Talk talk(SpabusProtocol(), Device(345));
  Asked(talk, kWrite);
  Hear(talk, kWrite, "<1A:");
  Asked(talk, kWrite);
  EXPECT_EQ(Hear(talk, kWrite, "<1N:8:").then, Then::ask_again);
  EXPECT_EQ(Body(Asked(talk, kWrite)), ">1WV161:345");
  const Answer answer = Hear(talk, kWrite, "<1A:");
  EXPECT_EQ(answer.outcome, Outcome::refused) << "the last answer tells how the write ended";
  EXPECT_EQ(answer.then, Then::done);
}

TEST(SpaWrite, ClosesAfterSilence) {
  for (const int step : {0, 1}) {
    Talk talk(SpabusProtocol(), Device(345));
    Asked(talk, kWrite);
    if (step == 1) {
      Hear(talk, kWrite, "<1A:");
      Asked(talk, kWrite);
    }
    EXPECT_EQ(talk.Fail(kWrite, Outcome::no_reply), Then::ask_again) << step;
    EXPECT_EQ(Body(Asked(talk, kWrite)), ">1WV161:345") << step;
    const Answer answer = Hear(talk, kWrite, "<1A:");
    EXPECT_EQ(answer.outcome, Outcome::no_reply) << "unconfirmed is not written";
    EXPECT_EQ(talk.Fail(kWrite, answer.outcome), Then::done);
  }
}

TEST(SpaWrite, ClosesAfterADeadlineBeforeTheValueWasSent) {
  Talk talk(SpabusProtocol(), Device(345));
  Asked(talk, kWrite);
  Hear(talk, kWrite, "<1A:");
  Asked(talk, kWrite);
  EXPECT_EQ(talk.Fail(kWrite, Outcome::busy), Then::ask_again);
  EXPECT_EQ(Body(Asked(talk, kWrite)), ">1WV161:345");
  const Answer answer = Hear(talk, kWrite, "<1A:");
  EXPECT_EQ(answer.outcome, Outcome::busy) << "an answer, and no reason to wait for another";
  EXPECT_EQ(answer.reason, "nothing was written, because the device is busy; write again");
}

TEST(SpaWrite, ClosesAfterAReplyOfAnotherDevice) {
  Talk talk(SpabusProtocol(), Device(345));
  Asked(talk, kWrite);
  EXPECT_EQ(talk.Fail(kWrite, Outcome::unexpected), Then::ask_again);
  EXPECT_EQ(Body(Asked(talk, kWrite)), ">1WV161:345");
}

TEST(SpaWrite, RepeatsALostClosingOnce) {
  Talk talk(SpabusProtocol(), Device(345));
  for (int step = 0; step < 2; ++step) {
    Asked(talk, kWrite);
    Hear(talk, kWrite, "<1A:");
  }
  EXPECT_EQ(Body(Asked(talk, kWrite)), ">1WV161:345");
  EXPECT_EQ(talk.Fail(kWrite, Outcome::no_reply), Then::ask_again);
  EXPECT_EQ(Body(Asked(talk, kWrite)), ">1WV161:345");
  EXPECT_EQ(talk.Fail(kWrite, Outcome::no_reply), Then::done);
}

TEST(SpaWrite, ARefusedPasswordIsNotSentUntilTheDeviceIsEnabledAgain) {
  Talk talk(SpabusProtocol(), Device(345));
  Asked(talk, kWrite);
  const Answer answer = Hear(talk, kWrite, "<1N:7:");
  EXPECT_EQ(answer.outcome, Outcome::refused);
  EXPECT_EQ(answer.then, Then::done);
  for (int attempt = 0; attempt < 3; ++attempt) {
    EXPECT_TRUE(Asked(talk, kWrite).starts_with("error: the device refused the password"));
  }
  talk->OnReconnect();
  EXPECT_TRUE(Asked(talk, kWrite).starts_with("error: the device refused the password"));
  talk->OnEnabled();
  EXPECT_EQ(Body(Asked(talk, kWrite)), ">1WV160:345");
}

TEST(SpaWrite, ADeviceWithoutPasswordItemIsReportedAndRetried) {
  for (const char* reply : {"<1N:5:", "<1N:6:"}) {
    Talk talk(SpabusProtocol(), Device(345));
    Asked(talk, kWrite);
    const Answer answer = Hear(talk, kWrite, reply);
    EXPECT_EQ(answer.outcome, Outcome::refused);
    EXPECT_NE(answer.reason.find("remove `password`"), std::string::npos) << answer.reason;
    EXPECT_EQ(Body(Asked(talk, kWrite)), ">1WV160:345");
  }
}

TEST(SpaWrite, ABusyOrDisturbedDeviceGetsThePasswordAgain) {
  for (const char* reply : {"<1N:0:", "<1N:1:", "<1N:2:"}) {
    Talk talk(SpabusProtocol(), Device(345));
    Asked(talk, kWrite);
    const Answer answer = Hear(talk, kWrite, reply);
    EXPECT_EQ(answer.then, Then::done);
    EXPECT_EQ(talk.Fail(kWrite, answer.outcome), Then::done);
    EXPECT_EQ(Body(Asked(talk, kWrite)), ">1WV160:345") << reply;
  }
}

TEST(SpaWrite, ADamagedWriteIsClosedWithARetry) {
  Talk talk(SpabusProtocol(), Device(345));
  Asked(talk, kWrite);
  Hear(talk, kWrite, "<1A:");
  Asked(talk, kWrite);
  const Answer damaged = Hear(talk, kWrite, "<1N:0:");
  EXPECT_EQ(talk.Fail(kWrite, damaged.outcome), Then::ask_again);
  EXPECT_EQ(Body(Asked(talk, kWrite)), ">1WV161:345");
  EXPECT_EQ(talk.Fail(kWrite, Outcome::no_reply), Then::ask_again);
  EXPECT_EQ(Body(Asked(talk, kWrite)), ">1WV161:345");
  const Answer closed = Hear(talk, kWrite, "<1A:");
  EXPECT_EQ(closed.outcome, Outcome::corrupt);
  EXPECT_EQ(closed.then, Then::done);
}

TEST(SpaWrite, OnlyTheClosingIsMarkedAsMandatory) {
  Talk talk(SpabusProtocol(), Device(345));
  for (const bool closes : {false, false, true}) {
    const std::string asked = Asked(talk, kWrite);
    EXPECT_EQ(talk.request().closes, closes) << asked;
    Hear(talk, kWrite, "<1A:");
  }
  Talk open(SpabusProtocol(), Device(0));
  Asked(open, kWrite);
  EXPECT_FALSE(open.request().closes);
}

/// The replies to the requests of a write in turn (empty: no reply), and the result of the write.
struct Course {
  const char* name;
  std::int64_t password;
  std::vector<std::string> heard;
  Outcome outcome;
  bool sent;
};

class SpaWriteEnd : public ::testing::TestWithParam<Course> {};

TEST_P(SpaWriteEnd, HasTheOutcomeOfItsReplies) {
  const Course& course = GetParam();
  Talk talk(SpabusProtocol(), Device(course.password));
  bool sent = false;
  Outcome outcome = Outcome::none;
  for (std::size_t step = 0;; ++step) {
    const auto request = talk.Ask(kWrite);
    ASSERT_TRUE(request) << request.error();
    sent = sent || (!request->prepares && !request->closes);
    ASSERT_LT(step, course.heard.size()) << "one request too many: " << ToHex(request->bytes);
    Then then = Then::done;
    const std::string& heard = course.heard[step];
    // As in the poller, a reply that does not prove the device's presence is a failure of the
    // request.
    const Outcome first =
        heard.empty() ? Outcome::no_reply : talk->Check(request->bytes, ReplyText(heard));
    if (ProvesLife(first)) {
      const Answer answer = Hear(talk, kWrite, heard);
      outcome = answer.outcome;
      then = answer.then;
    } else {
      outcome = first;
      then = talk.Fail(kWrite, first);
    }
    if (then == Then::ask_again) continue;
    EXPECT_EQ(step + 1, course.heard.size()) << "an answer is left over";
    break;
  }
  EXPECT_EQ(outcome, course.outcome);
  EXPECT_EQ(sent, course.sent);
}

const Course kCourses[] = {
    {"confirmed", 0, {"<1A:"}, Outcome::ok, true},
    {"silence", 0, {""}, Outcome::no_reply, true},
    {"damaged", 0, {"<1N:0:"}, Outcome::corrupt, true},
    {"busy", 0, {"<1N:1:"}, Outcome::busy, true},
    {"buffer_full", 0, {"<1N:2:"}, Outcome::busy, true},
    {"complicated", 0, {"<1N:3:"}, Outcome::unsupported, true},
    {"reserved", 0, {"<1N:4:"}, Outcome::refused, true},
    {"syntax", 0, {"<1N:5:"}, Outcome::unsupported, true},
    {"missing", 0, {"<1N:6:"}, Outcome::unsupported, true},
    {"needs_a_password", 0, {"<1N:7:"}, Outcome::refused, true},
    {"bad_value", 0, {"<1N:8:"}, Outcome::refused, true},
    {"other_error", 0, {"<1N:9:"}, Outcome::busy, true},
    {"data", 0, {"<1D:1:"}, Outcome::unexpected, true},
    {"guarded", 345, {"<1A:", "<1A:", "<1A:"}, Outcome::ok, true},
    {"guarded_silence", 345, {"<1A:", "", "<1A:"}, Outcome::no_reply, true},
    {"guarded_bad_value", 345, {"<1A:", "<1N:8:", "<1A:"}, Outcome::refused, true},
    {"guarded_busy", 345, {"<1A:", "<1N:1:", "<1A:"}, Outcome::busy, true},
    {"guarded_buffer_full", 345, {"<1A:", "<1N:2:", "<1A:"}, Outcome::busy, true},
    {"guarded_needs_a_password", 345, {"<1A:", "<1N:7:", "<1A:"}, Outcome::busy, true},
    {"guarded_other_error", 345, {"<1A:", "<1N:9:", "<1A:"}, Outcome::busy, true},
    {"password_unanswered", 345, {"", "<1A:"}, Outcome::no_reply, false},
    {"password_and_closing_unanswered", 345, {"", "", ""}, Outcome::no_reply, false},
    {"password_damaged", 345, {"<1N:0:", "<1A:"}, Outcome::corrupt, false},
    {"password_refused", 345, {"<1N:7:"}, Outcome::refused, false},
    {"password_busy", 345, {"<1N:1:"}, Outcome::busy, false},
    {"password_unknown", 345, {"<1N:6:"}, Outcome::refused, false},
};
INSTANTIATE_TEST_SUITE_P(Each, SpaWriteEnd, ::testing::ValuesIn(kCourses),
                         [](const auto& info) { return info.param.name; });

const Task kPoll = Poll(0);

struct Interrupted {
  explicit Interrupted(int steps) {
    values.fallback = std::int64_t{0};
    for (int step = 0; step < steps; ++step) talk.Exchange(kWrite, *twin);
    Asked(talk, kWrite);
    talk->OnReconnect();
  }
  bool is_open() const {
    const Bytes reply = twin->Answer(ToBytes(">1WV150:0:XX\r"), {});
    return AsText(reply).find("<1A:") != std::string_view::npos;
  }

  config::Device device = Device(345);
  FixedValues values;
  std::unique_ptr<Twin> twin = SpabusProtocol().make_twin(device, values);
  Talk talk{SpabusProtocol(), device};
};

TEST(SpaWrite, APasswordLeftOpenIsClosedBeforeTheFirstPoll) {
  for (const int steps : {1, 2}) {
    Interrupted relay(steps);
    ASSERT_TRUE(relay.is_open()) << steps;
    const Answer closed = relay.talk.Exchange(kPoll, *relay.twin);
    EXPECT_TRUE(relay.talk.request().closes);
    EXPECT_EQ(closed.then, Then::ask_again);
    EXPECT_TRUE(closed.readings.empty());
    EXPECT_FALSE(relay.is_open()) << steps;
    const Answer read = relay.talk.Exchange(kPoll, *relay.twin);
    EXPECT_EQ(read.outcome, Outcome::ok);
    EXPECT_EQ(read.readings.size(), 1U);
    EXPECT_EQ(Body(Asked(relay.talk, kPoll)).find("V161"), std::string::npos) << "once";
  }
}

TEST(SpaWrite, ARefusedClosingMeansThatTheSessionIsClosed) {
  Interrupted relay(0);
  ASSERT_FALSE(relay.is_open()) << "the password was sent and did not arrive";
  EXPECT_EQ(relay.talk.Exchange(kPoll, *relay.twin).then, Then::ask_again);
  EXPECT_EQ(relay.talk.Exchange(kPoll, *relay.twin).readings.size(), 1U);
  EXPECT_FALSE(relay.talk.request().closes);
  EXPECT_EQ(relay.talk->Queries().size(), 2U) << "V161 was not taken for a point";
}

TEST(SpaWrite, AnUnansweredClosingDoesNotBlockPolls) {
  Interrupted relay(1);
  for (const bool closes : {true, true, false, false}) {
    Asked(relay.talk, kPoll);
    EXPECT_EQ(relay.talk.request().closes, closes);
    const Then then = relay.talk.Fail(kPoll, Outcome::no_reply);
    EXPECT_EQ(then, closes ? Then::ask_again : Then::done);
  }
  relay.talk->OnReconnect();
  relay.talk.Run(kPoll, *relay.twin);
  EXPECT_FALSE(relay.is_open()) << "it has come back";
}

TEST(SpaWrite, ProbesAndTheNextWritePrecedeTheClosing) {
  Interrupted relay(1);
  const Task probe{.kind = Task::Kind::probe};
  EXPECT_TRUE(Asked(relay.talk, probe).starts_with(">1RF:"));
  EXPECT_EQ(relay.talk.Run(kWrite, *relay.twin).outcome, Outcome::ok);
  EXPECT_FALSE(relay.is_open());
  Asked(relay.talk, kPoll);
  EXPECT_FALSE(relay.talk.request().closes);
}

TEST(SpaWrite, LostClosingsAreRepeatedBeforeTheNextPoll) {
  Talk talk(SpabusProtocol(), Device(345));
  Asked(talk, kWrite);
  for (int closing = 0; closing < 2; ++closing) {
    talk.Fail(kWrite, Outcome::no_reply);
    Asked(talk, kWrite);
  }
  EXPECT_EQ(talk.Fail(kWrite, Outcome::no_reply), Then::done);
  EXPECT_EQ(Body(Asked(talk, kPoll)), ">1WV161:345");
  EXPECT_EQ(Hear(talk, kPoll, "<1A:").then, Then::ask_again);
  EXPECT_EQ(Body(Asked(talk, kPoll)).substr(0, 3), ">1R");
}

TEST(SpaWrite, AnUnsentClosingStaysPending) {
  Interrupted relay(1);
  for (int asked = 0; asked < 5; ++asked) {
    Asked(relay.talk, kPoll);
    EXPECT_TRUE(relay.talk.request().closes) << asked;
  }
  EXPECT_EQ(relay.talk.Fail(kPoll, Outcome::no_reply), Then::ask_again);
  for (int asked = 0; asked < 5; ++asked) Asked(relay.talk, kPoll);
  relay.talk.Run(kPoll, *relay.twin);
  EXPECT_FALSE(relay.is_open());
}

/// The write was forbidden after the conversation made its first request, and the conversation does
/// not learn this.
TEST(SpaWrite, AnUnsentWriteIsClosedBeforeTheNextPoll) {
  Interrupted relay(1);
  Asked(relay.talk, kWrite);
  relay.talk.Run(kPoll, *relay.twin);
  EXPECT_FALSE(relay.is_open());
}

TEST(SpaWrite, AnUnsentWriteLeavesTheSessionOpen) {
  Talk talk(SpabusProtocol(), Device(345));
  talk->OnUnsettledWrite();
  Asked(talk, kWrite);
  EXPECT_EQ(Body(Asked(talk, kPoll)), ">1WV160:345") << "is it the right one?";
}

TEST(SpaWrite, AnUnsettledWriteBeforeARestartIsClosed) {
  Interrupted relay(1);
  ASSERT_TRUE(relay.is_open());
  Talk again(SpabusProtocol(), Device(345));
  again->OnUnsettledWrite();
  EXPECT_EQ(again.Exchange(kPoll, *relay.twin).then, Then::ask_again);
  EXPECT_EQ(Body(std::string(AsText(again.request().bytes))), ">1WV160:345")
      << "is it the right one?";
  EXPECT_EQ(again.Exchange(kPoll, *relay.twin).then, Then::ask_again);
  EXPECT_EQ(Body(std::string(AsText(again.request().bytes))), ">1WV161:345");
  EXPECT_FALSE(relay.is_open());
  EXPECT_EQ(again.Exchange(kPoll, *relay.twin).readings.size(), 1U);
}

TEST(SpaWrite, ADeviceSilentOverASecondRestartIsClosedAfterwards) {
  Interrupted relay(1);
  ASSERT_TRUE(relay.is_open());
  EXPECT_FALSE(relay.talk->Memory().empty()) << "before it is closed";
  Talk first(SpabusProtocol(), Device(345));
  first->OnUnsettledWrite();
  Asked(first, kPoll);
  first.Fail(kPoll, Outcome::no_reply);
  const std::string memory = first->Memory();
  EXPECT_EQ(memory.find("345"), std::string::npos) << "a password is not for a file";

  Talk second(SpabusProtocol(), Device(345));
  second->Recall(memory, {});
  second.Run(kPoll, *relay.twin);
  EXPECT_FALSE(relay.is_open());
  EXPECT_EQ(second->Memory(), "");
}

TEST(SpaWrite, AnUnsettledWriteIsClosedOnlyWithTheRightPassword) {
  for (const std::int64_t password : {0, 346}) {
    Interrupted relay(1);
    Talk again(SpabusProtocol(), Device(password));
    again->OnUnsettledWrite();
    for (int polls = 0; polls < 3; ++polls) {
      again.Exchange(kPoll, *relay.twin);
      EXPECT_EQ(AsText(again.request().bytes).find("V161"), std::string_view::npos) << password;
    }
  }
}

TEST(SpaWrite, AnUnsettledWriteOfASilentDeviceDoesNotBlockPolls) {
  Talk talk(SpabusProtocol(), Device(345));
  talk->OnUnsettledWrite();
  for (const bool opens : {true, true, false}) {
    EXPECT_EQ(Body(Asked(talk, kPoll)) == ">1WV160:345", opens);
    talk.Fail(kPoll, Outcome::no_reply);
  }
}

TEST(SpaWrite, AWriteWithARefusedPasswordIsNotClosed) {
  Talk talk(SpabusProtocol(), Device(345));
  Asked(talk, kWrite);
  Hear(talk, kWrite, "<1N:7:");
  EXPECT_EQ(Body(Asked(talk, kPoll)).substr(0, 3), ">1R");
}

}  // namespace
}  // namespace baudgate::protocols::spabus
