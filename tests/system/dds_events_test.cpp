// Events on DDS from the whole program, with a subscriber on Fast DDS (`watch --events`) and one of
// another vendor, while the gateway and the process that speaks DDS are killed.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <signal.h>

#include <fstream>
#include <set>

#include "tests/system/event_station.h"

namespace baudgate::system_test {
namespace {

using ::testing::HasSubstr;
using Json = nlohmann::json;

class EventsOnDds : public EventStation {
 protected:
  std::unique_ptr<Child> Watch() const {
    return Start({"watch", "--events", "--json", "--domain", std::to_string(domain()), "--gateway",
                  gateway()});
  }
  std::unique_ptr<Child> Cyclone(std::size_t count) const {
    const std::vector<std::string> words = {
        CYCLONE_EVENTS, "--domain", std::to_string(domain()), "--count", std::to_string(count),
        "--seconds",    "60"};
    return std::make_unique<Child>(words, directory());
  }
  static std::vector<Json> Heard(const Child& watch) {
    std::vector<Json> heard;
    const std::string text = watch.Output();
    std::istringstream lines(text.substr(0, text.rfind('\n') + 1));
    for (std::string line; std::getline(lines, line);) heard.push_back(Json::parse(line));
    return heard;
  }
  std::uint64_t Newest() const { return Status()["events"]["newest"]; }
  /// The daemon's child; 0 while there is none.
  static pid_t Process(const Child& daemon) {
    const std::string task = "/proc/" + std::to_string(daemon.id()) + "/task";
    std::error_code error;
    for (const auto& thread : std::filesystem::directory_iterator(task, error)) {
      std::ifstream children(thread.path() / "children");
      if (pid_t child = 0; children >> child) return child;
    }
    return 0;
  }
};

TEST_F(EventsOnDds, AreHeardByBothSubscribersAsTheyWereKept) {
  const auto relay = StartRelay("every:300ms,count=2,numbered");
  const auto watch = Watch();
  const auto daemon = StartDaemon(Yaml(", events: on", "", true));
  ASSERT_TRUE(Eventually([&] { return Heard(*watch).size() >= 6; })) << daemon->Errors();
  const auto late = Cyclone(6);
  EXPECT_EQ(late->WaitForEnd(70s), 0) << late->Errors();
  const auto heard = Heard(*watch);
  const auto kept = Records();
  ASSERT_GE(kept.size(), heard.size());
  for (std::size_t i = 0; i < heard.size(); ++i) {
    ASSERT_EQ(heard[i]["seq"], i + 1) << "each once, in order";
    EXPECT_EQ(heard[i]["gateway"], gateway());
    for (const char* field :
         {"device", "receive_time", "device_time", "clock_quality", "channel", "code", "text"}) {
      EXPECT_EQ(heard[i][field], kept[i][field]) << field;
    }
  }
  EXPECT_THAT(late->Output(), HasSubstr("1 bay-1 "));
  EXPECT_THAT(late->Output(), HasSubstr(" 0 1 stage I> started: 1\n"));
  const Json status = Status()["dds"]["events"];
  EXPECT_GE(status["published"], 6);
  EXPECT_EQ(status["skipped"], 0);
}

/// A subscriber that stays gets all of them, whatever ends; what comes again it knows by its
/// number.
TEST_F(EventsOnDds, OfAGatewayThatIsKilledAreAllHeard) {
  const auto relay = StartRelay("every:150ms,count=4,numbered");
  const auto watch = Watch();
  const auto cyclone = Cyclone(100'000);
  auto daemon = StartDaemon(Yaml(", events: on", "", true));
  for (int round = 0; round < 4; ++round) {
    const std::uint64_t now = Newest();
    ASSERT_TRUE(Eventually([&] { return Newest() > now + 8; })) << daemon->Errors();
    if (round % 2 == 0) {
      const pid_t process = Process(*daemon);
      ASSERT_GT(process, 0);
      ::kill(process, SIGKILL);
    } else {
      daemon->Signal(SIGKILL);
      daemon->WaitForEnd();
      daemon = StartDaemon(Yaml(", events: on", "", true));
    }
  }
  const std::uint64_t last = Newest() + 8;
  const auto numbers = [&] {
    std::set<std::uint64_t> numbers;
    for (const Json& event : Heard(*watch)) numbers.insert(event["seq"].get<std::uint64_t>());
    return numbers;
  };
  const auto all_heard = [&] {
    const auto heard = numbers();
    return !heard.empty() && *heard.rbegin() >= last && heard.size() == *heard.rbegin();
  };
  EXPECT_TRUE(Eventually(all_heard)) << numbers().size() << " of " << last << daemon->Errors();
  const std::string text = "\n" + std::to_string(last) + " bay-1 ";
  EXPECT_TRUE(Eventually([&] { return cyclone->Output().find(text) != std::string::npos; }));
  std::istringstream lines(cyclone->Output());
  std::uint64_t number = 0;
  for (std::string line; std::getline(lines, line) && number < last;) {
    if (line.starts_with("again ")) continue;
    EXPECT_EQ(std::stoull(line), ++number) << line;
  }
}

}  // namespace
}  // namespace baudgate::system_test
