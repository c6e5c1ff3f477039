// Tests Modbus TCP: its messages, which bytes of a connection count as a reply, and servers that
// are devices. Golden bytes: MODBUS Application Protocol V1.1b3, 4.1 and 6; Messaging
// Implementation Guide V1.0b, 3.1.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/modbus/rules.h"
#include "tests/protocols/modbus/support.h"

namespace baudgate::protocols {
namespace {

using namespace protocols::modbus;  // NOLINT
namespace modbus = protocols::modbus;

constexpr const char* kRead500 = "00 01 00 00 00 06 14 03 01 F4 00 01";
constexpr const char* kIts31 = "00 01 00 00 00 05 14 03 02 00 31";

TEST(ModbusTcpCodec, AHeaderPrecedesThePdu) {
  const Bytes frame = Wrap(Framing::tcp, 20, ReadRequest(kReadHolding, 500, 1), 1);
  EXPECT_EQ(ToHex(frame), ToHex(Hex(kRead500)));
  const auto adu = Unwrap(Framing::tcp, frame);
  ASSERT_TRUE(adu);
  EXPECT_EQ(adu->slave, 20);
  EXPECT_EQ(adu->transaction, 1);
  EXPECT_EQ(ToHex(adu->pdu), "03 01 F4 00 01");
  EXPECT_EQ(Wrap(Framing::tcp, 20, Bytes(kMaxPdu)).size(), kMaxTcp);
}

TEST(ModbusTcpCodec, OtherProtocolsAndLengthsAreRefused) {
  for (const char* const wrong :
       {"00 01 00 01 00 05 14 03 02 00 31", "00 01 00 00 00 04 14 03 02 00 31",
        "00 01 00 00 00 01 14", "00 01 00 00 01 05 14 03 02 00 31", "00 01 00 00 00 05 14", ""}) {
    EXPECT_FALSE(Unwrap(Framing::tcp, Hex(wrong))) << wrong;
  }
  Bytes long_one = Hex("00 01 00 00 00 FF");
  long_one.resize(261);
  EXPECT_FALSE(Unwrap(Framing::tcp, long_one)) << "length 255: longer than any message";
}

TEST(ModbusTcpAddress, AcceptsUnits0To255) {
  for (const char* const unit : {"0", "255", "0xFF", "1", "248"}) {
    EXPECT_TRUE(ModbusTcpProtocol().canonical_address(unit)) << unit;
  }
  EXPECT_FALSE(ModbusTcpProtocol().canonical_address("256"));
  EXPECT_FALSE(ModbusRtuProtocol().canonical_address("0"));
  EXPECT_FALSE(ModbusRtuProtocol().canonical_address("248"));
}

struct Connection {
  explicit Connection(const char* request) {
    assembler.Begin(TcpReplyRule, Expect(Framing::tcp, Hex(request)));
  }
  std::optional<Bytes> Take(std::string_view hex, bool idle = false) {
    assembler.Feed(Hex(hex));
    return assembler.Next(idle);
  }
  Assembler assembler;
};

TEST(ModbusTcpReplyRule, ALateReplyIsSkipped) {
  Connection connection(kRead500);
  EXPECT_FALSE(connection.Take("00 00 00 00 00 05 14 03 02 00 99"));
  EXPECT_EQ(connection.assembler.blame(), Outcome::unexpected);
  EXPECT_EQ(connection.assembler.why(), "the reply is to another transaction");
  EXPECT_EQ(connection.Take(kIts31), Hex(kIts31));
}

TEST(ModbusTcpReplyRule, AReplyOfAnotherUnitIsSkipped) {
  Connection connection(kRead500);
  EXPECT_FALSE(connection.Take("00 01 00 00 00 05 15 03 02 00 99"));
  EXPECT_EQ(connection.assembler.blame(), Outcome::unexpected);
  EXPECT_EQ(connection.Take(kIts31), Hex(kIts31));
}

TEST(ModbusTcpReplyRule, ALateReplyAndTheOwnReplyMayArriveInOnePiece) {
  Connection connection(kRead500);
  EXPECT_EQ(connection.Take(std::string("FF FF 00 00 00 05 14 03 02 00 99 ") + kIts31),
            Hex(kIts31));
}

/// Example of damage: a serial server forwards RTU frames without a header.
TEST(ModbusTcpReplyRule, AfterDamageNothingIsAcceptedBeforeSilence) {
  for (const char* const damage :
       {"14 03 02 00 31 74 53", "00 01 00 07 00 05 14 03 02 00 31", "00 01 00 00 01 00 14 03",
        "00 01 00 00 00 00 14 03", "00 01 00 00 00 FF 14 03"}) {
    Connection connection(kRead500);
    EXPECT_FALSE(connection.Take(std::string(damage) + kIts31)) << damage;
    EXPECT_FALSE(connection.Take(kIts31)) << damage;
    EXPECT_FALSE(connection.Take("", true)) << damage;
    EXPECT_EQ(connection.assembler.blame(), Outcome::corrupt) << damage;
    EXPECT_EQ(connection.Take(kIts31), Hex(kIts31)) << damage;
  }
}

TEST(ModbusTcpReplyRule, AnIncompleteReplyIsPartial) {
  Connection connection(kRead500);
  EXPECT_FALSE(connection.Take("00 01 00 00 00 05 14 03 02 00"));
  EXPECT_FALSE(connection.Take("", true));
  EXPECT_EQ(connection.assembler.blame(), Outcome::partial);
  EXPECT_EQ(connection.assembler.held(), 0U);
}

TEST(ModbusTcpReplyRule, AFloodIsBounded) {
  Connection connection(kRead500);
  connection.assembler.Feed(Bytes(5000, 0x55));
  EXPECT_FALSE(connection.assembler.Next(false));
  EXPECT_LE(connection.assembler.held(), kMaxTcp);
}

struct Misframed {
  const char* request;
  const char* reply;
};

constexpr Misframed kMisframed[] = {
    {kRead500, "00 01 00 00 00 04 14 83 02"},
    {kRead500, "00 01 00 00 00 06 14 03 02 00 31"},
    {"00 01 00 00 00 06 14 06 00 08 00 02", "00 01 00 00 00 08 14 06 00 08 00 02"},
    {"00 01 00 00 00 08 14 0F 00 13 00 01 01 01", "00 01 00 00 00 07 14 0F 00 13 00 01"},
};

TEST(ModbusTcpReplyRule, AKnownReplySizeOverridesTheHeader) {
  for (const Misframed& one : kMisframed) {
    SCOPED_TRACE(one.reply);
    Connection connection(one.request);
    const auto at_once = connection.Take(one.reply);
    EXPECT_EQ(at_once ? at_once : connection.Take("", true), Hex(one.reply));
    const auto adu = UnwrapReply(Framing::tcp, Hex(one.reply));
    ASSERT_TRUE(adu);
    EXPECT_EQ(ToHex(adu->pdu), ToHex(View(Hex(one.reply)).subspan(kTcpOverhead)));
  }
  Connection connection(kRead500);
  EXPECT_EQ(connection.Take(std::string("00 00 00 00 00 04 14 83 02") + kIts31), Hex(kIts31))
      << "behind a late one";
  EXPECT_FALSE(UnwrapReply(Framing::tcp, Hex("00 01 00 00 00 05 14")));
  EXPECT_FALSE(UnwrapReply(Framing::tcp, Hex("00 01 00 00 00 04 14 03 02 00 31")));
}

TEST(ModbusTcpReplyRule, AReplyWithACorrectHeaderIsNotCut) {
  for (const auto& [request, reply] :
       {Misframed{kRead500, "00 01 00 00 00 07 14 03 04 00 31 00 32"},
        Misframed{"00 01 00 00 00 08 14 0F 00 13 00 01 01 01",
                  "00 01 00 00 00 08 14 0F 00 13 00 01 01 01"}}) {
    Connection connection(request);
    EXPECT_EQ(connection.Take(reply), Hex(reply)) << reply;
  }
}

config::Device MakeServer(std::vector<config::Point> points, const std::string& unit = "255") {
  return DeviceOf(ModbusTcpProtocol(), unit, std::move(points));
}

std::vector<config::Point> TwoBlocks() {
  return {modbus::ReadPoint("level", "holding 500"),
          modbus::ReadPoint("flow", "holding 900 float32", config::Type::float32)};
}

TEST(ModbusTcpConversation, EveryRequestHasItsOwnNumber) {
  Talk talk(ModbusTcpProtocol(), MakeServer(TwoBlocks()));
  const auto first = talk.Ask(Poll(0));
  const auto second = talk.Ask(Poll(1));
  ASSERT_TRUE(first && second);
  EXPECT_EQ(ToHex(first->bytes), ToHex(Hex("00 01 00 00 00 06 FF 03 01 F4 00 01")));
  EXPECT_EQ(ToHex(second->bytes), ToHex(Hex("00 02 00 00 00 06 FF 03 03 84 00 02")));
  EXPECT_TRUE(first->numbered);
  EXPECT_FALSE(first->is_proof()) << "a converter may put any reply behind the number";
  EXPECT_FALSE(first->expect.mirrors) << "nothing echoes here";
}

TEST(ModbusTcpConversation, DevicesOfAConnectionShareNoTransactionNumber) {
  const config::Device a = MakeServer(TwoBlocks(), "1");
  const config::Device b = MakeServer(TwoBlocks(), "1");
  const Protocol& protocol = ModbusTcpProtocol();
  const auto bus = MakeBus(protocol);
  const auto one = MakeConversation(protocol, a, bus.get());
  const auto other = MakeConversation(protocol, b, bus.get());
  const auto asked = one->Ask(Poll(0), {});
  const auto also = other->Ask(Poll(0), {});
  ASSERT_TRUE(asked && also);
  EXPECT_NE(ToHex(asked->bytes), ToHex(also->bytes));
  const Bytes reply = Hex("00 01 00 00 00 05 01 03 02 00 31");
  EXPECT_EQ(one->Check(asked->bytes, reply), Outcome::ok);
  EXPECT_EQ(other->Interpret(also->bytes, reply).outcome, Outcome::unexpected)
      << "of another transaction";
  EXPECT_EQ(other->Check(also->bytes, reply), Outcome::ok) << "the frame rule compares the numbers";
}

TEST(ModbusTcpConversation, AReplyIsDecoded) {
  Talk talk(ModbusTcpProtocol(), MakeServer(TwoBlocks()));
  ASSERT_TRUE(talk.Ask(Poll(0)));
  const Answer answer = talk.Reply(Poll(0), Hex("00 01 00 00 00 05 FF 03 02 09 C4"));
  EXPECT_EQ(answer.outcome, Outcome::ok) << answer.reason;
  ASSERT_EQ(answer.readings.size(), 1U);
  EXPECT_EQ(ToText(answer.readings[0].value), "2500");
}

/// The exceptions 0A and 0B come from a gateway whose device is absent.
TEST(ModbusTcpConversation, AGatewayExceptionMeansNoReply) {
  for (const char* const reply : {"00 01 00 00 00 03 FF 83 0A", "00 01 00 00 00 03 FF 83 0B"}) {
    Talk talk(ModbusTcpProtocol(), MakeServer(TwoBlocks()));
    ASSERT_TRUE(talk.Ask(Poll(0)));
    EXPECT_EQ(talk.Reply(Poll(0), Hex(reply)).outcome, Outcome::no_reply);
  }
}

TEST(ModbusTcpConversation, AnExceptionWithATooLongHeaderIsAccepted) {
  Talk talk(ModbusTcpProtocol(), MakeServer(TwoBlocks()));
  ASSERT_TRUE(talk.Ask(Poll(0)));
  const Answer answer = talk.Reply(Poll(0), Hex("00 01 00 00 00 04 FF 83 02"));
  EXPECT_EQ(answer.outcome, Outcome::unsupported) << answer.reason;
}

TEST(ModbusTcpConversation, Unit0IsTheServerAndNoBroadcast) {
  Talk talk(ModbusTcpProtocol(), MakeServer(TwoBlocks(), "0"));
  ASSERT_TRUE(talk.Ask(Poll(0)));
  EXPECT_EQ(talk.request().expect.reply, Expectation::Reply::one);
  EXPECT_EQ(talk.Reply(Poll(0), Hex("00 01 00 00 00 05 00 03 02 09 C4")).outcome, Outcome::ok);
}

TEST(ModbusTcpTwin, AnswersUnderTheNumberOfTheRequest) {
  const config::Device device = MakeServer({modbus::WritePoint("level", "holding 500")}, "0");
  FixedValues values;
  values.values[0] = std::uint64_t{49};
  ModbusTwin twin(Framing::tcp, device, values);
  EXPECT_EQ(ToHex(twin.Answer(Hex("AB CD 00 00 00 06 00 03 01 F4 00 01"), {})),
            ToHex(Hex("AB CD 00 00 00 05 00 03 02 00 31")));
  EXPECT_TRUE(twin.Answer(Hex("AB CD 00 00 00 06 01 03 01 F4 00 01"), {}).empty());
  Talk talk(ModbusTcpProtocol(), device);
  EXPECT_EQ(talk.Run(Write(0, Value{std::uint64_t{7}}), twin).outcome, Outcome::ok);
  const Answer read = talk.Run(Poll(0), twin);
  ASSERT_EQ(read.readings.size(), 1U);
  EXPECT_EQ(ToText(read.readings[0].value), "7");
}

}  // namespace
}  // namespace baudgate::protocols
