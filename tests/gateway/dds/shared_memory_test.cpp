// Gateways with shared memory that are killed leave nothing in /dev/shm that the next one does not
// remove.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <set>
#include <string>

#include "gateway/dds/fast/fast_writer.h"
#include "gateway/dds/fast/shared_memory_rest.h"

namespace baudgate::dds {
namespace {

namespace fs = std::filesystem;

ParticipantOptions Options() {
  ParticipantOptions options;
  options.domain = 100 + static_cast<int>(::getppid() % 100);
  options.interfaces = {"127.0.0.1"};
  options.shared_memory = true;
  return options;
}

std::set<std::string> Names() {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator("/dev/shm")) {
    names.insert(entry.path().filename().string());
  }
  return names;
}

/// What was not there before is as if nobody could be about to lock it any more.
void Age(const std::set<std::string>& before) {
  for (const auto& entry : fs::directory_iterator("/dev/shm")) {
    if (before.contains(entry.path().filename().string())) continue;
    fs::last_write_time(entry.path(), fs::file_time_type::clock::now() - 2 * kLockTaken);
  }
}

/// A gateway in a process of its own, killed once it is there; false: it could not be made.
bool StartAndKill() {
  int ends[2];
  if (::pipe(ends) != 0) return false;
  const pid_t child = ::fork();
  if (child == 0) {
    const auto writer = CreateFastWriter(Options(), 10, 1);
    if (!writer || ::write(ends[1], "1", 1) != 1) ::_exit(1);
    for (;;) ::pause();
  }
  ::close(ends[1]);
  char byte = 0;
  const bool made = ::read(ends[0], &byte, 1) == 1;
  ::close(ends[0]);
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  return made;
}

TEST(SharedMemory, OfTenThatWereKilledNothingStays) {
  RemoveSharedMemoryRest();
  const auto before = Names();
  for (int i = 0; i < 10; ++i) {
    ASSERT_TRUE(StartAndKill());
    Age(before);
  }
  const auto last = Names();
  EXPECT_GT(last.size(), before.size()) << "nothing was left, so that this test says nothing";
  EXPECT_LE(last.size(), before.size() + 10) << "one gateway's at most";
  EXPECT_GT(RemoveSharedMemoryRest(), 0U);
  EXPECT_EQ(Names(), before);
}

}  // namespace
}  // namespace baudgate::dds
