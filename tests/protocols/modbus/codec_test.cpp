// Tests frames of Modbus RTU and ASCII: all frames of the reference installation, check values, and
// bytes that are not a frame.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/modbus/rules.h"
#include "tests/protocols/modbus/support.h"

namespace baudgate::protocols::modbus {
namespace {

struct Vector {
  const char* what;
  Bytes pdu;
  const char* frame;
};

std::vector<Vector> Vectors() {
  const auto read = [](std::uint16_t address, std::size_t count) {
    return ReadRequest(kReadHolding, address, count);
  };
  return {
      {"read 40501", read(500, 1), "14 03 01 F4 00 01 C6 C1"},
      {"read 40201", read(200, 1), "14 03 00 C8 00 01 07 31"},
      {"read 40202", read(201, 1), "14 03 00 C9 00 01 56 F1"},
      {"read 40009", read(8, 1), "14 03 00 08 00 01 07 0D"},
      {"write 40014 = 25.00 Hz", WriteRegisterRequest(13, 2500), "14 06 00 0D 09 C4 1D 0F"},
      {"write 40009 forward", WriteRegisterRequest(8, 2), "14 06 00 08 00 02 8B 0C"},
      {"write 40009 stop", WriteRegisterRequest(8, 0), "14 06 00 08 00 00 0A CD"},
      {"clear 40501", WriteRegisterRequest(500, 0), "14 06 01 F4 00 00 CB 01"},
      {"read 41000 x120", read(999, 120), "14 03 03 E7 00 78 F7 5E"},
      {"read 41120 x120", read(1119, 120), "14 03 04 5F 00 78 76 0F"},
      {"read 41240 x120", read(1239, 120), "14 03 04 D7 00 78 F6 25"},
      {"read 41360 x120", read(1359, 120), "14 03 05 4F 00 78 76 36"},
      {"read 41480 x120", read(1479, 120), "14 03 05 C7 00 78 F6 1C"},
      {"read 41600 x120", read(1599, 120), "14 03 06 3F 00 78 77 A9"},
      {"read 41720 x120", read(1719, 120), "14 03 06 B7 00 78 F7 83"},
      {"read 41840 x120", read(1839, 120), "14 03 07 2F 00 78 77 90"},
      {"read 41960 x40", read(1959, 40), "14 03 07 A7 00 28 F7 86"},
      {"25.00 Hz", Hex("03 02 09 C4"), "14 03 02 09 C4 B2 44"},
      {"2.02 A", Hex("03 02 00 CA"), "14 03 02 00 CA 35 D0"},
      {"status 004B", Hex("03 02 00 4B"), "14 03 02 00 4B F5 B0"},
      {"fault E.THM", Hex("03 02 00 31"), "14 03 02 00 31 74 53"},
      {"illegal address", Exception(kReadHolding, kIllegalAddress), "14 83 02 D1 35"},
  };
}

TEST(ModbusRtuCodec, FramesMatchTheReference) {
  for (const Vector& vector : Vectors()) {
    const Bytes frame = Hex(vector.frame);
    EXPECT_EQ(ToHex(Wrap(Framing::rtu, 20, vector.pdu)), vector.frame) << vector.what;
    const auto adu = Unwrap(Framing::rtu, frame);
    ASSERT_TRUE(adu.has_value()) << vector.what;
    EXPECT_EQ(adu->slave, 20);
    EXPECT_EQ(adu->pdu, vector.pdu) << vector.what;
  }
}

TEST(ModbusRtuCodec, AWholeParameterBlockIs249Bytes) {
  const Bytes pdu = WriteRegistersRequest(999, std::vector<std::uint16_t>(120, 0x1234));
  const Bytes frame = Wrap(Framing::rtu, 20, pdu);
  EXPECT_EQ(frame.size(), 249U);
  EXPECT_EQ(ToHex(View(frame).first(7)), "14 10 03 E7 00 78 F0");
  const Bytes cut = CutFrame(RtuRequestRule, Expect(Framing::rtu, {}), frame);
  EXPECT_EQ(cut, frame);
  const Expectation expect = Expect(Framing::rtu, Wrap(Framing::rtu, 20, Hex("0303E70078")));
  ASSERT_EQ(expect.shapes.size(), 2U);
  EXPECT_EQ(expect.shapes[0].max_length, 5U);
  EXPECT_EQ(expect.shapes[1].max_length, 245U);
}

TEST(ModbusAsciiCodec, FramesAreHexWithAnLrc) {
  const Bytes frame = Wrap(Framing::ascii, 20, ReadRequest(kReadHolding, 500, 1));
  EXPECT_EQ(AsText(frame), ":140301F40001F3\r\n");
  EXPECT_EQ(AsText(Wrap(Framing::ascii, 20, Hex("03020031"))), ":1403020031B6\r\n");
  EXPECT_EQ(AsText(Wrap(Framing::ascii, 20, Hex("8302"))), ":14830267\r\n");
  // MODBUS over Serial Line: 01 03 00 00 00 0A has the LRC F2.
  EXPECT_EQ(AsText(Wrap(Framing::ascii, 1, ReadRequest(kReadHolding, 0, 10))),
            ":01030000000AF2\r\n");
  for (const Vector& vector : Vectors()) {
    const auto adu = Unwrap(Framing::ascii, Wrap(Framing::ascii, 20, vector.pdu));
    ASSERT_TRUE(adu.has_value()) << vector.what;
    EXPECT_EQ(adu->pdu, vector.pdu);
  }
  EXPECT_EQ(Wrap(Framing::ascii, 20, Bytes(kMaxPdu)).size(), kMaxAscii);
}

TEST(ModbusAsciiCodec, LowerCaseAndAMissingLineFeedAreRead) {
  EXPECT_TRUE(Unwrap(Framing::ascii, ToBytes(":140301f40001f3\r\n")).has_value());
  EXPECT_TRUE(Unwrap(Framing::ascii, ToBytes(":140301F40001F3\r")).has_value());
  for (const char* wrong :
       {":140301F40001F4\r\n", "140301F40001F3\r\n", ":140301F40001F3", ":140301F40001F\r\n",
        ":14 0301F40001F3\r\n", ":14EC\r\n", ":\r\n", ""}) {
    EXPECT_FALSE(Unwrap(Framing::ascii, ToBytes(wrong)).has_value()) << wrong;
  }
}

TEST(ModbusCodec, AddressesAreParsed) {
  EXPECT_EQ(ParseAddress("20").value(), 20);
  EXPECT_EQ(ParseAddress("0x14").value(), 20);
  EXPECT_EQ(ParseAddress("247").value(), 247);
  for (const char* wrong : {"0", "248", "256", "", "x", "-1", "0x", "1 "}) {
    const auto address = ParseAddress(wrong);
    ASSERT_FALSE(address) << wrong;
    EXPECT_NE(address.error().find("1...247"), std::string::npos);
  }
}

TEST(ModbusPdu, OtherWritesMatchTheReference) {
  EXPECT_EQ(ToHex(WriteCoilRequest(3, true)), "05 00 03 FF 00");
  EXPECT_EQ(ToHex(WriteCoilRequest(3, false)), "05 00 03 00 00");
  // Examples of the MODBUS Application Protocol, 6.11 and 6.16.
  EXPECT_EQ(ToHex(WriteCoilsRequest(
                19, {true, false, true, true, false, false, true, true, true, false})),
            "0F 00 13 00 0A 02 CD 01");
  EXPECT_EQ(ToHex(MaskWriteRequest(4, 0xF2, 0x25)), "16 00 04 00 F2 00 25");
  EXPECT_EQ(ToHex(LoopbackRequest(0xA537)), "08 00 00 A5 37");
}

TEST(ModbusPdu, AReplyMustRepeatItsRequest) {
  const auto outcome = [](const char* request, const char* reply) {
    return CheckReply(Hex(request), Hex(reply)).outcome;
  };
  EXPECT_EQ(outcome("0301F40001", "03020031"), Outcome::ok);
  EXPECT_EQ(outcome("0301F40001", "0304003100"), Outcome::unexpected);
  EXPECT_EQ(outcome("0301F40001", "03040031"), Outcome::unexpected) << "byte count";
  EXPECT_EQ(outcome("0301F40001", "04020031"), Outcome::unexpected);
  EXPECT_EQ(outcome("0301F40001", "8302"), Outcome::refused);
  EXPECT_EQ(outcome("0301F40001", "830200"), Outcome::unexpected);
  EXPECT_EQ(outcome("0301F40001", "8402"), Outcome::unexpected);
  EXPECT_EQ(outcome("0600080002", "0600080002"), Outcome::ok);
  EXPECT_EQ(outcome("0600080002", "0600080000"), Outcome::unexpected) << "value";
  EXPECT_EQ(outcome("0600080002", "0600090002"), Outcome::unexpected) << "address";
  EXPECT_EQ(outcome("050003FF00", "050003FF00"), Outcome::ok);
  EXPECT_EQ(outcome("050003FF00", "0500030000"), Outcome::unexpected);
  EXPECT_EQ(outcome("1003E70001020005", "1003E70001"), Outcome::ok);
  EXPECT_EQ(outcome("1003E70001020005", "1003E70002"), Outcome::unexpected) << "count";
  EXPECT_EQ(outcome("1003E70001020005", "1003E80001"), Outcome::unexpected) << "address";
  EXPECT_EQ(outcome("0F0013000A02CD01", "0F0013000A"), Outcome::ok);
  EXPECT_EQ(outcome("16000400F20025", "16000400F20025"), Outcome::ok);
  EXPECT_EQ(outcome("16000400F20025", "16000400F20024"), Outcome::unexpected);
  EXPECT_EQ(outcome("080000A55A", "080000A55A"), Outcome::ok);
  EXPECT_EQ(outcome("080000A55A", "0800005AA5"), Outcome::unexpected);
  EXPECT_EQ(outcome("08000B0000", "08000B0012"), Outcome::ok) << "a counter";
  EXPECT_EQ(outcome("1700000001000A0001020005", "17020007"), Outcome::ok);
  EXPECT_EQ(outcome("2B0E0100",
                    "2B0E01810000010001"
                    "41"),
            Outcome::ok);
  EXPECT_EQ(outcome("2B0E0100", "2B0D01"), Outcome::unexpected);
  EXPECT_EQ(outcome("640102", "64FF"), Outcome::ok) << "unknown functions pass";
}

/// A device can return the request as its reply. If bytes follow, the returned request is the echo
/// of the bus.
TEST(ModbusReplyRules, AReturnedWriteIsAFrameIfNothingFollows) {
  for (const Framing framing : {Framing::rtu, Framing::ascii}) {
    const Protocol& protocol = ProtocolOf(framing);
    for (const char* pdu : {"1003E70001020005", "0F0013000A02CD01"}) {
      const Bytes request = Wrap(framing, 20, Hex(pdu));
      const Bytes reply = Wrap(framing, 20, View(Hex(pdu)).first(5));
      Assembler assembler;
      assembler.Begin(protocol.reply_rule, Expect(framing, request));
      for (const std::uint8_t byte : request) {
        assembler.Feed(View(&byte, 1));
        EXPECT_FALSE(assembler.Next(false));
      }
      EXPECT_EQ(assembler.Next(true), request);
      assembler.Feed(request);
      EXPECT_FALSE(assembler.Next(false));
      assembler.Feed(reply);
      EXPECT_EQ(assembler.Next(true), reply);
    }
  }
}

TEST(ModbusExpect, ReadsAreRepeatableAndWritesMirror) {
  const auto expect = [](const char* pdu) {
    return Expect(Framing::rtu, Wrap(Framing::rtu, 20, Hex(pdu)));
  };
  for (const char* read : {"0100000001", "0200000001", "0300000001", "0400000001", "080000A55A"}) {
    EXPECT_TRUE(expect(read).repeatable) << read;
  }
  for (const char* write : {"050003FF00", "0600080002", "0F0013000A02CD01", "1003E70001020005",
                            "16000400F20025", "1700000001000A0001020005", "640102", "0800010000"}) {
    EXPECT_FALSE(expect(write).repeatable) << write;
  }
  for (const char* mirrored :
       {"050003FF00", "0600080002", "080000A55A", "16000400F20025", "08000A0000", "0800140000",
        "41010203", "1003E70001020005", "0F0013000A02CD01"}) {
    EXPECT_TRUE(expect(mirrored).mirrors) << mirrored;
  }
  for (const char* other : {"0300000001", "1700000001000A0001020005", "2B0E0100"}) {
    EXPECT_FALSE(expect(other).mirrors) << other;
  }
  EXPECT_EQ(expect("0300000001").address, Bytes{20});
  const Expectation broadcast = Expect(Framing::rtu, Wrap(Framing::rtu, 0, Hex("0600080002")));
  EXPECT_EQ(broadcast.reply, Expectation::Reply::none);
  EXPECT_EQ(Expect(Framing::ascii, Wrap(Framing::ascii, 20, Hex("0300000001"))).max_bytes, 513U);
}

TEST(ModbusCarrier, CarriesPdusBothWays) {
  for (const Framing framing : {Framing::rtu, Framing::ascii}) {
    const PduCarrier& carrier = *ProtocolOf(framing).carrier;
    EXPECT_EQ(carrier.slave_of("0x14").value(), 20);
    EXPECT_FALSE(carrier.slave_of("0"));
    const Bytes request = carrier.wrap(20, Hex("0300C80001"));
    const auto inside = carrier.unwrap_request(request);
    ASSERT_TRUE(inside.has_value());
    EXPECT_EQ(inside->first, 20);
    EXPECT_EQ(ToHex(inside->second), "03 00 C8 00 01");
    EXPECT_FALSE(carrier.unwrap_request(carrier.wrap(20, Hex("8302"))).has_value());
    EXPECT_FALSE(carrier.unwrap_request(carrier.wrap(248, Hex("0300C80001"))).has_value());
    EXPECT_FALSE(carrier.unwrap_request(Hex("140300")).has_value());

    Bytes pdu = {1};
    EXPECT_EQ(carrier.unwrap(request, carrier.wrap(20, Hex("030209C4")), pdu), Outcome::ok);
    EXPECT_EQ(ToHex(pdu), "03 02 09 C4");
    EXPECT_EQ(carrier.unwrap(request, carrier.wrap(20, Hex("8302")), pdu), Outcome::refused);
    EXPECT_EQ(ToHex(pdu), "83 02");
    for (const Bytes& frame : {carrier.wrap(21, Hex("030209C4")), carrier.wrap(20, Hex("040209C4")),
                               carrier.wrap(20, Hex("0600080002")), Bytes()}) {
      pdu = {1};
      EXPECT_EQ(carrier.unwrap(request, frame, pdu), Outcome::unexpected);
      EXPECT_TRUE(pdu.empty());
    }
    EXPECT_EQ(carrier.unwrap(request, carrier.wrap(20, Hex("030409C40000")), pdu),
              Outcome::unexpected);
    EXPECT_EQ(ToHex(pdu), "03 04 09 C4 00 00") << "of its slave and function, in an odd form";
  }
}

TEST(ModbusCarrier, CommonRequestsAreRecognised) {
  const auto write = [](std::uint8_t function, std::size_t quantity, std::size_t bytes) {
    Bytes pdu = ReadRequest(function, 0, quantity);
    pdu.push_back(static_cast<std::uint8_t>(bytes));
    pdu.resize(pdu.size() + bytes);
    return ToHex(pdu);
  };
  const std::pair<std::string, bool> table[] = {
      {"0100000001", true},
      {"01000007D0", true},
      {"01000007D1", false},
      {"0100000000", false},
      {"02F83007D0", true},
      {"02F83107D0", false},
      {"030000007D", true},
      {"030000007E", false},
      {"0300000000", false},
      {"03FFFF0001", true},
      {"03FFFF0002", false},
      {"04FF83007D", true},
      {"04FF84007D", false},
      {"030000", false},
      {"030000000100", false},
      {"0512340000", true},
      {"051234FF00", true},
      {"05123400FF", false},
      {"051234FF01", false},
      {"05FFFFFF00", true},
      {"05123400", false},
      {"06FFFFFFFF", true},
      {"0600000000", true},
      {"06000000", false},
      {"060000000000", false},
      {write(15, 1968, 246), true},
      {write(15, 1969, 247), false},
      {write(15, 0, 0), false},
      {write(15, 9, 2), true},
      {write(15, 9, 1), false},
      {write(15, 9, 3), false},
      {write(16, 123, 246), true},
      {write(16, 124, 248), false},
      {write(16, 0, 0), false},
      {write(16, 2, 2), false},
      {write(16, 2, 4) + "00", false},
      {"10FFFF0001020000", true},
      {"10FFFF00020400000000", false},
      {"0FFFF8000801FF", true},
      {"0FFFF9000801FF", false},
      {"100000000102", false},
      {"10000000010200", false},
      {"080000A55A", false},
      {"16000400F20025", false},
      {"2B0E0100", false},
      {"1700000001000A0001020005", false},
      {"07", false},
      {"11", false},
      {"00", false},
      {"6401020304", false},
      {"8302", false},
      {"8300000001", false},
  };
  for (const Framing framing : {Framing::rtu, Framing::ascii}) {
    const PduCarrier& carrier = *ProtocolOf(framing).carrier;
    for (const auto& [pdu, common] : table) EXPECT_EQ(carrier.is_common(Hex(pdu)), common) << pdu;
    EXPECT_FALSE(carrier.is_common({}));
  }
}

}  // namespace
}  // namespace baudgate::protocols::modbus
