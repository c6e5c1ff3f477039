// `baudgate check`: reads a configuration and says what is wrong with it, or what it comes to.
// The file comes through config/loader; text or JSON goes to the streams of the caller.
// WhyTakenBack tells whether the gateway has taken this configuration back.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "config/catalog/catalog.h"
#include "config/model/config.h"
#include "config/model/problem.h"

namespace baudgate::tools {

// Whether the gateway has taken this very configuration back (docs/reload.md), for `baudgate
// check`.

/// Exit codes: 0 usable (warnings included), 3 not. Problems go to `err`, a summary to `out`; with
/// `json` both go to `out` as one object.
int RunCheck(const std::string& file, const config::Catalog& catalog, std::ostream& out,
             std::ostream& err, bool json);

/// One line each, as `check` prints them; for every command that loads a configuration or a
/// profile.
void PrintProblems(const std::vector<config::Problem>& problems, std::ostream& err);

}  // namespace baudgate::tools
