// The outputs of the gateway: Modbus TCP and DDS.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "config/model/dds_security.h"
#include "config/model/discovery_server.h"
#include "config/model/fields.h"
#include "config/model/listener.h"
#include "config/model/route.h"
#include "gateway/base/time.h"

namespace baudgate::config {

struct Modbus {
  bool enabled = true;
  std::vector<Listener> listen;
  std::vector<Route> routes;  ///< first match wins
};

template <typename Visit>
void VisitFields(const Modbus*, Visit visit) {
  visit(Field<&Modbus::enabled>());
  visit(Field<&Modbus::listen>());
  visit(Field<&Modbus::routes>());
}

inline constexpr std::size_t kMostPeers = 64;

inline constexpr Duration kUsualLease = std::chrono::seconds(10);
inline constexpr Duration kShortestLease = std::chrono::seconds(2);
inline constexpr Duration kLongestLease = std::chrono::minutes(1);

struct Dds {
  bool enabled = true;
  int domain = 0;  ///< 0…232
  std::vector<std::string> interfaces = {"127.0.0.1"};
  bool multicast = true;           ///< ask the domain's multicast group, and listen to it
  std::vector<std::string> peers;  ///< IPv4 addresses, asked beside multicast; kMostPeers at most
  std::vector<HostPort> discovery_servers;  ///< IPv4; who announces himself there is introduced
  Duration heartbeat = std::chrono::seconds(10);  ///< every point is published at least so often
  Duration lease = kUsualLease;  ///< from its last sign of life until the gateway counts as gone
  DdsSecurity security;
  bool write = false;  ///< take write requests
};

template <typename Visit>
void VisitFields(const Dds*, Visit visit) {
  visit(Field<&Dds::enabled>());
  visit(Field<&Dds::domain>());
  visit(Field<&Dds::interfaces>());
  visit(Field<&Dds::multicast>());
  visit(Field<&Dds::peers>());
  visit(Field<&Dds::discovery_servers>());
  visit(Field<&Dds::heartbeat>());
  visit(Field<&Dds::lease>());
  visit(Field<&Dds::security>());
  visit(Field<&Dds::write>());
}

}  // namespace baudgate::config
