// Characters as a receiver with another bit rate reads them.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <random>
#include <string>
#include <vector>

#include "gateway/base/text.h"
#include "gateway/diagnosis/damage/changed_bytes.h"

namespace baudgate {
namespace {

/// Ten bits a character, without pauses; read `per_bit` times as fast. A character whose stop bit
/// is missing is an FF, as of our ports; the bit is taken for the next start bit, as UARTs do.
Bytes Received(std::string_view text, double per_bit) {
  std::vector<bool> wire;
  for (const char character : text) {
    wire.push_back(false);
    for (unsigned bit = 0; bit < 8; ++bit) {
      wire.push_back((static_cast<unsigned char>(character) >> bit & 1U) != 0);
    }
    wire.push_back(true);
  }
  const auto sample = [&](double at) {
    const auto bit = static_cast<std::size_t>(at / per_bit);
    return bit >= wire.size() || wire[bit];
  };
  Bytes read;
  const double end = static_cast<double>(wire.size()) * per_bit;
  for (double at = 0; at < end;) {
    if (sample(at)) {
      at += 0.25;
      continue;
    }
    unsigned byte = 0;
    for (unsigned bit = 0; bit < 8; ++bit) {
      if (sample(at + 1.5 + bit)) byte |= 1U << bit;
    }
    const bool stops = sample(at + 9.5);
    read.push_back(static_cast<std::uint8_t>(stops ? byte : 0xFF));
    at += stops ? 9.5 : 9;
  }
  return read;
}

TEST(OtherBitRate, HalfAndTwiceAreTold) {
  for (const char* text : {">+02.500+03.100+00.000+00.001\r", "<1D:0.52/0.50/0.51:7F\r\n",
                           ":010304006400C8CB\r\n", "$GPGGA,123519,4807.038,N\r\n"}) {
    const auto slow = OtherBitRate(Received(text, 2), false);
    ASSERT_TRUE(slow) << text;
    EXPECT_EQ(slow->cause, "its characters come at half the bit rate that is set here");
    const auto fast = OtherBitRate(Received(text, 0.5), true);
    ASSERT_TRUE(fast) << text;
    EXPECT_EQ(fast->cause, "its characters come at twice the bit rate that is set here");
    EXPECT_THAT(fast->remedy, ::testing::HasSubstr("serial server"));
    EXPECT_FALSE(OtherBitRate(ToBytes(text), false)) << text;
  }
}

TEST(OtherBitRate, NothingElseIsTakenForIt) {
  EXPECT_FALSE(OtherBitRate({}, false));
  EXPECT_FALSE(OtherBitRate(Bytes(30, 0x00), false)) << "a line that nobody drives";
  EXPECT_FALSE(OtherBitRate(Bytes(30, 0xFF), false));
  EXPECT_FALSE(OtherBitRate(Bytes(30, 0x78), false)) << "one value";
  std::minstd_rand random(1);
  int taken = 0;
  for (int i = 0; i < 1000; ++i) {
    Bytes noise(20);
    for (std::uint8_t& byte : noise) byte = static_cast<std::uint8_t>(random() >> 7U);
    if (OtherBitRate(noise, false)) ++taken;
  }
  EXPECT_EQ(taken, 0);
}

}  // namespace
}  // namespace baudgate
