// Benchmarks of Fast DDS with many points and many subscribers. Usage: baudgate_dds_bench image, or
// baudgate_dds_bench participants BAUDGATE COUNT.
// SPDX-License-Identifier: Apache-2.0
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>
#include <sstream>

#include "gateway/base/log.h"
#include "tests/bench/dds/bench.h"

namespace baudgate::bench {

pid_t Start(const std::vector<std::string>& words) {
  const pid_t child = ::fork();
  if (child != 0) return child;
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  std::vector<char*> arguments;
  std::string name = "baudgate_dds_bench";
  arguments.push_back(name.data());
  std::vector<std::string> copies = words;
  for (std::string& word : copies) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  ::execv("/proc/self/exe", arguments.data());
  ::_exit(127);
}

void End(pid_t child, int signal) {
  ::kill(child, signal);
  ::kill(child, SIGCONT);
  ::waitpid(child, nullptr, 0);
}

double ProcessorOf(pid_t process) {
  std::ifstream file("/proc/" + std::to_string(process) + "/stat");
  std::string text;
  std::getline(file, text);
  std::istringstream fields(text.substr(text.rfind(')') + 1));
  std::string skipped;
  for (int i = 0; i < 11; ++i) fields >> skipped;
  double user = 0;
  double system = 0;
  fields >> user >> system;
  return (user + system) / static_cast<double>(::sysconf(_SC_CLK_TCK));
}

long ResidentOf(pid_t process) {
  std::ifstream status("/proc/" + std::to_string(process) + "/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmRSS:")) return std::stol(line.substr(6));
  }
  return 0;
}

}  // namespace baudgate::bench

int main(int argc, char** argv) {
  using namespace baudgate;
  log::Begin(log::Level::error);
  const std::vector<std::string> words(argv + 1, argv + argc);
  const std::string part = words.empty() ? "" : words.front();
  if (part == "be-late-subscriber") return bench::BeLateSubscriber(words);
  if (part == "be-subscribers") return bench::BeSubscribers(words);
  if (part == "participants" && words.size() == 3) {
    return bench::RunParticipants(words[1], std::stoi(words[2])), 0;
  }
  if (part == "image") return bench::RunImage(), 0;
  std::fprintf(stderr, "usage: baudgate_dds_bench image | participants BAUDGATE COUNT\n");
  return 2;
}
