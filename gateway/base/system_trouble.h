// `SystemTrouble` describes a failed system call for users, with cause and cure. NoFileLeft and
// MostFileBytes return limits of this process. NameOfUser returns the name of a user. FindHolders
// and NameHolders return the programs that have a serial port open.
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

/// Returns words for `error`, an errno value: "too many open files; raise LimitNOFILE of the
/// service (ulimit -Hn)".
std::string SystemTrouble(int error);

/// True if the process has used up its file descriptors.
bool NoFileLeft();

/// Returns the largest size of a file that this process is allowed to write, in bytes; nothing: no
/// limit.
std::optional<std::size_t> MostFileBytes();

/// Returns the name of the user, such as "baudgate", or the number of a user without a name. A name
/// that was found once is remembered, and returned if the user database cannot be read or does not
/// answer within a second. Thread-safe.
std::string NameOfUser(uid_t user);

// The programs that have a serial port open, as far as this process may read /proc.
struct PortHolders {
  struct Program {
    int pid = 0;
    std::string name;
  };
  std::map<std::string, std::vector<Program>> by_port;  ///< key: the name below /dev, "ttyUSB0"
  bool all_seen = true;  ///< false: some programs of other users could not be read
};

/// Reads the folder proc below `root`. `root` is "/", or in tests another folder.
PortHolders FindHolders(const std::filesystem::path& root);

/// Returns the other programs that have the port open: "mbpoll, pid 4711". If no program is
/// visible, for example because it runs as another user, returns a command that finds the program:
/// "find it with: fuser -v /dev/ttyUSB0".
std::string NameHolders(const std::string& port);

}  // namespace baudgate
