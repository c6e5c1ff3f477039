// `baudgate check`: prints the problems of a configuration, or what it configures.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "config/catalog/catalog.h"
#include "config/model/config.h"
#include "config/model/problem.h"

namespace baudgate::tools {

/// Exit codes: 0 usable, warnings included; 3 not usable. Problems go to `err`, a summary to `out`;
/// with `json` everything goes to `out` as one object.
int RunCheck(const std::string& file, const config::Catalog& catalog, std::ostream& out,
             std::ostream& err, bool json);

/// Prints problems, one on each line.
void PrintProblems(const std::vector<config::Problem>& problems, std::ostream& err);

}  // namespace baudgate::tools
