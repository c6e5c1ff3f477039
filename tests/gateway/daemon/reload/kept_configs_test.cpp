// What a start takes, after every order of events; "again" is a restart, also by kill -9: nothing
// but what is on the disk is known.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "gateway/daemon/reload/trial.h"

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
  bool Write(const KeptTexts& wanted) const {
    const auto written = Again().Write(wanted);
    EXPECT_TRUE(written) << written.error();
    return written && *written;
  }
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
  Write({"a"});
  Write({"a", "b"});
  EXPECT_EQ(Again().trial(), Trial::running);
  EXPECT_TRUE(Again().IsUnconfirmed("b"));
  EXPECT_EQ(Again().confirmed(), "a");
  EXPECT_EQ(Again().why_taken_back(), "the gateway ended before it was confirmed");
  EXPECT_FALSE(Again().IsUnconfirmed("c")) << "the file was changed since";
}

TEST_F(KeptConfigsTest, WhatSomebodyHasRemovedOrChangedIsWrittenAgain) {
  const KeptTexts wanted{"a", "b", "why"};
  EXPECT_TRUE(Write(wanted));
  EXPECT_FALSE(Write(wanted));
  for (const char* file : {"confirmed.yaml", "trial.yaml", "taken_back.txt"}) {
    SCOPED_TRACE(file);
    fs::remove(folder_ / file);
    EXPECT_TRUE(Write(wanted));
    std::ofstream(folder_ / file) << "edited";
    EXPECT_TRUE(Write(wanted));
    EXPECT_FALSE(Write(wanted));
  }
  fs::remove_all(folder_);
  EXPECT_TRUE(Write(wanted));
  EXPECT_EQ(Again().confirmed(), "a");
  EXPECT_EQ(Again().trial(), Trial::taken_back);
}

TEST_F(KeptConfigsTest, AnEmptyCopyOfATrialConfirmsNothing) {
  Write({"a", "b"});
  std::ofstream(folder_ / "trial.yaml", std::ios::trunc).flush();
  EXPECT_TRUE(Again().IsUnconfirmed("b"));
  EXPECT_FALSE(Again().IsUnconfirmed("a")) << "the confirmed one";
  fs::remove(Again().confirmed_file());
  EXPECT_FALSE(Again().IsUnconfirmed("b")) << "there is nothing that could run in its place";
}

TEST_F(KeptConfigsTest, WhatIsConfirmedIsTaken) {
  Write({"a", "b"});
  Write({"b"});
  EXPECT_FALSE(Again().IsUnconfirmed("b"));
  EXPECT_EQ(Again().confirmed(), "b");
}

TEST_F(KeptConfigsTest, WhatWasTakenBackIsNotTakenUntilTheFileDiffers) {
  Write({"a", "b"});
  Write({"a", "b", "bay.a worked before"});
  EXPECT_EQ(Again().trial(), Trial::taken_back);
  EXPECT_EQ(Again().why_taken_back(), "bay.a worked before");
  EXPECT_TRUE(Again().IsUnconfirmed("b"));
  EXPECT_TRUE(Again().IsUnconfirmed("b")) << "at every start";
  EXPECT_FALSE(Again().IsUnconfirmed("c"));
  Write({"a", "b"});
  EXPECT_EQ(Again().trial(), Trial::running) << "once more";
  Write({"a", "b", "too late"});
  Write({"c"});
  EXPECT_FALSE(Again().IsUnconfirmed("b")) << "it was changed, so it is meant when it comes again";
}

TEST_F(KeptConfigsTest, OnlyWhatAStartNeedsIsKept) {
  for (const char* text : {"a", "b", "c"}) {
    Write({text});
    Write({text, "trial"});
    Write({text, "trial", "too late"});
  }
  EXPECT_THAT(Files(), UnorderedElementsAre("confirmed.yaml", "trial.yaml", "taken_back.txt"));
  Write({"d"});
  EXPECT_THAT(Files(), UnorderedElementsAre("confirmed.yaml"));
}

TEST_F(KeptConfigsTest, ADiskThatFailsIsToldAndChangesNothing) {
  fs::create_directories(folder_.parent_path());
  std::ofstream(folder_) << "a file";
  EXPECT_FALSE(Again().Write({"a"}));
  EXPECT_TRUE(Again().empty());
  fs::remove(folder_);
  Write({"a", "b"});
  fs::create_directories(folder_ / "taken_back.txt.part");
  EXPECT_FALSE(Again().Write({"a", "b", "too late"}));
  EXPECT_EQ(Again().trial(), Trial::running);
  fs::create_directories(folder_ / "confirmed.yaml.part");
  EXPECT_FALSE(Again().Write({"c"}));
  EXPECT_EQ(Again().confirmed(), "a");
  EXPECT_TRUE(Again().IsUnconfirmed("b"));
}

}  // namespace
}  // namespace baudgate::reload
