// What `baudgate check` says of the files of DDS Security.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "config/model/config.h"
#include "config/model/problem.h"
#include "gateway/base/time.h"

namespace baudgate {

/// Adds to `problems`; gives a line for the summary: "CN=baudgate, until 2031-11-21". Empty: DDS is
/// off, or open to everybody.
std::string CheckDdsSecurity(const config::Config& config, WallTime now,
                             std::vector<config::Problem>& problems);

}  // namespace baudgate
