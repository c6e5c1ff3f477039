// A reload of a gateway to which the system gives no more, or whose file is none.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include "tests/system/reload_fixture.h"

namespace baudgate::system_test {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

class ReloadLimits : public Reload {
 protected:
  /// So many more files may be open than are now. The limit is one of numbers, not of files.
  void Leave(int more) const {
    const fs::path open = "/proc/" + std::to_string(daemon->id()) + "/fd";
    rlim_t number = 0;
    for (int free = 0; free < more; ++number) {
      free += fs::exists(fs::symlink_status(open / std::to_string(number))) ? 0 : 1;
    }
    const rlimit limit{number, number};
    ASSERT_EQ(::prlimit(daemon->id(), RLIMIT_NOFILE, &limit, nullptr), 0);
  }
  std::string WithoutMeter() const {
    const std::string all = YamlWithSocket();
    return all.substr(0, all.find("  - name: meter"));
  }
};

TEST_F(ReloadLimits, WithoutDescriptorsChangesNothing) {
  StartAll(YamlWithSocket());
  SetFile(WithoutMeter());
  ASSERT_EQ(Ask({"reload"}).code, 0);
  Leave(2);  // the command's connection and the file
  SetFile(YamlWithSocket());
  const Finished reload = Ask({"reload"});
  EXPECT_EQ(reload.code, 4);
  EXPECT_THAT(reload.errors,
              AllOf(HasSubstr("line meter: no thread for its port: Too many open files"),
                    HasSubstr("nothing is changed")));
  EXPECT_EQ(Status()["lines"].size(), 2U);
  EXPECT_EQ(client.Float(kModuleUnit, 0), 100.25F);
}

TEST_F(ReloadLimits, WithoutDescriptorsIsTakenBackAllTheSame) {
  StartAll(YamlWithSocket());
  SetFile(WithoutMeter());
  ASSERT_EQ(Ask({"reload", "--confirm", "3s"}).code, 0);
  Leave(1);
  ASSERT_TRUE(EventuallyLogged(*daemon, "was taken back: nobody has confirmed it within 3s"));
  EXPECT_THAT(daemon->Errors(), HasSubstr("line meter: no thread for its port"));
  EXPECT_TRUE(EventuallyFloat(client, kModuleUnit, 0, 100.25F));
  daemon->Signal(SIGTERM);
  EXPECT_EQ(daemon->WaitForEnd(10s), 0);
}

TEST_F(ReloadLimits, ThatCanNotBeTakenBackAtOnceIsTakenBackLater) {
  StartAll(YamlWithSocket());
  SetFile(WithSlowerIo());
  ASSERT_EQ(Ask({"reload", "--confirm", "2s"}).code, 0);
  const fs::path copy = directory() / "state" / gateway() / "configurations/000001.yaml";
  fs::rename(copy, copy.string() + ".away");
  ASSERT_TRUE(EventuallyLogged(*daemon, "can not be taken back, and that is tried on: "));
  EXPECT_THAT(Ask({"status"}).output, HasSubstr("000001.yaml: can not be read"));
  fs::rename(copy.string() + ".away", copy);
  ASSERT_TRUE(EventuallyLogged(*daemon, "was taken back: nobody has confirmed it within 2s"));
  EXPECT_FALSE(RunsSlower());
}

TEST_F(ReloadLimits, OfAPipeWaitsForNobody) {
  StartAll(YamlWithSocket());
  fs::remove(file());
  ASSERT_EQ(::mkfifo(file().c_str(), 0600), 0);
  const Finished reload = Ask({"reload"});
  EXPECT_EQ(reload.code, 2);
  EXPECT_THAT(reload.errors, HasSubstr("is no regular file"));
  daemon->Signal(SIGTERM);
  EXPECT_EQ(daemon->WaitForEnd(10s), 0);
}

}  // namespace
}  // namespace baudgate::system_test
