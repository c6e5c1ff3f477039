// Tests the rules of Modbus PDUs with the messages of the reference installation (an inverter as
// slave 20) and the examples of the MODBUS Application Protocol V1.1b3.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/modbus_pdu/modbus_pdu.h"

#include <gtest/gtest.h>

#include "gateway/base/text.h"

namespace baudgate::modbus {
namespace {

Bytes Hex(std::string_view text) { return ParseHex(text).value(); }

Bytes Padded(std::string_view text, std::size_t zeros) {
  Bytes pdu = Hex(text);
  pdu.resize(pdu.size() + zeros);
  return pdu;
}

struct Row {
  const char* what;
  Bytes request;
  unsigned function, start, count;
  std::size_t data;
  std::size_t reply;
};

/// Register numbers are addresses + 40001.
const Row kReference[] = {
    {"read 40501", Hex("03 01 F4 00 01"), 3, 500, 1, 0, 4},
    {"read 40201", Hex("03 00 C8 00 01"), 3, 200, 1, 0, 4},
    {"read 40202", Hex("03 00 C9 00 01"), 3, 201, 1, 0, 4},
    {"read 40009", Hex("03 00 08 00 01"), 3, 8, 1, 0, 4},
    {"write 40014 = 25.00 Hz", Hex("06 00 0D 09 C4"), 6, 13, 1, 2, 5},
    {"write 40009 forward", Hex("06 00 08 00 02"), 6, 8, 1, 2, 5},
    {"write 40009 stop", Hex("06 00 08 00 00"), 6, 8, 1, 2, 5},
    {"clear 40501", Hex("06 01 F4 00 00"), 6, 500, 1, 2, 5},
    {"read 41000 x120", Hex("03 03 E7 00 78"), 3, 999, 120, 0, 242},
    {"read 41120 x120", Hex("03 04 5F 00 78"), 3, 1119, 120, 0, 242},
    {"read 41240 x120", Hex("03 04 D7 00 78"), 3, 1239, 120, 0, 242},
    {"read 41360 x120", Hex("03 05 4F 00 78"), 3, 1359, 120, 0, 242},
    {"read 41480 x120", Hex("03 05 C7 00 78"), 3, 1479, 120, 0, 242},
    {"read 41600 x120", Hex("03 06 3F 00 78"), 3, 1599, 120, 0, 242},
    {"read 41720 x120", Hex("03 06 B7 00 78"), 3, 1719, 120, 0, 242},
    {"read 41840 x120", Hex("03 07 2F 00 78"), 3, 1839, 120, 0, 242},
    {"read 41960 x40", Hex("03 07 A7 00 28"), 3, 1959, 40, 0, 82},
    {"write 41000 x120", Padded("10 03 E7 00 78 F0", 240), 16, 999, 120, 240, 5},
    // Examples of the specification: 6.1, 6.2, 6.5, 6.11, 6.12.
    {"coils 20-38", Hex("01 00 13 00 13"), 1, 0x13, 19, 0, 5},
    {"inputs 197-218", Hex("02 00 C4 00 16"), 2, 0xC4, 22, 0, 5},
    {"coil 173 on", Hex("05 00 AC FF 00"), 5, 0xAC, 1, 2, 5},
    {"coils 20-29", Hex("0F 00 13 00 0A 02 CD 01"), 15, 0x13, 10, 2, 5},
    {"two registers", Hex("10 00 01 00 02 04 00 0A 01 02"), 16, 1, 2, 4, 5},
};

TEST(ModbusPdu, RequestsMatchTheReference) {
  for (const Row& row : kReference) {
    PlainRequest request;
    ASSERT_EQ(ParseRequest(row.request, request), kNoException) << row.what;
    EXPECT_EQ(request.function, row.function) << row.what;
    EXPECT_EQ(request.start, row.start) << row.what;
    EXPECT_EQ(request.count, row.count) << row.what;
    EXPECT_EQ(request.data.size(), row.data) << row.what;
    EXPECT_EQ(AwaitedLength(row.request), row.reply) << row.what;
    EXPECT_EQ(IsRead(row.request[0]), row.data == 0) << row.what;
    EXPECT_EQ(IsPlainWrite(row.request[0]), row.data > 0) << row.what;
    EXPECT_EQ(IsRepeatable(row.request), row.data == 0) << row.what;
    EXPECT_TRUE(IsCommon(row.request)) << row.what;
  }
}

TEST(ModbusPdu, TheLengthOfARequestIsKnownBeforeItsEnd) {
  using Kind = PduLength::Kind;
  for (const Row& row : kReference) {
    bool known = false;
    for (std::size_t size = 1; size <= row.request.size(); ++size) {
      const PduLength length = RequestLength(View(row.request).first(size));
      EXPECT_NE(length.kind, Kind::unknown) << row.what << ", first " << size;
      known = length.kind == Kind::exact;
      if (known) {
        EXPECT_EQ(length.size, row.request.size()) << row.what << ", first " << size;
      }
    }
    EXPECT_TRUE(known) << row.what;
  }
}

TEST(ModbusPdu, TheLengthOfADiagnosisIsCheckedWhereItIsFixed) {
  EXPECT_EQ(AwaitedLength(Hex("08 00 00 A5 37 11")), 6U) << "a loopback";
  EXPECT_EQ(AwaitedLength(Hex("08 00 0B 00 00")), 5U) << "a counter";
  for (const char* own : {"08 00 05 00 00", "08 00 13 00 00", "08 00 15 00 03", "08 80 00 00 00"}) {
    EXPECT_FALSE(AwaitedLength(Hex(own))) << own;
    EXPECT_EQ(RequestLength(Hex(own)).kind, PduLength::Kind::unknown) << own;
  }
  Bytes statistics = Hex("08 00 15 00 03");
  statistics.resize(115);
  EXPECT_EQ(CheckReply(Hex("08 00 15 00 03"), statistics).outcome, Outcome::ok);
}

TEST(ModbusPdu, FunctionCodesAreClassified) {
  const auto codes = [](auto is) {
    std::string text;
    for (int code = 0; code < 256; ++code) {
      if (is(static_cast<std::uint8_t>(code))) text += std::to_string(code) + " ";
    }
    return text;
  };
  EXPECT_EQ(codes(IsRead), "1 2 3 4 ");
  EXPECT_EQ(codes(IsPlainWrite), "5 6 15 16 ");
  EXPECT_EQ(codes(IsAboutBits), "1 2 5 15 ");
  EXPECT_FALSE(IsFunction(0));
  EXPECT_TRUE(IsFunction(1));
  EXPECT_TRUE(IsFunction(127));
  EXPECT_FALSE(IsFunction(128));
}

TEST(ModbusPdu, RequestsThatMayChangeASlaveAreRecognised) {
  for (const char* reads : {"03 00 00 00 01", "07", "0B", "0C", "11", "14", "18", "2B 0E 01 00",
                            "08 00 00 01 01", "08 00 0B 00 00"}) {
    EXPECT_FALSE(MayChangeSlave(Hex(reads))) << reads;
  }
  for (const char* changes : {"06 00 00 00 01", "15", "16 00 04 00 F2 00 25", "17", "41", "2B 0D",
                              "2B", "08 00 01 00 00", "08"}) {
    EXPECT_TRUE(MayChangeSlave(Hex(changes))) << changes;
  }
}

struct Refused {
  const char* what;
  Bytes request;
  ExceptionCode exception;
};

TEST(ModbusPdu, InvalidRequestsGetTheirException) {
  const Refused rows[] = {
      {"no function", Hex(""), kIllegalFunction},
      {"function 0", Hex("00"), kIllegalFunction},
      {"a diagnosis", Hex("08 00 00 A5 37"), kIllegalFunction},
      {"a mask write", Hex("16 00 04 00 F2 00 25"), kIllegalFunction},
      {"an exception", Hex("83 02"), kIllegalFunction},
      {"a function code alone", Hex("03"), kIllegalValue},
      {"no registers", Hex("03 00 00 00 00"), kIllegalValue},
      {"126 registers", Hex("03 00 00 00 7E"), kIllegalValue},
      {"2001 bits", Hex("01 00 00 07 D1"), kIllegalValue},
      {"one byte too many", Hex("04 00 00 00 01 00"), kIllegalValue},
      {"a coil half on", Hex("05 00 AC 12 34"), kIllegalValue},
      {"124 registers written", Padded("10 00 00 00 7C F8", 248), kIllegalValue},
      {"1969 bits written", Padded("0F 00 00 07 B1 F7", 247), kIllegalValue},
      {"another byte count", Hex("10 00 00 00 02 02 00 00"), kIllegalValue},
      {"beyond address 65535", Hex("03 FF FF 00 02"), kIllegalAddress},
      {"written beyond address 65535", Hex("10 FF FF 00 02 04 00 00 00 00"), kIllegalAddress},
  };
  for (const Refused& row : rows) {
    PlainRequest request;
    EXPECT_EQ(ParseRequest(row.request, request), row.exception) << row.what;
    EXPECT_FALSE(IsCommon(row.request)) << row.what;
  }
}

TEST(ModbusPdu, TheLargestRequestOfEachKindIsAccepted) {
  for (const Bytes& request :
       {Hex("03 FF 83 00 7D"), Hex("01 F8 30 07 D0"), Padded("10 00 00 00 7B F6", 246),
        Padded("0F 00 00 07 B0 F6", 246)}) {
    PlainRequest parts;
    EXPECT_EQ(ParseRequest(request, parts), kNoException) << ToHex(request);
    EXPECT_LE(request.size(), kMaxPdu);
    EXPECT_LE(AwaitedLength(request).value(), kMaxPdu);
  }
}

struct Exchange {
  const char* what;
  const char* request;
  const char* reply;
  Outcome outcome;
};

TEST(ModbusPdu, RepliesMatchTheReference) {
  using enum Outcome;
  const Exchange rows[] = {
      {"25.00 Hz", "03 00 C8 00 01", "03 02 09 C4", ok},
      {"2.02 A", "03 00 C9 00 01", "03 02 00 CA", ok},
      {"status 004B", "03 00 08 00 01", "03 02 00 4B", ok},
      {"fault E.THM", "03 01 F4 00 01", "03 02 00 31", ok},
      {"illegal address", "03 01 F4 00 01", "83 02", refused},
      {"of a gateway on the way", "03 01 F4 00 01", "83 0B", refused},
      {"forward is confirmed", "06 00 08 00 02", "06 00 08 00 02", ok},
      {"stop in place of forward", "06 00 08 00 02", "06 00 08 00 00", unexpected},
      {"another register", "06 00 08 00 02", "06 00 0D 00 02", unexpected},
      {"a block in place of one", "03 00 C8 00 01", "03 04 09 C4 00 00", unexpected},
      {"another function", "03 00 C8 00 01", "04 02 09 C4", unexpected},
      {"a byte count too large", "03 00 C8 00 01", "03 04 09 C4", unexpected},
      {"a longer exception", "03 00 C8 00 01", "83 02 00", unexpected},
      {"another's exception", "03 00 C8 00 01", "86 02", unexpected},
      {"no reply at all", "03 00 C8 00 01", "", unexpected},
      {"functions nobody knows", "64 DE AD", "64 01 02 03", ok},
  };
  for (const Exchange& row : rows) {
    const Verdict verdict = CheckReply(Hex(row.request), Hex(row.reply));
    EXPECT_EQ(verdict.outcome, row.outcome) << row.what;
    EXPECT_EQ(verdict.reason.empty(), row.outcome == ok) << row.what;
  }
}

TEST(ModbusPdu, ExceptionsHaveTheirTexts) {
  EXPECT_EQ(ToHex(Exception(kReadHolding, kIllegalAddress)), "83 02");
  EXPECT_EQ(ExceptionText(kIllegalAddress), "exception 02, illegal data address");
  EXPECT_EQ(ExceptionText(0x63), "exception 63");
  EXPECT_EQ(CheckReply(Hex("03 00 C8 00 01"), Hex("83 0B")).exception, kNoTarget);
}

}  // namespace
}  // namespace baudgate::modbus
