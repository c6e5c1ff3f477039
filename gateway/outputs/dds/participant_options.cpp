// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/participant_options.h"

namespace baudgate::dds {

ParticipantOptions ParticipantOf(const config::Dds& dds) {
  ParticipantOptions options;
  options.domain = dds.domain;
  options.interfaces = dds.interfaces;
  options.lease = dds.lease;
  options.multicast = dds.multicast;
  options.peers = dds.peers;
  options.discovery_servers = dds.discovery_servers;
  options.security = dds.security;
  return options;
}

}  // namespace baudgate::dds
