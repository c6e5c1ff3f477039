// A Fast DDS participant with the gateway's settings, for publisher and subscriber alike: which
// transports, which interfaces, how fast a crash is noticed.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "gateway/base/result.h"

namespace eprosima::fastdds::dds {
class DomainParticipant;
}

namespace baudgate::dds {

struct ParticipantOptions {
  int domain = 0;                       ///< 0…232
  std::vector<std::string> interfaces;  ///< addresses of this machine; empty or 0.0.0.0 = all
  bool shared_memory = false;           ///< between processes of one user only
};

/// The error names what to change. No XML profile file is ever read.
Result<eprosima::fastdds::dds::DomainParticipant*> CreateParticipant(
    const ParticipantOptions& options);

/// With all that it contains.
void DeleteParticipant(eprosima::fastdds::dds::DomainParticipant* participant);

}  // namespace baudgate::dds
