// Tests events on DDS while the gateway and the DDS process are killed.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <signal.h>

#include <set>

#include "tests/system/event_station.h"

namespace baudgate::system_test {
namespace {

using ::testing::HasSubstr;

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
  std::unique_ptr<Child> Example() const {
    constexpr char kLoopback[] =
        "<General><Interfaces><NetworkInterface address=\"127.0.0.1\"/></Interfaces>"
        "<AllowMulticast>false</AllowMulticast></General>"
        "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
        "<Peers><Peer address=\"127.0.0.1\"/></Peers></Discovery>";
    const std::vector<std::string> words = {EXAMPLE_EVENTS, std::to_string(domain())};
    return std::make_unique<Child>(words, directory(),
                                   Child::Environment{{"CYCLONEDDS_URI", kLoopback}});
  }
  static std::vector<Json> Heard(const Child& watch) { return JsonLines(watch.Output()); }
  std::uint64_t Newest() const { return Status()["events"]["newest"]; }
};

TEST_F(EventsOnDds, AreReceivedByBothSubscribersAsTheyWereStored) {
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

TEST_F(EventsOnDds, OfAKilledGatewayAreAllReceived) {
  const auto relay = StartRelay("every:150ms,count=4,numbered");
  const auto watch = Watch();
  const auto cyclone = Cyclone(100'000);
  const auto example = Example();
  auto daemon = StartDaemon(Yaml(", events: on", "", true));
  for (int round = 0; round < 6; ++round) {
    const std::uint64_t now = Newest();
    ASSERT_TRUE(Eventually([&] { return Newest() > now + 8; })) << daemon->Errors();
    if (round % 2 == 0) {
      const pid_t process = ChildOf(*daemon);
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
  const auto printed = [&] {
    std::multiset<std::uint64_t> printed;
    const std::string output = example->Output();
    std::istringstream said(output.substr(0, output.rfind('\n') + 1));
    for (std::string line; std::getline(said, line);) {
      const std::uint64_t seq = std::stoull(line.substr(line.find(' ')));
      if (seq <= last) printed.insert(seq);
    }
    return printed;
  };
  EXPECT_TRUE(Eventually([&] { return printed().size() >= last; }))
      << printed().size() << " of " << last << example->Errors();
  for (std::uint64_t seq = 1; seq <= last; ++seq) EXPECT_EQ(printed().count(seq), 1U) << seq;
}

TEST_F(EventsOnDds, AnOrderlyStopNeitherLosesNorRepeatsConfirmedEvents) {
  const auto relay = StartRelay("every:300ms,count=2,numbered");
  auto daemon = StartDaemon(Yaml(", events: on", "", true));
  const auto end = [&] {
    daemon->Signal(SIGTERM);
    EXPECT_EQ(daemon->WaitForEnd(), 0);
  };
  const auto restart = [&] { daemon = StartDaemon(Yaml(", events: on", "", true)); };
  {
    const auto points = Start({"watch", "--json", "--domain", std::to_string(domain())});
    ASSERT_TRUE(Eventually([&] { return Newest() > 6 && !points->Output().empty(); }));
    end();
  }
  restart();
  const std::uint64_t so_far = Newest();
  const auto watch = Watch();
  const auto numbers = [&] {
    std::vector<std::uint64_t> numbers;
    for (const Json& event : Heard(*watch)) numbers.push_back(event["seq"]);
    return numbers;
  };
  ASSERT_TRUE(Eventually([&] { return numbers().size() >= so_far; })) << daemon->Errors();
  EXPECT_EQ(numbers().front(), 1U) << "nobody had heard of them";
  EXPECT_EQ(Status()["dds"]["readers"]["events"], 1);
  for (int round = 0; round < 2; ++round) {
    end();
    restart();
    const std::uint64_t more = Newest() + 4;
    ASSERT_TRUE(Eventually([&] { return numbers().back() >= more; })) << daemon->Errors();
  }
  for (std::size_t i = 0; i < numbers().size(); ++i) EXPECT_EQ(numbers()[i], i + 1);
}

}  // namespace
}  // namespace baudgate::system_test
