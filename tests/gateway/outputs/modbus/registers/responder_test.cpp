// Tests that a reply has the same bytes whether libmodbus sends it or the responder appends it.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/registers/responder.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <random>

#include "tests/gateway/outputs/modbus/registers/points.h"

namespace baudgate::modbus {
namespace {

TEST(Responder, AppendsTheBytesThatLibmodbusSends) {
  Responder responder;
  ASSERT_TRUE(responder.ready());
  int pair[2];
  ASSERT_EQ(::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK, 0, pair), 0);
  std::mt19937 random(1);
  for (std::uint16_t& one : responder.registers()) one = static_cast<std::uint16_t>(random());
  for (std::uint8_t& one : responder.bits()) one = random() % 2;
  for (const std::uint8_t function : std::initializer_list<std::uint8_t>{1, 2, 3, 4}) {
    const std::size_t most = function <= 2 ? kMostBits : kMostRegisters;
    for (std::size_t count = 1; count <= most; ++count) {
      const auto start = static_cast<std::uint16_t>(random() % (65536 - count));
      const Bytes frame = AduOf(
          static_cast<std::uint16_t>(random()), static_cast<std::uint8_t>(random()),
          Bytes{function, static_cast<std::uint8_t>(start >> 8U), static_cast<std::uint8_t>(start),
                static_cast<std::uint8_t>(count >> 8U), static_cast<std::uint8_t>(count)});
      ModbusRequest request;
      ASSERT_EQ(ParseRequest(frame, request), kNoException);
      ASSERT_EQ(responder.Send(request, pair[0]), Responder::Sent::whole);
      Bytes sent(kMaxAdu);
      sent.resize(static_cast<std::size_t>(::recv(pair[1], sent.data(), sent.size(), 0)));
      Bytes appended;
      responder.Append(request, appended);
      ASSERT_EQ(ToHex(appended), ToHex(sent)) << "function " << int{function} << ", " << count;
      ASSERT_EQ(appended.size(), ReplySize(request));
    }
  }
  ::close(pair[0]);
  ::close(pair[1]);
}

}  // namespace
}  // namespace baudgate::modbus
