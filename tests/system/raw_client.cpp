// Frames over a blocking socket with a deadline.
// SPDX-License-Identifier: Apache-2.0
#include "tests/system/raw_client.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>

namespace baudgate::system_test {
namespace {

constexpr std::size_t kHeader = 6;  // transaction, protocol, length

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

RawClient::RawClient(std::uint16_t port)
    : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    ::close(socket_);
    socket_ = -1;
  }
}

RawClient::~RawClient() {
  if (socket_ >= 0) ::close(socket_);
}

void RawClient::Send(const Message& message) {
  Bytes frame;
  AppendWord(frame, message.transaction);
  AppendWord(frame, 0);
  AppendWord(frame, 1 + message.pdu.size());
  frame.push_back(message.unit);
  Append(frame, message.pdu);
  SendBytes(frame);
}

void RawClient::SendBytes(View bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent <= 0) return;
    bytes = bytes.subspan(static_cast<std::size_t>(sent));
  }
}

std::optional<Message> RawClient::Receive(Duration limit) {
  const Instant deadline = std::chrono::steady_clock::now() + limit;
  for (;;) {
    const std::size_t whole = held_.size() < kHeader ? kHeader : kHeader + WordAt(held_, 4);
    if (held_.size() >= whole && whole > kHeader + 1) {
      Message message{WordAt(held_, 0), held_[kHeader], {}};
      const auto end = held_.begin() + static_cast<std::ptrdiff_t>(whole);
      message.pdu.assign(held_.begin() + kHeader + 1, end);
      held_.erase(held_.begin(), end);
      return message;
    }
    const auto left =
        std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
    pollfd waited = {socket_, POLLIN, 0};
    if (left.count() <= 0 || ::poll(&waited, 1, static_cast<int>(left.count())) <= 0) break;
    std::array<std::uint8_t, 1024> buffer;
    const ssize_t count = ::recv(socket_, buffer.data(), buffer.size(), 0);
    if (count <= 0) break;
    Append(held_, View(buffer).first(static_cast<std::size_t>(count)));
  }
  return std::nullopt;
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
