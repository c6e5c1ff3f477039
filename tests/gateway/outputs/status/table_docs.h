// Compares a table of counters (gateway/bus/points/counted.h) with docs/status-reference.md.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "gateway/bus/points/counted.h"

namespace baudgate::status {

inline nlohmann::ordered_json Known(const nlohmann::ordered_json& json,
                                    const nlohmann::ordered_json& expected) {
  nlohmann::ordered_json known;
  for (const auto& [key, value] : json.items()) {
    if (expected.contains(key)) known[key] = value;
  }
  return known;
}

/// Returns keys that occur twice, or that are missing in the table `| of |` of
/// docs/status-reference.md.
template <config::HasFields T>
std::vector<std::string> TroublesOfKeys(const std::string& of) {
  std::ifstream file("docs/status-reference.md");
  std::string page{std::istreambuf_iterator<char>(file), {}};
  const std::size_t begin = page.find("| " + of + " |");
  if (begin == std::string::npos)
    return {"no table of docs/status-reference.md has the head " + of};
  page = page.substr(begin, page.find("\n\n", begin) - begin);
  std::vector<std::string> troubles;
  std::set<std::string> keys;
  VisitFields(static_cast<const T*>(nullptr), [&](auto row) {
    if constexpr (row.in_json) {
      const std::string key(row.key);
      if (!keys.insert(key).second) troubles.push_back(key + " stands twice");
      if (page.find("`" + key + "`") == std::string::npos) troubles.push_back(key + ": no row");
    }
  });
  return troubles;
}

}  // namespace baudgate::status
