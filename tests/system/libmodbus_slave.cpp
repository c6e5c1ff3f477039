// SPDX-License-Identifier: Apache-2.0
#include "tests/system/libmodbus_slave.h"

#include <modbus/modbus.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <cerrno>

#include "tests/system/child.h"

namespace baudgate::system_test {
namespace {

constexpr std::uint32_t kIndicationMicroseconds = 50'000;

}  // namespace

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
  // libmodbus waits this long before it refuses an unknown request.
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

}  // namespace baudgate::system_test
