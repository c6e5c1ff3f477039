// In which DDS domain and on which interfaces a gateway or a subscriber takes part. Comes from
// `dds:` of the configuration or from the command line, goes to gateway/dds/fast/participant.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "config/model/outputs.h"
#include "gateway/base/time.h"

namespace baudgate::dds {

struct ParticipantOptions {
  int domain = 0;                       ///< 0…232
  std::vector<std::string> interfaces;  ///< addresses of this machine; empty or 0.0.0.0 = all
  std::size_t participants = 256;       ///< others in the domain; those beyond are not let in
  /// Who is silent for so long is taken for gone, and so are we by the others. Not below that of
  /// Cyclone DDS (10 s): it would forget us in a break of the link and we not it, and then nothing
  /// has the library introduce itself anew.
  Duration lease = config::kUsualLease;
  bool types = false;  ///< learn the types that others announce

  bool multicast = true;
  /// IPv4 addresses that are asked beside the multicast group.
  std::vector<std::string> peers{};
  std::vector<config::HostPort> discovery_servers{};
  /// Where subscribers were heard by the process before this one.
  std::vector<config::HostPort> reached{};
  config::DdsSecurity security{};
};

/// As the configuration has it.
ParticipantOptions ParticipantOf(const config::Dds& dds);

}  // namespace baudgate::dds
