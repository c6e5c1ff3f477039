// `CreateParticipant` creates a Fast DDS participant with the gateway's settings, for publishers
// and subscribers. UnansweredRemark describes a participant that acknowledges nothing.
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

/// Returns a sentence about a participant that announces itself and acknowledges nothing. `host`:
/// its address. `on_this_machine`: `host` is an address of this machine. `interfaces`: addresses
/// that our participant uses. Background: another Fast DDS on this machine that uses loopback sends
/// to us over loopback, and it sends to no address of this machine that it does not use itself.
std::string UnansweredRemark(const std::string& host, bool on_this_machine,
                             const std::vector<std::string>& interfaces);

/// Creates a participant; XML profiles are never read. `listener` is informed about everything that
/// is discovered, and must outlive the participant. `role` is sent to discovery servers. The error
/// contains the setting to change.
Result<eprosima::fastdds::dds::DomainParticipant*> CreateParticipant(
    const ParticipantOptions& options,
    eprosima::fastdds::dds::DomainParticipantListener* listener = nullptr, Role role = Role::any);

/// True if `interfaces` means all interfaces: it is empty or contains 0.0.0.0.
bool MeansAll(const std::vector<std::string>& interfaces);

/// Returns the counts of received UDP datagrams. Any thread may call it.
DatagramCounters DatagramsOf(const eprosima::fastdds::dds::DomainParticipant& participant);

/// Returns the matched subscribers, and remarks: a sentence for each address of dds.interfaces that
/// is gone and for each subscriber that does not acknowledge. With DDS Security, the silent
/// subscribers are left out, because a participant that is not authenticated gets no answer.
Neighbours NeighboursOf(const eprosima::fastdds::dds::DomainParticipant& participant,
                        const ParticipantOptions& options);

/// Deletes the participant and its publishers, subscribers and topics.
void DeleteParticipant(eprosima::fastdds::dds::DomainParticipant* participant);

}  // namespace baudgate::dds
