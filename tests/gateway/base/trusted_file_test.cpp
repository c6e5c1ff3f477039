// Tests of `WhyNotTrusted`, which says who else could change a file that the gateway relies on.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/base/trusted_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>

namespace baudgate {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class TrustedFileTest : public ::testing::Test {
 protected:
  TrustedFileTest() {
    std::string form = (fs::temp_directory_path() / "baudgate-trust-XXXXXX").string();
    folder_ = ::mkdtemp(form.data());
    file_ = folder_ / "inner" / "file";
    fs::create_directory(file_.parent_path());
    std::ofstream(file_) << "text";
    ::chmod(file_.parent_path().c_str(), 0755);
    ::chmod(file_.c_str(), 0644);
  }
  ~TrustedFileTest() override { fs::remove_all(folder_); }

  fs::path folder_;
  fs::path file_;
};

TEST_F(TrustedFileTest, AFileOfThisUserIsTrusted) {
  EXPECT_THAT(WhyNotTrusted(file_), IsEmpty());
  EXPECT_THAT(WhyNotTrusted(file_.parent_path()), IsEmpty());
  EXPECT_THAT(WhyNotTrusted(folder_ / "absent"), IsEmpty());
}

TEST_F(TrustedFileTest, NobodyElseMayWriteToTheFileOrItsFolders) {
  ::chmod(file_.c_str(), 0666);
  EXPECT_THAT(WhyNotTrusted(file_), HasSubstr("chmod go-w " + file_.string()));
  ::chmod(file_.c_str(), 0644);
  ::chmod(folder_.c_str(), 0777);
  EXPECT_THAT(WhyNotTrusted(file_), HasSubstr("chmod go-w " + folder_.string()));
  ::chmod(folder_.c_str(), 01777);
  EXPECT_THAT(WhyNotTrusted(file_), IsEmpty()) << "like /tmp";
}

TEST_F(TrustedFileTest, ALinkIsTrustedIfItsFolderAndItsTargetAre) {
  const fs::path link = folder_ / "link";
  fs::create_symlink(file_, link);
  EXPECT_THAT(WhyNotTrusted(link), IsEmpty());
  ::chmod(file_.c_str(), 0622);
  EXPECT_THAT(WhyNotTrusted(link), HasSubstr("chmod go-w " + file_.string()));
  ::chmod(file_.c_str(), 0644);
  const fs::path other = folder_ / "other";
  fs::create_directory(other);
  fs::create_symlink(file_, other / "link");
  ::chmod(other.c_str(), 0777);
  EXPECT_THAT(WhyNotTrusted(other / "link"), HasSubstr("chmod go-w " + other.string()));
}

TEST_F(TrustedFileTest, AFileOfAnotherUserIsNotTrusted) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can give a file away";
  ASSERT_EQ(::chown(file_.parent_path().c_str(), 65534, 0), 0);
  EXPECT_THAT(WhyNotTrusted(file_), HasSubstr("chown root " + file_.parent_path().string()));
}

}  // namespace
}  // namespace baudgate
