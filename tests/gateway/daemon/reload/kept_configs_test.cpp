// Tests which configuration the gateway uses at its start. In the names of tests, "again" is a
// restart, also after kill -9.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "gateway/daemon/reload/trial.h"
#include "tests/support/times.h"

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

TEST_F(KeptConfigsTest, TheFolderIsMissingAndEmptyAtFirst) {
  EXPECT_TRUE(Again().empty());
  EXPECT_FALSE(Again().confirmed());
  EXPECT_FALSE(Again().IsUnconfirmed("a"));
  EXPECT_FALSE(Again().IsUnconfirmed(""));
  EXPECT_EQ(Again().trial(), Trial::none);
  EXPECT_FALSE(fs::exists(folder_));
}

TEST_F(KeptConfigsTest, AConfigurationOnTrialAtAStartIsNotUsed) {
  Write({"a"});
  Write({"a", "b"});
  EXPECT_EQ(Again().trial(), Trial::running);
  EXPECT_TRUE(Again().IsUnconfirmed("b"));
  EXPECT_EQ(Again().confirmed(), "a");
  EXPECT_EQ(Again().why_taken_back(), "the gateway ended before the configuration was confirmed");
  EXPECT_FALSE(Again().IsUnconfirmed("c")) << "the file was changed since";
}

TEST_F(KeptConfigsTest, RemovedOrChangedFilesAreWrittenAgain) {
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
  std::ofstream(Again().confirmed_file(), std::ios::trunc).flush();
  EXPECT_FALSE(Again().IsUnconfirmed("b")) << "an empty text could not run in its place";
  fs::remove(Again().confirmed_file());
  EXPECT_FALSE(Again().IsUnconfirmed("b")) << "there is nothing that could run in its place";
}

TEST_F(KeptConfigsTest, AConfirmedConfigurationIsUsed) {
  Write({"a", "b"});
  Write({"b"});
  EXPECT_FALSE(Again().IsUnconfirmed("b"));
  EXPECT_EQ(Again().confirmed(), "b");
}

TEST_F(KeptConfigsTest, ARolledBackConfigurationIsNotUsedUntilTheFileDiffers) {
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

TEST_F(KeptConfigsTest, OnlyFilesThatAStartNeedsAreStored) {
  for (const char* text : {"a", "b", "c"}) {
    Write({text});
    Write({text, "trial"});
    Write({text, "trial", "too late"});
  }
  EXPECT_THAT(Files(), UnorderedElementsAre("confirmed.yaml", "trial.yaml", "taken_back.txt"));
  Write({"d"});
  EXPECT_THAT(Files(), UnorderedElementsAre("confirmed.yaml"));
}

TEST_F(KeptConfigsTest, AFailedWriteIsReportedAndChangesNothing) {
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

using ::testing::HasSubstr;

struct TrialCase {
  const char* what;
  Health before;
  Duration after;
  std::optional<Health> now;  // nothing: the device is no longer configured
  const char* gives_up;       // the reason for the rollback; "": no rollback
};

TEST(Probation, RollsBackByTimeAndDeviceHealth) {
  const TrialCase cases[] = {
      {"all is well", Health::well, 30s, Health::well, ""},
      {"the last moment", Health::well, 59s, Health::well, ""},
      {"nobody comes", Health::well, 60s, Health::well, "nobody ran 'baudgate confirm' in time"},
      {"gone bad", Health::well, 1s, Health::ill, "bay.a worked before the change, and fails now"},
      {"bad before", Health::ill, 30s, Health::ill, ""},
      {"not asked yet", Health::well, 19s, Health::unknown, ""},
      {"not asked for long", Health::well, 20s, Health::unknown, "has not answered since"},
      {"not known before", Health::unknown, 59s, Health::unknown, ""},
      {"taken out of use", Health::well, 59s, Health::unasked, ""},
      {"out of use before", Health::unasked, 59s, Health::ill, ""},
      {"taken out", Health::well, 59s, std::nullopt, ""},
  };
  for (const TrialCase& one : cases) {
    Probation probation;
    probation.Begin(kStart, 60s, {{"bay.a", one.before}});
    Healths healths;
    if (one.now) healths = {{"bay.a", *one.now}};
    const auto why = probation.Look(kStart + one.after, healths);
    EXPECT_EQ(why.has_value(), *one.gives_up != '\0') << one.what;
    EXPECT_THAT(why.value_or(""), HasSubstr(one.gives_up)) << one.what;
    EXPECT_TRUE(probation.running()) << one.what;
  }
}

TEST(Probation, OfAShortTimeWaitsHalfThatTimeForADevice) {
  Probation probation;
  probation.Begin(kStart, 4s, {{"bay.a", Health::well}});
  EXPECT_FALSE(probation.Look(kStart + 1999ms, {{"bay.a", Health::unknown}}));
  EXPECT_TRUE(probation.Look(kStart + 2s, {{"bay.a", Health::unknown}}));
}

TEST(Probation, ADeviceIsGivenTimeAfterItsPortWasLent) {
  Probation probation;
  probation.Begin(kStart, 60s, {{"bay.a", Health::well}});
  EXPECT_FALSE(probation.Look(kStart + 30s, {{"bay.a", Health::unasked}}));
  EXPECT_FALSE(probation.Look(kStart + 31s, {{"bay.a", Health::unknown}}));
  EXPECT_FALSE(probation.Look(kStart + 49s, {{"bay.a", Health::unknown}}));
  EXPECT_TRUE(probation.Look(kStart + 50s, {{"bay.a", Health::unknown}}));
}

// When the second trial begins, bay.a has not been polled yet. So its state before the first trial
// is compared.
TEST(Probation, RestartedDuringATrialRemembersWhichDevicesWorkedBefore) {
  Probation probation;
  probation.Begin(kStart, 60s, {{"bay.a", Health::well}});
  probation.Begin(kStart + 50s, 60s, {{"bay.a", Health::unknown}, {"bay.b", Health::well}});
  const auto look = [&](Duration after, Health a, Health b) {
    return probation.Look(kStart + after, {{"bay.a", a}, {"bay.b", b}}).value_or("");
  };
  EXPECT_EQ(look(69s, Health::unknown, Health::well), "");
  EXPECT_THAT(look(70s, Health::unknown, Health::well), HasSubstr("bay.a worked before"));
  EXPECT_THAT(look(60s, Health::well, Health::ill), HasSubstr("bay.b worked before"));
  EXPECT_EQ(look(109s, Health::well, Health::well), "");
  EXPECT_THAT(look(110s, Health::well, Health::well), HasSubstr("nobody ran 'baudgate confirm'"));
  probation.End();
  probation.Begin(kStart, 60s, {});
  EXPECT_EQ(look(30s, Health::ill, Health::ill), "") << "of one that has ended nothing is known";
}

TEST(Probation, AfterItsEndNeverRollsBack) {
  Probation probation;
  EXPECT_FALSE(probation.running());
  EXPECT_FALSE(probation.Look(kStart, {}));
  probation.Begin(kStart, 60s, {{"bay.a", Health::well}});
  probation.End();
  EXPECT_FALSE(probation.Look(kStart + 1h, {{"bay.a", Health::ill}}));
}

}  // namespace
}  // namespace baudgate::reload
