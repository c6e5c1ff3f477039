// SPDX-License-Identifier: Apache-2.0
#include "config/model/mark.h"

namespace baudgate::config {

std::string Mark::ToString() const {
  return *file + ":" + std::to_string(line) + ":" + std::to_string(column);
}

const Mark& Keys::MarkOf(std::string_view key) const {
  const auto found = values.find(key);
  return found == values.end() ? map : found->second;
}

}  // namespace baudgate::config
