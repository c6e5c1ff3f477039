// The simulated slave: what it answers to every function, what it refuses, and when it is silent.
// SPDX-License-Identifier: Apache-2.0
#include "tests/protocols/modbus/support.h"

namespace baudgate::protocols::modbus {
namespace {

using config::Type;

class ModbusTwinTest : public ::testing::Test {
 protected:
  void Make(const std::string& missing = "exception") {
    device_ = MakeDevice(
        {ReadPoint("frequency", "holding 200"), WritePoint("set", "holding 202"),
         WritePoint("limit", "holding 204", {}, Type::uint32),
         ReadPoint("running", "holding 8[b0]", Type::boolean),
         ReadPoint("fault", "holding 8[b15]", Type::boolean), WritePoint("run", "", "holding 8"),
         WritePoint("relay_0", "coil 0", {}, Type::boolean),
         WritePoint("relay_1", "coil 1", {}, Type::boolean),
         ReadPoint("door", "discrete 9", Type::boolean),
         ReadPoint("voltage", "input 0", Type::float32), WritePoint("mode", "holding 300"),
         ReadPoint("mode_on", "holding 300[b2]", Type::boolean)},
        {{"missing", missing}});
    values_.values = {{0, std::uint64_t{2500}},
                      {1, std::uint64_t{7}},
                      {2, std::uint64_t{65538}},
                      {3, true},
                      {4, true},
                      {6, false},
                      {7, true},
                      {8, true},
                      {9, 230.5},
                      {10, std::uint64_t{1}},
                      {11, false}};
    twin_ = std::make_unique<ModbusTwin>(Framing::rtu, device_, values_);
  }
  std::string Ask(const char* pdu) { return ToHex(AskTwin(*twin_, Hex(pdu))); }

