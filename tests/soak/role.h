// `Role` is a child process of a soak. Setting and Number read the environment.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <string>

#include "gateway/base/time.h"
#include "tests/support/long_run.h"

namespace baudgate::soak {

inline std::string Setting(const char* name, const std::string& usual) {
  const char* given = std::getenv((std::string("BAUDGATE_SOAK_") + name).c_str());
  return given == nullptr ? usual : given;
}
inline std::size_t Number(const char* name, std::size_t usual) {
  return baudgate::Setting(("BAUDGATE_SOAK_" + std::string(name)).c_str(), usual);
}
inline Instant Now() { return ReadClocks().instant; }

inline std::uint64_t LoopbackBytes() {
  std::ifstream file("/proc/self/net/dev");
  for (std::string word; file >> word;) {
    std::uint64_t bytes = 0;
    if (word == "lo:" && file >> bytes) return bytes;
  }
  return 0;
}

/// A child process. It is killed by SIGKILL when this object is destroyed or this process dies.
class Role {
 public:
  explicit Role(const std::function<void()>& run) : id_(::fork()) {
    if (id_ != 0) return;
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    run();
    ::_exit(1);
  }
  ~Role() {
    if (id_ <= 0) return;
    ::kill(id_, SIGKILL);
    ::waitpid(id_, nullptr, 0);
  }
  Role(const Role&) = delete;
  Role& operator=(const Role&) = delete;

  double ProcessorSeconds() const {
    std::ifstream file(Folder() + "stat");
    std::string word;
    for (int i = 0; i < 13; ++i) file >> word;
    double user = 0;
    double system = 0;
    file >> user >> system;
    return (user + system) / static_cast<double>(::sysconf(_SC_CLK_TCK));
  }
  std::size_t MemoryKiB() const {
    std::ifstream file(Folder() + "status");
    for (std::string word; file >> word;) {
      std::size_t kib = 0;
      if (word == "VmRSS:" && file >> kib) return kib;
    }
    return 0;
  }

 private:
  std::string Folder() const { return "/proc/" + std::to_string(id_) + "/"; }
  pid_t id_;
};

}  // namespace baudgate::soak
