// A Fast DDS participant with the gateway's settings, for publisher and subscriber alike: which
// transports, which interfaces, how fast a crash is noticed. UnansweredRemark is the
// remark about a participant that confirms nothing.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "config/model/outputs.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/outputs/dds/domain.h"
#include "gateway/outputs/dds/fast/datagram_check.h"
#include "gateway/outputs/dds/rtps/announcement.h"

namespace eprosima::fastdds::dds {
class DomainParticipant;
class DomainParticipantListener;
}  // namespace eprosima::fastdds::dds

namespace baudgate::dds {

// The remark about a participant that announces itself and confirms nothing. Pure; the
// participants come from gateway/outputs/dds/fast/domain_tables.h.

/// `host`: where it listens. `on_this_machine`: that is an address of ours. `interfaces`: those of
/// our participant. Another Fast DDS on this machine sends to loopback where it uses it, and never
/// to an address of the machine that it does not use.
std::string UnansweredRemark(const std::string& host, bool on_this_machine,
                             const std::vector<std::string>& interfaces);

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
