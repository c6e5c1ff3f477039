// Tests what the type of a SET-4TM meter (08 12) determines: profile and names of status bits.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "config/loader.h"
#include "protocols/set4tm/conversation.h"
#include "protocols/set4tm/meter/plan.h"
#include "protocols/set4tm/rules.h"
#include "protocols/set4tm/session.h"
#include "tests/protocols/set4tm/support.h"

namespace baudgate::protocols::set4tm {
namespace {

using config::Group;
using config::Type;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

config::Device OfTypes(std::vector<std::string> types) {
  return MakeDevice(
      "5",
      {MakePoint("08 1B 00 11 float_le@0"), MakePoint("08 0A alarm@0", Group::slow, Type::boolean),
       MakePoint("08 0A flag@1", Group::slow, Type::boolean)},
      {{"types", std::move(types)}});
}

constexpr const char* kIsType8 = "10 40 80";
constexpr const char* kIsType1 = "10 40 10";
constexpr const char* kFloat = "00 80 66 43";

TEST(Set4tmType, IsReadOnceBeforeOtherRequests) {
  Talk talk = OpenTalk(OfTypes({"8"}));
  EXPECT_EQ(talk.Run(Poll(0), Script({kIsType8, kFloat})).outcome, Outcome::ok);
  EXPECT_FALSE(talk->trouble());
  const Answer flags = talk.Run(Poll(1), Script({"01 00 00 00 80"}));
  EXPECT_EQ(flags.readings.at(0).value, Value(true));
  EXPECT_EQ(flags.readings.at(1).value, Value(true));
  talk.now += 16s;
  talk.Run(Poll(0), Script({"00", kFloat}));
  EXPECT_THAT(TakeAsked(talk), ElementsAre("08 12", "08 1B 00 11", "08 0A", "01", "08 1B 00 11"))
      << "opening the channel again is no other meter";
  talk->OnReconnect();
  talk.Run(Poll(0), Script({"00", kIsType8, kFloat}));
  EXPECT_THAT(TakeAsked(talk), ElementsAre("01", "08 12", "08 1B 00 11"));
}

TEST(Set4tmType, IsReadAgainAfterSilence) {
  Talk talk = OpenTalk(OfTypes({"8"}));
  talk.Run(Poll(0), Script({kIsType8, kFloat}));
  talk.Run(Poll(0), Script({}));
  TakeAsked(talk);
  talk.Run(Poll(0), Script({kIsType1}));
  EXPECT_THAT(TakeAsked(talk), ElementsAre("08 12"));
  EXPECT_EQ(talk->trouble().reason, Reason::other_module);
}

TEST(Set4tmType, AnotherTypeIsReportedAndOnlyIdentifiedUntilItIsRight) {
  Talk talk = OpenTalk(OfTypes({"8"}));
  const Answer answer = talk.Run(Poll(0), Script({kIsType1}));
  EXPECT_EQ(answer.outcome, Outcome::refused);
  EXPECT_EQ(answer.wait, 1min);
  EXPECT_EQ(talk->trouble().reason, Reason::other_module);
  EXPECT_THAT(talk->trouble().text, AllOf(HasSubstr("the meter has type 1 (SET-4TM.03)"),
                                          HasSubstr("type 8 (SET-4TM.02M, .03M)"),
                                          HasSubstr("correct the profile or the address")));
  talk->OnReconnect();
  EXPECT_EQ(talk->trouble().reason, Reason::other_module) << "until it is known to be right";
  talk.Run(Poll(0), Script({"00", kIsType1}));
  talk.Run(Poll(0), Script({kIsType8, kFloat}));
  EXPECT_FALSE(talk->trouble());
}

TEST(Set4tmType, StatusBitsOfAnotherTypeHaveNoNames) {
  for (unsigned type = 0; type < 16; ++type) {
    const std::string code(1, "0123456789ABCDEF"[type]);
    Talk talk = OpenTalk(OfTypes({code}));
    Answer answer = talk.Run(Poll(1), Script({"10 40 " + code + "0", "FF FF FF FF FF"}));
    if (answer.then == Then::restart) answer = talk.Run(Poll(1), Script({"FF FF FF FF FF"}));
    ASSERT_EQ(answer.readings.size(), 2U) << code;
    for (const Reading& reading : answer.readings) {
      EXPECT_EQ(IsGood(reading.quality), type == 8) << code;
      EXPECT_EQ(HasValue(reading.value), type == 8) << code;
      if (type != 8) {
        EXPECT_EQ(reading.quality, Quality(Quality::bad_configuration, Reason::not_fitted));
      }
    }
  }
}

TEST(Set4tmType, AMeterWithoutTypeIsNoContradiction) {
  Talk talk = OpenTalk(OfTypes({"8"}));
  EXPECT_EQ(talk.Run(Poll(0), Script({"01", kFloat})).outcome, Outcome::ok);
  EXPECT_FALSE(talk->trouble());
  const Answer flags = talk.Run(Poll(1), Script({"01 00 00 00 80"}));
  EXPECT_EQ(flags.readings.at(0).quality, Quality::bad_configuration) << "and names no bits";
  EXPECT_THAT(TakeAsked(talk), ElementsAre("08 12", "08 1B 00 11", "08 0A"));
}

TEST(Set4tmType, AnUnknownLaterTypeIsOnlyARemark) {
  Talk talk = OpenTalk(OfTypes({"8"}));
  EXPECT_EQ(talk.Run(Poll(0), Script({"10 40 C0", kFloat})).outcome, Outcome::ok);
  EXPECT_FALSE(talk->trouble());
  EXPECT_THAT(talk->trouble().text, HasSubstr("type C"));
}

TEST(Set4tmType, IgnoredIdentityServesAnyTypeWithoutStatusBits) {
  config::Device device = OfTypes({"8"});
  device.identity.ignore = true;
  Talk talk = OpenTalk(device);
  EXPECT_EQ(talk.Run(Poll(0), Script({kFloat})).outcome, Outcome::ok);
  const Answer flags = talk.Run(Poll(1), Script({kIsType1, "01 00 00 00 80"}));
  EXPECT_FALSE(talk->trouble());
  EXPECT_EQ(flags.readings.at(0).quality, Quality::bad_configuration);
}

TEST(Set4tmType, WithoutAListItIsReadForTheStatusWordOnly) {
  config::Device device = OfTypes({"8"});
  device.options.Set("types", std::vector<std::string>());
  Talk talk = OpenTalk(device);
  talk.Run(Poll(0), Script({kFloat}));
  talk.Run(Poll(1), Script({kIsType1, "01 00 00 00 80"}));
  EXPECT_THAT(TakeAsked(talk), ElementsAre("08 1B 00 11", "08 12", "08 0A"));
  EXPECT_FALSE(talk->trouble());
}

TEST(Set4tmType, ATwinOfAnotherTypeIsDetected) {
  for (const char* type : {"0", "1", "3", "6"}) {
    config::Device other = OfTypes({type});
    FixedValues values;
    values.Set(0, 230.5);
    values.Set(1, true);
    values.Set(2, true);
    MeterTwin twin(other, values);
    Talk talk(Set4tmProtocol(), OfTypes({"8"}));
    talk.Run(Poll(0), twin);
    EXPECT_EQ(talk->trouble().reason, Reason::other_module) << type;
  }
}

TEST(Set4tmType, RefusesAnInvalidList) {
  config::Options options = DefaultOptions();
  options.Set("types", std::vector<std::string>{"8", "G"});
  const Status status = CheckSettings(options);
  ASSERT_FALSE(status);
  EXPECT_THAT(status.error(), HasSubstr("\"G\" is not a type code"));
}

TEST(Set4tmDay, ANewDayOfTheMeterRestartsAllReads) {
  Talk talk = OpenTalk(MakeDevice("5", {MakePoint("04 00 time@0", Group::slow, Type::string)}));
  const auto clock = [&](const char* data) { return talk.Run(Poll(0), Script({data})).then; };
  EXPECT_EQ(clock("31 30 15 01 02 09 02 00"), Then::done) << "the first reading is no new day";
  EXPECT_EQ(clock("59 59 23 01 02 09 02 00"), Then::done);
  EXPECT_EQ(clock("05 00 00 02 03 09 02 00"), Then::restart);
  EXPECT_EQ(clock("06 00 00 02 03 09 02 00"), Then::done);
}

TEST(Set4tmPace, TheMultiplierExtendsSilenceAndReplyTime) {
  config::Device device = MakeDevice("5", {MakePoint("08 17 u8@1", Group::once, Type::uint16)});
  Talk talk = OpenTalk(device);
  const Duration character = 1145833ns;
  EXPECT_FALSE(talk->LeastTimes(character).reply);
  talk.Run(Poll(0), Script({"00 05"}));
  const config::Timing times = talk->LeastTimes(character);
  EXPECT_EQ(times.quiet, 5 * 7 * character);
  EXPECT_EQ(times.reply, 2 * 5 * 7 * character + 5 * 100ms + 200ms);
  EXPECT_EQ(talk->WhatIsLearned(), "timeouts are multiplied by the meter's multiplier 5");
  talk.Run(Poll(0), Script({"00 00"}));
  EXPECT_FALSE(talk->LeastTimes(character).reply) << "0 counts as 1";
  talk.Run(Poll(0), Script({"00 05"}));
  talk->OnReconnect();
  EXPECT_FALSE(talk->LeastTimes(character).reply);
}

config::Options WithKs() {
  config::Options options = DefaultOptions();
  options.Set("checksum", std::string("ks"));
  return options;
}

TEST(Set4tmKs, IsTheXorOfAllBytesAndFf) {
  EXPECT_EQ(ToHex(MakeFrame(Hex("00"), Hex("00"), Checksum::ks)), "00 00 FF");
  EXPECT_EQ(ToHex(MakeFrame(Hex("05"), Hex("08 00"), Checksum::ks)), "05 08 00 F2");
  EXPECT_EQ(ToHex(MakeFrame(Hex("05"), Hex("05"), Checksum::ks)), "05 05 FF");
  EXPECT_TRUE(SplitFrame(Hex("05 08 00 F2"), Checksum::ks));
  EXPECT_FALSE(SplitFrame(Hex("05 08 00 F3"), Checksum::ks));
  EXPECT_FALSE(SplitFrame(Hex("05 08 00 66 01"), Checksum::ks));
  EXPECT_FALSE(SplitFrame(Hex("05 08 00 F2")));
  EXPECT_FALSE(EndsInChecksum(Hex("FF"), Checksum::ks)) << "of nothing";
}

TEST(Set4tmKs, DetectsAnySingleBitError) {
  const Bytes good = MakeFrame(Hex("05"), Hex("00 00 27 11 00 00 13 89"), Checksum::ks);
  for (std::size_t bit = 0; bit < good.size() * 8; ++bit) {
    Bytes bad = good;
    bad[bit / 8] = static_cast<std::uint8_t>(bad[bit / 8] ^ (1U << (bit % 8)));
    EXPECT_FALSE(EndsInChecksum(bad, Checksum::ks)) << bit;
  }
}

TEST(Set4tmKs, HidesThePasswordAndItsChecksum) {
  const Expectation expect = Expect(MakeFrame(Hex("05"), Hex("01 30 30 30 30 30 31"), Checksum::ks),
                                    ReadSettings(WithKs()));
  ASSERT_EQ(expect.secrets.size(), 1U);
  EXPECT_EQ(expect.secrets[0], (std::pair<std::size_t, std::size_t>{2, 7}));
}

TEST(Set4tmKs, AStatusHasThreeBytesAndWaitsForSilence) {
  const Expectation expect = Expect(Hex("05 08 00 F2"), ReadSettings(WithKs()));
  const Bytes status = Hex("05 05 FF");
  EXPECT_EQ(ReplyRule(status, expect, false).kind, Cut::Kind::need_more);
  EXPECT_EQ(ReplyRule(status, expect, true).size, 3U);
  const Bytes whole = MakeFrame(Hex("05"), Hex("00 89 A2 61 06 09 02"), Checksum::ks);
  EXPECT_EQ(ReplyRule(whole, expect, false).size, whole.size());
  Bytes lengthened = status;
  lengthened.resize(whole.size());
  EXPECT_EQ(ReplyRule(lengthened, expect, true).kind, Cut::Kind::discard);
}

/// A damaged reply can have a valid checksum of the other kind. So a reply proves only that a meter
/// is present.
TEST(Set4tmKs, ASilentMeterIsSometimesProbedWithTheOtherChecksum) {
  config::Device device = MakeDevice("5", {MakePoint(kOneFloat)});
  device.options.Set("checksum", std::string("ks"));
  Talk talk(Set4tmProtocol(), device);
  std::vector<Bytes> in_other;
  for (int probe = 0; probe < 12; ++probe) {
    const Bytes request = talk.Ask(Probe())->bytes;
    if (EndsInChecksum(request, Checksum::crc)) in_other.push_back(request);
    talk.Fail(Probe(), Outcome::no_reply);
  }
  ASSERT_EQ(in_other.size(), 3U);
  EXPECT_EQ(in_other[0], MakeFrame(Hex("05"), Hex("08 00"), Checksum::crc));
  const auto found = Recognise(in_other[0], MakeFrame(Hex("05"), Hex("05"), Checksum::crc),
                               ReadSettings(WithKs()));
  ASSERT_TRUE(found);
  EXPECT_EQ(found->what, Recognised::What::other_setting);
  EXPECT_EQ(found->remedy, "set checksum: crc in the configuration");

  talk.Run(Probe(), [](View) { return MakeFrame(Hex("05"), Hex("00"), Checksum::ks); });
  for (int probe = 0; probe < 8; ++probe) {
    EXPECT_FALSE(EndsInChecksum(talk.Ask(Probe())->bytes, Checksum::crc)) << "it has answered";
    talk.Fail(Probe(), Outcome::no_reply);
  }
}

TEST(Set4tmKs, AnotherSerialNumberMustComeTwice) {
  Settings settings;
  settings.serial_number = 7;
  settings.checksum = Checksum::ks;
  MeterSession session(settings);
  EXPECT_FALSE(session.Doubts(7));
  EXPECT_TRUE(session.Doubts(9)) << "it may be damaged";
  EXPECT_FALSE(session.Doubts(9));
  session.OnTaskEnd();
  for (const std::uint32_t serial : {11U, 12U, 13U}) EXPECT_TRUE(session.Doubts(serial));
  EXPECT_FALSE(session.Doubts(14)) << "not without an end";
  settings.checksum = Checksum::crc;
  session.OnTaskEnd();
  EXPECT_FALSE(session.Doubts(9));
}

TEST(Set4tmKs, IsUsedByConversationAndTwin) {
  config::Device device = MakeDevice("5", {MakePoint("05 00 02 energy@0")});
  device.options.Set("checksum", std::string("ks"));
  device.options.Set("types", std::vector<std::string>{"0"});
  FixedValues values;
  values.Set(0, 1.0001);
  MeterTwin twin(device, values);
  Talk talk(Set4tmProtocol(), device);
  const Answer answer = talk.Run(Poll(0), twin);
  ASSERT_EQ(answer.outcome, Outcome::ok) << answer.reason;
  EXPECT_EQ(answer.readings.at(0).value, Value(1.0001));
  EXPECT_EQ(ToHex(talk.asked.back()), "05 05 00 02 FD");
}

TEST(Set4tmKs, AMeterWithTheOtherChecksumIsNotRead) {
  config::Device device = OneFloat();
  FixedValues values;
  MeterTwin with_crc(device, values);
  config::Device old = device;
  old.options.Set("checksum", std::string("ks"));
  Talk talk(Set4tmProtocol(), old);
  EXPECT_NE(talk.Run(Poll(0), with_crc).outcome, Outcome::ok);
}

config::Profile Load(const std::string& name) {
  config::Catalog catalog;
  catalog.protocols["set4tm"] = &Set4tmProtocol();
  auto loaded =
      config::LoadProfile("config/profiles/set4tm/" + name + ".yaml", Set4tmProtocol(), catalog);
  for (const config::Problem& problem : loaded.problems) ADD_FAILURE() << ToString(problem);
  return loaded.profile;
}

FixedValues Simulated(const std::vector<config::Point>& points) {
  FixedValues values;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const config::Point& point = points[i];
    if (!point.simulate) continue;
    if (point.simulate->text) {
      values.Set(i, *point.simulate->text);
    } else {
      values.Set(i, ((point.simulate->low - point.offset) / point.scale).ToDouble());
    }
  }
  return values;
}

class Set4tmProfile : public ::testing::TestWithParam<std::pair<std::string, const char*>> {};

TEST_P(Set4tmProfile, EveryPointIsReadBackFromTheTwin) {
  const config::Profile profile = Load(GetParam().first);
  ASSERT_FALSE(profile.points.empty());
  config::Device device = MakeDevice("1", profile.points);
  device.options.Set("snapshot", std::string(GetParam().second));
  FixedValues values = Simulated(device.points);
  MeterTwin twin(device, values);
  Talk talk(Set4tmProtocol(), device);
  std::vector<bool> seen(device.points.size());
  for (std::size_t query = 0; query < talk->Queries().size(); ++query) {
    const Answer answer = talk.Run(Poll(query), twin);
    ASSERT_EQ(answer.outcome, Outcome::ok) << answer.reason << TakeAsked(talk).back();
    for (const Reading& reading : answer.readings) {
      const config::Point& point = device.points.at(reading.point);
      seen[reading.point] = true;
      ASSERT_EQ(reading.quality, Quality::good) << point.name;
      const Value truth = values.Get(reading.point, talk.now);
      ASSERT_TRUE(HasValue(truth)) << point.name << " has no `simulate`";
      if (point.type == config::Type::string) {
        EXPECT_EQ(ToText(reading.value), ToText(truth)) << point.name;
      } else if (!point.read.ends_with("alarm@0")) {
        const double expected = ToDouble(truth);
        EXPECT_NEAR(ToDouble(reading.value), expected, std::abs(expected) * 1e-4 + 0.1)
            << point.name;
      }
    }
  }
  for (std::size_t i = 0; i < seen.size(); ++i) EXPECT_TRUE(seen[i]) << device.points[i].name;
}

INSTANTIATE_TEST_SUITE_P(Shipped, Set4tmProfile,
                         ::testing::Values(std::pair{"set-4tm.03m", "false"},
                                           std::pair{"set-4tm.03m", "auto"},
                                           std::pair{"set-4tm.02", "auto"}));

TEST(Set4tmProfileLayout, TheFastBlockIsContiguousAndNeedsFewRequests) {
  const config::Profile profile = Load("set-4tm.03m");
  std::size_t next = 0;
  for (const config::Point& point : profile.points) {
    if (point.group != config::Group::fast) continue;
    ASSERT_EQ(point.modbus, next) << point.name;
    next += config::RegisterCount(point);
  }
  EXPECT_EQ(next, 52U);
  config::Device device = MakeDevice("1", profile.points);
  MeterBus bus;
  const auto fast = [](const MeterConversation& conversation) {
    return std::ranges::count(conversation.Queries(), config::Group::fast, &Query::group);
  };
  EXPECT_EQ(fast(MeterConversation(device, ReadSettings(device.options), bus)), 8);
  device.options.Set("snapshot", std::string("true"));
  EXPECT_EQ(fast(MeterConversation(device, ReadSettings(device.options), bus)), 2);
}

}  // namespace
}  // namespace baudgate::protocols::set4tm
