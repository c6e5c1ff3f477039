// `baudgate profiles --check FILE`: all that is wrong with a profile, or its register table.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ostream>
#include <string>

#include "config/catalog/catalog.h"
#include "gateway/tools/cli/offline/profiles.h"

namespace baudgate {

struct CheckProfileOptions {
  std::string file;
  std::string protocol{};  ///< empty: that of its folder, or the one that it fits best
  ProfileFormat format = ProfileFormat::table;
  std::size_t width = 0;
};

/// Exit codes: 0 it can be used, warnings included; 2 no such protocol; 3 it is bad; 4 it cannot
/// be read.
int RunCheckProfile(const CheckProfileOptions& options, const config::Catalog& catalog,
                    std::ostream& out, std::ostream& err);

}  // namespace baudgate
