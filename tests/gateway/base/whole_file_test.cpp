// SPDX-License-Identifier: Apache-2.0
#include "gateway/base/whole_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cerrno>

namespace baudgate {
namespace {

namespace fs = std::filesystem;

class WholeFileTest : public ::testing::Test {
 protected:
  WholeFileTest() {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~WholeFileTest() override { fs::remove_all(folder_); }

  const fs::path folder_ = fs::path(::testing::TempDir()) / "baudgate-whole-file";
  const fs::path file_ = folder_ / "file";
};

TEST_F(WholeFileTest, IsReadBack) {
  EXPECT_FALSE(ReadWhole(file_));
  EXPECT_EQ(errno, ENOENT);
  EXPECT_EQ(WriteWhole(file_, "text"), 0);
  EXPECT_EQ(ReadWhole(file_), "text");
}

TEST_F(WholeFileTest, OneThatIsTooLargeIsNotRead) {
  ASSERT_EQ(WriteWhole(file_, ""), 0);
  fs::resize_file(file_, std::uintmax_t{20} << 30U);
  EXPECT_FALSE(ReadWhole(file_));
  EXPECT_EQ(errno, EFBIG);
}

TEST_F(WholeFileTest, APipeInItsPlaceIsNotWaitedFor) {
  ASSERT_EQ(::mkfifo(file_.c_str(), 0600), 0);
  EXPECT_FALSE(ReadWhole(file_));
  EXPECT_EQ(errno, EINVAL);
}

TEST_F(WholeFileTest, APipeInTheWayOfAWriteIsRemoved) {
  ASSERT_EQ(::mkfifo((file_.string() + ".part").c_str(), 0600), 0);
  EXPECT_EQ(WriteWhole(file_, "text"), 0);
  EXPECT_EQ(ReadWhole(file_), "text");
  EXPECT_FALSE(fs::exists(file_.string() + ".part"));
}

}  // namespace
}  // namespace baudgate
