// `FolderTest`: a folder that is removed after the test.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>

namespace baudgate::history {

class FolderTest : public ::testing::Test {
 protected:
  FolderTest() {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    // Tests write thousands of times, and must not wait for a disk each time.
    const bool in_memory = ::access("/dev/shm", W_OK) == 0;
    folder_ = std::filesystem::path(in_memory ? "/dev/shm" : ::testing::TempDir()) /
              (std::string("baudgate-history-") + test->test_suite_name() + "-" + test->name());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  ~FolderTest() override {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  const std::filesystem::path& folder() const { return folder_; }

 private:
  std::filesystem::path folder_;
};

}  // namespace baudgate::history
