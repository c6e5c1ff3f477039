// What a start takes, after every order of events; "again" is a restart, also by kill -9: nothing
// but what is on the disk is known.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/reload/kept_configs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

namespace baudgate::reload {
namespace {

namespace fs = std::filesystem;

class KeptConfigsTest : public ::testing::Test {
 protected:
  KeptConfigsTest() { fs::remove_all(folder_); }
  ~KeptConfigsTest() override { fs::remove_all(folder_); }

  KeptConfigs Again() const { return KeptConfigs(folder_); }
  Status Add(const std::string& text, bool trial) {
    return Again().Add(text, "user:anna", WallTime(1s), trial);
  }

  const fs::path folder_ = fs::path(::testing::TempDir()) / "baudgate-kept-configs/configurations";
};

TEST_F(KeptConfigsTest, NothingIsThereAtFirst) {
  EXPECT_TRUE(Again().entries().empty());
  EXPECT_FALSE(Again().CopyInPlaceOf("a"));
  EXPECT_FALSE(fs::exists(folder_));
}

TEST_F(KeptConfigsTest, WhatIsOnTrialAtAStartIsNotTaken) {
  ASSERT_TRUE(Add("a", false));
  ASSERT_TRUE(Add("b", true));
  const KeptConfigs kept = Again();
  ASSERT_EQ(kept.CopyInPlaceOf("b"), 1U);
  EXPECT_EQ(*kept.TextOf(1), "a");
  EXPECT_FALSE(kept.CopyInPlaceOf("c")) << "the file was changed since";
}

TEST_F(KeptConfigsTest, WhatIsConfirmedIsTaken) {
  ASSERT_TRUE(Add("a", false));
  ASSERT_TRUE(Add("b", true));
  ASSERT_TRUE(Again().Confirm());
  EXPECT_FALSE(Again().CopyInPlaceOf("b"));
  EXPECT_EQ(Again().confirmed(), 2U);
  ASSERT_TRUE(Again().Refuse("too late", WallTime(2s)));
  EXPECT_FALSE(Again().CopyInPlaceOf("b"));
}

TEST_F(KeptConfigsTest, WhatIsRefusedIsNotTakenUntilTheFileDiffers) {
  ASSERT_TRUE(Add("a", false));
  ASSERT_TRUE(Add("b", true));
  ASSERT_TRUE(Again().Refuse("bay.a was well before", WallTime(2s)));
  EXPECT_EQ(Again().why_refused(), "bay.a was well before");
  EXPECT_EQ(Again().CopyInPlaceOf("b"), 1U);
  EXPECT_EQ(Again().CopyInPlaceOf("b"), 1U) << "at every start";
  EXPECT_FALSE(Again().CopyInPlaceOf("c"));
  ASSERT_TRUE(Add("c", false));
  EXPECT_FALSE(Again().CopyInPlaceOf("b")) << "it was changed, so it is meant when it comes again";
}

TEST_F(KeptConfigsTest, KeepsTwentyAndThoseThatAreWanted) {
  ASSERT_TRUE(Add("confirmed", false));
  for (int i = 0; i < 30; ++i) ASSERT_TRUE(Add("trial " + std::to_string(i), true));
  const KeptConfigs kept = Again();
  EXPECT_EQ(kept.entries().size(), KeptConfigs::kMost);
  EXPECT_EQ(kept.entries().front().number, 1U);
  EXPECT_EQ(*kept.TextOf(1), "confirmed");
  EXPECT_EQ(kept.entries().back().number, 31U);
  EXPECT_FALSE(kept.TextOf(5));
  std::size_t files = 0;
  for ([[maybe_unused]] const auto& file : fs::directory_iterator(folder_)) ++files;
  EXPECT_EQ(files, KeptConfigs::kMost + 1) << "and the index";
}

TEST_F(KeptConfigsTest, AnIndexThatIsNoneIsNone) {
  ASSERT_TRUE(Add("a", false));
  ASSERT_TRUE(Add("b", true));
  for (const char* text :
       {"", "{", "[1]", R"({"entries":7,"trial":{"number":"x"},"confirmed":-1})"}) {
    std::ofstream(folder_ / "index.json") << text;
    EXPECT_FALSE(Again().CopyInPlaceOf("b")) << text;
  }
}

TEST_F(KeptConfigsTest, ADiskThatFailsIsToldAndChangesNothing) {
  fs::create_directories(folder_.parent_path());
  std::ofstream(folder_) << "a file";
  KeptConfigs kept(folder_);
  EXPECT_FALSE(kept.Add("a", "start", WallTime(1s), false));
  EXPECT_TRUE(kept.entries().empty());
}

TEST_F(KeptConfigsTest, ADamagedIndexIsPutAsideAndSaid) {
  ASSERT_TRUE(Add("a", false));
  EXPECT_EQ(Again().trouble(), "");
  EXPECT_EQ(Again().confirmed_text(), "a");
  std::ofstream(folder_ / "index.json", std::ios::trunc) << "";
  const KeptConfigs kept = Again();
  EXPECT_THAT(kept.trouble(), ::testing::HasSubstr("index.json is damaged"));
  EXPECT_FALSE(kept.confirmed_text());
  EXPECT_TRUE(fs::exists(folder_ / "index.json.bad"));
  EXPECT_EQ(Again().trouble(), "");
}

}  // namespace
}  // namespace baudgate::reload
