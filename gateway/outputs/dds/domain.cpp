// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/domain.h"

#include <cstdio>

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

std::string Text(const PublisherId& id) {
  std::string text;
  for (const std::uint8_t byte : id.bytes) {
    char two[4];
    std::snprintf(two, sizeof two, ".%02x", byte);
    text += two;
  }
  return text.substr(1);
}

std::string Text(const WriterId& id) {
  char entity[20];
  std::snprintf(entity, sizeof entity, "|%x.%x.%x.%x", id.entity[0], id.entity[1], id.entity[2],
                id.entity[3]);
  return Text(id.publisher) + entity;
}

}  // namespace baudgate::dds
