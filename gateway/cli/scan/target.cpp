// SPDX-License-Identifier: Apache-2.0
#include "gateway/cli/scan/target.h"

#include "gateway/base/spelling.h"

namespace baudgate {

bool IsPort(const std::string& target) { return target.find('/') != std::string::npos; }

Status CheckTarget(const std::string& target) {
  if (IsPort(target)) return {};
  const std::string quoted = config::Quoted(target);
  if (target.find(':') != std::string::npos) {
    return Error{quoted + " is no line of a gateway; a serial server is written tcp://" + target};
  }
  if (target.starts_with("tty")) {
    return Error{quoted + " is no port; write /dev/" + target};
  }
  return {};
}

}  // namespace baudgate
