// Tests of `UserFile`, `UserDirectory` and `baudgate users`: who a client is, and what it may do.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/users/user_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <thread>

#include "gateway/base/secrets.h"
#include "gateway/tools/cli/offline/users.h"

namespace baudgate::users {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

const WallTime kNow = ParseWallTime("2027-01-01").value();

TEST(Roles, MayDoWhatTheirTableSays) {
  const struct {
    Role role;
    std::array<bool, 4> may;  // read, operate, configure, audit
  } kRows[] = {{Role::viewer, {true, false, false, false}},
               {Role::operating, {true, true, false, false}},
               {Role::engineer, {true, true, true, false}},
               {Role::auditor, {true, false, false, true}}};
  for (const auto& [role, may] : kRows) {
    for (std::size_t act = 0; act < may.size(); ++act) {
      EXPECT_EQ(May(role, static_cast<Act>(act)), may[act]) << Name(role) << ' ' << act;
      EXPECT_TRUE(May(NeededFor(static_cast<Act>(act)), static_cast<Act>(act)));
    }
    EXPECT_EQ(RoleNamed(Name(role)), role);
  }
  EXPECT_EQ(RoleNamed("root"), std::nullopt);
}

TEST(UserFile, IsReadAsItIsWritten) {
  UserFile file;
  ASSERT_TRUE(file.Set("anna", Role::operating, "correct horse"));
  ASSERT_TRUE(file.Set("@scada", Role::viewer, ""));
  const auto token = file.AddToken("anna", kNow + 24h);
  ASSERT_TRUE(token);
  EXPECT_THAT(*token, SizeIs(64));
  EXPECT_THAT(file.Text(), Not(HasSubstr(*token)));
  EXPECT_THAT(file.Text(), Not(HasSubstr("correct")));
  const auto again = UserFile::Parse(file.Text());
  ASSERT_TRUE(again) << again.error();
  EXPECT_EQ(again->Text(), file.Text());
  EXPECT_TRUE(HasHash("correct horse", again->Find("anna")->hash));
  EXPECT_FALSE(HasHash("correct horse ", again->Find("anna")->hash));
  EXPECT_FALSE(HasHash(std::string("correct horse\0x", 15), again->Find("anna")->hash));
  EXPECT_EQ(again->Find("@scada")->role, Role::viewer);
  EXPECT_EQ(again->tokens().at(0).digest, Sha256Hex(*token));
}

TEST(UserFile, NamesTheLineOfAnError) {
  const struct {
    const char* text;
    const char* says;
  } kTexts[] = {{"user anna boss -", "line 1: 'boss' is not a role"},
                {"# comment\n\nuser an:na viewer -", "line 3: 'an:na' is not a name"},
                {"user anna viewer", "line 1: is not 'user NAME ROLE HASH'"},
                {"user anna viewer -\nuser anna viewer -", "line 2: 'anna' is listed twice"},
                {"token anna 2027-01-01 abc", "line 1: there is no user 'anna'"},
                {"user anna viewer -\ntoken anna soon abc", "line 2: "}};
  for (const auto& [text, says] : kTexts) {
    const auto file = UserFile::Parse(text);
    ASSERT_FALSE(file) << text;
    EXPECT_THAT(file.error(), HasSubstr(says));
  }
}

TEST(UserFile, RefusesShortPasswordsAndStrangeNames) {
  UserFile file;
  EXPECT_THAT(file.Set("anna", Role::viewer, "short").error(), HasSubstr("needs 8 to 256"));
  EXPECT_THAT(file.Set("an na", Role::viewer, "long enough").error(), HasSubstr("is not a name"));
  EXPECT_THAT(file.Set("anna", Role::viewer, std::string("long\0enough", 11)).error(),
              HasSubstr("NUL"));
  EXPECT_THAT(file.Set("@", Role::viewer, "").error(), HasSubstr("is not a name"));
  EXPECT_THAT(file.AddToken("anna", kNow).error(), HasSubstr("baudgate users add anna"));
  EXPECT_THAT(file.users(), IsEmpty());
}

class UserDirectoryTest : public ::testing::Test {
 protected:
  UserDirectoryTest() {
    std::string form = (fs::temp_directory_path() / "baudgate-users-XXXXXX").string();
    folder_ = ::mkdtemp(form.data());
    path_ = folder_ / "users";
  }
  ~UserDirectoryTest() override { fs::remove_all(folder_); }

  void Write(const UserFile& file, mode_t mode = 0640) const {
    std::ofstream(path_) << file.Text();
    ::chmod(path_.c_str(), mode);
  }

