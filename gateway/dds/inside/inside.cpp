// The module for `dds: { process: inside }`: Fast DDS in the daemon's own process. Loaded by
// gateway/daemon/dds_output.cpp; the daemon itself links no Fast DDS.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/dds/fast/fast_writer.h"
#include "gateway/dds/inside_module.h"

extern "C" {

const char* baudgate_dds_inside_tag() {
  static const std::string tag = baudgate::dds::InsideTag();
  return tag.c_str();
}

baudgate::dds::SampleWriter* baudgate_dds_inside(
    const baudgate::dds::ParticipantOptions& participant, std::size_t points, std::size_t devices,
    const std::string& requests_for, std::size_t events, std::string& error) {
  auto writer = baudgate::dds::CreateFastWriter(participant, points, devices, requests_for, events);
  if (writer) return writer->release();
  error = writer.error();
  return nullptr;
}
}
