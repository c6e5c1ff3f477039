// `baudgate config migrate`: a configuration, or a profile, in the words of today.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ostream>
#include <string>

#include "config/catalog/catalog.h"

namespace baudgate {

struct MigrateOptions {
  std::string file;
  bool in_place = false;  ///< the old one becomes FILE.bak; else the new one is printed
  std::string protocol;   ///< of a profile, whose file does not say it
};

/// What is changed goes to `err`. Exit codes: 0 done, or nothing to do; 2 a profile without its
/// protocol; 3 it is no YAML, or a place has to be changed by hand; 4 it can not be read or
/// written. Whatever is not 0, the file is as it was.
int RunMigrate(const MigrateOptions& options, const config::Catalog& catalog, std::ostream& out,
               std::ostream& err);

}  // namespace baudgate
