// SPDX-License-Identifier: Apache-2.0
#include "gateway/status/files_json.h"

#include <fmt/format.h>

#include <cerrno>

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

}  // namespace baudgate::control
