// Tests of the diagnosis of the points of a device, and of a device that sends unasked.
// SPDX-License-Identifier: Apache-2.0
#include <bit>
#include <string>

#include "gateway/diagnosis/causes/diagnose.h"
#include "protocols/modbus/protocol.h"
#include "tests/gateway/diagnosis/causes/diagnose_fixture.h"

namespace baudgate::diagnosis {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST_F(DiagnoseTest, PointsThatAreNotGoodAreCounted) {
  record_.age_limits[static_cast<std::size_t>(config::Group::fast)] = {3s, 9s};
  record_.points[0].read_at = status::kNow.instant - 4s;
  record_.points[0].reported = Quality::good;
  record_.points[1].read_at = status::kNow.instant;
  record_.points[1].reported = Quality::bad_sensor_failure;
  EXPECT_THAT(Say(),
              ElementsAre("1 of 2 points are older than their max_age, because its polls fail or "
                          "come too seldom. Follow the other sentences about it, or raise max_age",
                          "1 of 2 points have no good value (" + record_.device->points[1].name +
                              "): it sends no number for them. Check what it measures (NaN), or "
                              "look for a decimal comma with 'baudgate trace'"));
  const struct {
    std::string stands;
    std::string says;
    std::string remedy{};
  } rows[] = {
      {"", "it sends nothing for them. Check that the profile fits the device"},
      {"0,52",
       "'0,52' is no number. Set a decimal point at the device, or type: string in its profile"},
      {"-----", "'-----' means that nothing is measured. Check its inputs and cards"},
      {"READY",
       "'READY' is no number. Check that the profile fits the device, or set type: string in it"},
      {"'unit' says 'kg', which is not in the codes of its profile",
       "'unit' says 'kg', which is not in the codes of its profile. Set that", "set that"},
  };
  for (const auto& row : rows) {
    Looked(device(), Symptom::no_number, 1, {.cause = row.stands, .remedy = row.remedy});
    EXPECT_THAT(Say()[1], ::testing::EndsWith("): " + row.says));
  }
  line_.port_since = status::kNow.wall - 2s;
  config_.lines[0].devices[1].points[1].group = config::Group::fast;
  EXPECT_THAT(Say(), ElementsAre(::testing::HasSubstr("no good value")))
      << "its polls had no chance yet";
}

TEST_F(DiagnoseTest, ADeviceTakenIntoUseIsJudgedAfterItsFirstPolls) {
  record_.age_limits[static_cast<std::size_t>(config::Group::fast)] = {3s, 9s};
  for (bus::PointRecord& point : record_.points) point.read_at = status::kNow.instant - 10min;
  for (bus::PointRecord& point : record_.points) point.reported = Quality::good;
  EXPECT_THAT(Say(), ElementsAre(::testing::HasSubstr("its polls fail")));
  device().disabled_since = status::kNow.wall - 1s;
  EXPECT_THAT(Say(), IsEmpty());
}

TEST_F(DiagnoseTest, AReaderIsJudgedByItsMessages) {
  device().unasked = true;
  device().last_ok = status::kNow.instant - 12s;
  config_.lines[0].devices[1].max_age = 3s;
  record_.age_limits[static_cast<std::size_t>(config::Group::fast)] = {3s, 9s};
  for (bus::PointRecord& point : record_.points) point.read_at = status::kNow.instant - 12s;
  EXPECT_THAT(Say(), ElementsAre("nothing has come for 12 s, and its max_age is shorter. Check its "
                                 "power and its wire"));
  Looked(device(), Symptom::clean, 1, {.idle = 2s});
  Looked(device(), Symptom::clean, 15, {.idle = 20s});
  EXPECT_THAT(Say(), ElementsAre(::testing::StartsWith("nothing has come for 12 s")))
      << "others came sooner";
  Looked(device(), Symptom::clean, 16, {.idle = 10ms});
  Looked(device(), Symptom::clean, 16, {.idle = 20s});
  EXPECT_THAT(Say(),
              ElementsAre("comes every 20 s, and its max_age is shorter. Raise its 'poll' or "
                          "max_age above this interval, or let the device send more often"));
  device().last_ok = status::kNow.instant - 70s;
  EXPECT_THAT(Say(), ElementsAre(::testing::StartsWith("nothing has come for 70 s")))
      << "and not that this is normal";
  device().last_ok = status::kNow.instant - 12s;
  for (bus::PointRecord& point : record_.points) point.read_at = status::kNow.instant;
  Looked(device(), Symptom::refusal, 4, {.cause = "no number in 'OL'", .remedy = "look at it"});
  EXPECT_THAT(
      Say(), ElementsAre("no number in 'OL' (4 of its last 32 messages). Look at it; or switch off "
                         "other output between its messages (a printed header, another device)"));
  Looked(device(), Symptom::eighth_bit, 5);
  EXPECT_THAT(Say()[0],
              ::testing::StartsWith("5 of its last 32 messages are bad: they come damaged"));
  NeverAnswered();
  device().unasked = true;
  EXPECT_THAT(Say(),
              ElementsAre("has sent nothing yet, and its values are old after 3s. Check its "
                          "power and wire, then bit rate and parity (9600 7E1) and its options"));
  config_.lines[0].devices[1].max_age = 18250 * 24h;
  EXPECT_THAT(Say(), ElementsAre(::testing::StartsWith(
                         "has sent nothing yet, which is normal if nothing has happened")));
  device().exchanges = 2;
  Looked(device(), Symptom::noise, 2);
  EXPECT_THAT(
      Say(),
      ElementsAre(
          ::testing::StartsWith(
              "no message was good yet: bytes come, but no good message. Set the same bit rate"),
          "feeder-1 answers on the same line"));
}

TEST_F(DiagnoseTest, AReaderThatAnswersNoCommandIsReported) {
  device().unasked = true;
  Looked(device(), Symptom::silence, 16);
  Minute().failed = 16;
  EXPECT_THAT(Say(),
              ElementsAre(::testing::StartsWith(
                  "sends unasked, but does not answer commands. Check its power and the wire")));
  Minute().answered = 3;
  EXPECT_THAT(Say()[0], ::testing::Not(::testing::HasSubstr("commands")));
}

TEST_F(DiagnoseTest, UnreadPointsOfAReaderAreNotReported) {
  device().unasked = true;
  for (bus::PointRecord& point : record_.points) {
    point.read_at = status::kNow.instant;
    point.reported = Quality(Quality::bad_sensor_failure, Reason::not_ready);
  }
  EXPECT_THAT(Say(), ::testing::Each(::testing::Not(::testing::HasSubstr("no good value"))));
}

TEST_F(DiagnoseTest, AQualityReportedByTheDeviceIsExplained) {
  const struct {
    Quality quality;
    std::string ends;
  } rows[] = {
      {Quality::bad,
       "the device reports them as invalid, or sends them in another format. Check its sensors"},
      {Quality::uncertain,
       "the device reports them as uncertain (not stable). Check what it measures"},
      {{Quality::bad_sensor_failure, Reason::over_range},
       "Check the sensor, its wire and its range (at a balance the load)"},
  };
  for (const auto& row : rows) {
    record_.points[1].reported = row.quality;
    EXPECT_THAT(Say(), ElementsAre(::testing::EndsWith(row.ends)));
  }
  record_.points[0].reported = record_.points[1].reported;
  EXPECT_THAT(Say(), ElementsAre(::testing::EndsWith(
                         "Nothing is measured: check what is connected to the device")));
}

TEST_F(DiagnoseTest, AConfiguredLimitIsNamedOnlyIfEveryPointHasALimit) {
  std::vector<config::Point>& points = config_.lines[0].devices[1].points;
  const auto beyond = [](Reason reason) { return Quality(Quality::bad_sensor_failure, reason); };
  record_.points[1].reported = beyond(Reason::over_range);
  points[1].writing.max = Decimal(100);
  const std::string sensor = "Check the sensor, its wire and its range (at a balance the load)";
  const std::string max = ". Correct the configured max (100), or check the sensor and its range";
  points[1].access = config::Access::read;
  EXPECT_THAT(Say(),
              ElementsAre(::testing::EndsWith("(1 over range; " + points[1].name + ")" + max)));

  points[1].access = config::Access::read_write;
  EXPECT_THAT(Say(), ElementsAre(::testing::EndsWith(sensor))) << "it limits writes only";
  points[1].access = config::Access::read;
  record_.points[1].reported = beyond(Reason::under_range);
  EXPECT_THAT(Say(), ElementsAre(::testing::EndsWith(sensor))) << "there is no min";
  points[1].writing.min = Decimal(-5);
  EXPECT_THAT(Say(), ElementsAre(::testing::HasSubstr("Correct the configured min (-5), or")));

  points[0].access = config::Access::read;
  record_.points[0].reported = beyond(Reason::over_range);
  EXPECT_THAT(Say(), ElementsAre(::testing::Not(::testing::HasSubstr("configured"))))
      << "the first point has no max";
  points[0].writing.max = Decimal(100);
  EXPECT_THAT(Say(), ElementsAre(::testing::EndsWith(max))) << "both kinds, both with limits";
  EXPECT_LE(Say()[0].size(), 160U) << Say()[0];
}

TEST_F(DiagnoseTest, UnconfirmedReadingsAreNotBlamedOnTheDevice) {
  record_.points[1].reported = Quality::uncertain;
  config_.lines[0].devices[1].points[1].recheck = config::Recheck::jump;
  device().rechecks = 2;
  EXPECT_THAT(Say(), ElementsAre(::testing::EndsWith("set recheck: off at the point")));
}

TEST_F(DiagnoseTest, PointsThatTheDeviceDoesNotAnswerAreNamed) {
  record_.points[1].reported = {Quality::bad_configuration, Reason::not_fitted};
  Looked(device(), Symptom::silence, 9);
  EXPECT_THAT(Say()[0], ::testing::StartsWith("does not answer the request for " +
                                              record_.device->points[1].name + " ("));
  Looked(device(), Symptom::refusal, 1, {.cause = "NACK 6"});
  EXPECT_THAT(Say()[0], ::testing::Not(::testing::StartsWith("does not answer")));
}

TEST_F(DiagnoseTest, ImplausibleNumbersSuggestAnotherByteOrder) {
  record_.points[0].value = 3.879381e-35;
  record_.points[1].value = 0.0;
  config_.lines[0].devices[1].points[0].type = config::Type::float32;
  config_.lines[0].devices[1].points[1].type = config::Type::float64;
  const std::string name = record_.device->points[0].name;
  EXPECT_THAT(Say(), ElementsAre("1 of 2 numbers cannot be true (" + name +
                                 ": 3.88e-35). Check the order of their bytes (order), their type "
                                 "and their register"));
  record_.points[0].value = -4.2e-9;
  EXPECT_THAT(Say(), ::testing::IsEmpty());
}

TEST_F(DiagnoseTest, TheByteOrderThatMakesAllNumbersPlausibleIsNamed) {
  config::Device& its = config_.lines[0].devices[1];
  its.traits = &protocols::ModbusRtuProtocol().traits;
  its.options.Set("order", std::string("ABCD"));
  // As a float32, 230.25 is 43 66 40 00, and 50.02 is 42 48 14 7B. The values below have their
  // words swapped.
  for (const std::size_t i : {std::size_t{0}, std::size_t{1}}) {
    its.points[i].type = config::Type::float32;
    its.points[i].scale = 1;
    its.points[i].offset = 0;
    record_.points[i].value =
        static_cast<double>(std::bit_cast<float>(i == 0 ? 0x40004366U : 0x147B4248U));
  }
  EXPECT_THAT(Say()[0],
              ::testing::EndsWith(
                  ". Set order: CDAB in the configuration, as their bytes come in that order"));
  its.options.Set("order", std::string("BADC"));
  EXPECT_THAT(Say()[0], ::testing::EndsWith("and their register"));
}

/// The addresses are off by one register. With swapped words the numbers look usual, too, so the
/// order must not be named as the only cause.
TEST_F(DiagnoseTest, NumbersReadOneRegisterTooFarNameTheAddresses) {
  config::Device& its = config_.lines[0].devices[1];
  its.traits = &protocols::ModbusRtuProtocol().traits;
  its.options.Set("order", std::string("ABCD"));
  its.points.resize(3, its.points[0]);
  record_.points.resize(3, record_.points[0]);
  // The registers 0, 2 and 4 contain 230.25, 50.02 and 12.5; the points read 1, 3 and 5.
  const std::uint32_t read[] = {0x40004248U, 0x147B4148U, 0x00000000U};
  for (std::size_t i = 0; i < 3; ++i) {
    its.points[i].name = "p" + std::to_string(i);
    its.points[i].read = "holding " + std::to_string(2 * i + 1);
    its.points[i].type = config::Type::float32;
    its.points[i].scale = 1;
    its.points[i].offset = 0;
    record_.points[i].value = static_cast<double>(std::bit_cast<float>(read[i]));
  }
  EXPECT_THAT(
      Say()[0],
      ::testing::EndsWith(
          "Correct their addresses: one register lower (or higher) gives plausible numbers"));
  // Another value follows. Now order and address explain the numbers equally well.
  record_.points[2].value = static_cast<double>(std::bit_cast<float>(0x00004220U));
  EXPECT_THAT(Say()[0], ::testing::EndsWith(
                            "Set order: CDAB, or correct their addresses by one register; compare "
                            "with its display, because either change gives plausible numbers"));
  its.options.Set("order", std::string("CDAB"));
  EXPECT_THAT(Say()[0],
              ::testing::HasSubstr(
                  "Remove order: CDAB from the configuration, or correct their addresses"));
  its.options.Set("order", std::string("ABCD"));
  record_.points[2].value = {};
  record_.points[2].reported = {Quality::bad_configuration, Reason::not_fitted};
  EXPECT_THAT(Say(),
              ElementsAre("only the last address is refused (p2, holding 5), so all addresses are "
                          "off by one. Lower each address by one in the profile"));
}

TEST_F(DiagnoseTest, ImplausibleIntegersAreReported) {
  using enum config::Type;
  const struct {
    config::Type type;
    double value;
    double beside;
    std::string says;
  } rows[] = {
      {int16, 32767, 100, "(current: 32767). This number is a code, not a measurement"},
      {int16, -32768, 100, "(current: -32768). This number is a code, not a measurement"},
      {uint16, 32767, 100, "This number is a code, not a measurement"},
      {uint32, 4294967295, 100, "(current: 4294967295). This number is a code, not a measurement"},
      {uint16, 65436, 100, "(current: 65436). As a signed number it is -100: set type: int16"},
      {uint32, 4294967196, 100, "As a signed number it is -100: set type: int32 in the profile"},
      {uint16, 65436, 64000, ""},
      {uint16, 64000, 100, ""},
      {int16, -100, 100, ""},
      {float32, 32767, 100, ""},
  };
  for (const auto& row : rows) {
    for (config::Point& point : config_.lines[0].devices[1].points) point.type = row.type;
    record_.points[0].value = row.value;
    config_.lines[0].devices[1].points[0].scale = 1;
    record_.points[1].value = row.beside;
    EXPECT_THAT(Say(), row.says.empty() ? ::testing::Matcher<std::vector<std::string>>(IsEmpty())
                                        : ElementsAre(::testing::HasSubstr(row.says)));
  }
}

/// Points without a value are usual: a stopped motor sends NaN, a meter for one direction sends
/// FFFFFFFF, an optional register is refused.
TEST_F(DiagnoseTest, AMissingOptionalPointIsReportedAsUsual) {
  const struct {
    Quality quality;
    std::string says;
  } rows[] = {
      {{Quality::bad_sensor_failure, Reason::sentinel}, "usual where nothing is measured"},
      {{Quality::bad_configuration, Reason::not_fitted}, "usual if the device lacks them"},
      {{Quality::bad_out_of_service, Reason::channel_disabled}, "usual where nothing is measured"},
  };
  for (const auto& row : rows) {
    record_.points[1].reported = row.quality;
    EXPECT_THAT(Say(), ElementsAre(::testing::AllOf(
                           ::testing::StartsWith("note: 1 of 2 points have no value ("),
                           ::testing::HasSubstr(row.says))));
    record_.points[0].reported = row.quality;
    EXPECT_THAT(Say(), ElementsAre(::testing::StartsWith("2 of 2 points have no good value")));
    record_.points[0].reported = Quality::good;
  }
  Looked(device(), Symptom::refusal, 4, {.cause = "exception 02"});
  record_.points[1].reported = {Quality::bad_configuration, Reason::not_fitted};
  EXPECT_THAT(Say(), ElementsAre(::testing::HasSubstr("(it answers 'exception 02')")));
  record_.points[1].value = 1.5;
  EXPECT_THAT(Say()[0], ::testing::HasSubstr("It has answered before")) << "it gave this one";
}

TEST_F(DiagnoseTest, ValuesAreNotJudgedInTheFirstPeriod) {
  config_.lines[0].devices[1].poll = 10s;
  record_.points[0].reported = Quality::bad_sensor_failure;
  record_.points[1].at_best = Quality::uncertain;
  line_.port_since = status::kNow.wall - 9s;
  EXPECT_THAT(Say(), IsEmpty());
  line_.port_since = status::kNow.wall - 10s;
  EXPECT_THAT(Say(), ::testing::SizeIs(1)) << "the other one is read every minute";
  line_.port_since = status::kNow.wall - 1min;
  EXPECT_THAT(Say(), ::testing::SizeIs(2));
}

TEST_F(DiagnoseTest, PointsThatASpeakerNeverSendsAreReported) {
  device().unasked = true;
  record_.points[0] = {};
  record_.age_limits[static_cast<std::size_t>(record_.device->points[0].group)].uncertain_after =
      6s;
  EXPECT_THAT(Say(), ElementsAre(::testing::HasSubstr("none of its messages contains them")));
  device().missing = "no MDA comes: switch it on at the device";
  EXPECT_THAT(Say(), ElementsAre("1 of 2 points have no value yet (current): no MDA comes: switch "
                                 "it on at the device"));
}

TEST_F(DiagnoseTest, PointsInDoubtAreNotBlamedOnTheDevice) {
  for (bus::PointRecord& point : record_.points) {
    point.read_at = status::kNow.instant;
    point.reported = Quality::good;
  }
  record_.points[0].at_best = Quality::uncertain;
  EXPECT_THAT(
      Say(),
      ElementsAre("1 of 2 points are uncertain until the next read, because the port was reopened, "
                  "the device was away, or a reply may belong to another request"));
  record_.points[0].at_best = Quality::uncertain_last_usable;
  EXPECT_THAT(Say(),
              ElementsAre(::testing::HasSubstr("1 of 2 points are older than their max_age")));
}

TEST_F(DiagnoseTest, PointsWithoutAValueOfAnAnsweringDeviceAreReported) {
  record_.points[0] = {};
  Looked(device(), Symptom::refusal, 1, {.cause = "NACK 6"});
  EXPECT_THAT(Say(), ElementsAre("1 of 2 points have no value yet (current): it answers 'NACK 6'. "
                                 "Check that the profile fits the device and its options"));
}

}  // namespace
}  // namespace baudgate::diagnosis
