// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/server/passed_sockets.h"

#include <sys/socket.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <algorithm>
#include <sstream>

#include "gateway/base/log.h"

namespace baudgate::modbus {
namespace {

using asio::ip::tcp;

std::optional<tcp::endpoint> EndpointOf(int descriptor) {
  tcp::endpoint endpoint;
  auto size = static_cast<socklen_t>(endpoint.capacity());
  if (::getsockname(descriptor, endpoint.data(), &size) != 0) return std::nullopt;
  const auto family = endpoint.data()->sa_family;
  if (family != AF_INET && family != AF_INET6) return std::nullopt;
  endpoint.resize(size);
  return endpoint;
}

std::string TextOf(const tcp::endpoint& endpoint) {
  std::ostringstream text;
  text << endpoint;
  return text.str();
}

}  // namespace

PassedSockets::PassedSockets() {
  const int count = sd_listen_fds(1);
  for (int fd = SD_LISTEN_FDS_START; fd < SD_LISTEN_FDS_START + count; ++fd) {
    const bool listens = sd_is_socket(fd, AF_UNSPEC, SOCK_STREAM, 1) > 0;
    const auto endpoint = listens ? EndpointOf(fd) : std::nullopt;
    if (endpoint) {
      passed_.push_back({fd, *endpoint});
    } else {
      log::Warn(
          "modbus: systemd has passed descriptor {}, which is no listening TCP socket; closed", fd);
      ::close(fd);
    }
  }
}

PassedSockets::~PassedSockets() {
  for (const Passed& one : passed_) {
    log::Warn(
        "modbus: systemd has passed a socket at {}, which is no address of modbus.listen; closed. "
        "Give baudgate.socket and modbus.listen the same addresses",
        TextOf(one.endpoint));
    ::close(one.descriptor);
  }
}

std::optional<int> PassedSockets::Take(const tcp::endpoint& endpoint) {
  const auto found = std::ranges::find(passed_, endpoint, &Passed::endpoint);
  if (found == passed_.end()) return std::nullopt;
  const int descriptor = found->descriptor;
  passed_.erase(found);
  return descriptor;
}

}  // namespace baudgate::modbus
