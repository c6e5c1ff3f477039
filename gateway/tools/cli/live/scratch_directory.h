// A directory of a command's own, gone when the command ends.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>

namespace baudgate {

class ScratchDirectory {
 public:
  /// In the temporary directory, readable by nobody else. `command` is part of its name.
  explicit ScratchDirectory(const std::string& command) {
    const std::string name = "baudgate-" + command + "-XXXXXX";
    std::string form = (std::filesystem::temp_directory_path() / name).string();
    if (mkdtemp(form.data()) != nullptr) path_ = form;
  }
  ~ScratchDirectory() {
    std::error_code ignored;
    if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
  }
  ScratchDirectory(const ScratchDirectory&) = delete;
  ScratchDirectory& operator=(const ScratchDirectory&) = delete;

  /// Empty: it could not be made.
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace baudgate
