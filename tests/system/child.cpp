// SPDX-License-Identifier: Apache-2.0
#include "tests/system/child.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <fstream>
#include <sstream>

extern char** environ;

namespace baudgate::system_test {
namespace {

std::vector<std::string> Merged(const Child::Environment& added) {
  std::vector<std::string> merged;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string text = *entry;
    if (!added.contains(text.substr(0, text.find('=')))) merged.push_back(text);
  }
  for (const auto& [name, value] : added) merged.push_back(name + "=" + value);
  return merged;
}

std::vector<char*> Pointers(std::vector<std::string>& texts) {
  std::vector<char*> pointers;
  for (std::string& text : texts) pointers.push_back(text.data());
  pointers.push_back(nullptr);
  return pointers;
}

int OpenForWriting(const std::filesystem::path& file) {
  return ::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
}

}  // namespace

Child::Child(const std::vector<std::string>& words, const std::filesystem::path& directory,
             const Environment& environment) {
  static std::atomic<int> number = 0;  // tests start children from several threads
  const std::string name = std::to_string(++number);
  const auto pty = std::ranges::find(words, "--pty");
  if (pty != words.end() && pty + 1 != words.end()) pty_ = directory / *(pty + 1);
  output_ = directory / (name + ".out");
  errors_ = directory / (name + ".err");
  std::vector<std::string> arguments = words;
  Environment all = environment;
  all.try_emplace("STATE_DIRECTORY", (directory / "state").string());
  std::vector<std::string> variables = Merged(all);
  const std::vector<char*> argv = Pointers(arguments);
  const std::vector<char*> envp = Pointers(variables);
  const std::string where = directory.string();
  const int output = OpenForWriting(output_);
  const int errors = OpenForWriting(errors_);
  id_ = ::fork();
  if (id_ == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    const int nothing = ::open("/dev/null", O_RDONLY);
    ::dup2(nothing, STDIN_FILENO);
    ::dup2(output, STDOUT_FILENO);
    ::dup2(errors, STDERR_FILENO);
    if (::chdir(where.c_str()) == 0) ::execvpe(argv[0], argv.data(), envp.data());
    ::_exit(127);
  }
  ::close(output);
  ::close(errors);
}

Child::~Child() {
  if (!Running()) return;
  Signal(SIGKILL);
  WaitForEnd();
}

void Child::Signal(int number) const {
  if (id_ <= 0 || ended_) return;
  // A killed simulated device leaves its link. The kernel gives the number of its pty to a new pty,
  // so the link would lead to another test's pty.
  if (number == SIGKILL && !pty_.empty()) std::filesystem::remove(pty_);
  ::kill(id_, number);
}

bool Child::Running() {
  if (id_ <= 0 || ended_) return false;
  int status = 0;
  if (::waitpid(id_, &status, WNOHANG) != id_) return true;
  ended_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return false;
}

std::optional<int> Child::WaitForEnd(Duration limit) {
  Eventually([this] { return !Running(); }, limit);
  return ended_;
}

std::string Child::Output() const { return ReadWholeFile(output_); }
std::string Child::Errors() const { return ReadWholeFile(errors_); }

Finished RunToEnd(const std::vector<std::string>& words, const std::filesystem::path& directory,
                  const Child::Environment& environment, Duration limit) {
  Child child(words, directory, environment);
  const int code = child.WaitForEnd(limit).value_or(-1);
  return {code, child.Output(), child.Errors()};
}

std::string ReadWholeFile(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

}  // namespace baudgate::system_test
