// What is removed from /dev/shm, and what stays, in a directory of the test's own.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/dds/fast/shared_memory_rest.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <set>

namespace baudgate::dds {
namespace {

namespace fs = std::filesystem;
using ::testing::IsEmpty;

class SharedMemoryRest : public ::testing::Test {
 protected:
  SharedMemoryRest() { fs::create_directories(directory_); }
  ~SharedMemoryRest() override { fs::remove_all(directory_); }

  /// As a process that has ended has left it: a minute ago, unless `age` says so.
  void Left(const std::string& name, Duration age = 1min) const {
    const fs::path path = directory_ / name;
    std::ofstream(path) << "x";
    fs::last_write_time(path, fs::file_time_type::clock::now() -
                                  std::chrono::duration_cast<fs::file_time_type::duration>(age));
  }
  std::set<std::string> Names() const {
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(directory_)) {
      names.insert(entry.path().filename().string());
    }
    return names;
  }

  const fs::path directory_ = fs::temp_directory_path() / ("rest-" + std::to_string(::getpid()));
};

TEST_F(SharedMemoryRest, SegmentsAndPortsOfTheDeadGo) {
  for (const char* name :
       {"fastrtps_50e7bc0f1d2b4149", "fastrtps_50e7bc0f1d2b4149_el", "fastrtps_port7410",
        "fastrtps_port7410_el", "fastrtps_port7411", "fastrtps_port7411_sl",
        "sem.fastrtps_port7410_mutex", "sem.fastrtps_port7411_mutex"}) {
    Left(name);
  }
  EXPECT_EQ(RemoveSharedMemoryRest(directory_), 8U);
  EXPECT_THAT(Names(), IsEmpty());
}

TEST_F(SharedMemoryRest, WhatIsLockedStays) {
  Left("fastrtps_0000000000000001");
  Left("fastrtps_0000000000000001_el");
  Left("fastrtps_port7410");
  Left("fastrtps_port7410_el");
  Left("fastrtps_port7410_sl");
  const int segment = ::open((directory_ / "fastrtps_0000000000000001_el").c_str(), O_RDONLY);
  const int port = ::open((directory_ / "fastrtps_port7410_sl").c_str(), O_RDONLY);
  ASSERT_EQ(::flock(segment, LOCK_EX | LOCK_NB), 0);
  ASSERT_EQ(::flock(port, LOCK_SH | LOCK_NB), 0);
  EXPECT_EQ(RemoveSharedMemoryRest(directory_), 0U);
  ::close(segment);
  EXPECT_EQ(RemoveSharedMemoryRest(directory_), 2U);
  ::close(port);
  EXPECT_EQ(RemoveSharedMemoryRest(directory_), 3U);
}

TEST_F(SharedMemoryRest, WhatProvesNothingStays) {
  Left("fastrtps_0000000000000001_el", Duration::zero());  // somebody begins
  Left("fastrtps_0000000000000001");
  Left("fastrtps_0000000000000002");  // no lock file
  Left("fastrtps_port");
  Left("fastrtps_000000000000000g_el");
  Left("fastrtps_0000000000000003_other");
  Left("other_0000000000000004_el");
  fs::create_symlink(directory_ / "other_0000000000000004_el",
                     directory_ / "fastrtps_0000000000000005_el");
  ::mkfifo((directory_ / "fastrtps_0000000000000006_el").c_str(), 0600);
  const auto before = Names();
  EXPECT_EQ(RemoveSharedMemoryRest(directory_), 0U);
  EXPECT_EQ(Names(), before);
}

TEST_F(SharedMemoryRest, WithoutADirectoryNothingHappens) {
  EXPECT_EQ(RemoveSharedMemoryRest(directory_ / "none"), 0U);
}

}  // namespace
}  // namespace baudgate::dds
