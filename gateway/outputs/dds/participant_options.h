// In which DDS domain and on which interfaces a gateway or a subscriber takes part. Comes from
// `dds:` of the configuration or from the command line, goes to
// gateway/outputs/dds/fast/participant.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "config/model/outputs.h"
#include "gateway/base/time.h"

namespace baudgate::dds {

struct ParticipantOptions {
  std::string name = "baudgate";        ///< of the participant, for tools: that of the gateway
  int domain = 0;                       ///< 0…232
  std::vector<std::string> interfaces;  ///< addresses of this machine; empty or 0.0.0.0 = all
  std::size_t participants = 256;       ///< others in the domain; those beyond are not let in
  /// Others take us for gone after this time without a sign of life. It should not be shorter than
  /// the lease of Cyclone DDS (10 s). Otherwise Cyclone forgets us in a break of the link while we
  /// still know it, and the library does not introduce itself again.
  Duration lease = config::kUsualLease;

  bool multicast = true;
  /// IPv4 addresses that are asked beside the multicast group.
  std::vector<std::string> peers{};
  std::vector<config::HostPort> discovery_servers{};
  /// Addresses of subscribers that the process before this one has reached.
  std::vector<config::HostPort> reached{};
  config::DdsSecurity security{};
};

/// As the configuration has it.
ParticipantOptions ParticipantOf(const config::Dds& dds);

}  // namespace baudgate::dds
