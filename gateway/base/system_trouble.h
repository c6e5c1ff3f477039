// SystemTrouble names the cause and the cure of a failed system call in words for users. NoFileLeft
// and MostFileBytes tell limits of this process, and NameOfUser names a user. FindHolders and
// NameHolders find the programs that have a serial port open.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace baudgate {

/// `error`: an errno. "too many open files; raise LimitNOFILE of the service (ulimit -Hn)".
std::string SystemTrouble(int error);

/// The process has used up its file descriptors.
bool NoFileLeft();

/// The largest size of a file that this process may write, in bytes. Empty: no limit.
std::optional<std::size_t> MostFileBytes();

/// "baudgate"; of a user without a name its number. A name that was found once is remembered: it
/// counts while the users of the system cannot be read, or are not read within a second. From any
/// thread.
std::string NameOfUser(uid_t user);

// Which programs have a serial port open, as far as /proc shows it to us.
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
