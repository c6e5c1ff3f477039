// Whom a participant asks beside the multicast group, or in its place: `dds.peers` and
// `dds.discovery_servers` as settings of Fast DDS. To it a server is a peer with a port.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "gateway/outputs/dds/participant_options.h"

namespace eprosima::fastdds::dds {
class DomainParticipantQos;
}  // namespace eprosima::fastdds::dds

namespace baudgate::dds {

/// A participant takes the lowest port that is free, so of each peer so many are asked: more
/// participants of one machine than this do not find each other by peers.
inline constexpr std::uint32_t kParticipantsOfPeer = 32;

void AskPeers(const ParticipantOptions& options, eprosima::fastdds::dds::DomainParticipantQos& qos);

}  // namespace baudgate::dds
