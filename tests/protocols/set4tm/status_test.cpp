// What becomes of a request that a SET-4TM meter answers with a status code.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/meter/status.h"

#include <gmock/gmock.h>

#include "protocols/set4tm/conversation.h"
#include "tests/protocols/set4tm/support.h"

namespace baudgate::protocols::set4tm {
namespace {

using ::testing::ElementsAre;

/// A float that is refused asks for the type, which may have no floats.
TEST(Set4tmStatus, UnsupportedPointIsNotAskedAgain) {
  Talk talk =
      OpenTalk(MakeDevice("1", {MakePoint("08 1B 02 E0 float_le@0"), MakePoint(kOneFloat)}));
  const Answer answer = talk.Run(Poll(0), Script({"01", "10 40 80", "01"}));
  EXPECT_EQ(answer.outcome, Outcome::unsupported);
  EXPECT_EQ(answer.then, Then::replan);
  ASSERT_EQ(answer.readings.size(), 1U);
  EXPECT_EQ(answer.readings[0].point, 0U);
  EXPECT_EQ(answer.readings[0].quality, Quality::bad_configuration);
  ASSERT_EQ(talk->Queries().size(), 1U);
  EXPECT_THAT(talk->Queries()[0].points, ElementsAre(1));
  talk->OnReconnect();
  EXPECT_EQ(talk->Queries().size(), 2U);
}

TEST(Set4tmStatus, EachCodeHasItsOutcomeAndPatience) {
  struct Row {
    const char* body;
    Outcome outcome;
    Duration wait;
  };
  const Row kRows[] = {{"02", Outcome::refused, 10s},  {"04", Outcome::refused, 0s},
                       {"07", Outcome::busy, 0s},      {"08", Outcome::busy, 1s},
                       {"58", Outcome::busy, 5s},      {"0A", Outcome::refused, 0s},
                       {"0F", Outcome::no_reply, 0s},  {"0C", Outcome::refused, 10s},
                       {"00", Outcome::unexpected, 0s}};
  for (const Row& row : kRows) {
    Talk talk = OpenTalk(OneFloat());
    const Answer answer = talk.Run(Poll(0), Script({row.body}));
    EXPECT_EQ(answer.outcome, row.outcome) << row.body;
    EXPECT_EQ(answer.wait, row.wait) << row.body;
    EXPECT_EQ(answer.then, Then::done) << row.body;
    EXPECT_FALSE(answer.reason.empty()) << row.body;
    for (const Reading& reading : answer.readings) EXPECT_FALSE(HasValue(reading.value));
  }
}

constexpr const char* kSerialPoint = "08 00 u32_be@0";

TEST(Set4tmStatus, ASerialNumberThatIsNotToldIsAskedForOnce) {
  for (const char* status : {"01", "03"}) {
    Talk talk = OpenTalk(MakeDevice("5", {MakePoint(kSerialPoint, config::Group::once)}));
    const Answer answer = talk.Run(Poll(0), Script(std::vector<std::string>(10, status)));
    EXPECT_THAT(TakeAsked(talk), ElementsAre("08 00")) << status;
    EXPECT_EQ(answer.then, Then::replan) << status;
    ASSERT_EQ(answer.readings.size(), 1U) << status;
    EXPECT_FALSE(HasValue(answer.readings[0].value)) << status;
    EXPECT_TRUE(talk->Queries().empty()) << status;
  }
}

/// A meter of whom nothing was known before, with a memory of its own.
TEST(Set4tmStatus, WhoDoesNotTellItsSerialNumberContradictsNothing) {
  for (const char* status : {"01", "02", "03", "04", "0A"}) {
    Talk talk(Set4tmProtocol(), MakeDevice("5", {MakePoint(kOneFloat),
                                                 MakePoint(kSerialPoint, config::Group::once)}));
    talk->Recall("", {talk.now, WallTime(1'790'000'000s)});
    talk.Run(Probe(), Script({"00"}));
    TakeAsked(talk);
    for (int poll = 0; poll < 3; ++poll) {
      talk.Run(Poll(0), [status](View request) {
        return Script({Is(SplitFrame(request)->body, kAskSerial) ? status : "00 80 66 43"})(
            request);
      });
    }
    EXPECT_THAT(TakeAsked(talk), ElementsAre("08 00", "08 1B 00 11", "08 1B 00 11", "08 1B 00 11"))
        << status;
  }
}

/// Its values may be another meter's.
TEST(Set4tmStatus, WhoShouldTellItsSerialNumberAndDoesNotIsAskedRarely) {
  for (const char* status : {"01", "02", "0A"}) {
    config::Device device = OneFloat();
    device.options.Set("serial_number", std::int64_t{kMeter});
    Talk talk = OpenTalk(device);
    const Answer answer = talk.Run(Poll(0), Script({status, status, status}));
    EXPECT_EQ(answer.outcome, Outcome::refused) << status;
    EXPECT_TRUE(answer.readings.empty()) << status;
    EXPECT_EQ(answer.wait, 1min) << status;
    EXPECT_THAT(TakeAsked(talk), ElementsAre("08 00")) << status;
  }
}

TEST(Set4tmStatus, NotReadyKeepsTheLastValueAsUncertain) {
  Talk talk = OpenTalk(OneFloat());
  const Answer answer = talk.Run(Poll(0), Script({"07"}));
  ASSERT_EQ(answer.readings.size(), 1U);
  EXPECT_EQ(answer.readings[0].quality, Quality::uncertain_last_usable);
}

TEST(Set4tmStatus, RepeatsOnceWhenAsked) {
  Talk talk = OpenTalk(OneFloat());
  EXPECT_EQ(talk.Run(Poll(0), Script({"06", "00 80 66 43"})).outcome, Outcome::ok);
  EXPECT_EQ(TakeAsked(talk).size(), 2U);
  EXPECT_EQ(talk.Run(Poll(0), Script({"06", "06"})).outcome, Outcome::busy);
  EXPECT_EQ(TakeAsked(talk).size(), 2U);
}

}  // namespace
}  // namespace baudgate::protocols::set4tm
