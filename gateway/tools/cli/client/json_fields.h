// Members of an answer of the gateway.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

namespace baudgate {

/// A number that is always there.
inline std::uint64_t Number(const nlohmann::ordered_json& json, const char* key) {
  return json.at(key).get<std::uint64_t>();
}
inline std::string NumberText(const nlohmann::ordered_json& json, const char* key) {
  return std::to_string(Number(json, key));
}
inline std::string Text(const nlohmann::ordered_json& json, const char* key) {
  return json.at(key).get<std::string>();
}

/// Empty where there is none, or no text.
inline std::string TextOf(const nlohmann::ordered_json& json, const char* key) {
  const auto found = json.find(key);
  return found != json.end() && found->is_string() ? found->get<std::string>() : std::string();
}

}  // namespace baudgate
