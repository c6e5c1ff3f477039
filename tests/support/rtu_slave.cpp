// SPDX-License-Identifier: Apache-2.0
#include "tests/support/rtu_slave.h"

#include <poll.h>
#include <unistd.h>

#include <array>
#include <utility>

#include "gateway/base/bytes.h"

namespace baudgate {
namespace {

constexpr int kPollMilliseconds = 20;
constexpr std::size_t kCrc = 2;

/// Returns the length of a request (of the functions that tests use); 0: more bytes are needed.
std::size_t RequestLength(View held) {
  if (held.size() < 7) return 0;
  const bool counted = held[1] == 15 || held[1] == 16;
  return counted ? 7 + held[6] + kCrc : 8;
}

}  // namespace

Bytes RtuFrame(std::uint8_t unit, View pdu) {
  Bytes frame = {unit};
  Append(frame, pdu);
  AppendCrc16(frame);
  return frame;
}

std::uint16_t AddressOf(View request) {
  return static_cast<std::uint16_t>(request[2] << 8U | request[3]);
}

Bytes RegistersReply(View request, std::uint16_t base) {
  const unsigned count = static_cast<unsigned>(request[4] << 8U | request[5]);
  Bytes pdu = {request[1], static_cast<std::uint8_t>(2 * count)};
  for (unsigned i = 0; i < count; ++i) {
    const unsigned value = base + AddressOf(request) + i;
    pdu.push_back(static_cast<std::uint8_t>(value >> 8U & 0xFFU));
    pdu.push_back(static_cast<std::uint8_t>(value & 0xFFU));
  }
  return RtuFrame(request[0], pdu);
}

ScriptedSlave::ScriptedSlave(const std::string& link, Script script) : script_(std::move(script)) {
  auto pty = tools::Pty::Create(link);
  if (!pty.ok()) return;
  pty_ = std::make_unique<tools::Pty>(std::move(*pty));
  thread_ = std::thread([this] { Run(); });
}

ScriptedSlave::~ScriptedSlave() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
}

std::vector<Bytes> ScriptedSlave::heard() const {
  const std::lock_guard lock(mutex_);
  return heard_;
}

void ScriptedSlave::Run() {
  Bytes held;
  while (!stop_) {
    pollfd waited = {pty_->master(), POLLIN, 0};
    ::poll(&waited, 1, kPollMilliseconds);
    std::array<std::uint8_t, 1024> buffer;
    const ssize_t count = ::read(pty_->master(), buffer.data(), buffer.size());
    if (count > 0) Append(held, View(buffer).first(static_cast<std::size_t>(count)));
    std::size_t length = 0;
    while ((length = RequestLength(held)) > 0 && held.size() >= length) {
      const auto end = held.begin() + static_cast<std::ptrdiff_t>(length);
      const Bytes request(held.begin(), end);
      held.erase(held.begin(), end);
      if (EndsInCrc16(request)) Handle(request);
    }
  }
}

void ScriptedSlave::Handle(const Bytes& request) {
  {
    const std::lock_guard lock(mutex_);
    heard_.push_back(request);
  }
  for (const Piece& piece : script_(request)) {
    std::this_thread::sleep_for(piece.after);
    [[maybe_unused]] const ssize_t written =
        ::write(pty_->master(), piece.bytes.data(), piece.bytes.size());
  }
}

}  // namespace baudgate
