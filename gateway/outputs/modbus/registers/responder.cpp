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
  // A packet socket preserves message boundaries, so one read returns one whole reply.
  const int kind = SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC;
  if (::socketpair(AF_UNIX, kind, 0, pair_.data()) != 0) {
    ready_ = Error{"no sockets can be opened for Modbus replies; raise LimitNOFILE of the service"};
    return;
  }
  // modbus_reply sleeps for the response timeout before it sends an exception of its own, so the
  // timeout is the shortest possible: 1 us.
  modbus_set_response_timeout(library_->context, 0, 1);
}

Responder::~Responder() {
  for (const int end : pair_) {
    if (end >= 0) ::close(end);
  }
}

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

bool Responder::Append(const ModbusRequest& request, Bytes& out) {
  if (Reply(request, pair_[0]) < 0) return false;
  std::array<std::uint8_t, kMaxAdu> answer;
  const ssize_t size = ::recv(pair_[1], answer.data(), answer.size(), 0);
  if (size <= 0) return false;
  baudgate::Append(out, View(answer).first(static_cast<std::size_t>(size)));
  return true;
}

}  // namespace baudgate::modbus
