// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/scan/target.h"

#include "gateway/base/spelling.h"

namespace baudgate {

bool IsPort(const std::string& target) { return target.find('/') != std::string::npos; }

Status CheckTarget(const std::string& target) {
  if (IsPort(target) || target.find(':') == std::string::npos) return {};
  return Error{config::Quoted(target) +
               " is no line of a gateway; a serial server is written tcp://" + target};
}

}  // namespace baudgate
