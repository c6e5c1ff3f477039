// The history of the whole program: a meter's twin whose values change, a gateway that is stopped
// and killed, and what `baudgate history` and the program sqlite3 say.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <csignal>
#include <nlohmann/json.hpp>
#include <sstream>

#include "gateway/records/disk/database.h"
#include "tests/system/station.h"

namespace baudgate::system_test {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;
using Json = nlohmann::json;

class History : public Station {
 protected:
  std::string Yaml(const std::string& history) const {
    std::string head = Head();
    head.replace(0, head.find('\n'),
                 "gateway: { name: " + gateway() + ", socket: " + socket() +
                     ", state: " + (directory() / "state").string() + " }");
    return history + head +
           Line("bay", "spabus", "address: 1, unit: 1, profile: spaj140c, poll: 100ms");
  }
  std::string socket() const { return (directory() / "gate.sock").string(); }
  std::filesystem::path folder() const { return directory() / "state" / gateway(); }
  std::unique_ptr<Child> StartRelay() const {
    auto twin = Start({"simulate", "--profile", "spaj140c", "--address", "1", "--pty",
                       LinkOf("bay"), "--think", "1ms"});
    EXPECT_TRUE(Eventually([&] { return !twin->Output().empty(); })) << twin->Errors();
    return twin;
  }
  Finished Ask(std::vector<std::string> more = {}) const {
    std::vector<std::string> words = {"history", "bay.bay-1.current_l1", "--socket", socket()};
    words.insert(words.end(), more.begin(), more.end());
    return Command(words);
  }
  std::vector<Json> Records(std::vector<std::string> more = {}) const {
    more.emplace_back("--json");
    const Finished history = Ask(more);
    std::vector<Json> records;
    std::istringstream lines(history.output);
    for (std::string line; std::getline(lines, line);) records.push_back(Json::parse(line));
    return records;
  }
  Json Status() const {
    return Json::parse(Command({"status", "--json", "--socket", socket()}).output);
  }
};

constexpr const char* kKept = "history: { points: [ 'bay.*.current_*' ] }\n";

TEST_F(History, IsKeptAndReadBack) {
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
  EXPECT_THAT(Ask({"--csv"}).output, StartsWith("time_utc,point,value,quality,quality_text\r\n20"));
  EXPECT_THAT(Ask().output, HasSubstr("gap: the gateway was down until 20"));
  EXPECT_THAT(Ask({"--every", "15min", "--csv"}).output,
              StartsWith("time_utc,point,mean,min,max,first,last,count,seconds_good\r\n"));
  EXPECT_EQ(Ask({"--every", "90s"}).code, 2);
  const auto upside_down = Ask({"--since", "2h", "--until", "3h"});
  EXPECT_EQ(upside_down.code, 2);
  EXPECT_THAT(upside_down.errors, HasSubstr("--until: it has to be later than --since"));
  EXPECT_EQ(Ask({"--csv", "--json"}).code, 2);
  const Finished other = Command({"history", "bay.bay-1.current_l7", "--socket", socket()});
  EXPECT_EQ(other.code, 2);
  EXPECT_THAT(other.errors, HasSubstr("current_l7"));
  const Json status = Status()["history"];
  EXPECT_EQ(status["state"], "fine");
  EXPECT_EQ(status["dropped"], 0);
  EXPECT_GE(status["points"].get<int>(), 3);
  // Read by another program while it is written.
  for (const auto& entry : std::filesystem::directory_iterator(folder())) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with("values-") || !name.ends_with(".db")) continue;
    Database database(entry.path().string(), Database::Mode::read);
    ASSERT_TRUE(database.is_open());
    EXPECT_GE(std::get<std::int64_t>(database.First("SELECT count(*) FROM rows")), 1);
    EXPECT_EQ(std::get<std::int64_t>(database.First("SELECT count(*) FROM runs")), 2);
  }
}

TEST_F(History, IsOffUntilItIsAskedFor) {
  const auto relay = StartRelay();
  const auto daemon = StartDaemon(Yaml(""));
  const Finished history = Ask();
  EXPECT_EQ(history.code, 4);
  EXPECT_THAT(history.errors, HasSubstr("this gateway keeps no values"));
  EXPECT_TRUE(Status()["history"].is_null());
}

}  // namespace
}  // namespace baudgate::system_test
