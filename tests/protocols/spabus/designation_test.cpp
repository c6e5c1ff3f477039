// A relay that calls itself what another profile is for serves no good value; clones and variants
// with names of their own do. Source of the texts: SPA reference, F of SPCJ 4D29 and SPAU 130 C.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/common/identification.h"
#include "tests/protocols/spabus/support.h"

namespace baudgate::protocols::spabus {
namespace {

config::Device Relay() {
  config::Device device = MakeDevice({MakePoint("I1"), MakePoint("S1")}, "1");
  device.identity.names = {"SPCJ 4D29", "SPAJ 140 C"};
  device.identity.others = {{"SPAU130C", "spau130c"}};
  return device;
}

TEST(Designation, OnlyANameThatAnotherProfileListsContradicts) {
  config::Identity identity = Relay().identity;
  EXPECT_EQ(JudgeName(identity, " SPAJ 140C").text, "");
  EXPECT_EQ(JudgeName(identity, "spcj 4d29").text, "");
  const DeviceTrouble foreign = JudgeName(identity, "SPAU 130 C");
  EXPECT_EQ(foreign.reason, Reason::other_module);
  EXPECT_NE(foreign.text.find("set profile: spau130c"), std::string::npos) << foreign.text;
  const DeviceTrouble unknown = JudgeName(identity, "SPAJ 140 X");
  EXPECT_FALSE(unknown);
  EXPECT_NE(unknown.text.find("does not list (SPCJ 4D29, SPAJ 140 C)"), std::string::npos)
      << unknown.text;
  identity.ignore = true;
  EXPECT_EQ(JudgeName(identity, "SPAU 130 C").text, "");
  EXPECT_EQ(JudgeName({}, "anything").text, "");
}

TEST(SpaDesignation, IsAskedBeforeTheFirstPollAndDecides) {
  Talk talk(SpabusProtocol(), Relay());
  EXPECT_EQ(Asked(talk, Poll(0)), ">1RF:21");
  const Answer foreign = Hear(talk, Poll(0), "<1D:SPAU 130 C:");
  EXPECT_EQ(foreign.then, Then::replan);
  EXPECT_TRUE(foreign.readings.empty());
  EXPECT_EQ(talk->trouble().reason, Reason::other_module);
  ASSERT_EQ(talk->Queries().size(), 1U);
  EXPECT_EQ(talk->Queries()[0].group, config::Group::slow);

  talk->OnReconnect();
  EXPECT_TRUE(talk->trouble()) << "until it is known to be right";
  EXPECT_EQ(Asked(talk, Poll(0)), ">1RF:21");
  EXPECT_EQ(Hear(talk, Poll(0), "<1D:SPCJ 4D29:").then, Then::replan);
  EXPECT_FALSE(talk->trouble());
  EXPECT_EQ(talk->Queries().size(), 2U);
  EXPECT_NE(Asked(talk, Poll(0)), ">1RF:21");
}

TEST(SpaDesignation, SilenceAndRefusalContradictNothing) {
  for (const char* reply : {"", "<1N:6:"}) {
    Talk talk(SpabusProtocol(), Relay());
    const Bytes wire = *reply == '\0' ? Bytes() : ReplyText(reply);
    const bool silent = wire.empty();
    EXPECT_EQ(talk.Exchange(Poll(0), View(wire)).then, silent ? Then::done : Then::ask_again);
    EXPECT_NE(Asked(talk, Poll(0)), ">1RF:21");
    EXPECT_FALSE(talk->trouble());
  }
}

/// The question waits behind a probe, or is parked, while the relay is asked for something else.
TEST(SpaDesignation, AFailureOfAnotherTaskIsNoAnswerToIt) {
  Talk talk(SpabusProtocol(), Relay());
  EXPECT_EQ(Asked(talk, Poll(0)), ">1RF:21");
  Asked(talk, Probe());
  talk.Fail(Probe(), Outcome::no_reply);
  EXPECT_EQ(Asked(talk, Poll(0)), ">1RF:21");

  config::Device guarded = Relay();
  guarded.points.push_back(MakePoint("V150", Type::uint16, Group::slow, Access::read_write));
  guarded.options.Set("password", std::int64_t{345});
  Talk writes(SpabusProtocol(), std::move(guarded));
  Asked(writes, Poll(0));
  Asked(writes, Write(2, Value(std::int64_t{1})));
  EXPECT_EQ(writes.Fail(Write(2, Value(std::int64_t{1})), Outcome::no_reply), Then::ask_again);
  EXPECT_EQ(Body(Asked(writes, Write(2, Value(std::int64_t{1})))), ">1WV161:345");
}

}  // namespace
}  // namespace baudgate::protocols::spabus
