// `FindOwnAddresses` returns the IPv4 addresses of this machine. InterfaceWatch detects changed
// interfaces, and FindSocketFacts checks whether a participant can receive datagrams from others.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gateway/outputs/dds/domain.h"

namespace baudgate::dds {

/// The addresses of this machine. Key: the address, e.g. "10.0.0.5"; value: the index of its
/// interface, or nothing while the interface is down or unplugged (Fast DDS then does not use the
/// address). An interface that is deleted and created again gets a new index.
using OwnAddresses = std::map<std::string, std::optional<unsigned>>;

/// Returns an empty map if the system reports an error.
OwnAddresses FindOwnAddresses();

/// True if the address belongs to this machine. All of 127/8 does, although the interface lists
/// only 127.0.0.1.
bool IsOwn(const OwnAddresses& own, const std::string& address);

std::optional<std::string> WhyUnused(const OwnAddresses& own, const std::string& address);

// InterfaceWatch detects that the participant must be created again, because an address is new, or
// its interface was created again or is up now: Fast DDS has joined its multicast groups on the old
// interfaces and sends nothing on the new ones. If one of several addresses is gone, Fast DDS finds
// no new subscriber on the others either (measured). In the table, "10.0.0.5 at 2" is an address of
// the interface with index 2.
//
//   at the start 10.0.0.5 at 2     later 10.0.0.5 at 2    nothing
//                                  later down             nothing: the other addresses still work
//                                  later gone, others up  the participant must be made again
//                                  later gone, alone      nothing: nobody can be reached anyway
//                                  later 10.0.0.5 at 7    the participant must be made again
//   at the start 10.0.0.5 down     later 10.0.0.5 at 2    the participant must be made again
class InterfaceWatch {
 public:
  /// `interfaces`: see ParticipantOptions. `own`: the addresses when the participant was created.
  InterfaceWatch(std::vector<std::string> interfaces, OwnAddresses own)
      : interfaces_(std::move(interfaces)), own_(std::move(own)) {}

  std::optional<std::string> Look(const OwnAddresses& now) const;

 private:
  bool Uses(const std::string& address) const;
  /// Returns the reason if a configured address was up and is gone, while another configured
  /// address remains.
  std::optional<std::string> Gone(const OwnAddresses& now) const;

  const std::vector<std::string> interfaces_;
  const OwnAddresses own_;
};

// FindSocketFacts checks whether a participant of this process can receive datagrams from others,
// because Fast DDS 2.9.1 does not report it (measured): if another program has the domain's port,
// the library silently listens at another port, to which nobody sends. The library also ignores a
// multicast group that it cannot join, and a socket buffer that is smaller than requested.
//
//   UDP 44900 is taken (domain 150)          no newcomer is received: the library listens at 44902
//   the group is not joined on 10.0.0.5      no newcomer is received on that interface
//   net.core.rmem_max is 208 KiB             a burst of samples is lost, and sent again later

/// Returns the UDP port to which announcements are sent by multicast (RTPS 2.3, 9.6.1).
constexpr std::uint16_t MulticastPort(int domain) {
  return static_cast<std::uint16_t>(7400 + 250 * domain);
}

/// The buffer size in bytes that is requested for each socket. A smaller buffer loses samples when
/// a subscriber joins and gets the values of some thousand points at once.
inline constexpr int kSocketBuffer = 4 << 20;

struct SocketFacts {
  bool has_port = true;               ///< the participant has bound the port of the multicast group
  std::vector<std::string> unjoined;  ///< interfaces on which the group was not joined
  /// Smallest receive buffer of the participant's sockets; 0: no socket found.
  int receive_bytes = 0;
  int send_bytes = 0;  ///< largest send buffer of the participant's sockets
  /// First and last port of the range from which Linux assigns ports to programs that request none.
  std::pair<int, int> given_ports;
};

SocketFacts FindSocketFacts(const ParticipantOptions& options, const OwnAddresses& own);

std::vector<std::string> RemarksOn(const SocketFacts& facts, const ParticipantOptions& options);

/// Look returns a reason to create the participant again: the domain's port was used by another
/// program and is free now.
class PortWatch {
 public:
  std::optional<std::string> Look(const ParticipantOptions& options, const OwnAddresses& own);

 private:
  bool was_taken_ = false;
};

}  // namespace baudgate::dds
