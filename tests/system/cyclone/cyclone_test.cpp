// Tests the publisher with a subscriber on Cyclone DDS (tests/system/cyclone/cyclone_subscriber.c).
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdio.h>
#include <sys/wait.h>

#include <map>
#include <sstream>
#include <string>

#include "gateway/outputs/dds/publisher.h"
#include "tests/gateway/outputs/dds/fixture.h"
#include "tests/gateway/outputs/dds/write_client.h"

namespace baudgate::dds {
namespace {

using testing::MakeConfig;
using testing::Publish;
using testing::Set;
using testing::TestDomain;

class CycloneSubscriber {
 public:
  explicit CycloneSubscriber(const std::string& arguments) {
    const std::string command = std::string(CYCLONE_SUBSCRIBER) + " --domain " +
                                std::to_string(TestDomain()) + " --seconds 20 " + arguments;
    output_ = ::popen(command.c_str(), "r");
  }
  ~CycloneSubscriber() {
    if (output_ != nullptr) ::pclose(output_);
  }

  std::optional<std::string> Line() {
    char buffer[512];
    if (output_ == nullptr || ::fgets(buffer, sizeof buffer, output_) == nullptr) return {};
    std::string line(buffer);
    line.erase(line.find_last_not_of('\n') + 1);
    return line;
  }

