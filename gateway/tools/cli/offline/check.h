// `baudgate check`: prints the problems of a configuration and, if it has no errors, a summary.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "config/catalog/catalog.h"
#include "config/model/config.h"
#include "config/model/problem.h"

namespace baudgate::tools {

/// Exit codes: 0 the configuration can be used, even with warnings; 3 it cannot. Problems go to
/// `err` and a summary to `out`. With `json`, one object with problems and summary goes to `out`.
int RunCheck(const std::string& file, const config::Catalog& catalog, std::ostream& out,
             std::ostream& err, bool json);

void PrintProblems(const std::vector<config::Problem>& problems, std::ostream& err);

}  // namespace baudgate::tools
