// A configuration or profile of an older baudgate in the words of today: only those words change,
// comments and order stay. A file goes in; what it would be goes to gateway/cli/offline/migrate.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "config/model/problem.h"
#include "config/renames.h"

namespace baudgate::config {

struct Migration {
  FileKind kind = FileKind::configuration;
  std::string before;
  std::string after;  ///< where there is no problem
  std::vector<Renamed> changes;
  bool readable = false;
  std::vector<Problem> problems;  ///< it can not be read, is no YAML, or is to be changed by hand
};

/// `protocol`: of a profile, whose file does not say it.
Migration MigrateFile(const std::string& path, std::string_view protocol);

}  // namespace baudgate::config