  config::Device device_;
  FixedValues values_;
  std::unique_ptr<ModbusTwin> twin_;
};

TEST_F(ModbusTwinTest, Reads) {
  Make();
  EXPECT_EQ(Ask("0300C80001"), "03 02 09 C4");
  EXPECT_EQ(Ask("0300CC0002"), "03 04 00 01 00 02");
  EXPECT_EQ(Ask("0300CD0001"), "03 02 00 02") << "half of a value, as a real device gives it";
  EXPECT_EQ(Ask("0300080001"), "03 02 80 01") << "bits of one register";
  EXPECT_EQ(Ask("0100000002"), "01 01 02");
  EXPECT_EQ(Ask("0200090001"), "02 01 01");
  EXPECT_EQ(Ask("0400000002"), "04 04 43 66 80 00");
}

TEST_F(ModbusTwinTest, RepliesUnderAnotherSlaveWhenToldSo) {
  Make();
  twin_->ReplyAs("0x15");
  const auto reply_to = [&](std::uint8_t slave) {
    return twin_->Answer(Wrap(Framing::rtu, slave, Hex("0300C80001")), {});
  };
  EXPECT_EQ(reply_to(20), Wrap(Framing::rtu, 21, Hex("030209C4")));
  EXPECT_TRUE(reply_to(21).empty()) << "it is still called 20";
  ModbusTwin ascii(Framing::ascii, device_, values_);
  ascii.ReplyAs("21");
  EXPECT_EQ(ascii.Answer(Wrap(Framing::ascii, 20, Hex("0300C80001")), {}),
            Wrap(Framing::ascii, 21, Hex("030209C4")));
}

TEST_F(ModbusTwinTest, RefusesAsTheSpecificationSays) {
  Make();
  EXPECT_EQ(Ask("0300C80002"), "83 02") << "201 is missing";
  EXPECT_EQ(Ask("0300000001"), "83 02");
  EXPECT_EQ(Ask("0300C80000"), "83 03");
  EXPECT_EQ(Ask("0300C8007E"), "83 03");
  EXPECT_EQ(Ask("01000007D1"), "81 03");
  EXPECT_EQ(Ask("03FFFF0002"), "83 02");
  EXPECT_EQ(Ask("0600C80001"), "86 02") << "read-only";
  EXPECT_EQ(Ask("050000FF01"), "85 03");
  EXPECT_EQ(Ask("64"), "E4 01");
  EXPECT_EQ(Ask("0800010000"), "88 01");
  EXPECT_EQ(Ask("2B0D0100"), "AB 01");
  EXPECT_EQ(Ask("1000CA0002020005"), "90 03") << "count and bytes contradict each other";
}

TEST_F(ModbusTwinTest, MissingRegistersReadZeroBesideOthers) {
  Make("zero");
  EXPECT_EQ(Ask("0300C70003"), "03 06 00 00 09 C4 00 00");
  EXPECT_EQ(Ask("0301C80001"), "83 02") << "all of them are missing";
  EXPECT_EQ(Ask("1000C90002040001002A"), "10 00 C9 00 02");
  EXPECT_EQ(values_.values[1], Value(std::uint64_t{42}));
  EXPECT_EQ(Ask("0600C80005"), "06 00 C8 00 05") << "ignored";
  EXPECT_EQ(Ask("0300C80001"), "03 02 09 C4");
  EXPECT_EQ(Ask("0601C80005"), "86 02");
}

TEST_F(ModbusTwinTest, WhatIsWrittenIsReadLater) {
  Make();
  EXPECT_EQ(Ask("0600CA0055"), "06 00 CA 00 55");
  EXPECT_EQ(Ask("0300CA0001"), "03 02 00 55");
  EXPECT_EQ(Ask("1000CC0002040003 0004"), "10 00 CC 00 02");
  EXPECT_EQ(Ask("0300CC0002"), "03 04 00 03 00 04");
  EXPECT_EQ(Ask("0600CD0009"), "06 00 CD 00 09") << "half of a value";
  EXPECT_EQ(values_.values[2], Value(std::uint64_t{0x00030009}));
  EXPECT_EQ(Ask("1600CA00F00005"), "16 00 CA 00 F0 00 05");
  EXPECT_EQ(Ask("0300CA0001"), "03 02 00 55") << "55 & F0 | 05";
  EXPECT_EQ(Ask("050000FF00"), "05 00 00 FF 00");
  EXPECT_EQ(Ask("0F0000000201 01"), "0F 00 00 00 02");
  EXPECT_EQ(Ask("0100000002"), "01 01 01");
  EXPECT_EQ(Ask("1700CA0001 00CA0001020007"), "17 02 00 07") << "written first, then read";
  EXPECT_EQ(Ask("0600080002"), "06 00 08 00 02");
  EXPECT_EQ(values_.values[5], Value(std::uint64_t{2}));
  EXPECT_EQ(Ask("06012C0004"), "06 01 2C 00 04");
  EXPECT_EQ(values_.values[11], Value(true)) << "a view of the same register";
}

TEST_F(ModbusTwinTest, LoopbackAndIdentification) {
  Make();
  EXPECT_EQ(Ask("080000A55A"), "08 00 00 A5 5A");
  EXPECT_EQ(Ask("0800000102030405"), "08 00 00 01 02 03 04 05");
  const Bytes identity = AskTwin(*twin_, Hex("2B0E0100"));
  EXPECT_NE(AsText(identity).find("baudgate"), std::string_view::npos);
  EXPECT_NE(AsText(identity).find("Test Device"), std::string_view::npos);
  const auto length = ReplyLength(identity);
  EXPECT_EQ(length.kind, PduLength::Kind::exact);
  EXPECT_EQ(length.size, identity.size());
  EXPECT_EQ(Ask("2B0E0400"), "2B 0E 04 81 00 00 01 00 08 62 61 75 64 67 61 74 65");
  EXPECT_EQ(Ask("2B0E0409"), "AB 02");
}

TEST_F(ModbusTwinTest, SilentOnDamageAndOtherAddresses) {
  Make();
  const Bytes good = Wrap(Framing::rtu, 20, Hex("0300C80001"));
  EXPECT_FALSE(twin_->Answer(good, Instant{}).empty());
  for (std::size_t i = 0; i < good.size(); ++i) {
    Bytes damaged = good;
    damaged[i] ^= 1;
    EXPECT_TRUE(twin_->Answer(damaged, Instant{}).empty());
  }
  EXPECT_TRUE(twin_->Answer(Wrap(Framing::rtu, 21, Hex("0300C80001")), Instant{}).empty());
  EXPECT_TRUE(twin_->Answer(Wrap(Framing::rtu, 20, Hex("8302")), Instant{}).empty());
}

TEST_F(ModbusTwinTest, ABroadcastIsDoneAndNotAnswered) {
  Make();
  EXPECT_TRUE(twin_->Answer(Wrap(Framing::rtu, 0, Hex("0600CA0055")), Instant{}).empty());
  EXPECT_EQ(values_.values[1], Value(std::uint64_t{0x55}));
}

TEST_F(ModbusTwinTest, NoRequestBreaksIt) {
  Make("zero");
  std::uint32_t state = 1;
  for (int round = 0; round < 20000; ++round) {
    Bytes pdu(1 + round % 20);
    for (std::uint8_t& byte : pdu) {
      state = state * 1664525U + 1013904223U;
      byte = static_cast<std::uint8_t>(state >> 24U);
    }
    constexpr std::uint8_t kKnown[] = {1, 2, 3, 4, 5, 6, 8, 15, 16, 22, 23, 43};
    pdu[0] = kKnown[static_cast<std::size_t>(round) % std::size(kKnown)];
    const Bytes reply = twin_->Answer(Wrap(Framing::rtu, 20, pdu), Instant{});
    EXPECT_GE(reply.size(), 5U);
    EXPECT_LE(reply.size(), kMaxRtu);
  }
}

}  // namespace
}  // namespace baudgate::protocols::modbus
