// `FindOwnAddresses` asks the system for the IPv4 addresses of this machine. InterfaceWatch detects
// changed interfaces, and FindSocketFacts finds out whether a participant can receive from others.
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

/// From an address in dotted form to the index of its interface; empty while the interface is down
/// or unplugged: Fast DDS then leaves the address out. An interface that is deleted and made again
/// has another index.
using OwnAddresses = std::map<std::string, std::optional<unsigned>>;

/// Empty also if the system reports an error.
OwnAddresses FindOwnAddresses();

/// All of 127/8 belongs to this machine, although the interface lists 127.0.0.1 only.
bool IsOwn(const OwnAddresses& own, const std::string& address);

/// Why nothing can be sent from the address now; empty: it can be used.
std::optional<std::string> WhyUnused(const OwnAddresses& own, const std::string& address);

// Detects that an interface was made again or is up now, or that an address is new: Fast DDS has
// joined its multicast groups on the old interfaces and sends nothing on the new ones. If one of
// several addresses is gone, it finds no new subscriber on the others either (measured). In the
// table, "10.0.0.5 at 2" is an address of the interface with index 2.
//
//   at the start 10.0.0.5 at 2     later 10.0.0.5 at 2    nothing
//                                  later down             nothing: the other addresses still work
//                                  later gone, others up  the participant must be made again
//                                  later gone, alone      nothing: nobody can be reached anyway
//                                  later 10.0.0.5 at 7    the participant must be made again
//   at the start 10.0.0.5 down     later 10.0.0.5 at 2    the participant must be made again
class InterfaceWatch {
 public:
  /// `interfaces`: as in ParticipantOptions. `own`: when the participant was made.
  InterfaceWatch(std::vector<std::string> interfaces, OwnAddresses own)
      : interfaces_(std::move(interfaces)), own_(std::move(own)) {}

  /// Why the participant must be made again; empty: it need not be.
  std::optional<std::string> Look(const OwnAddresses& now) const;

 private:
  bool Uses(const std::string& address) const;
  /// Not empty if an address in use was up and is gone, while another one remains.
  std::optional<std::string> Gone(const OwnAddresses& now) const;

  const std::vector<std::string> interfaces_;
  const OwnAddresses own_;
};

// FindSocketFacts asks the system whether a participant of this process can receive from others,
// because Fast DDS 2.9.1 does not report it (measured): if another program has the domain's port,
// the library silently listens at another port, to which nobody sends. It also ignores a multicast
// group that it cannot join, and a socket buffer that is smaller than requested.
//
//   UDP 44900 is taken (domain 150)          no newcomer is received: the library listens at 44902
//   the group is not joined on 10.0.0.5      no newcomer is received on that interface
//   net.core.rmem_max is 208 KiB             a burst of samples is lost, and sent again later

/// Announcements are sent to this port by multicast (RTPS 2.3, 9.6.1).
constexpr std::uint16_t MulticastPort(int domain) {
  return static_cast<std::uint16_t>(7400 + 250 * domain);
}

/// Requested for each socket, in bytes. A smaller buffer loses samples when a subscriber joins and
/// gets the image of some thousand points.
inline constexpr int kSocketBuffer = 4 << 20;

struct SocketFacts {
  bool has_port = true;               ///< the participant has the port of the multicast group
  std::vector<std::string> unjoined;  ///< interfaces on which the group was not joined
  /// Smallest receive buffer of the participant's sockets; 0: no socket found.
  int receive_bytes = 0;
  int send_bytes = 0;  ///< largest send buffer
  /// First and last port that Linux assigns to programs without a fixed port.
  std::pair<int, int> given_ports;
};

/// `own`: the addresses of this machine.
SocketFacts FindSocketFacts(const ParticipantOptions& options, const OwnAddresses& own);

/// One sentence for each fault: what is wrong, its effect, and the remedy.
std::vector<std::string> RemarksOn(const SocketFacts& facts, const ParticipantOptions& options);

/// Detects that the domain's port was taken at first and is free now.
class PortWatch {
 public:
  /// As InterfaceWatch::Look.
  std::optional<std::string> Look(const ParticipantOptions& options, const OwnAddresses& own);

 private:
  bool was_taken_ = false;
};

}  // namespace baudgate::dds
