// open(2), flock(2) and TIOCEXCL on the port, and the words for each way in which they fail.
// SPDX-License-Identifier: Apache-2.0
#include "transports/port_lock.h"

#include <fcntl.h>
#include <grp.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <vector>

#include "gateway/base/port_holders.h"
#include "gateway/base/text.h"
#include "transports/serial_settings.h"

namespace baudgate {
namespace {

std::string GroupOf(gid_t id) {
  group entry{};
  group* found = nullptr;
  std::vector<char> names(4096);
  if (getgrgid_r(id, &entry, names.data(), names.size(), &found) != 0 || found == nullptr) {
    return std::to_string(id);
  }
  return entry.gr_name;
}

std::string NotSerial(const std::string& port) {
  return port + " is not a serial port: correct port";
}

/// What stands in the place of the port, and what to do; empty: a device, or nothing.
std::string OtherThing(const std::string& port) {
  struct stat info {};
  if (stat(port.c_str(), &info) != 0) return {};
  if (S_ISDIR(info.st_mode)) return port + " is a folder, not a serial port: correct port";
  if (S_ISREG(info.st_mode)) {
    return port +
           " is an ordinary file, not a serial port: remove it (written while the adapter was "
           "away?), or correct port";
  }
  return S_ISCHR(info.st_mode) ? std::string() : NotSerial(port);
}

std::string NoSerialPort(const std::string& port) {
  const std::string other = OtherThing(port);
  return other.empty() ? NotSerial(port) : other;
}

std::string HowToAllow(const std::string& port) {
  struct stat info {};
  const bool known = stat(port.c_str(), &info) == 0;
  if (known && !IsGroupForPorts(info.st_gid, info.st_mode)) return HowToGive(port);
  const std::string group = known ? GroupOf(info.st_gid) : "dialout";
  return "add the user of the gateway to group " + group;
}

/// The process that holds a flock on the same inode, from /proc/locks:
/// "1: FLOCK  ADVISORY  WRITE 1234 00:05:87 0 EOF". Nothing when it is of another pid namespace.
std::optional<pid_t> LockHolder(int fd) {
  struct stat info {};
  if (fstat(fd, &info) != 0) return std::nullopt;
  char inode[64];
  std::snprintf(inode, sizeof inode, "%02x:%02x:%llu", major(info.st_dev), minor(info.st_dev),
                static_cast<unsigned long long>(info.st_ino));
  std::ifstream locks("/proc/locks");
  for (std::string line; std::getline(locks, line);) {
    std::vector<std::string_view> words;
    for (const std::string_view word : Split(line, ' ')) {
      if (!word.empty()) words.push_back(word);
    }
    if (words.size() < 6 || words[1] != "FLOCK" || words[5] != inode) continue;
    const auto holder = ParseInteger<pid_t>(words[4]);
    if (holder && *holder > 0) return holder;
  }
  return std::nullopt;
}

std::string Conflict(const std::string& port, std::optional<pid_t> holder) {
  if (!holder) {
    return port + " is in use by another program (" + NameHolders(port) + "); close it there first";
  }
  if (*holder == getpid()) return port + " is in use by another line of this gateway";
  std::ifstream file("/proc/" + std::to_string(*holder) + "/comm");
  std::string name;
  std::getline(file, name);
  if (name.empty()) name = "another program";
  return port + " is in use by " + name + " (pid " + std::to_string(*holder) +
         "); close it there first";
}

Status Lock(int fd, const std::string& port) {
  if (flock(fd, LOCK_EX | LOCK_NB) != 0) {
    if (errno == EWOULDBLOCK) return Error{Conflict(port, LockHolder(fd))};
    return Error{"cannot lock " + port + ": " + std::strerror(errno)};
  }
  // On a pty the flag would outlive us for as long as the other side keeps the pair open.
  if (IsPty(fd)) return {};
  int exclusive = 0;
  // Root may open a port that another program holds exclusively; it must not disturb that one.
  if (ioctl(fd, TIOCGEXCL, &exclusive) == 0 && exclusive != 0) {
    return Error{Conflict(port, std::nullopt)};
  }
  if (ioctl(fd, TIOCEXCL) != 0) {
    return Error{"cannot take " + port + " for this program alone: " + std::strerror(errno)};
  }
  return {};
}

}  // namespace

bool IsGroupForPorts(gid_t group, mode_t mode) { return group != 0 && (mode & 0060U) == 0060U; }

std::string HowToGive(const std::string& port) {
  return "sudo chgrp dialout " + port + " && sudo chmod 660 " + port +
         "; a udev rule makes it last";
}

std::string OpenErrorText(const std::string& port, int error) {
  switch (error) {
    case ENOENT:
    case ENXIO:
    case ENODEV:
      return "no such port " + port + "; is the adapter plugged in?";
    case EACCES:
    case EPERM:
      if (auto other = OtherThing(port); !other.empty()) return other;
      return "no permission for " + port + "; " + HowToAllow(port);
    case EBUSY:
      return Conflict(port, std::nullopt);
    case EISDIR:
    case ENOTDIR:
      return NoSerialPort(port);
    case EIO:
      return port + " exists but does not work (input/output error); is there hardware behind it?";
    default:
      return "cannot open " + port + ": " + std::strerror(error);
  }
}

Result<int> OpenExclusive(const std::string& port) {
  const int fd = open(port.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (fd < 0) return Error{OpenErrorText(port, errno)};
  if (isatty(fd) == 0) {
    const int error = errno;  // EIO: a port of the board without hardware behind it
    close(fd);
    return Error{error == EIO ? OpenErrorText(port, EIO) : NoSerialPort(port)};
  }
  if (const Status locked = Lock(fd, port); !locked) {
    close(fd);
    return Error{locked.error()};
  }
  return fd;
}

void ReleaseLocks(int fd) {
  if (!IsPty(fd)) (void)ioctl(fd, TIOCNXCL);
  (void)flock(fd, LOCK_UN);
}

}  // namespace baudgate
