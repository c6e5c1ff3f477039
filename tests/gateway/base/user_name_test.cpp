// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <sys/resource.h>

#include "gateway/base/system_trouble.h"

namespace baudgate {
namespace {

TEST(UserName, IsKnownAlsoWhereNoFileCanBeOpened) {
  constexpr uid_t kNobody = 65534;
  constexpr uid_t kUnknown = 4'000'000'000;
  EXPECT_EQ(NameOfUser(0), "root");
  EXPECT_EQ(NameOfUser(kNobody), "nobody");
  EXPECT_EQ(NameOfUser(kUnknown), "4000000000");
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
  const rlimit none{0, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &none), 0);
  const std::string root = NameOfUser(0);
  const std::string nobody = NameOfUser(kNobody);
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &before), 0);
  EXPECT_EQ(root, "root");
  EXPECT_EQ(nobody, "nobody");
}

}  // namespace
}  // namespace baudgate
