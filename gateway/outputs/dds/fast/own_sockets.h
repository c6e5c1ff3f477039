// Finds out from the system whether a participant of this process can hear others. Fast DDS 2.9.1
// does not report it (measured): if another program has the domain's port, the library silently
// listens at another port, to which nobody sends. The library also ignores a multicast group that
// it cannot join, and a socket buffer that is smaller than it has asked for.
//
//   UDP 44900 is taken (domain 150)          nobody who comes is heard: the library hears 44902
//   the group is not joined on 10.0.0.5      nobody who comes there is heard
//   net.core.rmem_max is 208 KiB             a burst of samples is lost, and sent again later
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gateway/outputs/dds/fast/own_addresses.h"
#include "gateway/outputs/dds/participant_options.h"

namespace baudgate::dds {

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
