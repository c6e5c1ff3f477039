// SPDX-License-Identifier: Apache-2.0
#include "gateway/dds/fast/peers.h"

#include <fastrtps/utils/IPLocator.h>

#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>
#include <string>

namespace baudgate::dds {
namespace {

namespace rtps = eprosima::fastrtps::rtps;

constexpr char kMulticastGroup[] = "239.255.0.1";  // RTPS 2.3, 9.6.1.4

/// Port 0: the domain's ports.
rtps::Locator_t LocatorOf(const std::string& address) {
  rtps::Locator_t locator;
  rtps::IPLocator::createLocator(LOCATOR_KIND_UDPv4, address, 0, locator);
  return locator;
}

}  // namespace

void AskPeers(const ParticipantOptions& options,
              eprosima::fastdds::dds::DomainParticipantQos& qos) {
  if (options.peers.empty()) return;
  // Without the group, neighbours would not be heard any more.
  auto& asked = qos.wire_protocol().builtin.initialPeersList;
  asked.push_back(LocatorOf(kMulticastGroup));
  for (const std::string& peer : options.peers) asked.push_back(LocatorOf(peer));
}

}  // namespace baudgate::dds
