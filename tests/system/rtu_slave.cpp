// Serves requests on threads.
// SPDX-License-Identifier: Apache-2.0
#include "tests/system/rtu_slave.h"

#include <modbus/modbus.h>
#include <poll.h>
#include <unistd.h>

#include <array>

#include "gateway/base/checksum.h"

namespace baudgate::system_test {
namespace {

constexpr int kPollMilliseconds = 20;
constexpr std::uint32_t kIndicationMicroseconds = 50'000;
constexpr std::size_t kCrc = 2;

/// Of the functions that tests use; 0: not yet known.
std::size_t RequestLength(View held) {
  if (held.size() < 7) return 0;
  const bool counted = held[1] == 15 || held[1] == 16;
  return counted ? 7 + held[6] + kCrc : 8;
}

bool HasGoodCrc(View frame) {
  const std::uint16_t crc = Crc16(frame.first(frame.size() - kCrc));
  return frame[frame.size() - 2] == (crc & 0xFFU) && frame[frame.size() - 1] == crc >> 8U;
}

}  // namespace

// ---------------------------------------------------------------- libmodbus

std::unique_ptr<LibmodbusSlave> LibmodbusSlave::OnTty(const std::string& tty, int unit) {
  modbus_t* const context = modbus_new_rtu(tty.c_str(), 19200, 'N', 8, 1);
  modbus_set_slave(context, unit);
  return std::unique_ptr<LibmodbusSlave>(new LibmodbusSlave(context, false));
}

std::unique_ptr<LibmodbusSlave> LibmodbusSlave::OnTcp(std::uint16_t port) {
  modbus_t* const context = modbus_new_tcp("127.0.0.1", port);
  return std::unique_ptr<LibmodbusSlave>(new LibmodbusSlave(context, true));
}

LibmodbusSlave::LibmodbusSlave(modbus_t* context, bool tcp)
    : context_(context), memory_(modbus_mapping_new(kSize, kSize, kSize, kSize)), tcp_(tcp) {
  for (int i = 0; i < kSize; ++i) {
    memory_->tab_bits[i] = i % 3 == 0;
    memory_->tab_input_bits[i] = i % 5 == 0;
    memory_->tab_registers[i] = static_cast<std::uint16_t>(1000 + i);
    memory_->tab_input_registers[i] = static_cast<std::uint16_t>(2000 + i);
  }
  // Of requests that it does not know it rests for this time before it refuses them.
  modbus_set_response_timeout(context_, 0, 1);
  modbus_set_indication_timeout(context_, 0, kIndicationMicroseconds);
  if (tcp_) listening_ = modbus_tcp_listen(context_, 1);
  connected_ = tcp_ ? listening_ >= 0 : modbus_connect(context_) == 0;
  if (connected_) thread_ = std::thread([this] { Run(); });
}

LibmodbusSlave::~LibmodbusSlave() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
  if (!tcp_ || client_ >= 0) modbus_close(context_);
  if (listening_ >= 0) ::close(listening_);
  modbus_mapping_free(memory_);
  modbus_free(context_);
}

bool LibmodbusSlave::HasClient() {
  if (!tcp_ || client_ >= 0) return true;
  pollfd waited = {listening_, POLLIN, 0};
  if (::poll(&waited, 1, kPollMilliseconds) <= 0) return false;
  client_ = modbus_tcp_accept(context_, &listening_);
  return client_ >= 0;
}

void LibmodbusSlave::Run() {
  std::array<std::uint8_t, MODBUS_TCP_MAX_ADU_LENGTH> request;
  while (!stop_) {
    if (!HasClient()) continue;
    const int length = modbus_receive(context_, request.data());
    if (length > 0) {
      last_unit_ = request[static_cast<std::size_t>(modbus_get_header_length(context_)) - 1];
      modbus_reply(context_, request.data(), length, memory_);
    } else if (tcp_ && length < 0 && errno != ETIMEDOUT) {
      modbus_close(context_);
      client_ = -1;
    }
  }
}

// ---------------------------------------------------------------- scripted

Bytes RtuFrame(std::uint8_t unit, View pdu) {
  Bytes frame = {unit};
  Append(frame, pdu);
  const std::uint16_t crc = Crc16(frame);
  frame.push_back(static_cast<std::uint8_t>(crc & 0xFFU));
  frame.push_back(static_cast<std::uint8_t>(crc >> 8U));
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
  auto pty = Pty::Create(link);
  if (!pty.ok()) return;
  pty_ = std::make_unique<Pty>(std::move(*pty));
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
    const std::size_t length = RequestLength(held);
    if (length == 0 || held.size() < length) continue;
    const Bytes request(held.begin(), held.begin() + static_cast<std::ptrdiff_t>(length));
    held.erase(held.begin(), held.begin() + static_cast<std::ptrdiff_t>(length));
    if (HasGoodCrc(request)) Handle(request);
  }
}

void ScriptedSlave::Handle(const Bytes& request) {
  {
    const std::lock_guard lock(mutex_);
    heard_.push_back(request);
  }
  for (const Piece& piece : script_(request)) {
    std::this_thread::sleep_for(piece.after);
    // A pty holds far more than one frame.
    [[maybe_unused]] const ssize_t written =
        ::write(pty_->master(), piece.bytes.data(), piece.bytes.size());
  }
}

}  // namespace baudgate::system_test
