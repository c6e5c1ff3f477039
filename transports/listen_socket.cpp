// SPDX-License-Identifier: Apache-2.0
#include "transports/listen_socket.h"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>

namespace baudgate::transports {
namespace {

std::string Explain(int error, std::string_view key) {
  const std::string where(key);
  switch (error) {
    case EADDRINUSE:
      return "address already in use; stop the program that uses it, or choose another port in " +
             where;
    case EACCES:
      return "permission denied, because ports below 1024 need CAP_NET_BIND_SERVICE; choose a port "
             "from 1024 up in " +
             where;
    case EADDRNOTAVAIL:
      return "this machine has no such address; correct " + where;
    default:
      return std::strerror(error);
  }
}

}  // namespace

ListenSocket::~ListenSocket() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

std::uint16_t ListenSocket::port() const {
  asio::ip::tcp::endpoint at;
  auto size = static_cast<socklen_t>(at.capacity());
  if (::getsockname(descriptor_, at.data(), &size) != 0) return 0;
  at.resize(size);
  return at.port();
}

Result<ListenSocket> ListenSocket::Open(const asio::ip::tcp::endpoint& at, std::string_view key) {
  const int family = at.protocol().family();
  ListenSocket opened(::socket(family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const int on = 1;
  const int off = 0;
  if (opened.is_open() && family == AF_INET6) {
    // If the system refuses this option, its default decides whether IPv4 clients can connect.
    ::setsockopt(opened.descriptor_, IPPROTO_IPV6, IPV6_V6ONLY, &off, sizeof(off));
  }
  if (!opened.is_open() ||
      ::setsockopt(opened.descriptor_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on)) != 0 ||
      ::bind(opened.descriptor_, at.data(), static_cast<socklen_t>(at.size())) != 0 ||
      ::listen(opened.descriptor_, SOMAXCONN) != 0) {
    return Error{Explain(errno, key)};
  }
  return opened;
}

Status Listen(asio::ip::tcp::acceptor& acceptor, const asio::ip::tcp::endpoint& at,
              std::string_view key) {
  auto socket = ListenSocket::Open(at, key);
  if (!socket) return Error{socket.error()};
  asio::error_code failed;
  const int descriptor = socket->Release();
  acceptor.assign(at.protocol(), descriptor, failed);
  if (!failed) return {};
  ::close(descriptor);
  return Error{failed.message()};
}

Status HasAddressOf(const asio::ip::tcp::acceptor& acceptor) {
  asio::error_code failed;
  asio::ip::tcp::endpoint at = acceptor.local_endpoint(failed);
  if (failed) return {};
  const std::string address = at.address().to_string();
  at.port(0);
  const int probe = ::socket(at.protocol().family(), SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const bool is_gone = probe >= 0 &&
                       ::bind(probe, at.data(), static_cast<socklen_t>(at.size())) != 0 &&
                       errno == EADDRNOTAVAIL;
  if (probe >= 0) ::close(probe);
  if (!is_gone) return {};
  return Error{
      "this machine does not have the address " + address +
      " now ('ip addr' lists its addresses); clients can connect again when the address is back"};
}

}  // namespace baudgate::transports
