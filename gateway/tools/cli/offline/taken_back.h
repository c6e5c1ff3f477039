// Whether the gateway has taken this very configuration back (docs/reload.md), for `baudgate
// check`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "config/model/config.h"
#include "config/model/problem.h"

namespace baudgate {

/// A warning; empty: it has not, for all that whoever asks may read.
std::optional<config::Problem> WhyTakenBack(const std::string& file, const config::Config& config);

}  // namespace baudgate
