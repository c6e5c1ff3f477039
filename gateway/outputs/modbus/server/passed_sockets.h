// Listening sockets that systemd has opened for this process (a .socket unit), each for the
// listener of the same address. https://www.freedesktop.org/software/systemd/man/sd_listen_fds.html
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/ip/tcp.hpp>
#include <optional>
#include <vector>

namespace baudgate::modbus {

class PassedSockets {
 public:
  /// Takes what the environment tells of, and clears it: children get none of it.
  PassedSockets();
  /// Closes those that no listener has taken, and names them in the log.
  ~PassedSockets();
  PassedSockets(const PassedSockets&) = delete;
  PassedSockets& operator=(const PassedSockets&) = delete;

  /// The descriptor that listens at exactly this address, which is the caller's from now on.
  std::optional<int> Take(const asio::ip::tcp::endpoint& endpoint);

 private:
  struct Passed {
    int descriptor;
    asio::ip::tcp::endpoint endpoint;
  };
  std::vector<Passed> passed_;
};

}  // namespace baudgate::modbus
