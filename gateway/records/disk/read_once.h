// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <utility>

#include "gateway/base/result.h"
#include "gateway/records/disk/database.h"

namespace baudgate {

/// One read, in a connection that ends with it; all of it is of the same moment. `damaged`, where
/// it is given: set if SQLite has found that the file is.
template <typename Read>
auto ReadOnce(const std::filesystem::path& file, bool* damaged, Read read)
    -> decltype(read(std::declval<Database&>())) {
  Database database(file.string(), Database::Mode::read);
  const auto failed = [&](const std::string& why) {
    if (damaged != nullptr) *damaged = database.damaged();
    return Error{file.string() + ": " + why};
  };
  if (!database.is_open() || !database.Execute("BEGIN")) return failed(database.error());
  auto read_back = read(database);
  if (!read_back) return failed(read_back.error());
  return read_back;
}

}  // namespace baudgate
