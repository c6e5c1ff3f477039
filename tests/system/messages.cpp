// SPDX-License-Identifier: Apache-2.0
#include "tests/system/messages.h"

namespace baudgate::system_test {
namespace {

constexpr std::size_t kHeader = 7;

std::uint16_t WordAt(View bytes, std::size_t place) {
  return static_cast<std::uint16_t>(bytes[place] << 8U | bytes[place + 1]);
}

void AppendWord(Bytes& to, std::size_t word) {
  to.push_back(static_cast<std::uint8_t>(word >> 8U & 0xFFU));
  to.push_back(static_cast<std::uint8_t>(word & 0xFFU));
}

Bytes Pdu(std::uint8_t function, std::uint16_t first, std::uint16_t second) {
  Bytes pdu = {function};
  AppendWord(pdu, first);
  AppendWord(pdu, second);
  return pdu;
}

}  // namespace

Bytes FrameOf(const Message& message) {
  Bytes frame;
  AppendWord(frame, message.transaction);
  AppendWord(frame, 0);
  AppendWord(frame, 1 + message.pdu.size());
  frame.push_back(message.unit);
  Append(frame, message.pdu);
  return frame;
}

void Send(const RawClient& client, const Message& message) { client.Send(FrameOf(message)); }

std::optional<Message> Receive(const RawClient& client) {
  const Bytes frame = client.ReceiveFrame();
  if (frame.size() <= kHeader) return std::nullopt;
  return Message{WordAt(frame, 0), frame[kHeader - 1], Bytes(frame.begin() + kHeader, frame.end())};
}

Message ReadRequest(std::uint16_t transaction, std::uint8_t unit, std::uint16_t address,
                    std::uint16_t count) {
  return {transaction, unit, Pdu(3, address, count)};
}

Message WriteRequest(std::uint16_t transaction, std::uint8_t unit, std::uint16_t address,
                     std::uint16_t value) {
  return {transaction, unit, Pdu(6, address, value)};
}

int ExceptionIn(const Message& message) {
  return message.pdu.size() == 2 && message.pdu[0] >= 0x80 ? message.pdu[1] : 0;
}

std::vector<std::uint16_t> RegistersIn(const Message& message) {
  std::vector<std::uint16_t> registers;
  const Bytes& pdu = message.pdu;
  if (pdu.size() < 2 || pdu[0] != 3 || pdu.size() != 2U + pdu[1]) return registers;
  for (std::size_t i = 2; i + 1 < pdu.size(); i += 2) registers.push_back(WordAt(pdu, i));
  return registers;
}

}  // namespace baudgate::system_test
