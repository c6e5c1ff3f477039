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
using ::testing::UnorderedElementsAre;
using Trial = KeptConfigs::Trial;

class KeptConfigsTest : public ::testing::Test {
 protected:
  KeptConfigsTest() { fs::remove_all(folder_); }
  ~KeptConfigsTest() override { fs::remove_all(folder_); }

  KeptConfigs Again() const { return KeptConfigs(folder_); }
  Status Add(const std::string& text, bool trial) { return Again().Add(text, trial); }
  std::vector<std::string> Files() const {
    std::vector<std::string> names;
    for (const auto& file : fs::directory_iterator(folder_)) {
      names.push_back(file.path().filename().string());
    }
    return names;
  }

  const fs::path folder_ = fs::path(::testing::TempDir()) / "baudgate-kept-configs/configurations";
};

TEST_F(KeptConfigsTest, NothingIsThereAtFirst) {
  EXPECT_TRUE(Again().empty());
  EXPECT_FALSE(Again().confirmed());
  EXPECT_FALSE(Again().IsUnconfirmed("a"));
  EXPECT_FALSE(Again().IsUnconfirmed(""));
  EXPECT_EQ(Again().trial(), Trial::none);
  EXPECT_FALSE(fs::exists(folder_));
}

TEST_F(KeptConfigsTest, WhatIsOnTrialAtAStartIsNotTaken) {
  ASSERT_TRUE(Add("a", false));
  ASSERT_TRUE(Add("b", true));
  EXPECT_EQ(Again().trial(), Trial::running);
  EXPECT_TRUE(Again().IsUnconfirmed("b"));
  EXPECT_EQ(Again().confirmed(), "a");
  EXPECT_EQ(Again().why_taken_back(), "the gateway ended before it was confirmed");
  EXPECT_FALSE(Again().IsUnconfirmed("c")) << "the file was changed since";
}

TEST_F(KeptConfigsTest, ACopyThatSomebodyHasRemovedIsWrittenAgain) {
  ASSERT_TRUE(Add("a", false));
  ASSERT_TRUE(Add("b", true));
  ASSERT_TRUE(Again().TakeBack("why"));
  EXPECT_EQ(Again().Restore("a").value(), false);
  fs::remove(Again().confirmed_file());
  EXPECT_EQ(Again().Restore("a").value(), true);
  EXPECT_EQ(Again().confirmed(), "a");
  EXPECT_EQ(Again().trial(), Trial::taken_back);
  fs::remove_all(folder_);
  EXPECT_EQ(Again().Restore("a").value(), true);
  EXPECT_EQ(Again().confirmed(), "a");
}

TEST_F(KeptConfigsTest, AnEmptyCopyOfATrialConfirmsNothing) {
  ASSERT_TRUE(Add("a", false));
  ASSERT_TRUE(Add("b", true));
  std::ofstream(folder_ / "trial.yaml", std::ios::trunc).flush();
  EXPECT_TRUE(Again().IsUnconfirmed("b"));
  EXPECT_FALSE(Again().IsUnconfirmed("a")) << "the confirmed one";
  fs::remove(Again().confirmed_file());
  EXPECT_FALSE(Again().IsUnconfirmed("b")) << "there is nothing that could run in its place";
}

TEST_F(KeptConfigsTest, WhatIsConfirmedIsTaken) {
  ASSERT_TRUE(Add("a", false));
  ASSERT_TRUE(Add("b", true));
  ASSERT_TRUE(Again().Confirm());
  EXPECT_FALSE(Again().IsUnconfirmed("b"));
  EXPECT_EQ(Again().confirmed(), "b");
  ASSERT_TRUE(Again().TakeBack("too late"));
  EXPECT_FALSE(Again().IsUnconfirmed("b"));
  ASSERT_TRUE(Again().Confirm());
  EXPECT_EQ(Again().confirmed(), "b");
}

TEST_F(KeptConfigsTest, WhatWasTakenBackIsNotTakenUntilTheFileDiffers) {
  ASSERT_TRUE(Add("a", false));
  ASSERT_TRUE(Add("b", true));
  ASSERT_TRUE(Again().TakeBack("bay.a worked before"));
  EXPECT_EQ(Again().trial(), Trial::taken_back);
  EXPECT_EQ(Again().why_taken_back(), "bay.a worked before");
  EXPECT_TRUE(Again().IsUnconfirmed("b"));
  EXPECT_TRUE(Again().IsUnconfirmed("b")) << "at every start";
  EXPECT_FALSE(Again().IsUnconfirmed("c"));
  ASSERT_TRUE(Again().Confirm());
  EXPECT_EQ(Again().confirmed(), "a") << "it is too late";
  ASSERT_TRUE(Add("b", true));
  EXPECT_EQ(Again().trial(), Trial::running) << "once more";
  ASSERT_TRUE(Again().TakeBack("too late"));
  ASSERT_TRUE(Add("c", false));
  EXPECT_FALSE(Again().IsUnconfirmed("b")) << "it was changed, so it is meant when it comes again";
}

TEST_F(KeptConfigsTest, OnlyWhatAStartNeedsIsKept) {
  for (const char* text : {"a", "b", "c"}) {
    ASSERT_TRUE(Add(text, false));
    ASSERT_TRUE(Add("trial", true));
    ASSERT_TRUE(Again().TakeBack("too late"));
  }
  EXPECT_THAT(Files(), UnorderedElementsAre("confirmed.yaml", "trial.yaml", "taken_back.txt"));
  ASSERT_TRUE(Add("d", false));
  EXPECT_THAT(Files(), UnorderedElementsAre("confirmed.yaml"));
}

TEST_F(KeptConfigsTest, ADiskThatFailsIsToldAndChangesNothing) {
  fs::create_directories(folder_.parent_path());
  std::ofstream(folder_) << "a file";
  EXPECT_FALSE(Add("a", false));
  EXPECT_TRUE(Again().empty());
  fs::remove(folder_);
  ASSERT_TRUE(Add("a", false));
  ASSERT_TRUE(Add("b", true));
  fs::create_directories(folder_ / "taken_back.txt.part");
  EXPECT_FALSE(Again().TakeBack("too late"));
  EXPECT_EQ(Again().trial(), Trial::running);
  fs::create_directories(folder_ / "confirmed.yaml.part");
  EXPECT_FALSE(Add("c", false));
  EXPECT_EQ(Again().confirmed(), "a");
  EXPECT_TRUE(Again().IsUnconfirmed("b"));
}

}  // namespace
}  // namespace baudgate::reload
