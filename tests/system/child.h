// `Child` is a child process of a system test: the daemon, a simulated device, mbpoll or a
// subscriber. Its output goes to files in the test's directory. It dies with the test.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "gateway/base/time.h"

namespace baudgate::system_test {

/// Under the thread sanitizer, programs take this many times longer.
#ifdef __SANITIZE_THREAD__
constexpr int kSlower = 4;
#else
constexpr int kSlower = 1;
#endif
/// The time limit of every wait. A result may be late in a test, but if it takes longer, the test
/// fails.
constexpr Duration kPatience = kSlower * 20s;
/// The duration of a release or trial in which a test runs two or three commands.
constexpr Duration kLongEnough = kSlower * 3s;
/// The interval at which the thread of a cable or slave checks whether to end.
constexpr int kPollMilliseconds = 20;

template <typename Condition>
bool Eventually(Condition condition, Duration limit = kPatience) {
  const Instant deadline = std::chrono::steady_clock::now() + limit;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(10ms);
  }
  return true;
}

class Child {
 public:
  using Environment = std::map<std::string, std::string>;

  /// Starts words[0] (from PATH) in `directory`. The calling thread must live as long as the child.
  /// `environment` is added to the test's own.
  Child(const std::vector<std::string>& words, const std::filesystem::path& directory,
        const Environment& environment = {});
  ~Child();
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  pid_t id() const { return id_; }
  void Signal(int number) const;
  bool Running();
  /// Returns the exit code, or 128 + signal; nothing if the child still runs after `limit`.
  std::optional<int> WaitForEnd(Duration limit = kPatience);

  std::string Output() const;
  std::string Errors() const;

 private:
  pid_t id_ = -1;
  std::optional<int> ended_;
  std::filesystem::path pty_;
  std::filesystem::path output_;
  std::filesystem::path errors_;
};

struct Finished {
  int code = -1;  ///< exit code, or 128 + signal; -1: the test had to kill the child
  std::string output;
  std::string errors;
};
Finished RunToEnd(const std::vector<std::string>& words, const std::filesystem::path& directory,
                  const Child::Environment& environment = {}, Duration limit = 60s);

std::string ReadWholeFile(const std::filesystem::path& file);

}  // namespace baudgate::system_test
