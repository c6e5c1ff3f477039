// The IPv4 addresses of this machine, asked of the system each time: interfaces come and go.
// InterfaceWatch notices that interfaces have changed, and FindSocketFacts whether a participant
// can hear others.
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

/// By address in dotted form, the index of its interface; nothing while that is down or its cable
/// is unplugged: Fast DDS then leaves the address out. An interface that is deleted and made again
/// with the same address has another index.
using OwnAddresses = std::map<std::string, std::optional<unsigned>>;

/// Empty as well where the system does not tell.
OwnAddresses FindOwnAddresses();

/// All of 127/8 is ours, although the interface lists 127.0.0.1 only.
bool IsOwn(const OwnAddresses& own, const std::string& address);

/// Why nothing can be sent from an address now; empty: it can.
std::optional<std::string> WhyUnused(const OwnAddresses& own, const std::string& address);

// Notices that an interface was deleted and made again or has come up, or that an address has come:
// the library has joined its multicast groups on the old ones, and sends nothing on the new ones.
// When an address is gone, the library reaches no new subscriber on the others either (measured).
// Pure: addresses come in, from FindOwnAddresses.
//
//   at the start 10.0.0.5 at 2     later 10.0.0.5 at 2    nothing
//                                  later down             nothing: others are still reached
//                                  later gone, others up  the participant must be made again
//                                  later gone, alone      nothing: there is nobody to reach
//                                  later 10.0.0.5 at 7    the participant must be made again
//   at the start 10.0.0.5 down     later 10.0.0.5 at 2    the same
class InterfaceWatch {
 public:
  /// `interfaces`: as in ParticipantOptions. `own`: when the participant was made.
  InterfaceWatch(std::vector<std::string> interfaces, OwnAddresses own)
      : interfaces_(std::move(interfaces)), own_(std::move(own)) {}

  /// Why the participant must be made again; empty: it need not.
  std::optional<std::string> Look(const OwnAddresses& now) const;

 private:
  bool Uses(const std::string& address) const;
  /// An address that was up and that the machine no longer has, while it has another one.
  std::optional<std::string> Gone(const OwnAddresses& now) const;

  const std::vector<std::string> interfaces_;
  const OwnAddresses own_;
};

// Finds out from the system whether a participant of this process can hear others. Fast DDS 2.9.1
// does not report it (measured): if another program has the domain's port, the library silently
// listens at another port, to which nobody sends. The library also ignores a multicast group that
// it cannot join, and a socket buffer that is smaller than it has asked for.
//
//   UDP 44900 is taken (domain 150)          nobody who comes is heard: the library hears 44902
//   the group is not joined on 10.0.0.5      nobody who comes there is heard
//   net.core.rmem_max is 208 KiB             a burst of samples is lost, and sent again later

/// What others ask for by multicast comes here (RTPS 2.3, 9.6.1).
constexpr std::uint16_t MulticastPort(int domain) {
  return static_cast<std::uint16_t>(7400 + 250 * domain);
}

/// The socket buffer that the participant asks for, in bytes. With a smaller buffer samples are
/// lost when a subscriber joins and is sent the image of some thousand points.
inline constexpr int kSocketBuffer = 4 << 20;

struct SocketFacts {
  bool has_port = true;               ///< of the multicast group
  std::vector<std::string> unjoined;  ///< interfaces on which the group is not heard
  int receive_bytes = 0;              ///< the smallest buffer of the participant's sockets
  int send_bytes = 0;                 ///< the largest
  std::pair<int, int> given_ports;    ///< those that Linux gives to programs that name none
};

/// Asks the system. `own`: the addresses of this machine.
SocketFacts FindSocketFacts(const ParticipantOptions& options, const OwnAddresses& own);

/// A sentence each: what is wrong, what follows from it, and what helps.
std::vector<std::string> RemarksOn(const SocketFacts& facts, const ParticipantOptions& options);

/// Notices that the domain's port, which was taken when the participant was made, is free.
class PortWatch {
 public:
  /// Why the participant must be made again; empty: it need not.
  std::optional<std::string> Look(const ParticipantOptions& options, const OwnAddresses& own);

 private:
  bool was_taken_ = false;
};

}  // namespace baudgate::dds
