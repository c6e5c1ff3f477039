// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/bundle/system_log.h"

#include <array>
#include <cstdio>
#include <memory>

namespace baudgate {

Result<std::string> SystemLog() {
  constexpr const char* kCommand =
      "journalctl --quiet --no-pager --utc --output=short-iso-precise --lines=5000 "
      "--unit=baudgate --unit=baudgate-dds 2>/dev/null";
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(::popen(kCommand, "r"), ::pclose);
  if (!pipe) return Error{"journalctl cannot be started"};
  std::string text;
  std::array<char, 65536> chunk{};
  while (const std::size_t count = std::fread(chunk.data(), 1, chunk.size(), pipe.get())) {
    text.append(chunk.data(), count);
  }
  if (!text.empty()) return text;
  return Error{
      "journalctl has no line of the service: it is not installed, the gateway is not run by "
      "systemd, or you may not read its journal (group adm or systemd-journal, or sudo)"};
}

}  // namespace baudgate
