// What a file of XML QoS profiles (`dds.profiles`) may not say, because the gateway's contract or
// its safety depends on it. Text comes from gateway/dds/fast/qos_profiles.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <set>
#include <string>

#include "gateway/base/result.h"

namespace baudgate::dds {

/// Names of profiles that are there, and that we use.
struct OwnProfiles {
  bool participant = false;       ///< `baudgate`
  std::set<std::string> writers;  ///< `baudgate/points`, `baudgate/devices`, …: by topic
};

inline constexpr char kParticipantProfile[] = "baudgate";

/// The error names file, line and element. Profiles of other names are for others: not looked at.
Result<OwnProfiles> CheckProfiles(const std::string& file, const std::string& text);

}  // namespace baudgate::dds
