// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/simulate/pty.h"

#include <fcntl.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <tuple>
#include <utility>

#include "gateway/base/text.h"
#include "transports/serial_settings.h"

namespace baudgate::tools {

// ServerOf finds the process by /proc/PID/fdinfo/FD: for the master of /dev/pts/7, this file
// contains "tty-index: 7".

namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPty = "/dev/pts/";
constexpr std::string_view kIndex = "tty-index:";

bool IsMasterOf(const fs::path& descriptor_info, int number) {
  std::ifstream info(descriptor_info);
  for (std::string line; std::getline(info, line);) {
    if (!line.starts_with(kIndex)) continue;
    return ParseInteger<int>(Trim(std::string_view(line).substr(kIndex.size()))) == number;
  }
  return false;
}

bool HoldsMasterOf(const fs::path& process, int number) {
  std::error_code hidden;
  for (const auto& one : fs::directory_iterator(process / "fdinfo", hidden)) {
    if (IsMasterOf(one.path(), number)) return true;
  }
  return false;
}

std::string HolderOf(int number) {
  std::error_code hidden;
  for (const auto& process : fs::directory_iterator("/proc", hidden)) {
    const auto id = ParseInteger<pid_t>(process.path().filename().native());
    if (!id || !HoldsMasterOf(process.path(), number)) continue;
    if (*id == getpid()) return "this program itself";
    std::ifstream file(process.path() / "comm");
    std::string name;
    std::getline(file, name);
    return (name.empty() ? "another program" : name) + " (pid " + std::to_string(*id) + ")";
  }
  return "another program";
}

bool IsLater(const timespec& a, const timespec& b) {
  return std::tie(a.tv_sec, a.tv_nsec) > std::tie(b.tv_sec, b.tv_nsec);
}

}  // namespace

std::optional<std::string> ServerOf(const std::string& link, const std::string& target) {
  if (!target.starts_with(kPty)) return std::nullopt;
  const auto number = ParseInteger<int>(std::string_view(target).substr(kPty.size()));
  struct stat made {};
  struct stat linked {};
  if (!number || stat(target.c_str(), &made) != 0 || lstat(link.c_str(), &linked) != 0) {
    return std::nullopt;
  }
  // Reading and writing a pty do not change its change time, so this is the time of its creation.
  if (IsLater(made.st_ctim, linked.st_mtim)) return std::nullopt;
  return HolderOf(*number);
}

namespace {

std::string LastError() { return std::strerror(errno); }

std::string LinkTarget(const std::string& link) {
  char target[256];
  const ssize_t size = readlink(link.c_str(), target, sizeof target);
  return size < 0 ? std::string() : std::string(target, static_cast<std::size_t>(size));
}

void CloseAndForget(int& fd) {
  if (fd >= 0) close(fd);
  fd = -1;
}

}  // namespace

Result<Pty> Pty::Create(const std::string& link) {
  Pty pty;
  if (const Status opened = pty.OpenPair(); !opened) return Error{opened.error()};
  if (!link.empty()) {
    if (const Status linked = pty.MakeLink(link); !linked) return Error{linked.error()};
  }
  return pty;
}

Pty::Pty(Pty&& other) noexcept { *this = std::move(other); }

Pty& Pty::operator=(Pty&& other) noexcept {
  if (this == &other) return *this;
  Unplug();
  master_ = std::exchange(other.master_, -1);
  slave_ = std::exchange(other.slave_, -1);
  slave_path_ = std::exchange(other.slave_path_, {});
  link_ = std::exchange(other.link_, {});
  return *this;
}

Status Pty::OpenPair() {
  master_ = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  char name[64];
  if (master_ < 0 || grantpt(master_) != 0 || unlockpt(master_) != 0 ||
      ptsname_r(master_, name, sizeof name) != 0) {
    return Error{"cannot make a pseudo terminal: " + LastError()};
  }
  slave_path_ = name;
  slave_ = open(name, O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (slave_ < 0) return Error{"cannot open " + slave_path_ + ": " + LastError()};
  return transports::MakeRaw(slave_);
}

Status Pty::MakeLink(const std::string& link) {
  struct stat there {};
  if (lstat(link.c_str(), &there) == 0 && !S_ISLNK(there.st_mode)) {
    return Error{link + " exists and is no link; choose another path"};
  }
  const std::string target = LinkTarget(link);
  if (!target.empty() && !target.starts_with("/dev/pts/")) {
    return Error{link + " is a link to " + target + ", which is no pty; choose another path"};
  }
  if (const auto server = ServerOf(link, target)) {
    return Error{link + " is a link to " + target + ", which is served by " + *server +
                 "; end this program first, or choose another path"};
  }
  // The link is replaced by rename, so that a reader always finds either the old or the new link.
  const std::string fresh = link + ".new-" + std::to_string(getpid());
  (void)unlink(fresh.c_str());
  if (symlink(slave_path_.c_str(), fresh.c_str()) != 0) {
    return Error{"cannot make the link " + link + ": " + LastError()};
  }
  if (rename(fresh.c_str(), link.c_str()) != 0) {
    const Error error{"cannot make the link " + link + ": " + LastError()};
    (void)unlink(fresh.c_str());
    return error;
  }
  link_ = link;
  return {};
}

int Pty::TakeMaster() { return std::exchange(master_, -1); }

void Pty::Unplug() {
  // While this object has the slave open, the number of the slave cannot be reused, so a link with
  // this target is the link of this object.
  if (!link_.empty() && LinkTarget(link_) == slave_path_) (void)unlink(link_.c_str());
  link_.clear();
  CloseAndForget(slave_);
  CloseAndForget(master_);
}

}  // namespace baudgate::tools
