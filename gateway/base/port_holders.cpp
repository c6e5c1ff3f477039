// SPDX-License-Identifier: Apache-2.0
#include "gateway/base/port_holders.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <set>

#include "gateway/base/shown.h"
#include "gateway/base/text.h"

namespace baudgate {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kDevices = "/dev/";

std::string NameOf(const fs::path& process) {
  std::ifstream file(process / "comm");
  std::string name;
  std::getline(file, name);
  return name.empty() ? "a program" : Harmless(name);
}

}  // namespace

PortHolders FindHolders(const fs::path& root) {
  PortHolders holders;
  std::error_code error;
  for (const auto& process : fs::directory_iterator(root / "proc", error)) {
    const auto pid = ParseInteger<int>(process.path().filename().string());
    if (!pid) continue;
    std::error_code hidden;
    fs::directory_iterator files(process.path() / "fd", hidden);
    if (hidden == std::errc::permission_denied) holders.all_seen = false;
    std::set<std::string> held;
    for (; !hidden && files != fs::directory_iterator(); files.increment(hidden)) {
      std::error_code gone;
      const std::string target = fs::read_symlink(files->path(), gone).string();
      if (target.starts_with(kDevices)) held.insert(target.substr(kDevices.size()));
    }
    for (const std::string& port : held) {
      holders.by_port[port].push_back({*pid, NameOf(process.path())});
    }
  }
  for (auto& [port, programs] : holders.by_port) {
    std::ranges::sort(programs, {}, &PortHolders::Program::pid);
  }
  return holders;
}

std::string NameHolders(const std::string& port) {
  std::error_code none;
  const std::string path = fs::canonical(port, none).string();
  std::string names;
  if (path.starts_with(kDevices)) {
    PortHolders holders = FindHolders("/");
    for (const auto& program : holders.by_port[path.substr(kDevices.size())]) {
      if (program.pid == getpid()) continue;
      names += (names.empty() ? "" : ", ") + program.name + ", pid " + std::to_string(program.pid);
    }
  }
  return names.empty() ? "fuser -v " + port : names;
}

}  // namespace baudgate
