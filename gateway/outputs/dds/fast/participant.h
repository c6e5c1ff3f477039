// A Fast DDS participant with the gateway's settings, for publisher and subscriber alike: which
// transports, which interfaces, how fast a crash is noticed.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/base/result.h"
#include "gateway/outputs/dds/fast/datagram_gate.h"
#include "gateway/outputs/dds/neighbours.h"
#include "gateway/outputs/dds/participant_options.h"
#include "gateway/outputs/dds/rtps/announcement.h"

namespace eprosima::fastdds::dds {
class DomainParticipant;
class DomainParticipantListener;
}  // namespace eprosima::fastdds::dds

namespace baudgate::dds {

/// The error names what to change. XML profiles are never read. `listener`
/// hears of what is discovered from the first moment on, and outlives the participant. `role` is
/// for discovery servers.
Result<eprosima::fastdds::dds::DomainParticipant*> CreateParticipant(
    const ParticipantOptions& options,
    eprosima::fastdds::dds::DomainParticipantListener* listener = nullptr, Role role = Role::any);

/// No interface is named, or 0.0.0.0.
bool MeansAll(const std::vector<std::string>& interfaces);

/// What was let in by UDP and what was not. From any thread.
DatagramCounters DatagramsOf(const eprosima::fastdds::dds::DomainParticipant& participant);

/// The subscribers that it reaches, and a sentence for each address of dds.interfaces that is gone
/// and for each subscriber that was heard and cannot be answered. With DDS Security the latter have
/// none: a stranger is not answered anyway.
Neighbours NeighboursOf(const eprosima::fastdds::dds::DomainParticipant& participant,
                        const ParticipantOptions& options);

/// With all that it contains.
void DeleteParticipant(eprosima::fastdds::dds::DomainParticipant* participant);

}  // namespace baudgate::dds
