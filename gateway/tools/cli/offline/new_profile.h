// `baudgate profiles --new FROM.csv`: a profile from a device's register list.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <ostream>
#include <string>

#include "config/catalog/catalog.h"
#include "gateway/tools/cli/offline/register_list.h"

namespace baudgate {

struct NewProfileOptions {
  std::string file;
  std::optional<FirstRegister> first{};
  std::string table = "holding";  ///< of numbers that tell none
  std::string title{};            ///< `device:`; empty: the file's name
};

/// The profile goes to `out`, or nothing does. Exit codes: 0 done, 2 it is not said what the first
/// register is called, 3 the list has errors (all go to `err`), 4 it cannot be read.
int RunNewProfile(const NewProfileOptions& options, const config::Catalog& catalog,
                  std::ostream& out, std::ostream& err);

}  // namespace baudgate
