// Tests of `Reloader`. The content of a configuration file is the name of its only line.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/reloader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <future>

namespace baudgate::daemon {
namespace {

namespace fs = std::filesystem;
using control::ReloadAnswer;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr Duration kNever = Duration::zero();

config::Config ConfigOf(const std::string& text, const std::string& profile = {}) {
  config::Config config;
  config.lines.emplace_back().name = text.substr(0, text.find('#')) + profile;
  return config;
}

class ReloaderTest : public ::testing::Test {
 protected:
  ReloaderTest() { fs::remove_all(folder_); }
  ~ReloaderTest() override {
    reloader_.reset();
    fs::remove_all(folder_);
  }

  void Start(std::optional<reload::Refused> refused = {}, Duration disk_patience = 1min) {
    ReloadOptions options;
    options.refused = std::move(refused);
    options.disk_patience = disk_patience;
    options.file = "baudgate.yaml";
    options.text_at_start = "a";
    options.read = [this, disk = disk_]() -> Result<std::string> {
      if (disk.valid()) disk.wait();
      return file_;
    };
    options.load = [this](const std::string& text) {
      return LoadedText{ConfigOf(text, profile_), warnings_};
    };
    options.notify = [](const std::string&) {};
    options.summary = [] { return "runs"; };
    options.kept.emplace(folder_);
    Reloader::Links links;
    links.running = [this] { return std::make_shared<const config::Config>(running_); };
    links.keeps = [] { return true; };
    links.open_folder = []() -> Status { return {}; };
    links.examine = [](const config::Config&, reload::Difference&) {};
    links.prepare = [this](config::Config next, const reload::Difference&) {
      return Reloader::Prepared{troubles_, [this, next = std::move(next)] {
                                  running_ = next;
                                  return missing_;
                                }};
    };
    links.healths = [] { return reload::Healths{}; };
    links.tell = [this](bool, const std::string& text) { told_ = text; };
    reloader_ = std::make_unique<Reloader>(std::move(options), std::move(links));
    reloader_->Start();
  }

  template <typename Ask>
  static ReloadAnswer Answer(Ask ask) {
    std::promise<ReloadAnswer> answer;
    ask([&answer](const ReloadAnswer& its) { answer.set_value(its); });
    return answer.get_future().get();
  }
  ReloadAnswer Reload(const std::string& file, Duration confirm = kNever) {
    file_ = file;
    return Answer([&](control::ReloadService::Answered answered) {
      reloader_->Reload({.confirm = confirm, .by = "user:anna"}, std::move(answered));
    });
  }
  ReloadAnswer Confirm() {
    return Answer([&](control::ReloadService::Answered answered) {
      reloader_->Confirm({.by = "user:anna"}, std::move(answered));
    });
  }
  ReloadAnswer Revert() {
    return Answer([&](control::ReloadService::Answered answered) {
      reloader_->Revert({.by = "user:anna", .applied = seen_}, std::move(answered));
    });
  }
  std::string Runs() const { return running_.lines[0].name; }
  std::string AtAStart() const {
    const reload::KeptConfigs kept(folder_);
    return kept.IsUnconfirmed(file_) ? kept.confirmed().value_or("none") : file_;
  }

