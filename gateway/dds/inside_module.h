// What baudgate-dds-inside.so exports: a SampleWriter on Fast DDS, in the process that loads it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

#include "gateway/base/version.h"
#include "gateway/dds/participant_options.h"
#include "gateway/dds/sample_writer.h"

namespace baudgate::dds {

/// Module and daemon must be of one release and one compiler: C++ passes between them.
inline std::string InsideTag() {
  return std::string("baudgate-dds-inside ") + kVersion + " made by " __VERSION__;
}

}  // namespace baudgate::dds

extern "C" {
/// InsideTag of its build; asked before anything else.
const char* baudgate_dds_inside_tag();
/// `requests_for`, `events`: see CreateFastWriter. The caller owns what comes; null: `error` says
/// what in `dds:` to change.
baudgate::dds::SampleWriter* baudgate_dds_inside(
    const baudgate::dds::ParticipantOptions& participant, std::size_t points, std::size_t devices,
    const std::string& requests_for, std::size_t events, std::string& error);
}
