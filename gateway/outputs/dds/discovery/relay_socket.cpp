// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/discovery/relay_socket.h"

#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "gateway/base/log.h"
#include "gateway/base/time.h"

namespace baudgate::dds {
namespace {

constexpr int kMostAtOnce = 256;
// Room for the announcements of 512 participants at one moment.
constexpr int kSocketBuffer = 4 << 20;

sockaddr_in AddressOf(const UdpAddress& at) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(at.port);
  address.sin_addr.s_addr = htonl(at.address);
  return address;
}

Error CanNotOpen(const config::HostPort& at, int reason) {
  std::string text =
      at.host + ":" + std::to_string(at.port) + " cannot be opened: " + std::strerror(reason);
  if (reason == EADDRINUSE) text += "; does another discovery server run here?";
  if (reason == EADDRNOTAVAIL) text += "; list this machine's addresses with: ip -4 addr";
  return Error{text};
}

}  // namespace

Result<RelaySocket> RelaySocket::Open(const config::HostPort& at) {
  const auto place = ParseUdpAddress(at.host, at.port);
  if (!place) return CanNotOpen(at, EINVAL);
  RelaySocket opened(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (opened.descriptor_ < 0) return CanNotOpen(at, errno);
  // As much of it as the kernel grants.
  ::setsockopt(opened.descriptor_, SOL_SOCKET, SO_RCVBUF, &kSocketBuffer, sizeof kSocketBuffer);
  ::setsockopt(opened.descriptor_, SOL_SOCKET, SO_SNDBUF, &kSocketBuffer, sizeof kSocketBuffer);
  const sockaddr_in address = AddressOf(*place);
  if (::bind(opened.descriptor_, reinterpret_cast<const sockaddr*>(&address), sizeof address) !=
      0) {
    return CanNotOpen(at, errno);
  }
  return opened;
}

RelaySocket::~RelaySocket() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

RelaySocket::RelaySocket(RelaySocket&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)) {}

void RelaySocket::Take(AnnouncementRelay& relay) {
  std::array<std::uint8_t, 0x10000> buffer;
  for (int i = 0; i < kMostAtOnce; ++i) {
    sockaddr_in from{};
    socklen_t length = sizeof from;
    const ssize_t size = ::recvfrom(descriptor_, buffer.data(), buffer.size(), 0,
                                    reinterpret_cast<sockaddr*>(&from), &length);
    if (size < 0) return;
    const UdpAddress sender{ntohl(from.sin_addr.s_addr), ntohs(from.sin_port)};
    const Relayed relayed =
        relay.On(View(buffer.data(), static_cast<std::size_t>(size)), sender, ReadClocks().instant);
    if (!relayed.refused.empty()) {
      log::WarnFolded("discovery server: refused", "discovery server: refused {} from {}",
                      relayed.refused, Text(sender));
    }
    for (const Introduction& introduction : relayed.introductions) Send(introduction);
  }
}

void RelaySocket::Send(const Introduction& introduction) const {
  const sockaddr_in to = AddressOf(introduction.to);
  // What cannot be sent now is sent again with the next round.
  [[maybe_unused]] const auto sent =
      ::sendto(descriptor_, introduction.datagram.data(), introduction.datagram.size(),
               MSG_NOSIGNAL, reinterpret_cast<const sockaddr*>(&to), sizeof to);
}

}  // namespace baudgate::dds
