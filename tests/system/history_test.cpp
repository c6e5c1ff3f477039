// Tests the history with a gateway that is stopped and killed, by `baudgate history` and sqlite3.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <csignal>
#include <fstream>
#include <iterator>

#include "gateway/records/disk/database.h"
#include "tests/system/station.h"

namespace baudgate::system_test {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

class History : public Station {
 protected:
  std::string Yaml(const std::string& history) const {
    return history + WithSocket(Head(), "state: " + LinkOf("state") + ", ") +
           Line("bay", "spabus", "address: 1, unit: 1, profile: spaj140c, poll: 100ms");
  }
  std::filesystem::path folder() const { return directory() / "state" / gateway(); }
  std::unique_ptr<Child> StartRelay() const {
    return StartTwin("bay", "spaj140c", "1", {"--think", "1ms"});
  }
  Finished Ask(std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {"history", "bay.bay-1.current_l1"});
    return Station::Ask(more);
  }
  std::vector<Json> Records(std::vector<std::string> more = {}) const {
    more.emplace_back("--json");
    return JsonLines(Ask(more).output);
  }
};

constexpr const char* kKept = "history: { points: [ 'bay.*.current_*' ] }\n";

TEST_F(History, IsStoredAndReadBack) {
  const auto relay = StartRelay();
  {
    const auto daemon = StartDaemon(Yaml(kKept));
    ASSERT_TRUE(Eventually([&] { return Records().size() >= 3; })) << Ask().errors;
    daemon->Signal(SIGKILL);
    daemon->WaitForEnd();
  }
  const auto daemon = StartDaemon(Yaml(kKept));
  const auto gaps = [&] {
    std::size_t count = 0;
    for (const Json& record : Records()) count += record.contains("gap") ? 1 : 0;
    return count;
  };
  ASSERT_TRUE(
      Eventually([&] { return gaps() == 1 && Records().back()["quality_text"] == "good"; }));
  std::string before;
  for (const Json& record : Records()) {
    EXPECT_GE(record["time"].get<std::string>(), before);
    before = record["time"];
    EXPECT_EQ(record["point"], "bay.bay-1.current_l1");
    if (!record.contains("gap")) {
      EXPECT_TRUE(record["quality"].is_number_unsigned());
      continue;
    }
    EXPECT_TRUE(record["value"].is_null());
    EXPECT_EQ(record["gap"], "started");
    EXPECT_GT(record["until"].get<std::string>(), before);
  }
  EXPECT_EQ(Records().back()["quality_text"], "good");
  EXPECT_TRUE(Records().back()["value"].is_number());
  EXPECT_TRUE(Records({"--since", "2200-01-01"}).empty());
  EXPECT_TRUE(Records({"--until", "2001-01-01"}).empty());
  EXPECT_THAT(Ask({"--csv"}).output,
              StartsWith("time_utc,point,value,quality,quality_text,shown\r\n20"));
  EXPECT_THAT(Ask().output, HasSubstr("gap: the gateway was down until 20"));
  EXPECT_THAT(Ask({"--every", "15min", "--csv"}).output,
              StartsWith("time_utc,point,mean,min,max,first,last,count,seconds_good\r\n"));
  EXPECT_EQ(Ask({"--every", "90s"}).code, 2);
  const auto upside_down = Ask({"--since", "2h", "--until", "3h"});
  EXPECT_EQ(upside_down.code, 2);
  EXPECT_THAT(upside_down.errors, HasSubstr("--until: write a time later than --since"));
  EXPECT_EQ(Ask({"--csv", "--json"}).code, 2);
  const Finished other = Station::Ask({"history", "bay.bay-1.current_l7"});
  EXPECT_EQ(other.code, 2);
  EXPECT_THAT(other.errors, HasSubstr("current_l7"));
  const Json status = Status()["history"];
  EXPECT_EQ(status["state"], "fine");
  EXPECT_EQ(status["dropped"], 0);
  EXPECT_GE(status["points"].get<int>(), 3);
  for (const auto& entry : std::filesystem::directory_iterator(folder())) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with("values-") || !name.ends_with(".db")) continue;
    records::Database database(entry.path().string(), records::Database::Mode::read);
    ASSERT_TRUE(database.is_open());
    EXPECT_GE(std::get<std::int64_t>(database.First("SELECT count(*) FROM rows")), 1);
    EXPECT_EQ(std::get<std::int64_t>(database.First("SELECT count(*) FROM runs")), 2);
  }
}

TEST_F(History, IsOffByDefault) {
  const auto relay = StartRelay();
  const auto daemon = StartDaemon(Yaml(""));
  const Finished history = Ask();
  EXPECT_EQ(history.code, 4);
  EXPECT_THAT(history.errors, HasSubstr("this gateway records no history"));
  EXPECT_TRUE(Status()["history"].is_null());
}

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

TEST_F(Memory, AnotherMeterIsBadUntilItIsEnabledByHand) {
  Run("meter-a");
  ASSERT_TRUE(Becomes(kGood)) << daemon_->Errors();
  End();
  Run("meter-b");
  ASSERT_TRUE(Becomes(kSwapped)) << daemon_->Errors();
  const Finished status = Ask({"status", "meters.meters-1"});
  EXPECT_THAT(status.output, HasSubstr("meter 9020002 answers instead of 9020001"));
  End();
  Run("meter-b");
  ASSERT_TRUE(Becomes(kSwapped)) << "a restart takes nobody";
  EXPECT_EQ(Ask({"enable", "meters.meters-1"}).code, 0);
  ASSERT_TRUE(Becomes(kGood)) << daemon_->Errors();
  End();
  Run("meter-b");
  EXPECT_TRUE(Becomes(kGood)) << "it is the meter now";
}

TEST_F(Memory, TheConfiguredMeterIsGoodAgainByItself) {
  Run("meter-a");
  ASSERT_TRUE(Becomes(kGood));
  End();
  Run("meter-b");
  ASSERT_TRUE(Becomes(kSwapped));
  End();
  Run("meter-a");
  EXPECT_TRUE(Becomes(kGood));
}

TEST_F(Memory, AStateFolderServesOnlyOneGateway) {
  Run("meter-a");
  std::string yaml = Head();
  yaml.replace(yaml.find("modbus:"), yaml.find('\n', yaml.find("modbus:")) - yaml.find("modbus:"),
               "modbus: { enabled: false }");
  const auto file =
      Write("second.yaml", yaml + Line("others", "set4tm", "address: 200, profile: meter"));
  const Finished second = Command({"run", "-c", file.string()});
  EXPECT_EQ(second.code, 4);
  EXPECT_THAT(second.errors,
              HasSubstr("is in use: another baudgate with this gateway.name is running"));
}

}  // namespace
}  // namespace baudgate::system_test
