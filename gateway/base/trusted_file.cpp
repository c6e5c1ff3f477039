// SPDX-License-Identifier: Apache-2.0
#include "gateway/base/trusted_file.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <system_error>

#include "gateway/base/system_trouble.h"

namespace baudgate {

namespace fs = std::filesystem;

namespace {

/// Checks `path` and all folders above it. `path` has no symbolic links.
std::string WhyNot(const fs::path& path) {
  for (fs::path one = path;; one = one.parent_path()) {
    struct stat its {};
    if (::lstat(one.c_str(), &its) != 0) return {};
    if (its.st_uid != 0 && its.st_uid != ::geteuid()) {
      return fmt::format("{} can be changed by user '{}', to whom {} belongs; run: chown root {}",
                         path.string(), NameOfUser(its.st_uid), one.string(), one.string());
    }
    const bool sticky = S_ISDIR(its.st_mode) && (its.st_mode & S_ISVTX) != 0;
    const bool by_group = (its.st_mode & S_IWGRP) != 0 && its.st_gid != 0;
    if (!sticky && (by_group || (its.st_mode & S_IWOTH) != 0)) {
      return fmt::format("{} can be changed by other users; run: chmod go-w {}", path.string(),
                         one.string());
    }
    if (one == one.parent_path()) return {};
  }
}

}  // namespace

std::string WhyNotTrusted(const fs::path& file) {
  std::error_code error;
  const fs::path target = fs::canonical(file, error);
  if (error) return {};
  if (std::string why = WhyNot(target); !why.empty()) return why;
  const fs::path folder = fs::canonical(fs::absolute(file).parent_path(), error);
  return error ? std::string() : WhyNot(folder);
}

}  // namespace baudgate
