// The archive of a support bundle.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "gateway/tools/cli/bundle/support_bundle.h"
#include "tests/gateway/tools/cli/bundle/unpacked.h"

namespace baudgate {
namespace {

using ::testing::ElementsAre;
using ::testing::Pair;

TEST(Archive, HoldsFilesByName) {
  Archive archive("bundle", WallTime(1'790'000'000s));
  archive.Add("a.txt", "");
  archive.Add("trace/bay-1.trace", std::string(512, 'x'));
  archive.Add("../b\n", "b");
  const auto packed = archive.Packed();
  ASSERT_TRUE(packed) << packed.error();
  EXPECT_THAT(Unpacked(*packed),
              ElementsAre(Pair("bundle/../b_", "b"), Pair("bundle/a.txt", ""),
                          Pair("bundle/trace/bay-1.trace", std::string(512, 'x'))));
  EXPECT_EQ(Gunzipped(*packed).substr(136, 12), std::string("15254235600\0", 12));
}

TEST(Archive, CutsLongNames) {
  Archive archive("bundle", WallTime{});
  archive.Add(std::string(200, 'n'), "content");
  EXPECT_THAT(Unpacked(*archive.Packed()),
              ElementsAre(Pair("bundle/" + std::string(83, 'n'), "content")));
}

}  // namespace
}  // namespace baudgate
