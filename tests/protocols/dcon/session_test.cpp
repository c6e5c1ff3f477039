// What a DCON conversation remembers: refused and unknown commands, probes, and what comes of
// writes.
// SPDX-License-Identifier: Apache-2.0
#include "tests/protocols/dcon/support.h"

namespace baudgate::protocols::dcon {
namespace {

using config::Group;
using config::Type;

TEST(DconSession, ARefusedCommandCostsNoOther) {
  const config::Device device = MakeDevice({ReadPoint("a", "#0"), ReadPoint("b", "#9")});
  Talk talk(DconProtocol(), device);
  EXPECT_EQ(Exchange(talk, Poll(0), ">+05.880\r").outcome, Outcome::ok);
  Answer refused = Exchange(talk, Poll(1), "?01\r");
  EXPECT_EQ(refused.outcome, Outcome::unsupported);
  EXPECT_TRUE(refused.readings.empty()) << "a damaged reply may look like that";
  EXPECT_EQ(refused.then, Then::replan);
  EXPECT_EQ(talk->Queries()[0].group, Group::fast);
  EXPECT_EQ(talk->Queries()[1].group, Group::slow);
  EXPECT_EQ(Exchange(talk, Poll(1), "?01\r").then, Then::done);
  refused = Exchange(talk, Poll(1), "?01\r");
  ASSERT_EQ(refused.readings.size(), 1U);
  EXPECT_EQ(refused.readings[0].point, 1U);
  EXPECT_EQ(refused.readings[0].quality, Quality::bad_configuration);
  EXPECT_FALSE(HasValue(refused.readings[0].value));

  EXPECT_EQ(Exchange(talk, Poll(1), ">+01.000\r").then, Then::replan) << "it answers again";
  EXPECT_EQ(talk->Queries()[1].group, Group::fast);
}

TEST(DconSession, ACommandThatIsNeverAnsweredIsAskedRarely) {
  const config::Device device = MakeDevice({ReadPoint("a", "#0"), ReadPoint("b", "$3")});
  Talk talk(DconProtocol(), device);
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(Exchange(talk, Poll(1), "").then, Then::done) << "the module itself may be away";
  }
  Exchange(talk, Poll(0), ">+05.880\r");
  EXPECT_EQ(Exchange(talk, Poll(1), "").then, Then::done);
  EXPECT_EQ(Exchange(talk, Poll(1), "").then, Then::done);
  EXPECT_EQ(Exchange(talk, Poll(1), "").then, Then::replan);
  EXPECT_EQ(talk->Queries()[1].group, Group::slow);
  for (int i = 0; i < 9; ++i) EXPECT_EQ(Exchange(talk, Poll(0), "").then, Then::done);
  EXPECT_EQ(talk->Queries()[0].group, Group::fast) << "it has answered: the module is away";
  talk->OnReconnect();
  EXPECT_EQ(talk->Queries()[1].group, Group::fast);
}

TEST(DconSession, ProbesWithTheCheapestCommandThatWorks) {
  const config::Device device = MakeDevice(
      {ReadPoint("a", "#[0]"), ReadPoint("b", "#[1]"), ReadPoint("c", "#1"), ReadPoint("d", "$3")});
  Talk talk(DconProtocol(), device);
  EXPECT_EQ(Asked(talk, Probe()), "#01\r") << "nothing is known: the first query";
  Exchange(talk, Poll(0), ">+05.880+05.880\r");
  EXPECT_EQ(Asked(talk, Probe()), "#01\r");
  Exchange(talk, Poll(1), ">+05.880\r");
  EXPECT_EQ(Asked(talk, Probe()), "#011\r");
  talk->OnReconnect();
  EXPECT_EQ(Asked(talk, Probe()), "#011\r");
}

TEST(DconSession, AProbeThatFailsGivesWayToOtherCommands) {
  const config::Device device =
      MakeDevice({ReadPoint("a", "$3"), ReadPoint("b", "#1"), ReadPoint("c", "$60 commanded")});
  Talk talk(DconProtocol(), device);
  std::vector<std::string> asked;
  for (int i = 0; i < 6; ++i) {
    asked.push_back(Asked(talk, Probe()));
    Exchange(talk, Probe(), "");
    talk->OnReconnect();
  }
  EXPECT_EQ(asked,
            (std::vector<std::string>{"$013\r", "#011\r", "$013\r", "$013\r", "$013\r", "#011\r"}))
      << "never the command that may reset a counter";
  EXPECT_EQ(Exchange(talk, Probe(), ">+01.000\r").outcome, Outcome::ok);
  EXPECT_EQ(Asked(talk, Probe()), "$013\r");
}

TEST(DconSession, ProbesByNameWhereTheModuleHasOne) {
  const config::Device named = MakeDevice({ReadPoint("a", "#[0]")}, {{"identify", true}});
  Talk talk(DconProtocol(), named);
  EXPECT_EQ(Asked(talk, Probe()), "$01M\r");
  EXPECT_EQ(Exchange(talk, Probe(), "!017017\r").outcome, Outcome::ok);
  const config::Device no_reads = MakeDevice({WritePoint("a", "", "#0{+00.000}")});
  Talk writer(DconProtocol(), no_reads);
  EXPECT_EQ(Asked(writer, Probe()), "$01M\r");
}

/// What came of it the gateway reads by itself.
TEST(DconSession, AWriteIsOneExchange) {
  const config::Device device =
      MakeDevice({WritePoint("relay", "$6[b8]", "#10{bit}", Type::boolean)});
  Talk talk(DconProtocol(), device);
  const Task on = Write(0, true);
  EXPECT_EQ(Asked(talk, on), "#011001\r");
  const Answer confirmed = Exchange(talk, on, ">\r");
  EXPECT_EQ(confirmed.outcome, Outcome::ok);
  EXPECT_EQ(confirmed.then, Then::done);
  EXPECT_EQ(Asked(talk, Write(0, false)), "#011000\r");
}

TEST(DconSession, WritesThatTheModuleOrTheGatewayRefuses) {
  const config::Device device = MakeDevice({WritePoint("volts", "$80", "#0{+00.000 0..10}")});
  Talk talk(DconProtocol(), device);
  EXPECT_EQ(Exchange(talk, Write(0, 5.0), "!\r").outcome, Outcome::refused);
  EXPECT_EQ(Exchange(talk, Write(0, 5.0), "?\r").outcome, Outcome::refused);
  EXPECT_EQ(Exchange(talk, Write(0, 5.0), "?01\r").outcome, Outcome::refused);
  EXPECT_EQ(Exchange(talk, Write(0, 5.0), "?02\r").outcome, Outcome::unexpected);
  EXPECT_NE(Asked(talk, Write(0, 10.5)).find("outside 0...10"), std::string::npos);
  EXPECT_EQ(Asked(talk, Write(0, 5.0)), "#010+05.000\r");
}

/// Reference, 10.1: out of its range an output goes to its limit, and the module says no.
TEST(DconSession, AnAnalogOutputThatIsRefusedMayHaveMoved) {
  const config::Device device = MakeDevice({WritePoint("volts", "$80", "#0{+00.000 0..10}"),
                                            WritePoint("bare", "", "#{00.000}"),
                                            WritePoint("outputs", "", "@{hex2}", Type::uint16)});
  Talk talk(DconProtocol(), device);
  EXPECT_TRUE(Exchange(talk, Write(0, 5.0), "?\r").may_have_acted);
  EXPECT_TRUE(Exchange(talk, Write(1, 5.0), "?01\r").may_have_acted);
  const Answer ignored = Exchange(talk, Write(0, 5.0), "!\r");
  EXPECT_EQ(ignored.outcome, Outcome::refused);
  EXPECT_FALSE(ignored.may_have_acted) << "the host watchdog holds it";
  EXPECT_FALSE(Exchange(talk, Write(2, 255.0), "?\r").may_have_acted);
}

/// Reference, 9.1 and 14: settings are confirmed by !AA, and by nothing else.
TEST(DconSession, SettingsAreConfirmedWithTheAddress) {
  const config::Device device =
      MakeDevice({WritePoint("run", "$50[b0]", "$50{flag}", Type::boolean),
                  WritePoint("preset", "@G0", "@P0{hex8}", Type::uint32),
                  WritePoint("outputs", "@DI[b8-b9]", "@DO0{hex1}", Type::uint16),
                  WritePoint("adam", "$Y", "$X{dec4}", Type::uint16)});
  Talk talk(DconProtocol(), device);
  const std::vector<std::pair<Task, std::string>> writes = {{Write(0, true), "$01501\r"},
                                                            {Write(1, 123456.0), "@01P00001E240\r"},
                                                            {Write(2, 3.0), "@01DO03\r"},
                                                            {Write(3, 50.0), "$01X0050\r"}};
  for (const auto& [task, request] : writes) {
    EXPECT_EQ(Asked(talk, task), request);
    EXPECT_EQ(Exchange(talk, task, "!01\r").outcome, Outcome::ok) << request;
    EXPECT_EQ(Exchange(talk, task, ">\r").outcome, Outcome::unexpected) << request;
    EXPECT_EQ(Exchange(talk, task, "!02\r").outcome, Outcome::unexpected) << request;
    EXPECT_EQ(Exchange(talk, task, "?01\r").outcome, Outcome::refused) << request;
  }
  const std::vector<std::pair<std::string, Value>> reads = {
      {"!011\r", Value{true}},
      {"!010001E240\r", Value{std::uint64_t{123456}}},
      {"!0110300\r", Value{std::uint64_t{3}}},
      {"!010050\r", Value{std::uint64_t{50}}}};
  for (std::size_t query = 0; query < reads.size(); ++query) {
    const Answer answer = Exchange(talk, Poll(query), reads[query].first);
    ASSERT_EQ(answer.readings.size(), 1U) << answer.reason;
    EXPECT_EQ(answer.readings[0].value, reads[query].second);
  }
}

}  // namespace
}  // namespace baudgate::protocols::dcon
