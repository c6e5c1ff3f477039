// Tests functions other than 1 to 4: counters of the line, files, queues, and identification of the
// device. Golden bytes: MODBUS Application Protocol V1.1b3, 6.7, 6.9, 6.10, 6.13, 6.14, 6.18 and
// 6.21, and the manual of the KBR multicomp F144-3 (43/14).
// SPDX-License-Identifier: Apache-2.0
#include "protocols/modbus/plan.h"
#include "tests/protocols/modbus/support.h"
#include "tests/support/times.h"

namespace baudgate::protocols::modbus {
namespace {

using config::Group;
using config::Type;

config::Point Once(const std::string& name, const std::string& read) {
  return ReadPoint(name, read, Type::string, Group::once);
}

std::string Shown(const Answer& answer) {
  std::string text = answer.outcome == Outcome::ok ? "" : answer.reason;
  for (const Reading& reading : answer.readings) {
    text += (text.empty() ? "" : ", ") +
            (HasValue(reading.value) ? ToText(reading.value) : std::string("none")) +
            (IsGood(reading.quality) ? "" : " " + std::to_string(reading.quality.word()));
  }
  return text;
}

struct One {
  std::string read;
  Type type;
  std::string request;
  std::string reply;
  std::string shows;
};

TEST(ModbusFunctions, MatchTheExamplesOfTheSpecification) {
  const One kCases[] = {
      {"exception status", Type::uint16, "07", "07 6D", "109"},
      {"exception status[b5]", Type::boolean, "07", "07 6D", "true"},
      {"exception status[b2-b4]", Type::uint16, "07", "07 6D", "3"},
      {"event counter", Type::uint16, "0B", "0B FF FF 01 08", "264"},
      {"event status", Type::uint16, "0B", "0B FF FF 01 08", "65535"},
      {"message counter", Type::uint16, "0C", "0C 08 00 00 01 08 01 21 20 00", "289"},
      {"file 4:1", Type::uint32, "14 07 06 00 04 00 01 00 02", "14 06 05 06 0D FE 00 20",
       "234749984"},
      {"queue 1246[0]", Type::uint16, "18 04 DE", "18 00 06 00 02 01 B8 12 84", "440"},
      {"queue 0x4DE[1]", Type::uint16, "18 04 DE", "18 00 06 00 02 01 B8 12 84", "4740"},
      {"queue 1246 count", Type::uint16, "18 04 DE", "18 00 06 00 02 01 B8 12 84", "2"},
      {"queue 1246[2]", Type::uint16, "18 04 DE", "18 00 06 00 02 01 B8 12 84", "none 1536"},
      {"holding 8[b3-b5]", Type::uint16, "03 00 08 00 01", "03 02 FF D7", "2"},
  };
  for (const One& one : kCases) {
    for (const Framing framing : {Framing::rtu, Framing::ascii, Framing::tcp}) {
      Talk talk(ProtocolOf(framing), MakeDevice({ReadPoint("p", one.read, one.type)}));
      const auto request = talk.Ask(Poll(0));
      ASSERT_TRUE(request) << one.read;
      const auto sent = Unwrap(framing, request->bytes);
      EXPECT_EQ(ToHex(sent->pdu), one.request) << one.read;
      const Bytes reply = Wrap(framing, kSlave, Hex(one.reply), sent->transaction);
      EXPECT_EQ(Shown(talk.Reply(Poll(0), reply)), one.shows) << one.read;
    }
  }
}

TEST(ModbusFunctions, AMismatchedReplyIsUnexpected) {
  const struct {
    const char* read;
    const char* reply;
  } kCases[] = {
      {"exception status", "07 6D 00"},
      {"event counter", "0B FF FF 01"},
      {"file 4:1", "14 04 03 06 0D FE"},
      {"file 4:1", "14 06 05 07 0D FE 00 20"},
      {"file 4:1", "14 06 04 06 0D FE 00 20"},
      {"queue 1246[0]", "18 00 06 00 03 01 B8 12 84"},
      {"queue 1246[0]", "18 00 04 00 02 01 B8 12 84"},
  };
  for (const auto& one : kCases) {
    const Type type = one.read[0] == 'f' ? Type::uint32 : Type::uint16;
    Talk talk(ModbusTcpProtocol(), MakeDevice({ReadPoint("p", one.read, type)}));
    ASSERT_TRUE(talk.Ask(Poll(0)));
    const Answer answer = talk.Reply(Poll(0), Wrap(Framing::tcp, kSlave, Hex(one.reply), 1));
    EXPECT_EQ(answer.outcome, Outcome::unexpected) << one.reply;
    EXPECT_TRUE(answer.readings.empty());
  }
}

TEST(ModbusFunctions, NeighboursShareARequest) {
  Talk talk(ModbusRtuProtocol(),
            MakeDevice({ReadPoint("a", "file 4:1"), ReadPoint("b", "file 4:3"),
                        ReadPoint("c", "file 5:1"), ReadPoint("d", "queue 9[0]"),
                        ReadPoint("e", "queue 9[5]"), ReadPoint("f", "event status"),
                        ReadPoint("g", "event counter")}));
  std::vector<std::string> asked;
  for (std::size_t i = 0; i < talk->Queries().size(); ++i) asked.push_back(Asked(talk, Poll(i)));
  EXPECT_EQ(asked, (std::vector<std::string>{"14 07 06 00 04 00 01 00 03",
                                             "14 07 06 00 05 00 01 00 01", "18 00 09", "0B"}));
}

TEST(ModbusFunctions, AnUnsupportedFunctionIsRequestedRarely) {
  Talk talk(ModbusRtuProtocol(), MakeDevice({ReadPoint("p", "exception status")}));
  const Answer answer = Exchange(talk, Poll(0), "87 01");
  EXPECT_EQ(answer.outcome, Outcome::unsupported);
  ASSERT_EQ(answer.readings.size(), 1U);
  EXPECT_EQ(answer.readings[0].quality, Quality::bad_configuration);
  EXPECT_EQ(talk->Queries()[0].group, Group::slow);
}

const std::string kKbr =
    "01 2B 0E 01 01 00 00 03 00 08 4B 42 52 20 47 6D 62 48 01 12 6D 75 6C 74 69 63 6F 6D 70 20 46 "
    "31 34 34 2D 33 20 20 02 09 20 32 2E 30 30 72 30 31 36 CD DB";

TEST(ModbusIdentification, IsReadIntoPoints) {
  Talk talk(ModbusRtuProtocol(), MakeDevice({Once("maker", "identification vendor"),
                                             Once("type", "identification product"),
                                             Once("firmware", "identification revision")},
                                            {}, "1"));
  ASSERT_TRUE(talk.Ask(Poll(0)));
  EXPECT_EQ(ToHex(talk.request().bytes), "01 2B 0E 01 00 70 77");
  const Bytes reply = Hex(kKbr);
  EXPECT_EQ(Shown(talk.Reply(Poll(0), reply)), "KBR GmbH, multicomp F144-3, 2.00r016");
}

TEST(ModbusIdentification, IsReadInSeveralReplies) {
  Talk talk(ModbusTcpProtocol(),
            MakeDevice({Once("maker", "identification vendor"), Once("name", "identification name"),
                        Once("url", "identification url"), Once("model", "identification model"),
                        Once("own", "identification 0x81")}));
  ASSERT_EQ(talk->Queries().size(), 3U) << "of three categories";
  EXPECT_EQ(ToHex(talk.Ask(Poll(1))->bytes), "00 01 00 00 00 05 14 2B 0E 02 00");
  const Answer first = talk.Reply(Poll(1), Hex("00 01 00 00 00 0C 14 2B 0E 02 02 FF 04 01 03 02 "
                                               "41 42"));
  EXPECT_EQ(first.then, Then::ask_again);
  EXPECT_EQ(Shown(first), "AB");
  EXPECT_EQ(ToHex(talk.Ask(Poll(1))->bytes), "00 02 00 00 00 05 14 2B 0E 02 04");
  const Answer last = talk.Reply(Poll(1), Hex("00 02 00 00 00 0C 14 2B 0E 02 02 00 00 01 04 02 43 "
                                              "44"));
  EXPECT_EQ(last.then, Then::done);
  EXPECT_EQ(Shown(last), "CD, none 1284") << "it has no model, and has told the URL before";
  EXPECT_EQ(ToHex(talk.Ask(Poll(2))->bytes), "00 03 00 00 00 05 14 2B 0E 03 80");
}

TEST(ModbusIdentification, AServerIdIsText) {
  Talk talk(ModbusRtuProtocol(),
            MakeDevice({Once("type", "server id"),
                        ReadPoint("code", "server id[0]", Type::uint16, Group::once)}));
  ASSERT_EQ(talk->Queries().size(), 1U);
  EXPECT_EQ(Asked(talk, Poll(0)), "11");
  EXPECT_EQ(Shown(Exchange(talk, Poll(0), "11 09 07 FF 4D 4F 44 45 4C 2D 37")), "MODEL-7, 7");
}

TEST(ModbusIdentification, IsNotPolled) {
  EXPECT_FALSE(CheckPoint(ReadPoint("p", "server id", Type::string)));
  EXPECT_TRUE(CheckPoint(Once("p", "server id")));
}

/// Tests of a device whose profile lists names. Each test gives the replies, which can be those of
/// another device.
class ModbusNames : public ::testing::Test {
 protected:
  static config::Device Listing(std::vector<std::string> names) {
    config::Device device = MakeDevice({ReadPoint("level", "holding 500")});
    device.identity.names = std::move(names);
    device.identity.others = {{config::SpokenName("OTHER 5"), "other-5"}};
    return device;
  }
  /// Returns the request PDUs of one poll. `says`: the reply PDU to each request; empty: no reply.
  static std::vector<std::string> AskedBy(Talk& talk,
                                          const std::map<std::string, std::string>& says) {
    talk.asked.clear();
    talk.Run(Poll(0), [&](View request) {
      const auto asked = Unwrap(Framing::rtu, request);
      const auto found = says.find(ToHex(asked->pdu));
      return found == says.end() ? Bytes() : Wrap(Framing::rtu, kSlave, Hex(found->second));
    });
    std::vector<std::string> pdus;
    for (const Bytes& request : talk.asked)
      pdus.push_back(ToHex(Unwrap(Framing::rtu, request)->pdu));
    return pdus;
  }
  static std::string Product(const std::string& name) {
    return "2B 0E 01 01 00 00 01 01 " + HexByte(static_cast<std::uint8_t>(name.size())) + " " +
           ToHex(ToBytes(name));
  }
  const std::string objects_ = "2B 0E 01 00";
  const std::string read_ = "03 01 F4 00 01";
  const std::string value_ = "03 02 00 31";
};

TEST_F(ModbusNames, AreReadOncePerConnectionBeforeThePoll) {
  Talk talk(ModbusRtuProtocol(), Listing({"Meter 7"}));
  const std::map<std::string, std::string> says = {{objects_, Product("METER7")}, {read_, value_}};
  EXPECT_EQ(AskedBy(talk, says), (std::vector{objects_, read_}));
  EXPECT_FALSE(talk->trouble());
  EXPECT_TRUE(talk->trouble().text.empty());
  EXPECT_EQ(AskedBy(talk, says), std::vector{read_}) << "never in the steady state";
  talk->OnReconnect();
  EXPECT_EQ(AskedBy(talk, says), (std::vector{objects_, read_}));
}

TEST_F(ModbusNames, AreNotReadIfUnlistedOrIgnored) {
  Talk none(ModbusRtuProtocol(), Listing({}));
  EXPECT_EQ(AskedBy(none, {{read_, value_}}), std::vector{read_});
  config::Device device = Listing({"Meter 7"});
  device.identity.ignore = true;
  Talk ignored(ModbusRtuProtocol(), device);
  EXPECT_EQ(AskedBy(ignored, {{read_, value_}}), std::vector{read_});
}

TEST_F(ModbusNames, OfAnotherProfileAreAContradiction) {
  Talk talk(ModbusRtuProtocol(), Listing({"Meter 7"}));
  AskedBy(talk, {{objects_, Product("Other 5")}, {read_, value_}});
  EXPECT_EQ(talk->trouble().reason, Reason::other_module);
  EXPECT_NE(talk->trouble().text.find("set profile: other-5"), std::string::npos)
      << talk->trouble().text;
  EXPECT_EQ(AskedBy(talk, {{objects_, Product("Meter 7")}, {read_, value_}}),
            (std::vector{objects_, read_}))
      << "such a one is asked again";
  EXPECT_FALSE(talk->trouble());
}

TEST_F(ModbusNames, UnlistedNamesAreARemark) {
  Talk talk(ModbusRtuProtocol(), Listing({"Meter 7"}));
  AskedBy(talk, {{objects_, Product("Clone X")}, {read_, value_}});
  EXPECT_FALSE(talk->trouble());
  EXPECT_NE(talk->trouble().text.find("'Clone X'"), std::string::npos);
}

TEST_F(ModbusNames, AreAlsoReadFromTheServerId) {
  Talk talk(ModbusRtuProtocol(), Listing({"Meter 7"}));
  EXPECT_EQ(
      AskedBy(talk,
              {{objects_, "AB 01"}, {"11", "11 09 01 FF 4D 45 54 45 52 20 37"}, {read_, value_}}),
      (std::vector<std::string>{objects_, "11", read_}));
  EXPECT_TRUE(talk->trouble().text.empty()) << talk->trouble().text;
}

TEST_F(ModbusNames, MissingNamesAreNoContradiction) {
  for (const bool silent : {false, true}) {
    Talk talk(ModbusRtuProtocol(), Listing({"Meter 7"}));
    std::map<std::string, std::string> says = {{read_, value_}};
    if (!silent) says.insert({{objects_, "AB 01"}, {"11", "91 01"}});
    EXPECT_EQ(AskedBy(talk, says), (std::vector<std::string>{objects_, "11", read_}));
    EXPECT_FALSE(talk->trouble());
    EXPECT_EQ(AskedBy(talk, says), std::vector{read_});
  }
}

TEST(ModbusTwinFunctions, AnswersItsOwnConversation) {
  config::Device device = MakeDevice(
      {ReadPoint("a", "exception status"), ReadPoint("b", "event counter"),
       ReadPoint("c", "message counter"), ReadPoint("d", "file 4:1", Type::float32),
       ReadPoint("e", "file 4:10"), ReadPoint("f", "queue 1246 count"),
       ReadPoint("g", "queue 1246[1]"), Once("h", "identification vendor"),
       Once("i", "identification model"), Once("j", "server id"), Once("k", "identification 0x90")},
      {{"missing", std::string("zero")}});
  const std::vector<Value> truth = {
      std::uint64_t{109},  std::uint64_t{264}, std::uint64_t{289},  2.5,
      std::uint64_t{4711}, std::uint64_t{2},   std::uint64_t{4740}, std::string("KBR"),
      std::string("F144"), std::string("M 7"), std::string("own")};
  FixedValues values;
  for (std::size_t i = 0; i < truth.size(); ++i) values.values[i] = truth[i];
  for (const Framing framing : {Framing::rtu, Framing::ascii, Framing::tcp}) {
    ModbusTwin twin(framing, device, values);
    Talk talk(ProtocolOf(framing), device);
    std::size_t seen = 0;
    for (std::size_t query = 0; query < talk->Queries().size(); ++query) {
      const Answer answer = talk.Run(Poll(query), twin);
      EXPECT_EQ(answer.outcome, Outcome::ok) << answer.reason;
      for (const Reading& reading : answer.readings) {
        ++seen;
        EXPECT_EQ(ToText(reading.value), ToText(truth[reading.point]))
            << device.points[reading.point].name;
      }
    }
    EXPECT_EQ(seen, truth.size());
  }
}

TEST(ModbusTwinFunctions, ReturnsTheNameFromItsProfile) {
  config::Device device = MakeDevice({ReadPoint("level", "holding 500")});
  device.identity.names = {"Meter 7"};
  FixedValues values;
  ModbusTwin twin(Framing::rtu, device, values);
  EXPECT_EQ(AsText(AskTwin(twin, Hex("2B 0E 04 01"))).substr(9), "Meter 7");
  EXPECT_EQ(AsText(AskTwin(twin, Hex("11"))).substr(3), "Meter 7");
  Talk talk(ModbusRtuProtocol(), device);
  EXPECT_EQ(talk.Run(Poll(0), twin).outcome, Outcome::ok);
  EXPECT_TRUE(talk->trouble().text.empty()) << talk->trouble().text;
}

TEST(ModbusTwinFunctions, RefusesFunctionsMissingInItsProfile) {
  const config::Device device = MakeDevice({ReadPoint("level", "holding 500")});
  FixedValues values;
  ModbusTwin twin(Framing::rtu, device, values);
  EXPECT_EQ(ToHex(AskTwin(twin, Hex("07"))), "87 01");
  EXPECT_EQ(ToHex(AskTwin(twin, Hex("11"))), "91 01");
  EXPECT_EQ(ToHex(AskTwin(twin, Hex("18 04 DE"))), "98 01");
  EXPECT_EQ(ToHex(AskTwin(twin, Hex("14 07 06 00 04 00 01 00 02"))), "94 02");
  EXPECT_EQ(ToHex(AskTwin(twin, Hex("14 07 06 00 04 00 01 00 FF"))), "94 03");
}

/// Returns group, table, address and count, such as "fast holding 0+3 slow coil 5+1".
std::string Shown(const SpacePlan& plan) {
  std::string text;
  for (std::size_t i = 0; i < plan.queries().size(); ++i) {
    const Block<Space>& block = plan.block(i);
    text += (text.empty() ? "" : " ") + std::string(config::Name(plan.queries()[i].group)) + " " +
            std::string(Name(block.key.table)) + " " + std::to_string(block.begin) + "+" +
            std::to_string(block.size());
  }
  return text;
}

SpacePlan Plan(const std::vector<config::Point>& points, const Settings& settings = {}) {
  return MakePlan(points, ReadLocations(points), settings);
}

std::vector<config::Point> Points(const std::vector<std::string>& reads, Type type = Type::uint16) {
  std::vector<config::Point> points;
  for (const std::string& read : reads) points.push_back(ReadPoint("p" + read, read, type));
  return points;
}

TEST(ModbusPlan, NeighboursShareARequest) {
  const auto points = Points({"holding 200", "holding 201", "holding 8", "input 200"});
  EXPECT_EQ(Shown(Plan(points, {})), "fast holding 8+1 fast holding 200+2 fast input 200+1");
}

TEST(ModbusPlan, HolesAreReadUpToALimit) {
  const auto points = Points({"holding 0", "holding 9", "holding 19"});
  EXPECT_EQ(Shown(Plan(points, {})), "fast holding 0+10 fast holding 19+1");
  Settings none;
  none.hole = 0;
  EXPECT_EQ(Shown(Plan(points, none)), "fast holding 0+1 fast holding 9+1 fast holding 19+1");
  const auto bits = Points({"coil 0", "coil 129", "coil 259"}, Type::boolean);
  EXPECT_EQ(Shown(Plan(bits, {})), "fast coil 0+130 fast coil 259+1") << "16 bits a register";
}

TEST(ModbusPlan, NoRequestIsLongerThanABlock) {
  std::vector<std::string> reads;
  for (int i = 0; i < 130; ++i) reads.push_back("holding " + std::to_string(i));
  EXPECT_EQ(Shown(Plan(Points(reads), {})), "fast holding 0+120 fast holding 120+10");
  Settings small;
  small.block = 3;
  EXPECT_EQ(Shown(Plan(Points({"input 0", "input 2", "input 4"}, Type::float32), small)),
            "fast input 0+2 fast input 2+2 fast input 4+2")
      << "no point is split";
  small.block = 1;
  EXPECT_EQ(Shown(Plan(Points({"input 0"}, Type::float32), small)), "fast input 0+2");
}

TEST(ModbusPlan, GroupsAreSeparateAndWritePointsAreNotRead) {
  auto points = Points({"holding 0", "holding 1", "holding 2"});
  points[1].group = Group::slow;
  points.push_back(WritePoint("w", "", "holding 3"));
  EXPECT_EQ(Shown(Plan(points, {})), "fast holding 0+3 slow holding 1+1");
}

TEST(ModbusPlan, PointsOfARegisterShareItsRequest) {
  auto points = Points({"holding 8[b0]", "holding 8[b15]"}, Type::boolean);
  points.push_back(ReadPoint("word", "holding 8"));
  points.push_back(ReadPoint("wide", "holding 7", Type::uint32));
  const SpacePlan plan = Plan(points);
  EXPECT_EQ(Shown(plan), "fast holding 7+2");
  EXPECT_EQ(plan.queries()[0].points.size(), 4U);
}

TEST(ModbusPlan, ARefusedBlockIsSplitUntilAReconnect) {
  SpacePlan plan = Plan(Points({"holding 0", "holding 1", "holding 5", "holding 8"}));
  ASSERT_EQ(Shown(plan), "fast holding 0+9");
  EXPECT_EQ(plan.OnRefused(0, kStart), PlanChange::split);
  EXPECT_EQ(Shown(plan), "fast holding 0+2 fast holding 5+4");
  plan.OnReconnect();
  EXPECT_EQ(Shown(plan), "fast holding 0+9");
}

TEST(ModbusPlan, OverlappingPointsAreNotSeparated) {
  auto points = Points({"holding 8[b0]", "holding 8[b1]"}, Type::boolean);
  points.push_back(ReadPoint("word", "holding 8"));
  SpacePlan plan = Plan(points);
  EXPECT_EQ(plan.OnRefused(0, kStart), PlanChange::set_apart);
  EXPECT_EQ(Shown(plan), "slow holding 8+1");
  EXPECT_EQ(plan.queries()[0].points.size(), 3U);
}

TEST(ModbusPlan, ARefusedPointIsRequestedRarelyAndSeparately) {
  auto points = Points({"holding 0", "holding 1", "holding 2"});
  points[2].group = Group::slow;
  SpacePlan plan = Plan(points);
  ASSERT_EQ(plan.OnRefused(0, kStart), PlanChange::split);
  ASSERT_EQ(Shown(plan), "fast holding 0+1 fast holding 1+1 slow holding 2+1");
  EXPECT_EQ(plan.OnRefused(1, kStart), PlanChange::set_apart);
  EXPECT_EQ(Shown(plan), "fast holding 0+1 slow holding 2+1 slow holding 1+1");
  EXPECT_EQ(plan.OnRefused(2, kStart), PlanChange::nothing);
  EXPECT_EQ(plan.OnAnswered(1, kStart), PlanChange::nothing);
  EXPECT_EQ(plan.OnAnswered(2, kStart), PlanChange::restored) << "new firmware knows it";
  EXPECT_EQ(Shown(plan), "fast holding 0+1 fast holding 1+1 slow holding 2+1");
}

}  // namespace
}  // namespace baudgate::protocols::modbus
