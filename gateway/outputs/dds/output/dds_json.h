// `DdsJson` returns the state of the DDS output as JSON and sentences, for `baudgate status`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>

#include "gateway/base/time.h"
#include "gateway/outputs/dds/link/link_state.h"

namespace baudgate::dds {

/// Returns the fields that docs/status-reference.md describes. The field "advice" contains a
/// sentence for each fault.
nlohmann::ordered_json DdsJson(int domain, const dds::LinkState& state, Instant now);

}  // namespace baudgate::dds
