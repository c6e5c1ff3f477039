// SPDX-License-Identifier: Apache-2.0
#include "gateway/status/put_aside.h"

#include <fmt/format.h>

#include "gateway/base/shown.h"

namespace baudgate::control {

std::string PutAsideAdvice(const std::filesystem::path& folder,
                           const std::vector<std::string>& files) {
  if (files.empty()) return {};
  const std::string first = (folder / files.front()).string();
  const std::string more = files.size() == 1 ? "" : fmt::format(" (and {} more)", files.size() - 1);
  return fmt::format(
      "{}{} was damaged and put aside, and what it holds is missing here: save it with 'sqlite3 {} "
      ".recover', then move it away",
      first, more, first);
}

}  // namespace baudgate::control
