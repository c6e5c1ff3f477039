// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/terminal/command_end.h"

#include <iostream>

#include "gateway/base/exit_code.h"

namespace baudgate::tools {

int AfterOutput(int code) {
  if (std::cout.flush() || code != 0) return code;
  pollfd output{STDOUT_FILENO, 0, 0};
  if (::poll(&output, 1, 0) == 1 && (output.revents & (POLLERR | POLLHUP)) != 0) return code;
  std::cerr << "baudgate: standard output cannot be written; check free space on the disk\n";
  return kExitCanNot;
}

}  // namespace baudgate::tools
