// In which DDS domain and on which interfaces a gateway or a subscriber takes part. Comes from
// `dds:` of the configuration or from the command line, goes to gateway/dds/fast/participant.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "config/model/outputs.h"

namespace baudgate::dds {

struct ParticipantOptions {
  int domain = 0;                       ///< 0…232
  std::vector<std::string> interfaces;  ///< addresses of this machine; empty or 0.0.0.0 = all
  std::size_t participants = 256;       ///< others in the domain; those beyond are not let in
  bool types = false;                   ///< learn the types that others announce

  bool multicast = true;
  /// IPv4 addresses that are asked beside the multicast group.
  std::vector<std::string> peers{};
  std::vector<config::HostPort> discovery_servers{};
  config::DdsSecurity security{};
};

/// As the configuration has it.
ParticipantOptions ParticipantOf(const config::Dds& dds);

}  // namespace baudgate::dds
