// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/fast/peers.h"

#include <fastrtps/utils/IPLocator.h>

#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>
#include <string>

namespace baudgate::dds {
namespace {

using eprosima::fastrtps::rtps::BuiltinAttributes;
using eprosima::fastrtps::rtps::IPLocator;
using eprosima::fastrtps::rtps::Locator_t;

constexpr char kMulticastGroup[] = "239.255.0.1";  // RTPS 2.3, 9.6.1.4

/// Port 0: the domain's ports.
Locator_t LocatorOf(const std::string& address, std::uint16_t port = 0) {
  Locator_t locator;
  IPLocator::createLocator(LOCATOR_KIND_UDPv4, address, port, locator);
  return locator;
}

/// Where addresses are named, the library does not add the multicast group.
void HearUnicastOnly(const ParticipantOptions& options, BuiltinAttributes& builtin) {
  for (const std::string& address : options.interfaces) {
    builtin.metatrafficUnicastLocatorList.push_back(LocatorOf(address));
  }
  if (options.interfaces.empty()) {
    builtin.metatrafficUnicastLocatorList.push_back(LocatorOf("0.0.0.0"));
  }
}

}  // namespace

void AskPeers(const ParticipantOptions& options,
              eprosima::fastdds::dds::DomainParticipantQos& qos) {
  auto& builtin = qos.wire_protocol().builtin;
  if (!options.multicast) HearUnicastOnly(options, builtin);
  if (options.peers.empty() && options.discovery_servers.empty() && options.reached.empty()) return;
  auto& asked = builtin.initialPeersList;
  // Without the group, neighbours would not be heard any more.
  if (options.multicast) asked.push_back(LocatorOf(kMulticastGroup));
  for (const std::string& peer : options.peers) asked.push_back(LocatorOf(peer));
  for (const auto* places : {&options.discovery_servers, &options.reached}) {
    for (const auto& at : *places) asked.push_back(LocatorOf(at.host, at.port));
  }
}

}  // namespace baudgate::dds