  const fs::path folder_ = fs::path(::testing::TempDir()) / "baudgate-reloader/configurations";
  std::string file_ = "a";
  std::shared_future<void> disk_;  // if valid: the file can be read only when the future is ready
  std::string profile_;
  std::vector<std::string> warnings_;
  std::vector<std::string> troubles_;
  std::vector<std::string> missing_;
  std::string told_;
  std::string seen_;  // ReloadAsk::applied of Revert
  config::Config running_ = ConfigOf("a");
  std::unique_ptr<Reloader> reloader_;
};

TEST_F(ReloaderTest, ATrialEndsOnlyByConfirmationOrAnEarlierConfiguration) {
  Start();
  struct Step {
    const char* file;
    Duration confirm;
    const char* at_a_start;
    Duration left;
  };
  const Step steps[] = {
      {"b", 60s, "a", 60s},       {"b", kNever, "a", 60s},    {"b#", kNever, "a", 60s},
      {"c", kNever, "a", 60s},    {"c", 24h, "a", 24h},       {"d", 90s, "a", 90s},
      {"a", kNever, "a", kNever}, {"a", 60s, "a", kNever},    {"b", 60s, "a", 60s},
      {"a", 60s, "a", kNever},    {"e", kNever, "e", kNever},
  };
  for (const Step& step : steps) {
    SCOPED_TRACE(step.file);
    const ReloadAnswer answer = Reload(step.file, step.confirm);
    EXPECT_TRUE(answer.ok) << answer.text;
    EXPECT_LE(answer.confirm, step.left);
    EXPECT_EQ(answer.confirm > kNever, step.left > kNever);
    EXPECT_EQ(reloader_->state().confirm_until.has_value(), step.left > kNever);
    EXPECT_EQ(Runs(), std::string(step.file, 1));
    EXPECT_EQ(AtAStart(), step.at_a_start);
  }
  ASSERT_TRUE(Reload("f", 60s).ok);
  EXPECT_TRUE(Confirm().ok);
  EXPECT_EQ(AtAStart(), "f");
  EXPECT_EQ(Confirm().exit_code, 2);
}

TEST_F(ReloaderTest, ATrialIsTakenBackOnRequest) {
  Start();
  EXPECT_FALSE(Revert().ok) << "there is no trial";
  ASSERT_TRUE(Reload("b", 60s).ok);
  seen_ = "2026-01-01T00:00:00.000Z";
  EXPECT_EQ(Revert().exit_code, 2) << "the person has seen another configuration";
  EXPECT_EQ(Runs(), "b");
  seen_ = FormatWallTime(reloader_->state().applied);
  const ReloadAnswer answer = Revert();
  EXPECT_TRUE(answer.ok);
  EXPECT_THAT(answer.text, ::testing::HasSubstr("user:anna"));
  EXPECT_EQ(Runs(), "a");
  EXPECT_EQ(AtAStart(), "a");
  EXPECT_FALSE(reloader_->state().confirm_until);
  EXPECT_FALSE(Revert().ok);
  EXPECT_FALSE(Confirm().ok);
  EXPECT_EQ(Runs(), "a");
}

TEST_F(ReloaderTest, AChangedProfileAloneCanBeOnTrial) {
  Start();
  profile_ = "2";
  EXPECT_GT(Reload("a", 60s).confirm, kNever);
  EXPECT_EQ(Runs(), "a2");
  EXPECT_GT(Reload("a").confirm, kNever);
  profile_ = "";
  EXPECT_EQ(Reload("a").confirm, kNever);
  EXPECT_EQ(Runs(), "a");
  EXPECT_EQ(Confirm().exit_code, 2);
}

TEST_F(ReloaderTest, TheAnswerContainsTheWarningsOfTheFile) {
  Start();
  warnings_ = {"baudgate.yaml:7:3: warning: max_age: 5s is shorter than slow (2min)"};
  EXPECT_EQ(Reload("b").warnings, warnings_);
  EXPECT_EQ(Reload("b").warnings, warnings_) << "also where nothing has changed";
  troubles_ = {"listener 0.0.0.0:502: address already in use"};
  EXPECT_EQ(Reload("c").warnings, warnings_);
}

TEST_F(ReloaderTest, AnUnavailableListenerRefusesTheReloadAndATrialContinues) {
  Start();
  ASSERT_TRUE(Reload("b", 60s).ok);
  troubles_ = {"listener 0.0.0.0:502: address already in use"};
  const ReloadAnswer answer = Reload("c");
  EXPECT_EQ(answer.exit_code, 4);
  EXPECT_THAT(answer.text, HasSubstr("address already in use; nothing is changed"));
  EXPECT_EQ(Runs(), "b");
  EXPECT_TRUE(reloader_->state().confirm_until.has_value());
}

TEST_F(ReloaderTest, AnUnstorableTrialIsRefusedAndAnUnstorableReloadReported) {
  fs::create_directories(folder_.parent_path());
  std::ofstream(folder_) << "a file in place of the folder";
  Start();
  EXPECT_EQ(Reload("b", 60s).exit_code, 4);
  EXPECT_EQ(Runs(), "a");
  const ReloadAnswer answer = Reload("b");
  EXPECT_TRUE(answer.ok);
  EXPECT_THAT(answer.text, HasSubstr("; the configuration cannot be saved for the next start: "));
  EXPECT_EQ(Runs(), "b");
}

TEST_F(ReloaderTest, ARolledBackConfigurationIsAcceptedOnlyForATrial) {
  Start(reload::Refused{"b", "nobody ran 'baudgate confirm'"});
  EXPECT_TRUE(reload::KeptConfigs(folder_).IsUnconfirmed("b"));
  const ReloadAnswer again = Reload("b");
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_THAT(again.text, AllOf(HasSubstr("is not in use: nobody ran 'baudgate confirm'"),
                                HasSubstr("reload --confirm")));
  EXPECT_EQ(Runs(), "a");
  EXPECT_TRUE(Reload("b", 60s).ok);
  EXPECT_EQ(Runs(), "b");
  EXPECT_THAT(reloader_->state().not_the_file, IsEmpty());
  EXPECT_EQ(AtAStart(), "a");
}

TEST_F(ReloaderTest, AReloadIsAnsweredWhenTheDiskHangs) {
  std::promise<void> disk;
  disk_ = disk.get_future().share();
  Start({}, Duration::zero());
  const ReloadAnswer answer = Reload("b");
  EXPECT_EQ(answer.exit_code, 2);
  EXPECT_EQ(
      answer.text,
      "baudgate.yaml: cannot be read, because its disk does not answer; check the disk (dmesg)");
  EXPECT_EQ(Runs(), "a");
  disk.set_value();
}

TEST_F(ReloaderTest, TheAnswerNamesPartsThatAreNotYetOpen) {
  missing_ = {"modbus: port 502 is not open yet"};
  Start();
  const ReloadAnswer answer = Reload("b");
  EXPECT_TRUE(answer.ok);
  EXPECT_EQ(Runs(), "b") << "the rest is";
  EXPECT_THAT(answer.text, HasSubstr("; not working yet: modbus: port 502 is not open yet"));
  EXPECT_THAT(told_, HasSubstr("; not working yet: modbus: port 502 is not open yet"));
  missing_.clear();
  EXPECT_THAT(Reload("c").text, Not(HasSubstr("not working yet")));
}

}  // namespace
}  // namespace baudgate::daemon
