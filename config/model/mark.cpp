// SPDX-License-Identifier: Apache-2.0
#include "config/model/mark.h"

namespace baudgate::config {

std::string Mark::ToString() const {
  return file + ":" + std::to_string(line) + ":" + std::to_string(column);
}

}  // namespace baudgate::config
