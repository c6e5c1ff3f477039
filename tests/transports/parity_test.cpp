// Software parity: every character, every single-bit error.
// SPDX-License-Identifier: Apache-2.0
#include "transports/parity.h"

#include <gtest/gtest.h>

namespace baudgate {
namespace {

using config::Parity;

TEST(SoftwareParity, KnownCharacters) {
  EXPECT_EQ(WithParity('A', Parity::even), 0x41);  // two ones
  EXPECT_EQ(WithParity('A', Parity::odd), 0xC1);
  EXPECT_EQ(WithParity('>', Parity::even), 0xBE);  // five ones
  EXPECT_EQ(WithParity('>', Parity::odd), 0x3E);
  EXPECT_EQ(WithParity(0x00, Parity::odd), 0x80);
}

TEST(SoftwareParity, EveryCharacterComesBack) {
  for (const Parity parity : {Parity::even, Parity::odd}) {
    for (int value = 0; value < 128; ++value) {
      const auto character = static_cast<std::uint8_t>(value);
      EXPECT_EQ(WithoutParity(WithParity(character, parity), parity), character);
    }
  }
}

TEST(SoftwareParity, EverySingleBitErrorIsSeen) {
  for (const Parity parity : {Parity::even, Parity::odd}) {
    for (int value = 0; value < 128; ++value) {
      for (int bit = 0; bit < 8; ++bit) {
        const auto damaged = static_cast<std::uint8_t>(
            WithParity(static_cast<std::uint8_t>(value), parity) ^ (1U << bit));
        EXPECT_EQ(WithoutParity(damaged, parity), std::nullopt) << value << " bit " << bit;
      }
    }
  }
}

TEST(SoftwareParity, EighthBitOfTheSenderIsNotSent) {
  EXPECT_EQ(WithParity(0xC1, Parity::even), WithParity(0x41, Parity::even));
}

TEST(SoftwareParity, DamageIsMarkedAndCounted) {
  SoftwareParity parity(Parity::even);
  Bytes wire = parity.Encode(ToBytes(">+12.3\r"));
  wire[3] ^= 0x80;
  Bytes expected = ToBytes(">+12.3\r");
  expected[3] = kDamaged;
  EXPECT_EQ(parity.Decode(wire), expected);
  EXPECT_EQ(parity.errors(), 1U);
}

TEST(SoftwareParity, NoneChangesNothing) {
  SoftwareParity parity;
  const Bytes bytes = {0x00, 0x7F, 0x80, 0xFF};
  EXPECT_EQ(parity.Encode(bytes), bytes);
  EXPECT_EQ(parity.Decode(bytes), bytes);
  EXPECT_EQ(parity.errors(), 0U);
}

TEST(SoftwareParity, PortIsSetToEightNone) {
  config::SerialSettings serial;
  serial.data_bits = 7;
  serial.parity = Parity::even;
  EXPECT_EQ(OnTheWire(serial).ToString(), "9600 7E1");
  serial.software_parity = true;
  EXPECT_EQ(OnTheWire(serial).ToString(), "9600 8N1");
  EXPECT_EQ(OnTheWire(serial).BitsPerCharacter(), serial.BitsPerCharacter());
}

TEST(SoftwareParity, OnlySevenBitsWithParity) {
  config::SerialSettings serial;
  EXPECT_TRUE(CheckSoftwareParity(serial).ok());
  serial.software_parity = true;
  EXPECT_FALSE(CheckSoftwareParity(serial).ok());  // 8N1
  serial.data_bits = 7;
  EXPECT_FALSE(CheckSoftwareParity(serial).ok());  // 7N1
  serial.parity = Parity::odd;
  EXPECT_TRUE(CheckSoftwareParity(serial).ok());
}

}  // namespace
}  // namespace baudgate
