// `baudgate enable` and `baudgate disable`: whether a device is asked, until the gateway restarts.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ostream>
#include <string>

namespace baudgate {

struct InUseOptions {
  std::string target;  ///< "LINE.DEVICE"
  bool in_use = true;
  std::string socket;  ///< empty: the gateway in the default places
};

/// Exit code 0; 2 for an unknown device; 4 when no gateway answers.
int RunInUse(const InUseOptions& options, std::ostream& out, std::ostream& err);

}  // namespace baudgate