  int Wait() {
    const int status = ::pclose(output_);
    output_ = nullptr;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

 private:
  FILE* output_ = nullptr;
};

TEST(Cyclone, EveryPointArrivesAsWritten) {
  const config::Config config = MakeConfig(10, 100);
  bus::PointStore store(config);
  for (std::uint32_t device = 0; device < 10; ++device) {
    for (std::uint32_t point = 0; point < 100; ++point) {
      Set(store, device, point, device * 1000 + point + 0.25, Quality::uncertain_sub_normal);
    }
  }
  auto publisher = Publish(config, store);
  ASSERT_NE(publisher, nullptr);

  CycloneSubscriber subscriber("--count 1000");
  std::map<std::string, std::string> heard;
  std::string gateway;
  while (const auto line = subscriber.Line()) {
    if (line->starts_with("gateway ")) {
      gateway = *line;
      continue;
    }
    std::istringstream words(*line);
    std::string device;
    std::string point;
    std::string rest;
    words >> device >> point;
    std::getline(words, rest);
    heard[device + " " + point] = rest;
  }
  EXPECT_EQ(subscriber.Wait(), 0);
  EXPECT_THAT(gateway, ::testing::MatchesRegex("gateway substation-7 [0-9]{19} [0-9.]+"));
  ASSERT_EQ(heard.size(), 1000U);
  for (int device = 0; device < 10; ++device) {
    for (int point = 0; point < 100; ++point) {
      const auto key = "feeder-" + std::to_string(device) + " p" + std::to_string(point);
      EXPECT_EQ(heard[key], " " + std::to_string(device * 1000 + point) + ".25 88 A") << key;
    }
  }
}

TEST(Cyclone, TheExampleOfThePackageShowsEveryPoint) {
  const config::Config config = MakeConfig(1, 2);
  bus::PointStore store(config);
  Set(store, 0, 0, 1.5);
  Set(store, 0, 1, 2.5, Quality::bad_communication);
  auto publisher = Publish(config, store);
  ASSERT_NE(publisher, nullptr);
  const std::string command =
      "CYCLONEDDS_URI='<General><Interfaces><NetworkInterface address=\"127.0.0.1\"/></Interfaces>"
      "<AllowMulticast>false</AllowMulticast></General>"
      "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
      "<Peers><Peer address=\"127.0.0.1\"/></Peers></Discovery>' timeout 3 " +
      std::string(EXAMPLE_SUBSCRIBER) + " " + std::to_string(TestDomain());
  FILE* output = ::popen(command.c_str(), "r");
  std::set<std::string> lines;
  char line[512];
  while (::fgets(line, sizeof line, output) != nullptr) lines.insert(line);
  ::pclose(output);
  EXPECT_THAT(lines, ::testing::UnorderedElementsAre(
                         "substation-7 feeder-0 p0 = 1.5 A\n",
                         "substation-7 feeder-0 p1: not good, quality 0x0018\n"));
}

TEST(Cyclone, TheEndOfAGatewayReachesSubscribers) {
  const config::Config config = MakeConfig(2, 20);
  bus::PointStore store(config);
  auto publisher = Publish(config, store);
  ASSERT_NE(publisher, nullptr);

  CycloneSubscriber subscriber("--count 40 --gone");
  int arrived = 0;
  int last = 0;
  int left = 0;
  while (const auto line = subscriber.Line()) {
    if (line->starts_with("gone ")) {
      ++left;
    } else if (line->starts_with("gateway ")) {
      continue;
    } else if (line->ends_with(" 8 A")) {
      ++last;
    } else if (++arrived == 40) {
      publisher->Stop();
      publisher.reset();
    }
  }
  EXPECT_EQ(subscriber.Wait(), 0);
  EXPECT_EQ(arrived, 40);
  EXPECT_EQ(last, 40) << "not connected";
  EXPECT_EQ(left, 40);
}

// Fast DDS 2.9 fails an assertion when it sends to a multicast group of two subscribers.
TEST(Cyclone, SubscribersThatNameTheSameMulticastGroupAllGetEveryPoint) {
  const config::Config config = MakeConfig(2, 50);
  bus::PointStore store(config);
  auto publisher = Publish(config, store);
  ASSERT_NE(publisher, nullptr);

  CycloneSubscriber first("--count 100 --multicast");
  CycloneSubscriber second("--count 100 --multicast");
  CycloneSubscriber third("--count 100 --multicast");
  for (CycloneSubscriber* subscriber : {&first, &second, &third}) {
    while (subscriber->Line()) {
    }
    EXPECT_EQ(subscriber->Wait(), 0);
  }
}

TEST(Cyclone, AReaderWithIncompatibleQosIsNamedUntilItLeaves) {
  ParticipantOptions options;
  options.domain = TestDomain();
  options.interfaces = {"127.0.0.1"};
  const auto writer = CreateFastWriter(options, {.points = 1, .devices = 1});
  ASSERT_TRUE(writer) << writer.error();
  PointSample sample;
  sample.gateway = "g", sample.device = "d", sample.point = "p";
  ASSERT_EQ((*writer)->Write(sample), Sent::yes);
  const auto remarks = [&] { return (*writer)->neighbours().remarks; };
  const std::map<std::string, std::string> asked = {
      {"deadline", "DEADLINE"},
      {"exclusive", "exclusive OWNERSHIP"},
      {"liveliness", "LIVELINESS with a lease or a manual kind"},
      {"partition", "a PARTITION"},
      {"transient", "DURABILITY beyond TRANSIENT_LOCAL"},
      {"order", "DESTINATION_ORDER by source timestamp"},
      {"presentation", "PRESENTATION beyond INSTANCE"},
      {"xcdr2", "XCDR2 alone"}};
  std::vector<std::unique_ptr<CycloneSubscriber>> subscribers;
  std::vector<std::string> expected;
  for (const auto& [policy, words] : asked) {
    subscribers.push_back(
        std::make_unique<CycloneSubscriber>("--count 1 --seconds 3 --qos " + policy));
    expected.push_back(
        "a reader of baudgate/points at 127.0.0.1 receives no samples, because it asks for " +
        words + ", which is not offered; docs/dds.md lists what a reader may request");
  }
  EXPECT_TRUE(testing::Eventually([&] { return remarks().size() == asked.size(); }));
  EXPECT_THAT(remarks(), ::testing::UnorderedElementsAreArray(expected));
  for (const auto& subscriber : subscribers) {
    while (subscriber->Line()) {
    }
    EXPECT_EQ(subscriber->Wait(), 1) << "no sample came";
  }
  EXPECT_TRUE(testing::Eventually([&] { return remarks().empty(); }));
  CycloneSubscriber any_partition("--count 1 --seconds 3 --qos any_partition");
  EXPECT_TRUE(testing::Eventually([&] { return remarks().size() == 1; }))
      << "Cyclone DDS takes it for matched, and it gets nothing";
  EXPECT_THAT(remarks(), ::testing::Contains(::testing::HasSubstr("asks for a PARTITION")));
  while (any_partition.Line()) {
  }
  EXPECT_EQ(any_partition.Wait(), 1) << "no sample came";
  CycloneSubscriber good("--count 1 --seconds 5");
  EXPECT_TRUE(good.Line()) << "what an ordinary reader gets";
  EXPECT_TRUE(testing::Eventually([&] { return remarks().empty(); })) << "behind their lease";
}

}  // namespace
}  // namespace baudgate::dds
