// What one UART hears of another that is set differently.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <numeric>

#include "gateway/base/text.h"
#include "gateway/tools/simulate/twin_port.h"
#include "transports/parity.h"

namespace baudgate {
namespace {

using config::Parity;

config::SerialSettings Format(int baud, int data, Parity parity, int stop = 1) {
  config::SerialSettings serial;
  serial.baud = baud;
  serial.data_bits = data;
  serial.parity = parity;
  serial.stop_bits = stop;
  return serial;
}

/// Every character that has `data` bits.
Bytes Alphabet(int data) {
  Bytes all(std::size_t{1} << static_cast<unsigned>(data));
  std::iota(all.begin(), all.end(), std::uint8_t{0});
  return all;
}

TEST(Uart, EqualSettingsCarryEveryCharacter) {
  for (const int baud : {300, 9600, 115200, 921600}) {
    for (const int data : {7, 8}) {
      for (const Parity parity : {Parity::none, Parity::even, Parity::odd}) {
        const auto serial = Format(baud, data, parity);
        const Received received = ReceiveAs(serial, Alphabet(data), serial);
        EXPECT_EQ(received.bytes, Alphabet(data)) << serial.ToString();
        EXPECT_EQ(received.damaged, 0U);
        EXPECT_TRUE(Understand(serial, serial));
      }
    }
  }
}

TEST(Uart, AClockThatIsTwoPerCentOffIsUnderstood) {
  const auto right = Format(9600, 8, Parity::none);
  const auto fast = Format(9792, 8, Parity::none);
  EXPECT_EQ(ReceiveAs(right, Alphabet(8), fast).bytes, Alphabet(8));
  EXPECT_TRUE(Understand(right, fast));
}

TEST(Uart, AnotherBitRateIsGarbage) {
  const Bytes reply = ToBytes("1D:2.35/0.12/0.00/0.00:4C\r\n");
  for (const int baud : {1200, 2400, 4800, 19200, 38400, 115200}) {
    const auto user = Format(baud, 8, Parity::none);
    const Received received = ReceiveAs(user, reply, Format(9600, 8, Parity::none));
    EXPECT_FALSE(received.bytes.empty()) << baud;
    EXPECT_NE(received.bytes, reply) << baud;
    EXPECT_LE(received.bytes.size(), 5 * reply.size()) << baud;
  }
}

TEST(Uart, WrongParityIsDamage) {
  const Received received =
      ReceiveAs(Format(9600, 8, Parity::odd), Alphabet(8), Format(9600, 8, Parity::even));
  EXPECT_EQ(received.damaged, Alphabet(8).size());
  const Received none =
      ReceiveAs(Format(9600, 8, Parity::none), Alphabet(8), Format(9600, 8, Parity::even));
  EXPECT_GT(none.damaged, 0U);
  EXPECT_NE(none.bytes, Alphabet(8));
}

TEST(Uart, SevenBitsWithParityAreEightWithout) {
  const auto seven = Format(9600, 7, Parity::even);
  const auto eight = Format(9600, 8, Parity::none);
  Bytes with_parity;
  for (const std::uint8_t byte : Alphabet(7)) {
    with_parity.push_back(WithParity(byte, Parity::even));
  }
  EXPECT_EQ(ReceiveAs(eight, Alphabet(7), seven).bytes, with_parity);
  const Received back = ReceiveAs(seven, with_parity, eight);
  EXPECT_EQ(back.bytes, Alphabet(7));
  EXPECT_EQ(back.damaged, 0U);
}

}  // namespace
}  // namespace baudgate
