// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/client/in_use.h"

#include "gateway/tools/cli/client/control_client.h"

namespace baudgate {

int RunInUse(const InUseOptions& options, std::ostream& out, std::ostream& err) {
  ControlClient::Json answer;
  const ControlClient::Json request = {{"command", options.in_use ? "enable" : "disable"},
                                       {"target", options.target}};
  if (const int code = Ask(options.socket, request, answer, err); code != 0) return code;
  out << options.target
      << (options.in_use ? ": in use, it is asked again"
                         : ": out of use, it is not asked and its points are out of service");
  // Said only where the restart changes something.
  if (answer.value("enabled", true) != options.in_use) {
    out << ". A restart forgets this: 'enabled: " << (options.in_use ? "true" : "false")
        << "' in the configuration keeps it";
  }
  out << '\n';
  return 0;
}

}  // namespace baudgate
