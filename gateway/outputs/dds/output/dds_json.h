// How it stands with the DDS output, as JSON and as a sentence: a part of `baudgate status`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>

#include "gateway/base/time.h"
#include "gateway/outputs/dds/link/link_state.h"

namespace baudgate::dds {

/// docs/status.md has the fields; `advice` has a sentence for each thing that is wrong.
nlohmann::ordered_json DdsJson(int domain, const dds::LinkState& state, Instant now);

}  // namespace baudgate::dds
