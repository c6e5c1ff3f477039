// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include "gateway/daemon/descriptors.h"

namespace baudgate {
namespace {

TEST(OpenFiles, AreCountedAlsoWhereNoneCanBeOpened) {
  OpenFiles files;
  const std::size_t before = files.Now().open;
  const int more = ::dup(0);
  EXPECT_EQ(files.Now().open, before + 1);
  rlimit limit{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &limit), 0);
  const rlimit none{1, limit.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &none), 0);
  const OpenFiles::Count count = files.Now();
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &limit), 0);
  ::close(more);
  EXPECT_EQ(count.open, before + 1);
  EXPECT_EQ(count.limit, 1U);
}

}  // namespace
}  // namespace baudgate
