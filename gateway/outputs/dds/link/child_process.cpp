// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/link/child_process.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <thread>
#include <utility>

#include "gateway/base/shown.h"

namespace baudgate::dds {

std::vector<std::string> BoundedLines::Add(std::string_view bytes, Instant now) {
  std::vector<std::string> lines;
  for (const char c : bytes) {
    if (c == '\n') {
      Finish(now, lines);
    } else if (line_.size() < kLongest) {
      line_ += c;
    }
  }
  return lines;
}

void BoundedLines::Finish(Instant now, std::vector<std::string>& lines) {
  const std::string line = Harmless(std::exchange(line_, {}));
  if (line.empty()) return;
  if (now >= period_end_) {
    period_end_ = now + kPeriod;
    told_ = 0;
    if (const std::size_t count = std::exchange(left_out_, 0); count > 0) {
      lines.push_back(std::to_string(count) + " lines were left out");
    }
  }
  if (told_ < kMost) {
    ++told_;
    lines.push_back(line);
  } else {
    ++left_out_;
  }
}

namespace {

namespace fs = std::filesystem;

constexpr Duration kReapPause = 2ms;

std::string EndOf(int status) {
  if (WIFSIGNALED(status)) return "was ended by signal " + std::to_string(WTERMSIG(status));
  return "ended with exit code " + std::to_string(WEXITSTATUS(status));
}

/// The settings of posix_spawn. fork is not used, because between fork and exec a process with
/// threads can call almost nothing safely.
struct SpawnSettings {
  SpawnSettings() {
    posix_spawn_file_actions_init(&actions);
    posix_spawnattr_init(&attributes);
  }
  ~SpawnSettings() {
    posix_spawn_file_actions_destroy(&actions);
    posix_spawnattr_destroy(&attributes);
  }
  SpawnSettings(const SpawnSettings&) = delete;
  SpawnSettings& operator=(const SpawnSettings&) = delete;

  void UseDescriptors(int output, int link) {
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    // The output is duplicated first, because the pipe may have the number kLinkDescriptor, which
    // the last dup2 overwrites.
    posix_spawn_file_actions_adddup2(&actions, output, STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions, output, STDERR_FILENO);
    posix_spawn_file_actions_adddup2(&actions, link, kLinkDescriptor);
    posix_spawn_file_actions_addclosefrom_np(&actions, kLinkDescriptor + 1);
  }
  /// Sets the child's signals: none is blocked or ignored, unlike in this process.
  void UseSignals() {
    sigset_t none;
    sigset_t all;
    sigemptyset(&none);
    sigfillset(&all);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setsigdefault(&attributes, &all);
    posix_spawnattr_setpgroup(&attributes, 0);
    posix_spawnattr_setflags(
        &attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
  }

  posix_spawn_file_actions_t actions{};
  posix_spawnattr_t attributes{};
};

}  // namespace

Result<ChildProcess> ChildProcess::Start(const std::string& program,
                                         const std::vector<std::string>& arguments,
                                         const Descriptor& link) {
  int pipe_ends[2];
  if (::pipe2(pipe_ends, O_CLOEXEC) != 0) {
    return Error{std::string("no pipe: ") + std::strerror(errno)};
  }
  Descriptor reading(pipe_ends[0]);
  const Descriptor writing(pipe_ends[1]);
  ::fcntl(reading.get(), F_SETFL, O_NONBLOCK);

  SpawnSettings settings;
  settings.UseDescriptors(writing.get(), link.get());
  settings.UseSignals();
  std::vector<char*> words{const_cast<char*>(program.c_str())};
  for (const std::string& argument : arguments)
    words.push_back(const_cast<char*>(argument.c_str()));
  words.push_back(nullptr);
  ChildProcess child;
  const int failed = ::posix_spawn(&child.id_, program.c_str(), &settings.actions,
                                   &settings.attributes, words.data(), environ);
  if (failed != 0) {
    child.id_ = -1;
    return Error{program + ": " + std::strerror(failed)};
  }
  child.output_ = std::move(reading);
  return child;
}

ChildProcess::~ChildProcess() {
  if (id_ > 0) Reap(Duration::zero());
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept
    : id_(std::exchange(other.id_, -1)), output_(std::move(other.output_)) {}

ChildProcess& ChildProcess::operator=(ChildProcess&& other) noexcept {
  std::swap(id_, other.id_);
  std::swap(output_, other.output_);
  return *this;
}

std::string ChildProcess::Reap(Duration most) {
  const Instant until = std::chrono::steady_clock::now() + most;
  int status = 0;
  while (::waitpid(id_, &status, WNOHANG) == 0) {
    if (std::chrono::steady_clock::now() >= until) {
      ::kill(id_, SIGKILL);
      ::waitpid(id_, &status, 0);
      break;
    }
    std::this_thread::sleep_for(kReapPause);
  }
  id_ = -1;
  return EndOf(status);
}

Result<std::string> FindProgram(const std::string& name) {
  std::error_code error;
  const fs::path beside = fs::read_symlink("/proc/self/exe", error).parent_path();
  const fs::path installed = BAUDGATE_INSTALLED_BINARIES;
  for (const fs::path& folder : {beside, installed}) {
    const fs::path program = folder / name;
    if (::access(program.c_str(), X_OK) == 0) return program.string();
  }
  return Error{name + " is neither in " + beside.string() + " nor in " + installed.string()};
}

}  // namespace baudgate::dds
