// Something that dies is begun anew; something that ends is not.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/watch/restarting_child.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstdlib>
#include <new>
#include <sstream>

namespace baudgate {
namespace {

constexpr Duration kAtOnce[] = {Duration::zero()};

/// A number that parent and children share.
class SharedCount {
 public:
  SharedCount()
      : count_(new (::mmap(nullptr, sizeof(int), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS,
                           -1, 0)) int(0)) {}
  ~SharedCount() { ::munmap(count_, sizeof(int)); }
  SharedCount(const SharedCount&) = delete;
  SharedCount& operator=(const SharedCount&) = delete;
  int& operator*() const { return *count_; }

 private:
  int* count_;
};

TEST(Guarded, GivesTheExitCodeOfWhatEnds) {
  std::ostringstream err;
  EXPECT_EQ(RunGuarded([] { return 4; }, kAtOnce, err), 4);
  EXPECT_EQ(err.str(), "");
}

TEST(Guarded, BeginsAnewWhatDies) {
  const SharedCount runs;
  std::ostringstream err;
  const auto run = [&runs] {
    const int number[] = {SIGABRT, SIGKILL};
    if (*runs < 2) ::raise(number[(*runs)++]);
    return 3;
  };
  EXPECT_EQ(RunGuarded(run, kAtOnce, err), 3);
  EXPECT_EQ(*runs, 2);
  EXPECT_EQ(err.str(),
            "watch: the DDS library was ended by signal 6; begun anew\n"
            "watch: the DDS library was ended by signal 9; begun anew\n");
}

TEST(Guarded, PassesTheSignalToStopOn) {
  const SharedCount runs;
  std::ostringstream err;
  const auto run = [&runs] {
    ++*runs;
    ::kill(::getppid(), SIGTERM);  // as a user would
    for (;;) ::pause();
    return 0;
  };
  EXPECT_EQ(RunGuarded(run, kAtOnce, err), 128 + SIGTERM);
  EXPECT_EQ(*runs, 1);
  EXPECT_EQ(err.str(), "");
}

}  // namespace
}  // namespace baudgate
