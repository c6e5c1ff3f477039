// Checks of requests: every function, count, limit and length.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/wire/request.h"

#include <gtest/gtest.h>

#include "tests/gateway/outputs/modbus/registers/points.h"

namespace baudgate::modbus {
namespace {

struct BadRequest {
  const char* name;
  std::string pdu;
  ExceptionCode exception;
};

class BadRequests : public testing::TestWithParam<BadRequest> {};

TEST_P(BadRequests, AreRefused) {
  const Bytes frame = Frame(1, GetParam().pdu);
  ModbusRequest request;
  EXPECT_EQ(ParseRequest(frame, request), GetParam().exception);
}

std::string Zeros(std::size_t bytes) { return std::string(2 * bytes, '0'); }

constexpr auto kFunction = kIllegalFunction;

INSTANTIATE_TEST_SUITE_P(
    All, BadRequests,
    testing::Values(BadRequest{"function_0", "00", kFunction},
                    BadRequest{"function_7", "07", kFunction},
                    BadRequest{"function_22", "16 00 00 FF FF 00 00", kFunction},
                    BadRequest{"function_23", "17 00 00 00 01 00 00 00 01 02 00 00", kFunction},
                    BadRequest{"function_131", "83 00 00 00 01", kFunction},
                    BadRequest{"read_function_only", "03", kIllegalValue},
                    BadRequest{"read_short", "03 00 00 00", kIllegalValue},
                    BadRequest{"read_long", "03 00 00 00 01 00", kIllegalValue},
                    BadRequest{"read_no_registers", "04 00 00 00 00", kIllegalValue},
                    BadRequest{"read_126_registers", "03 00 00 00 7E", kIllegalValue},
                    BadRequest{"read_no_bits", "01 00 00 00 00", kIllegalValue},
                    BadRequest{"read_2001_bits", "02 00 00 07 D1", kIllegalValue},
                    BadRequest{"read_past_the_end", "03 FF FF 00 02", kIllegalAddress},
                    BadRequest{"coil_neither_on_nor_off", "05 00 00 12 34", kIllegalValue},
                    BadRequest{"coil_short", "05 00 00 FF", kIllegalValue},
                    BadRequest{"register_short", "06 00 00 00", kIllegalValue},
                    BadRequest{"register_long", "06 00 00 00 00 00", kIllegalValue},
                    BadRequest{"registers_without_data", "10 00 00 00 02 04", kIllegalValue},
                    BadRequest{"registers_header_only", "10 00 00 00 02", kIllegalValue},
                    BadRequest{"registers_byte_count", "10 00 00 00 02 02 00 00", kIllegalValue},
                    BadRequest{"registers_surplus", "10 00 00 00 01 02 00 00 00", kIllegalValue},
                    BadRequest{"registers_none", "10 00 00 00 00 00", kIllegalValue},
                    BadRequest{"registers_124", "10 00 00 00 7C F8" + Zeros(246), kIllegalValue},
                    BadRequest{"bits_byte_count", "0F 00 00 00 09 01 00", kIllegalValue},
                    BadRequest{"bits_none", "0F 00 00 00 00 00", kIllegalValue},
                    BadRequest{"bits_1969", "0F 00 00 07 B1 F7" + Zeros(247), kIllegalValue}),
    [](const auto& info) { return info.param.name; });

TEST(Request, TheLargestOfEachKindPass) {
  for (const std::string& pdu :
       {std::string("03 00 00 00 7D"), std::string("04 FF 83 00 7D"), std::string("01 00 00 07 D0"),
        "10 00 00 00 7B F6" + Zeros(246), "0F 00 00 07 B0 F6" + Zeros(246)}) {
    ModbusRequest request;
    const Bytes frame = Frame(1, pdu);
    EXPECT_EQ(ParseRequest(frame, request), kNoException) << pdu.substr(0, 14);
  }
}

TEST(Request, FieldsAreTakenFromTheirPlaces) {
  ModbusRequest request;
  const Bytes frame = Frame(21, "10 01 02 00 02 04 AA BB CC DD");
  ASSERT_EQ(ParseRequest(frame, request), kNoException);
  EXPECT_EQ(request.unit, 21);
  EXPECT_EQ(request.function, kWriteRegisters);
  EXPECT_EQ(request.start, 0x0102);
  EXPECT_EQ(request.count, 2);
  EXPECT_EQ(ToHex(request.data), "AA BB CC DD");
  EXPECT_EQ(request.table(), config::Table::registers);
}

TEST(Request, SizesOfReplies) {
  const std::pair<const char*, std::size_t> sizes[] = {
      {"01 00 00 00 01", 10},          {"02 00 00 00 08", 10}, {"02 00 00 00 09", 11},
      {"01 00 00 07 D0", 259},         {"03 00 00 00 01", 11}, {"04 00 00 00 7D", 259},
      {"05 00 00 FF 00", 12},          {"06 00 00 00 01", 12}, {"0F 00 00 00 09 02 00 01", 12},
      {"10 00 00 00 01 02 00 01", 12},
  };
  for (const auto& [pdu, size] : sizes) {
    const Bytes frame = Frame(1, pdu);
    ModbusRequest request;
    ASSERT_EQ(ParseRequest(frame, request), kNoException) << pdu;
    EXPECT_EQ(ReplySize(request), size) << pdu;
  }
}

TEST(Request, ExceptionReplyKeepsTransactionAndUnit) {
  const auto reply = ExceptionReply(Frame(9, "03 00 00 00 01", 0xABCD), kBusy);
  EXPECT_EQ(ToHex(reply), "AB CD 00 00 00 03 09 83 06");
}

}  // namespace
}  // namespace baudgate::modbus
