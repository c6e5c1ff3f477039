// SPDX-License-Identifier: Apache-2.0
#include "config/names.h"

#include "config/checks/name_checks.h"

namespace baudgate::config {

std::optional<std::string> ReadName(MapReader& map, std::string_view example) {
  const auto node = map.Need("name", example);
  if (!node) return std::nullopt;
  auto name = ReadText(*node, "name", map.problems());
  if (!name) return std::nullopt;
  if (const Status status = CheckName(*name); !status) {
    map.problems().Error(node->mark(), "name: " + status.error());
    return std::nullopt;
  }
  map.Rename(map.what() + " '" + *name + "'");
  return name;
}

}  // namespace baudgate::config
