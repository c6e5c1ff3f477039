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
  const std::string at = "listen: \"127.0.0.1:" + std::to_string(port()) + "\"";
  SetFile(Replaced(
      WithoutMeter(), at,
      "listen: [ \"127.0.0.1:" + std::to_string(port()) + "\", " + LinkOf("master") + " ]"));
  const Finished master = Ask({"reload"});
  EXPECT_EQ(master.code, 4);
  EXPECT_THAT(master.errors, HasSubstr("listener " + LinkOf("master") + ": Too many open files"));
  EXPECT_EQ(Status()["modbus"]["masters"].size(), 0U);
  EXPECT_EQ(Status()["lines"].size(), 2U);
  EXPECT_EQ(client.Float(kModuleUnit, 0), 100.25F);
}

TEST_F(ReloadLimits, WithoutDescriptorsIsTakenBackAllTheSame) {
  StartAll(YamlWithSocket());
  SetFile(WithoutMeter());
  ASSERT_EQ(Ask({"reload", "--confirm", "3s"}).code, 0);
  Leave(1);
  ASSERT_TRUE(EventuallyLogged(*daemon, "was taken back: nobody has confirmed it in time"));
  EXPECT_THAT(daemon->Errors(), HasSubstr("line meter: no thread for its port"));
  EXPECT_TRUE(EventuallyFloat(client, kModuleUnit, 0, 100.25F));
  daemon->Signal(SIGTERM);
  EXPECT_EQ(daemon->WaitForEnd(10s), 0);
}

/// What ran is known, whatever the disk says by now.
TEST_F(ReloadLimits, IsTakenBackWithoutCopyAndProfile) {
  StartAll(YamlWithSocket());
  SetFile(WithSlowerIo());
  ASSERT_EQ(Ask({"reload", "--confirm", "2s"}).code, 0);
  fs::remove(ConfirmedCopy());
  Station::Write("profiles/dcon/module.yaml", "no profile");
  ASSERT_TRUE(EventuallyLogged(*daemon, "was taken back: nobody has confirmed it in time"));
  EXPECT_TRUE(EventuallyLogged(*daemon, "reload: line io: begins anew: poll of io-1"));
  EXPECT_TRUE(EventuallyFloat(client, kModuleUnit, 0, 100.25F));
}

TEST_F(ReloadLimits, AStartWithoutDescriptorsSaysWhichLimit) {
  SetFile(YamlWithSocket());
  const Finished start =
      RunToEnd({"/bin/sh", "-c", "ulimit -n 8; exec " BAUDGATE_BINARY " run -c " + file().string()},
               directory(), Environment());
  EXPECT_EQ(start.code, 4);
  EXPECT_THAT(start.errors, AllOf(HasSubstr("Too many open files"), HasSubstr("LimitNOFILE")));
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
