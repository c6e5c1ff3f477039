// This file alone calls libmodbus.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/registers/responder.h"

#include <modbus.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>

namespace baudgate::modbus {

struct Responder::Library {
  modbus_t* context = modbus_new_tcp(nullptr, 0);  // never connected: only its encoder is used
  modbus_mapping_t mapping{};

  Library() = default;
  ~Library() { modbus_free(context); }
  Library(const Library&) = delete;
  Library& operator=(const Library&) = delete;
};

Responder::Responder() : library_(std::make_unique<Library>()) {
  if (library_->context == nullptr) {
    ready_ = Error{"there is not enough memory for libmodbus"};
    return;
  }
  // modbus_reply sleeps for the response timeout before it sends an exception of its own, so the
  // timeout is the shortest possible: 1 us.
  modbus_set_response_timeout(library_->context, 0, 1);
}

Responder::~Responder() = default;

int Responder::Reply(const ModbusRequest& request, int socket) {
  modbus_mapping_t& mapping = library_->mapping;
  mapping = {};
  const int start = request.start;
  const int count = request.count;
  if (request.table() == config::Table::bits) {
    mapping.start_bits = mapping.start_input_bits = start;
    mapping.nb_bits = mapping.nb_input_bits = count;
    mapping.tab_bits = mapping.tab_input_bits = bits_.data();
  } else {
    mapping.start_registers = mapping.start_input_registers = start;
    mapping.nb_registers = mapping.nb_input_registers = count;
    mapping.tab_registers = mapping.tab_input_registers = registers_.data();
  }
  modbus_set_socket(library_->context, socket);
  return modbus_reply(library_->context, request.frame.data(),
                      static_cast<int>(request.frame.size()), &mapping);
}

Responder::Sent Responder::Send(const ModbusRequest& request, int socket) {
  if (Reply(request, socket) >= 0) return Sent::whole;
  if (errno == EAGAIN || errno == EWOULDBLOCK) return Sent::would_block;
  return errno == EMBBADDATA ? Sent::cut : Sent::failed;
}

void Responder::Append(const ModbusRequest& request, Bytes& out) const {
  const std::size_t count = request.count;
  const bool is_bits = request.table() == config::Table::bits;
  const std::size_t size = is_bits ? (count + 7) / 8 : 2 * count;
  constexpr std::size_t kAfterLength = 3;  // unit, function and the number of bytes
  const auto append_u16 = [&out](std::size_t number) {
    out.push_back(static_cast<std::uint8_t>(number >> 8U));
    out.push_back(static_cast<std::uint8_t>(number));
  };
  baudgate::Append(out, request.frame.first(4));
  append_u16(kAfterLength + size);
  out.insert(out.end(), {request.unit, request.function, static_cast<std::uint8_t>(size)});
  if (!is_bits) {
    for (std::size_t i = 0; i < count; ++i) append_u16(registers_[i]);
    return;
  }
  for (std::size_t first = 0; first < count; first += 8) {
    std::uint8_t byte = 0;
    for (std::size_t bit = 0; bit < 8 && first + bit < count; ++bit) {
      if (bits_[first + bit] != 0) byte |= static_cast<std::uint8_t>(1U << bit);
    }
    out.push_back(byte);
  }
}

}  // namespace baudgate::modbus
