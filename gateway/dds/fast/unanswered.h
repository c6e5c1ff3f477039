// What people are told of a participant that announces itself and confirms nothing. Pure; the
// participants come from gateway/dds/fast/participant_table.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace baudgate::dds {

/// `host`: where it listens. `on_this_machine`: that is an address of ours. `interfaces`: those of
/// our participant. A library on this machine sends to loopback, or to nothing that it does not use
/// itself, so both sides need the same addresses.
std::string UnansweredRemark(const std::string& host, bool on_this_machine,
                             const std::vector<std::string>& interfaces);

}  // namespace baudgate::dds
