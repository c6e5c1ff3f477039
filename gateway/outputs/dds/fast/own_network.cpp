// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/fast/own_network.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <fstream>
#include <memory>

#include "gateway/outputs/dds/fast/participant.h"

namespace baudgate::dds {

OwnAddresses FindOwnAddresses() {
  OwnAddresses own;
  ifaddrs* raw = nullptr;
  if (getifaddrs(&raw) != 0) return own;
  const std::unique_ptr<ifaddrs, decltype(&freeifaddrs)> list(raw, &freeifaddrs);
  for (const ifaddrs* at = raw; at != nullptr; at = at->ifa_next) {
    if (at->ifa_addr == nullptr || at->ifa_addr->sa_family != AF_INET) continue;
    const auto* address = reinterpret_cast<const sockaddr_in*>(at->ifa_addr);
    std::array<char, INET_ADDRSTRLEN> text{};
    inet_ntop(AF_INET, &address->sin_addr, text.data(), text.size());
    auto& index = own[text.data()];
    if ((at->ifa_flags & IFF_RUNNING) != 0) index = if_nametoindex(at->ifa_name);
  }
  return own;
}

bool IsOwn(const OwnAddresses& own, const std::string& address) {
  in_addr wanted{};
  if (inet_pton(AF_INET, address.c_str(), &wanted) != 1) return false;
  return ntohl(wanted.s_addr) >> 24U == 127 || own.contains(address);
}

std::optional<std::string> WhyUnused(const OwnAddresses& own, const std::string& address) {
  if (!IsOwn(own, address)) return "no interface of this machine has this address now";
  const auto at = own.find(address);
  if (at == own.end() || at->second) return std::nullopt;
  return "its interface is down or unplugged";
}

bool InterfaceWatch::Uses(const std::string& address) const {
  return MeansAll(interfaces_) || std::ranges::count(interfaces_, address) > 0;
}

std::optional<std::string> InterfaceWatch::Gone(const OwnAddresses& now) const {
  const auto is_here = [&now](const std::string& address) { return IsOwn(now, address); };
  if (MeansAll(interfaces_) || std::ranges::none_of(interfaces_, is_here)) return std::nullopt;
  const auto gone = std::ranges::find_if(interfaces_, [&](const std::string& address) {
    return own_.contains(address) && !is_here(address);
  });
  if (gone == interfaces_.end()) return std::nullopt;
  return "this machine no longer has the address " + *gone;
}

std::optional<std::string> InterfaceWatch::Look(const OwnAddresses& now) const {
  for (const auto& [address, index] : now) {
    if (!index || !Uses(address)) continue;
    const auto was = own_.find(address);
    if (was == own_.end()) return "this machine has a new address, " + address;
    if (!was->second) return "the interface of " + address + " is up now";
    if (was->second != index) return "the interface of " + address + " was created again";
  }
  return Gone(now);
}

namespace {

constexpr const char* kGroup = "239.255.0.1";
constexpr int kMostDescriptors = 1024;
constexpr int kPortsOfADomain = 250;

struct Socket {
  int descriptor = -1;
  in_addr address{};
  int port = 0;
};

int OptionOf(int descriptor, int name) {
  int value = 0;
  socklen_t size = sizeof value;
  return ::getsockopt(descriptor, SOL_SOCKET, name, &value, &size) == 0 ? value : 0;
}

/// Returns the size of the socket's buffer in bytes, which is half of what the kernel returns.
/// `name`: SO_RCVBUF or SO_SNDBUF.
int BufferOf(const Socket& socket, int name) { return OptionOf(socket.descriptor, name) / 2; }

std::vector<Socket> UdpSockets() {
  std::vector<Socket> found;
  for (int descriptor = 0; descriptor < kMostDescriptors; ++descriptor) {
    if (OptionOf(descriptor, SO_TYPE) != SOCK_DGRAM) continue;
    sockaddr_in at{};
    socklen_t size = sizeof at;
    if (::getsockname(descriptor, reinterpret_cast<sockaddr*>(&at), &size) != 0) continue;
    if (at.sin_family != AF_INET || at.sin_port == 0) continue;
    found.push_back({descriptor, at.sin_addr, ntohs(at.sin_port)});
  }
  return found;
}

in_addr AddressOf(const std::string& text) {
  in_addr address{};
  ::inet_pton(AF_INET, text.c_str(), &address);
  return address;
}

/// True if the socket is a member of the multicast group on this interface: the kernel returns the
/// filter of a membership only to a member.
bool HasJoined(const Socket& socket, const std::string& interface) {
  ip_msfilter filter{};
  filter.imsf_multiaddr = AddressOf(kGroup);
  filter.imsf_interface = AddressOf(interface);
  socklen_t size = IP_MSFILTER_SIZE(0);
  return ::getsockopt(socket.descriptor, IPPROTO_IP, IP_MSFILTER, &filter, &size) == 0;
}

std::vector<std::string> UsedInterfaces(const ParticipantOptions& options,
                                        const OwnAddresses& own) {
  std::vector<std::string> used;
  if (!MeansAll(options.interfaces)) {
    std::ranges::copy_if(options.interfaces, std::back_inserter(used),
                         [&](const std::string& one) { return !WhyUnused(own, one); });
  } else {
    for (const auto& [address, index] : own) {
      if (index) used.push_back(address);
    }
  }
  return used;
}

std::pair<int, int> GivenPorts() {
  std::ifstream file("/proc/sys/net/ipv4/ip_local_port_range");
  int first = 0;
  int last = 0;
  if (file >> first >> last) return {first, last};
  return {32768, 60999};
}

/// Returns false if another program uses the port and does not share it.
bool CanBind(const std::string& address, std::uint16_t port) {
  const int probe = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (probe < 0) return false;
  const int on = 1;
  ::setsockopt(probe, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_addr = AddressOf(address);
  at.sin_port = htons(port);
  const bool bound = ::bind(probe, reinterpret_cast<const sockaddr*>(&at), sizeof at) == 0;
  const bool taken = !bound && errno == EADDRINUSE;
  ::close(probe);
  return !taken;
}

std::string CutRemark(const char* which, const char* setting, int has) {
  return fmt::format(
      "the system limits the {} buffers of DDS to {} KiB instead of {} KiB, so a burst of values "
      "arrives late; raise the limit with: sysctl -w {}={}",
      which, has / 1024, kSocketBuffer / 1024, setting, kSocketBuffer);
}

}  // namespace

SocketFacts FindSocketFacts(const ParticipantOptions& options, const OwnAddresses& own) {
  SocketFacts facts;
  facts.given_ports = GivenPorts();
  const int port = MulticastPort(options.domain);
  const std::vector<Socket> sockets = UdpSockets();
  std::vector<Socket> hear;
  for (const Socket& socket : sockets) {
    facts.send_bytes = std::max(facts.send_bytes, BufferOf(socket, SO_SNDBUF));
    if (socket.port < port || socket.port >= port + kPortsOfADomain) continue;
    const int receive = BufferOf(socket, SO_RCVBUF);
    facts.receive_bytes =
        facts.receive_bytes == 0 ? receive : std::min(facts.receive_bytes, receive);
    const bool group = socket.address.s_addr == AddressOf(kGroup).s_addr ||
                       socket.address.s_addr == htonl(INADDR_ANY);
    if (socket.port == port && group) hear.push_back(socket);
  }
  if (!options.multicast) return facts;
  facts.has_port = !hear.empty();
  const auto used = UsedInterfaces(options, own);
  for (const std::string& interface : used) {
    const auto joined = [&](const Socket& socket) { return HasJoined(socket, interface); };
    if (std::ranges::none_of(hear, joined)) facts.unjoined.push_back(interface);
  }
  // If all interfaces are used, some may not support multicast. Therefore failed joins are reported
  // only if no interface has joined.
  if (MeansAll(options.interfaces) && facts.unjoined.size() < used.size()) facts.unjoined.clear();
  return facts;
}

std::vector<std::string> RemarksOn(const SocketFacts& facts, const ParticipantOptions& options) {
  std::vector<std::string> remarks;
  const int port = MulticastPort(options.domain);
  if (!facts.has_port) {
    const auto [first, last] = facts.given_ports;
    const std::string remedy =
        port >= first && port <= last
            ? fmt::format("reserve it ('sysctl -w net.ipv4.ip_local_reserved_ports={}')", port)
            : std::string("end that program");
    remarks.push_back(fmt::format(
        "no new subscriber is discovered: another program has UDP port {} ('ss -ulnp' names the "
        "program); {} or choose another domain. DDS restarts when the port is free",
        port, remedy));
  } else {
    for (const std::string& interface : facts.unjoined) {
      remarks.push_back(
          fmt::format("no new subscriber is discovered on {}: the gateway could not join the "
                      "multicast group {} there. Name the subscribers in dds.peers, or raise "
                      "net.ipv4.igmp_max_memberships and restart the gateway",
                      interface, kGroup));
    }
  }
  if (facts.receive_bytes > 0 && facts.receive_bytes < kSocketBuffer) {
    remarks.push_back(CutRemark("receive", "net.core.rmem_max", facts.receive_bytes));
  }
  if (facts.send_bytes > 0 && facts.send_bytes < kSocketBuffer) {
    remarks.push_back(CutRemark("send", "net.core.wmem_max", facts.send_bytes));
  }
  return remarks;
}

std::optional<std::string> PortWatch::Look(const ParticipantOptions& options,
                                           const OwnAddresses& own) {
  if (!options.multicast || FindSocketFacts(options, own).has_port) return std::nullopt;
  const std::uint16_t port = MulticastPort(options.domain);
  std::vector<std::string> needed = UsedInterfaces(options, own);
  needed.emplace_back(kGroup);
  const bool taken = !std::ranges::all_of(
      needed, [port](const std::string& address) { return CanBind(address, port); });
  if (taken) was_taken_ = true;
  if (taken || !was_taken_) return std::nullopt;
  return "UDP port " + std::to_string(port) + " is free now";
}

}  // namespace baudgate::dds
