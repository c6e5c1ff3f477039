// `CursorFile` is outlet-NAME.db in the state folder: up to where the receiver of an outlet has the
// values of the history. Used by one thread.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "gateway/base/result.h"
#include "gateway/records/disk/database_file.h"
#include "gateway/records/history/kept_reader.h"

namespace baudgate::outlet {

class CursorFile {
 public:
  /// `vfs`: as in Database.
  explicit CursorFile(std::filesystem::path path, std::string vfs = {})
      : path_(std::move(path)), vfs_(std::move(vfs)) {}

  /// Opens the file unless it is open. If a damaged file was put aside, `news` receives a sentence.
  Status Open(std::string& news);
  /// Returns the stored place; empty: none is stored. To be called after Open.
  Result<std::optional<history::Pass>> Load();
  /// Opens the file if necessary, also if it was removed. A kill of the process loses nothing that
  /// Save has written; a power cut can lose the last writes.
  Status Save(const history::Pass& pass);

 private:
  Error Failed();

  const std::filesystem::path path_;
  const std::string vfs_;
  std::unique_ptr<records::Database> database_;
  records::OpenFile open_;
};

}  // namespace baudgate::outlet
