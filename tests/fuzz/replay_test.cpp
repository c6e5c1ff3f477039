// Runs every input of tests/fuzz/corpus through its target, each target in a child process.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#include "tests/fuzz/target.h"

namespace baudgate::fuzz {
namespace {

namespace fs = std::filesystem;

constexpr unsigned kMostSeconds = 60;

fs::path Folder() { return fs::path(FUZZ_SOURCE_DIR) / "tests/fuzz"; }

std::vector<std::string> Names() {
  std::ifstream file(Folder() / "targets.txt");
  std::vector<std::string> names;
  for (std::string line; std::getline(file, line);) {
    std::string name;
    if (std::istringstream(line) >> name && name != "#") names.push_back(name);
  }
  return names;
}

std::vector<fs::path> Entries(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> entries;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    entries.push_back(at->path());
  }
  std::ranges::sort(entries);
  return entries;
}

[[noreturn]] void RunAll(const Target& target, const std::vector<fs::path>& inputs, int progress) {
  for (const fs::path& path : inputs) {
    std::ifstream file(path, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    // A copy of the exact size lets AddressSanitizer detect reads beyond the end.
    const Bytes input(text.begin(), text.end());
    if (::write(progress, "", 1) != 1) std::exit(3);
    ::alarm(kMostSeconds);
    target.run(input);
  }
  std::exit(0);
}

std::string Words(int status) {
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM) {
    return "has not ended after " + std::to_string(kMostSeconds) + " s";
  }
  if (WIFSIGNALED(status)) return std::string("ended by: ") + ::strsignal(WTERMSIG(status));
  return "exit status " + std::to_string(WEXITSTATUS(status));
}

class FuzzReplay : public ::testing::TestWithParam<std::string> {};

TEST_P(FuzzReplay, EveryInputOfTheCorpusPasses) {
  const Target* target = FindTarget(GetParam());
  ASSERT_NE(target, nullptr) << "no source registers it";
  const auto inputs = Entries(Folder() / "corpus" / GetParam());
  ASSERT_FALSE(inputs.empty()) << "put at least one input into its corpus";
  std::array<int, 2> progress{};
  ASSERT_EQ(::pipe(progress.data()), 0);
  std::fflush(nullptr);
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    ::close(progress[0]);
    RunAll(*target, inputs, progress[1]);
  }
  ::close(progress[1]);
  std::size_t begun = 0;
  for (char byte = 0; ::read(progress[0], &byte, 1) == 1;) ++begun;
  ::close(progress[0]);
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_TRUE(status == 0) << (begun == 0 ? GetParam() : inputs[begun - 1].string()) << ": "
                           << Words(status);
  EXPECT_TRUE(status != 0 || begun == inputs.size());
}

INSTANTIATE_TEST_SUITE_P(Targets, FuzzReplay, ::testing::ValuesIn(Names()),
                         [](const auto& info) { return info.param; });

TEST(FuzzTargets, ListSourcesAndCorporaNameTheSame) {
  std::vector<std::string> registered;
  for (const Target& target : Targets()) registered.push_back(target.name);
  std::vector<std::string> corpora;
  for (const fs::path& folder : Entries(Folder() / "corpus")) corpora.push_back(folder.filename());
  EXPECT_THAT(registered, ::testing::UnorderedElementsAreArray(Names()));
  EXPECT_THAT(corpora, ::testing::UnorderedElementsAreArray(Names()));
}

}  // namespace
}  // namespace baudgate::fuzz
