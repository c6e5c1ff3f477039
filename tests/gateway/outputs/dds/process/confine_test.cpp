// Tests that a confined DDS process cannot make certain calls. The exit code of a child names a
// call that still works.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sched.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/mount.h>
#include <sys/ptrace.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <thread>

#include "gateway/outputs/dds/process/serve.h"

namespace baudgate::dds {
namespace {

using ::testing::ExitedWithCode;
using ::testing::KilledBySignal;

bool Refused(long result) { return result == -1 && errno == EPERM; }

int WhatIsNotRefused() {
  if (!DenyCalls().ok()) return 1;
  char* const none[] = {nullptr};
  if (!Refused(::execve("/bin/true", none, none))) return 2;
  if (!Refused(::ptrace(PTRACE_TRACEME, 0, nullptr, nullptr))) return 3;
  if (!Refused(::kill(::getppid(), 0))) return 4;
  if (!Refused(::mount("none", "/mnt", "tmpfs", 0, nullptr))) return 5;
  if (!Refused(::socket(AF_UNIX, SOCK_STREAM, 0))) return 6;
  if (!Refused(::unshare(0))) return 7;
  return 0;
}

int WhatIsNotPermitted() {
  if (!DenyCalls().ok()) return 1;
  const int datagrams = ::socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const auto* plain = reinterpret_cast<const sockaddr*>(&address);
  if (datagrams < 0 || ::bind(datagrams, plain, sizeof address) != 0) return 2;
  bool ran = false;
  std::thread([&ran] { ran = true; }).join();
  return ran ? 0 : 3;
}

TEST(ConfineDeathTest, DangerousSystemCallsAreRefused) {
  EXPECT_EXIT(::_exit(WhatIsNotRefused()), ExitedWithCode(0), "");
}

TEST(ConfineDeathTest, SocketsAndThreadsArePermitted) {
  EXPECT_EXIT(::_exit(WhatIsNotPermitted()), ExitedWithCode(0), "");
}

TEST(ConfineDeathTest, AnAbortStillEndsTheProcess) {
  EXPECT_EXIT(
      {
        if (!DenyCalls().ok()) ::_exit(1);
        ::abort();
      },
      KilledBySignal(SIGABRT), "");
}

#ifndef __SANITIZE_ADDRESS__  // the shadow memory of AddressSanitizer is larger than any limit
int WhatMemoryThereIs() {
  if (!LimitMemory(1ULL << 30).ok()) return 1;
  const auto get = [](std::size_t bytes) {
    return ::mmap(nullptr, bytes, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  };
  if (get(1ULL << 20) == MAP_FAILED) return 2;
  return get(1ULL << 30) == MAP_FAILED ? 0 : 3;
}

TEST(ConfineDeathTest, MemoryIsLimited) {
  EXPECT_EXIT(::_exit(WhatMemoryThereIs()), ExitedWithCode(0), "");
}
#endif

TEST(Confine, AParentThatHasEndedIsDetected) {
  EXPECT_TRUE(EndWith(::getppid()));
  EXPECT_FALSE(EndWith(::getpid()));
}

}  // namespace
}  // namespace baudgate::dds
