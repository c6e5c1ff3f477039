// RTU frames of clients: every cut, damage, silence, and how replies are framed.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "gateway/base/text.h"
#include "gateway/outputs/modbus/wire/request.h"
#include "protocols/modbus/protocol.h"

namespace baudgate::modbus {
namespace {

using FramingState = ClientFraming::State;

class RtuFramingTest : public testing::Test {
 protected:
  static Bytes Rtu(std::uint8_t slave, const std::string& pdu) {
    return ModbusRtuProtocol().carrier->wrap(slave, ParseHex(pdu).value());
  }
  void Put(View bytes) {
    while (!bytes.empty()) {
      const auto space = framing_.Space();
      ASSERT_FALSE(space.empty());
      const std::size_t count = std::min(space.size(), bytes.size());
      std::copy_n(bytes.begin(), count, space.begin());
      framing_.Commit(count);
      bytes = bytes.subspan(count);
    }
  }
  /// Hex of the next frame, or "need more".
  std::string Take() {
    View frame;
    const FramingState peeked = framing_.Peek();
    EXPECT_EQ(framing_.Take(frame), peeked);
    return peeked == FramingState::frame ? ToHex(frame) : "need more";
  }

  SerialFraming framing_{ModbusRtuProtocol()};
};

TEST_F(RtuFramingTest, EveryCutOfEveryFunctionGivesTheModbusTcpForm) {
  for (const char* pdu : {"03 01 F4 00 01", "06 00 08 00 02", "10 00 01 00 02 04 00 0A 01 02",
                          "0F 00 13 00 0A 02 CD 01", "16 00 04 00 F2 00 25", "2B 0E 01 00",
                          "17 00 03 00 06 00 0E 00 01 02 00 FF", "08 00 00 A5 37"}) {
    const Bytes frame = Rtu(20, pdu);
    const std::string expected = ToHex(AduOf(0, 20, ParseHex(pdu).value()));
    for (std::size_t cut = 0; cut < frame.size(); ++cut) {
      Put(View(frame).first(cut));
      ASSERT_EQ(Take(), "need more") << pdu << " cut at " << cut;
      Put(View(frame).subspan(cut));
      ASSERT_EQ(Take(), expected) << pdu << " cut at " << cut;
      ASSERT_EQ(Take(), "need more");
    }
  }
}

TEST_F(RtuFramingTest, FramesInOneGoComeOneAfterTheOther) {
  Bytes both = Rtu(20, "03 01 F4 00 01");
  Append(both, View(Rtu(21, "06 00 08 00 02")));
  Put(both);
  View first;
  ASSERT_EQ(framing_.Take(first), FramingState::frame);
  ASSERT_EQ(framing_.Peek(), FramingState::frame);
  EXPECT_EQ(ToHex(first), "00 00 00 00 00 06 14 03 01 F4 00 01") << "valid after Peek";
  EXPECT_EQ(Take(), "00 00 00 00 00 06 15 06 00 08 00 02");
}

TEST_F(RtuFramingTest, ADamagedFrameIsDroppedAndTheNextOneFound) {
  const Bytes good = Rtu(20, "03 01 F4 00 01");
  for (std::size_t at = 0; at < good.size(); ++at) {
    Bytes damaged = good;
    damaged[at] ^= 0x10;
    Put(damaged);
    Take();
    framing_.Settle();
    ASSERT_EQ(Take(), "need more") << "damaged at " << at;
    Put(good);
    ASSERT_EQ(Take(), "00 00 00 00 00 06 14 03 01 F4 00 01") << "damaged at " << at;
  }
}

TEST_F(RtuFramingTest, SilenceDropsHalfAFrame) {
  const Bytes block = Rtu(20, "10 00 01 00 02 04 00 0A 01 02");
  Put(View(block).first(7));
  EXPECT_EQ(Take(), "need more");
  framing_.Settle();
  EXPECT_EQ(Take(), "need more");
  Put(Rtu(20, "03 01 F4 00 01"));
  EXPECT_EQ(Take(), "00 00 00 00 00 06 14 03 01 F4 00 01");
}

TEST_F(RtuFramingTest, SilenceEndsAFrameOfUnknownLength) {
  Put(Rtu(20, "64 DE AD BE EF 01"));
  EXPECT_EQ(Take(), "need more");
  framing_.Settle();
  EXPECT_EQ(Take(), "00 00 00 00 00 07 14 64 DE AD BE EF 01");
}

TEST_F(RtuFramingTest, MemoryIsBoundedWhileNothingIsTaken) {
  const Bytes frame = Rtu(20, "03 01 F4 00 01");
  std::size_t put = 0;
  while (!framing_.Space().empty()) {
    const auto space = framing_.Space();
    const std::size_t count = std::min(space.size(), frame.size());
    std::copy_n(frame.begin(), count, space.begin());
    framing_.Commit(count);
    ++put;
  }
  EXPECT_EQ(put, 128U);
  for (std::size_t i = 0; i < put; ++i) {
    ASSERT_EQ(Take(), "00 00 00 00 00 06 14 03 01 F4 00 01");
  }
  EXPECT_EQ(Take(), "need more");
  EXPECT_FALSE(framing_.Space().empty());
}

TEST_F(RtuFramingTest, RepliesHaveAddressAndCrc) {
  Bytes out = {0xAA};
  framing_.Append(out, AduOf(0x1234, 20, ParseHex("03 02 09 C4").value()));
  EXPECT_EQ(ToHex(out), "AA 14 03 02 09 C4 B2 44");
  EXPECT_TRUE(framing_.one_at_a_time());
}

}  // namespace
}  // namespace baudgate::modbus
