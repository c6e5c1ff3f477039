// Which programs have a serial port open, as far as /proc shows it to us.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace baudgate {

struct PortHolders {
  struct Program {
    int pid = 0;
    std::string name;
  };
  std::map<std::string, std::vector<Program>> by_port;  ///< by the name below /dev, "ttyUSB0"
  bool all_seen = true;  ///< false: there are programs of others, whose files we may not see
};

/// `root`: "/", or a tree with proc.
PortHolders FindHolders(const std::filesystem::path& root);

/// Names the other programs that have the port open: "mbpoll, pid 4711". If none is visible to us,
/// for example because it runs as another user, the text is a command that finds it:
/// "fuser -v /dev/ttyUSB0".
std::string NameHolders(const std::string& port);

}  // namespace baudgate