  Now Later(Duration time) const { return {now_.instant + time, now_.wall + time}; }

  struct Ran {
    int code;
    std::string out;
    std::string err;
  };
  Ran Run(tools::UsersOptions options, const std::string& input = "") const {
    options.file = path_.string();
    std::istringstream in(input);
    std::ostringstream out;
    std::ostringstream err;
    const int code = tools::RunUsers(options, in, out, err);
    return {code, out.str(), err.str()};
  }

  const Now now_{Instant() + 1h, kNow};
  fs::path folder_;
  fs::path path_;
};

using What = tools::UsersOptions::What;

TEST_F(UserDirectoryTest, KnowsUsersByPasswordTokenAndGroup) {
  UserFile file;
  ASSERT_TRUE(file.Set("anna", Role::operating, "correct horse"));
  ASSERT_TRUE(file.Set("meter", Role::viewer, ""));
  ASSERT_TRUE(file.Set("@root", Role::engineer, ""));
  const std::string token = file.AddToken("meter", kNow + 24h).value();
  Write(file);
  UserDirectory directory;
  EXPECT_FALSE(directory.is_used());
  directory.SetFile(path_.string());
  EXPECT_TRUE(directory.is_used());
  EXPECT_THAT(directory.Trouble(now_.instant), IsEmpty());
  EXPECT_EQ(directory.ByPassword("anna", "correct horse", now_.instant)->user.role,
            Role::operating);
  EXPECT_FALSE(directory.ByPassword("anna", "wrong horse", now_.instant));
  EXPECT_FALSE(directory.ByPassword("meter", "", now_.instant)) << "has no password";
  EXPECT_FALSE(directory.ByPassword("nobody", "correct horse", now_.instant));
  EXPECT_EQ(directory.ByToken(token, now_)->user.name, "meter");
  EXPECT_FALSE(directory.ByToken(token, Later(24h))) << "has ended";
  EXPECT_FALSE(directory.ByToken("", now_));
  const std::array<gid_t, 2> groups = {1234567, 0};
  EXPECT_EQ(directory.OfSystemUser("anna", {}, now_.instant), Role::operating);
  EXPECT_EQ(directory.OfSystemUser("otto", groups, now_.instant), Role::engineer)
      << "by the group root";
  EXPECT_EQ(directory.OfSystemUser("otto", {}, now_.instant), Role::viewer);
}

TEST_F(UserDirectoryTest, ALoginHoldsUntilItsPasswordOrTokenChanges) {
  UserFile file;
  ASSERT_TRUE(file.Set("anna", Role::viewer, "correct horse"));
  const std::string token = file.AddToken("anna", kNow + 24h).value();
  Write(file);
  UserDirectory before;
  before.SetFile(path_.string());
  const auto by_password = before.ByPassword("anna", "correct horse", now_.instant)->login;
  const auto by_token = before.ByToken(token, now_)->login;
  EXPECT_EQ(before.RoleOf(by_password, now_), Role::viewer);
  EXPECT_EQ(before.RoleOf(by_token, now_), Role::viewer);
  EXPECT_EQ(before.RoleOf(by_token, Later(24h)), std::nullopt) << "the token has ended";
  ASSERT_TRUE(file.Set("anna", Role::engineer, "another horse"));
  Write(file);
  UserDirectory after;
  after.SetFile(path_.string());
  EXPECT_EQ(after.RoleOf(by_password, now_), std::nullopt) << "the password was changed";
  EXPECT_EQ(after.RoleOf(by_token, now_), Role::engineer);
  file.Remove("anna");
  ASSERT_TRUE(file.Set("anna", Role::engineer, "another horse"));
  Write(file);
  UserDirectory again;
  again.SetFile(path_.string());
  EXPECT_EQ(again.RoleOf(by_token, now_), std::nullopt) << "a new user of the same name";
}

TEST_F(UserDirectoryTest, AFileThatOthersCanReadOrChangeIsNotUsed) {
  UserFile file;
  ASSERT_TRUE(file.Set("anna", Role::operating, "correct horse"));
  Write(file, 0644);
  UserDirectory directory;
  directory.SetFile(path_.string());
  EXPECT_THAT(directory.Trouble(now_.instant), HasSubstr("chmod o= " + path_.string()));
  EXPECT_FALSE(directory.ByPassword("anna", "correct horse", now_.instant));
  ::chmod(path_.c_str(), 0660);
  UserDirectory other;
  other.SetFile(path_.string());
  // The group root may write, because its members are trusted.
  EXPECT_EQ(other.Trouble(now_.instant).empty(), ::getegid() == 0);
  fs::remove(path_);
  UserDirectory absent;
  absent.SetFile(path_.string());
  EXPECT_THAT(absent.Trouble(now_.instant), HasSubstr("has no users, so nobody can log in"));
  EXPECT_FALSE(absent.ByPassword("anna", "correct horse", now_.instant));
}

TEST_F(UserDirectoryTest, AFileWhoseModeBecomesUnsafeIsRefusedASecondLater) {
  UserFile file;
  ASSERT_TRUE(file.Set("anna", Role::operating, "correct horse"));
  Write(file);
  UserDirectory directory;
  directory.SetFile(path_.string());
  const auto role = [&](Duration after) {
    return directory.OfSystemUser("anna", {}, now_.instant + after);
  };
  EXPECT_EQ(role(0s), Role::operating);
  ::chmod(path_.c_str(), 0644);
  EXPECT_EQ(role(900ms), Role::operating) << "looks once a second";
  EXPECT_EQ(role(1s), Role::viewer);
  EXPECT_THAT(directory.Trouble(now_.instant + 1s), HasSubstr("chmod o= "));
  ::chmod(path_.c_str(), 0640);
  EXPECT_EQ(role(2s), Role::operating);
  ::chmod(folder_.c_str(), 0777);
  EXPECT_EQ(role(3s), Role::viewer) << "others could replace the file";
  EXPECT_THAT(directory.Trouble(now_.instant + 3s), HasSubstr(folder_.string()));
  ::chmod(folder_.c_str(), 0700);
  EXPECT_EQ(role(4s), Role::operating);
}

TEST_F(UserDirectoryTest, TheCommandAddsListsAndRemovesUsers) {
  EXPECT_EQ(
      Run({.what = What::add, .file = {}, .name = "anna", .role = "operator"}, "correct horse\n")
          .code,
      0);
  const Ran token = Run({.what = What::token, .file = {}, .name = "anna"});
  EXPECT_EQ(token.code, 0);
  EXPECT_THAT(token.out, SizeIs(65)) << "the token alone is on the standard output";
  struct stat its {};
  ASSERT_EQ(::stat(path_.c_str(), &its), 0);
  EXPECT_EQ(its.st_mode & 0777U, 0640U);
  UserDirectory directory;
  directory.SetFile(path_.string());
  EXPECT_TRUE(directory.ByPassword("anna", "correct horse", now_.instant));
  EXPECT_TRUE(directory.ByToken(token.out.substr(0, 64), ReadClocks()));
  const std::string list = Run({.what = What::list, .file = {}}).out;
  EXPECT_THAT(list, HasSubstr("anna  operator  set       20"));
  EXPECT_EQ(Run({.what = What::remove, .file = {}, .name = "anna"}).code, 0);
  EXPECT_EQ(Run({.what = What::remove, .file = {}, .name = "anna"}).code, 2);
}

TEST_F(UserDirectoryTest, CommandsAtTheSameTimeDoNotUndoEachOther) {
  std::vector<std::thread> commands;
  for (int i = 0; i < 8; ++i) {
    commands.emplace_back([this, i] {
      const tools::UsersOptions add{.what = What::add,
                                    .file = {},
                                    .name = "user" + std::to_string(i),
                                    .role = "viewer",
                                    .no_password = true};
      EXPECT_EQ(Run(add).code, 0);
    });
  }
  for (std::thread& command : commands) command.join();
  EXPECT_THAT(UserFile::Read(path_)->users(), SizeIs(8));
}

TEST_F(UserDirectoryTest, TheCommandRefusesWhatItCannotDo) {
  const auto add = [this](const char* name, const char* role, const char* input) {
    return Run({.what = What::add, .file = {}, .name = name, .role = role}, input);
  };
  EXPECT_THAT(add("anna", "boss", "correct horse\n").err, HasSubstr("'boss' is not a role"));
  EXPECT_THAT(add("anna", "viewer", "").err, HasSubstr("no password on the standard input"));
  EXPECT_THAT(add("anna", "viewer", "short\n").err, HasSubstr("needs 8 to 256"));
  EXPECT_EQ(Run({.what = What::token, .file = {}, .name = "anna"}).code, 2);
  EXPECT_FALSE(fs::exists(path_)) << "nothing was written";
  std::ofstream(path_) << "nonsense\n";
  ::chmod(path_.c_str(), 0640);
  EXPECT_EQ(add("anna", "viewer", "correct horse\n").code, 4);
}

}  // namespace
}  // namespace baudgate::users
