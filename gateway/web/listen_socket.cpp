// SPDX-License-Identifier: Apache-2.0
#include "gateway/web/listen_socket.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>

namespace baudgate::web {
namespace {

constexpr int kBacklog = 512;

struct Address {
  sockaddr_storage storage{};
  socklen_t size = 0;
};

Address AddressOf(const config::HostPort& at) {
  Address address;
  if (config::IsIpv4(at.host)) {
    sockaddr_in four{};
    four.sin_family = AF_INET;
    four.sin_port = htons(at.port);
    ::inet_pton(AF_INET, at.host.c_str(), &four.sin_addr);
    std::memcpy(&address.storage, &four, sizeof(four));
    address.size = sizeof(four);
  } else {
    sockaddr_in6 six{};
    six.sin6_family = AF_INET6;
    six.sin6_port = htons(at.port);
    ::inet_pton(AF_INET6, at.host.c_str(), &six.sin6_addr);
    std::memcpy(&address.storage, &six, sizeof(six));
    address.size = sizeof(six);
  }
  return address;
}

std::string Explain(const config::Web& web, int error) {
  std::string text = "web: " + web.Place() + ": " + std::strerror(error);
  if (error == EADDRINUSE) text += "; another program has the port: choose one with web.listen";
  if (error == EACCES) text += "; ports below 1024 need the shipped service or the capability";
  if (error == EADDRNOTAVAIL) text += "; no interface of this machine has the address";
  return text;
}

}  // namespace

ListenSocket::~ListenSocket() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

std::uint16_t ListenSocket::port() const {
  sockaddr_storage storage{};
  socklen_t size = sizeof(storage);
  if (::getsockname(descriptor_, reinterpret_cast<sockaddr*>(&storage), &size) != 0) return 0;
  sockaddr_in6 six{};
  std::memcpy(&six, &storage, sizeof(six));
  return ntohs(six.sin6_port);  // at the same place as of IPv4
}

Result<ListenSocket> ListenSocket::Open(const config::Web& web) {
  const Address address = AddressOf(web.listen);
  ListenSocket opened(
      ::socket(address.storage.ss_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const int on = 1;
  const auto* const where = reinterpret_cast<const sockaddr*>(&address.storage);
  if (!opened.is_open() ||
      ::setsockopt(opened.descriptor_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on)) != 0 ||
      ::bind(opened.descriptor_, where, address.size) != 0 ||
      ::listen(opened.descriptor_, kBacklog) != 0) {
    return Error{Explain(web, errno)};
  }
  return opened;
}

}  // namespace baudgate::web
