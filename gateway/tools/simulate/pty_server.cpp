// /proc/PID/fdinfo/FD of the master has "tty-index: 7" for /dev/pts/7.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/simulate/pty_server.h"

#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <system_error>
#include <tuple>

#include "gateway/base/text.h"

namespace baudgate {
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
  // Reading and writing leave the change time of a pty alone.
  if (IsLater(made.st_ctim, linked.st_mtim)) return std::nullopt;
  return HolderOf(*number);
}

}  // namespace baudgate
