// A text out of a request; what is no text, or not there, is empty.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gateway/status/status_json.h"

namespace baudgate::control {

inline std::string TextOf(const Json& request, const char* key) {
  const auto found = request.find(key);
  return found != request.end() && found->is_string() ? found->get<std::string>() : std::string();
}

}  // namespace baudgate::control
