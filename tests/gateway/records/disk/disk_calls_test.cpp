// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "gateway/records/disk/disk.h"

namespace baudgate {
namespace {

using ::testing::ElementsAre;

TEST(DiskCalls, AResultComesBack) {
  DiskCalls calls("test", 1min);
  EXPECT_EQ(calls.Wait([] { return 7; }), 7);
}

/// Time: a patience of zero never waits.
TEST(DiskCalls, ADiskThatHangsHoldsNobodyAndNothingIsLost) {
  std::promise<void> disk;
  std::vector<int> done;
  {
    DiskCalls calls("test", Duration::zero());
    const auto hang = [&done, answers = disk.get_future().share()](int call) {
      answers.wait();
      done.push_back(call);
      return call;
    };
    EXPECT_EQ(calls.Wait([hang] { return hang(1); }), std::nullopt);
    EXPECT_EQ(calls.Wait([hang] { return hang(2); }), std::nullopt);
    EXPECT_FALSE(calls.Offer([hang] { hang(3); })) << "another call is under way";
    for (int i = 0; i < 100; ++i) {
      EXPECT_EQ(calls.Wait([] { return 4; }), std::nullopt);
    }
    disk.set_value();
    calls.Stop();
    EXPECT_FALSE(calls.Offer([hang] { hang(5); })) << "it has stopped";
  }
  EXPECT_THAT(done, ElementsAre(1, 2));
}

}  // namespace
}  // namespace baudgate
