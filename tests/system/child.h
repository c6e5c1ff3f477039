// Child processes of the system tests: the daemon, twins, mbpoll and subscribers. What they print
// goes to files in the test's directory; whatever happens to the test, they die with it.
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

/// How many times longer programs take under the thread sanitizer.
#ifdef __SANITIZE_THREAD__
constexpr int kSlower = 4;
#else
constexpr int kSlower = 1;
#endif
/// How long a test waits for an event before it fails. Nothing is concluded from being fast.
constexpr Duration kPatience = kSlower * 20s;
/// The time of a release or of a trial within which a test runs two or three commands.
constexpr Duration kLongEnough = kSlower * 3s;
/// How often a thread of a cable or a slave looks whether it shall end.
constexpr int kPollMilliseconds = 20;

/// Asks again and again until `condition` holds; false when it did not within `limit`.
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

  /// Starts words[0] (looked up in PATH) with `directory` as its working directory; call it from
  /// the thread that lives as long as the child. `environment` is added to the test's own.
  Child(const std::vector<std::string>& words, const std::filesystem::path& directory,
        const Environment& environment = {});
  ~Child();
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  pid_t id() const { return id_; }
  void Signal(int number) const;
  bool Running();
  /// Its exit code, or 128 + the signal that ended it; nothing when it still runs after `limit`.
  std::optional<int> WaitForEnd(Duration limit = kPatience);

  std::string Output() const;  ///< standard output so far
  std::string Errors() const;  ///< standard error so far

 private:
  pid_t id_ = -1;
  std::optional<int> ended_;
  std::filesystem::path pty_;  // of a twin: the link to it
  std::filesystem::path output_;
  std::filesystem::path errors_;
};

/// A command that ends by itself.
struct Finished {
  int code = -1;  ///< as of WaitForEnd; -1: it had to be killed
  std::string output;
  std::string errors;
};
Finished RunToEnd(const std::vector<std::string>& words, const std::filesystem::path& directory,
                  const Child::Environment& environment = {}, Duration limit = 60s);

std::string ReadWholeFile(const std::filesystem::path& file);

}  // namespace baudgate::system_test
