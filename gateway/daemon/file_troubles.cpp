// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/file_troubles.h"

#include <utility>

#include "gateway/base/log.h"

namespace baudgate {

std::vector<std::string> FileTroubles::Held::All() const {
  std::vector<std::string> all;
  const MutexLock lock(mutex);
  for (const auto& [file, trouble] : troubles) all.push_back(trouble);
  return all;
}

std::string FileTroubles::Held::Set(const std::string& file, const std::string& trouble) {
  const MutexLock lock(mutex);
  if (trouble.empty()) {
    const auto found = troubles.extract(file);
    return found.empty() ? std::string() : found.mapped();
  }
  return std::exchange(troubles[file], trouble);
}

/// The log hears of the first trouble and of its end.
std::function<void(const std::string& trouble)> FileTroubles::Reporter(const std::string& file) {
  return [held = held_, file](const std::string& trouble) {
    const std::string was = held->Set(file, trouble);
    if (was.empty() && !trouble.empty()) log::Warn("{}", trouble);
    if (!was.empty() && trouble.empty()) log::Info("{} is written again", file);
  };
}

}  // namespace baudgate
