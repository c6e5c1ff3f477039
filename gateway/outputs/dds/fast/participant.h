// `CreateParticipant` makes a Fast DDS participant with the gateway's settings, for publishers and
// subscribers: transports, interfaces, and how soon a crash is noticed. UnansweredRemark is the
// sentence about a participant that acknowledges nothing.
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

/// Returns the sentence about a participant that announces itself and acknowledges nothing. `host`:
/// where it listens. `on_this_machine`: `host` is an address of this machine. `interfaces`: those
/// of our participant. Another Fast DDS on this machine sends to loopback if it uses loopback, and
/// never to an address of the machine that it does not use itself.
std::string UnansweredRemark(const std::string& host, bool on_this_machine,
                             const std::vector<std::string>& interfaces);

/// Makes a participant. XML profiles are never read. `listener` gets what is discovered from the
/// first moment, and must outlive the participant. `role` is sent to discovery servers. The error
/// names what to change.
Result<eprosima::fastdds::dds::DomainParticipant*> CreateParticipant(
    const ParticipantOptions& options,
    eprosima::fastdds::dds::DomainParticipantListener* listener = nullptr, Role role = Role::any);

/// True if no interface is named, or 0.0.0.0.
bool MeansAll(const std::vector<std::string>& interfaces);

/// Returns the counts of datagrams that came by UDP. Any thread may call it.
DatagramCounters DatagramsOf(const eprosima::fastdds::dds::DomainParticipant& participant);

/// Returns the matched subscribers, and a sentence for each address of dds.interfaces that is gone
/// and for each subscriber that cannot be answered. With DDS Security there are no sentences about
/// subscribers, because strangers are not answered anyway.
Neighbours NeighboursOf(const eprosima::fastdds::dds::DomainParticipant& participant,
                        const ParticipantOptions& options);

/// Deletes the participant with all its entities.
void DeleteParticipant(eprosima::fastdds::dds::DomainParticipant* participant);

}  // namespace baudgate::dds
