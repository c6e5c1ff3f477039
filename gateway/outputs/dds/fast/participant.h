// `CreateParticipant` makes a Fast DDS participant with the gateway's settings, for publishers and
// subscribers. UnansweredRemark is the sentence about a participant that acknowledges nothing.
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

/// About a participant that announces itself and acknowledges nothing. `host`: where it listens.
/// `on_this_machine`: `host` is our address. `interfaces`: of our participant. Another Fast DDS on
/// this machine sends to loopback if it uses loopback, and never to an address of the machine that
/// it does not use itself.
std::string UnansweredRemark(const std::string& host, bool on_this_machine,
                             const std::vector<std::string>& interfaces);

/// XML profiles are never read. `listener` gets everything that is discovered, and must outlive the
/// participant. `role` is for discovery servers. The error names what to change.
Result<eprosima::fastdds::dds::DomainParticipant*> CreateParticipant(
    const ParticipantOptions& options,
    eprosima::fastdds::dds::DomainParticipantListener* listener = nullptr, Role role = Role::any);

/// True if no interface is named, or 0.0.0.0.
bool MeansAll(const std::vector<std::string>& interfaces);

/// Datagrams by UDP. Any thread may call it.
DatagramCounters DatagramsOf(const eprosima::fastdds::dds::DomainParticipant& participant);

/// Returns the matched subscribers, and a sentence for each address of dds.interfaces that is gone
/// and each subscriber that cannot be answered (not with DDS Security, where strangers are not
/// answered anyway).
Neighbours NeighboursOf(const eprosima::fastdds::dds::DomainParticipant& participant,
                        const ParticipantOptions& options);

/// Also deletes its entities.
void DeleteParticipant(eprosima::fastdds::dds::DomainParticipant* participant);

}  // namespace baudgate::dds
