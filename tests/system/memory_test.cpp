// What outlives the daemon: the meter that was there before it ended is the only one whose values
// are good after it has started again, until a person takes another.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <csignal>
#include <fstream>
#include <iterator>

#include "tests/system/station.h"

namespace baudgate::system_test {
namespace {

using ::testing::HasSubstr;

constexpr int kGrowingUnit = 21;
constexpr int kSwapped = 0x090C;

class Memory : public Station {
 protected:
  Memory() {
    PinProfile("set4tm", "set-4tm.03m", "meter", {});
    std::ifstream file(directory() / "profiles/set4tm/meter.yaml");
    const std::string text((std::istreambuf_iterator<char>(file)), {});
    Write("profiles/set4tm/meter-a.yaml", "serial_number: 9020001\n" + text);
    Write("profiles/set4tm/meter-b.yaml", "serial_number: 9020002\n" + text);
  }

  void Run(const std::string& meter) {
    daemon_.reset();
    twin_.reset();
    twin_ = StartTwin("meters", meter, "200");
    daemon_ =
        StartDaemon(WithSocket(Head()) + Line("meters", "set4tm",
                                              "address: 200, profile: meter, unit: 21, poll: 300ms",
                                              "serial: 115200 8O1"));
  }
  void End() {
    daemon_->Signal(SIGTERM);
    ASSERT_EQ(daemon_->WaitForEnd(), 0);
  }
  bool Becomes(int quality) { return EventuallyQuality(client_, kGrowingUnit, 0, quality); }

  ModbusClient client_{port()};
  std::unique_ptr<Child> twin_;
  std::unique_ptr<Child> daemon_;
};

TEST_F(Memory, AnotherMeterIsBadUntilAPersonTakesIt) {
  Run("meter-a");
  ASSERT_TRUE(Becomes(kGood)) << daemon_->Errors();
  End();
  Run("meter-b");
  ASSERT_TRUE(Becomes(kSwapped)) << daemon_->Errors();
  const Finished status = Ask({"status", "meters.meters-1"});
  EXPECT_THAT(status.output, HasSubstr("meter 9020002 answers in place of 9020001"));
  End();
  Run("meter-b");
  ASSERT_TRUE(Becomes(kSwapped)) << "a restart takes nobody";
  EXPECT_EQ(Ask({"enable", "meters.meters-1"}).code, 0);
  ASSERT_TRUE(Becomes(kGood)) << daemon_->Errors();
  End();
  Run("meter-b");
  EXPECT_TRUE(Becomes(kGood)) << "it is the meter now";
}

TEST_F(Memory, TheRightMeterIsGoodAgainByItself) {
  Run("meter-a");
  ASSERT_TRUE(Becomes(kGood));
  End();
  Run("meter-b");
  ASSERT_TRUE(Becomes(kSwapped));
  End();
  Run("meter-a");
  EXPECT_TRUE(Becomes(kGood));
}

TEST_F(Memory, OneFolderServesOneGateway) {
  Run("meter-a");
  std::string yaml = Head();
  yaml.replace(yaml.find("modbus:"), yaml.find('\n', yaml.find("modbus:")) - yaml.find("modbus:"),
               "modbus: { enabled: false }");
  const auto file =
      Write("second.yaml", yaml + Line("others", "set4tm", "address: 200, profile: meter"));
  const Finished second = Command({"run", "-c", file.string()});
  EXPECT_EQ(second.code, 4);
  EXPECT_THAT(second.errors, HasSubstr("is in use: another baudgate of this gateway.name runs"));
}

}  // namespace
}  // namespace baudgate::system_test
