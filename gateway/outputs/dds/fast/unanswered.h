// The remark about a participant that announces itself and confirms nothing. Pure; the
// participants come from gateway/outputs/dds/fast/participant_table.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace baudgate::dds {

/// `host`: where it listens. `on_this_machine`: that is an address of ours. `interfaces`: those of
/// our participant. Another Fast DDS on this machine sends to loopback where it uses it, and never
/// to an address of the machine that it does not use.
std::string UnansweredRemark(const std::string& host, bool on_this_machine,
                             const std::vector<std::string>& interfaces);

}  // namespace baudgate::dds
