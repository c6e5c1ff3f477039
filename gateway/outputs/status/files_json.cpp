// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/status/files_json.h"

#include <fmt/format.h>

#include <cerrno>

#include "gateway/base/shown.h"
#include "gateway/base/system_trouble.h"

namespace baudgate::control {

using Json = nlohmann::ordered_json;

namespace {

/// A database is three.
constexpr std::size_t kFew = 4;

}  // namespace

Json FilesJson(const FilesState& state) {
  Json advice = Json::array();
  if (state.limit != 0 && state.open + kFew > state.limit) {
    advice.push_back(
        fmt::format("{} of the {} that this process may have open are open, and what needs another "
                    "one fails: {}",
                    state.open, state.limit, SystemTrouble(EMFILE)));
  }
  for (const std::string& trouble : state.troubles) advice.push_back(trouble);
  return {{"open", state.open},
          {"limit", state.limit == 0 ? Json(nullptr) : Json(state.limit)},
          {"advice", std::move(advice)}};
}

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
