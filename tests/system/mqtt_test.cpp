// Tests the MQTT output of the whole program with a real mosquitto: values, events, commands, and
// stored values over the ends of the gateway and of the broker.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <set>
#include <string>
#include <vector>

#include "tests/support/mqtt_broker.h"
#include "tests/system/station.h"

namespace baudgate::system_test {
namespace {

class Mqtt : public Station {
 protected:
  std::string Yaml(const std::string& more = "") const {
    return "history: { points: [ 'bay.*.current_*' ] }\nevents: {}\nmqtt: { broker: "
           "\"mqtt://127.0.0.1:" +
           std::to_string(broker_.port()) + "\", commands: allow" + more + " }\n" +
           WithSocket(Head(), "state: " + LinkOf("state") + ", ") +
           Line("bay", "spabus",
                "address: 1, unit: 1, profile: spaj140c, poll: 100ms, write: allow");
  }
  std::string Topic(const std::string& leaf) const { return "baudgate/" + gateway() + "/" + leaf; }
  std::string Point(const std::string& leaf) const { return Topic("bay/bay-1/" + leaf); }

  /// Checks that the listener has each value that the history has stored until now, in order; a
  /// value may come twice, with the same `seq`.
  void CheckStored(const MqttListener& listener) const {
    std::vector<std::string> stored;
    for (const Json& record :
         JsonLines(Ask({"history", "bay.bay-1.current_l1", "--json"}).output)) {
      if (!record.contains("gap")) stored.push_back(record["time"]);
    }
    ASSERT_GT(stored.size(), 5U);
    const auto has_last = [&] {
      return std::ranges::any_of(listener.Payloads(Point("current_l1/history")),
                                 [&](const std::string& payload) {
                                   return payload.find(stored.back()) != std::string::npos;
                                 });
    };
    EXPECT_TRUE(Eventually(has_last));
    std::vector<std::string> received;
    std::int64_t last = 0;
    for (const std::string& payload : listener.Payloads(Point("current_l1/history"))) {
      const Json json = Json::parse(payload);
      if (json["seq"].get<std::int64_t>() <= last) continue;
      last = json["seq"];
      received.push_back(json["time"]);
      if (received.back() == stored.back()) break;
    }
    ASSERT_FALSE(received.empty());
    // The first start begins with the values that are stored from then on.
    std::erase_if(stored, [&](const std::string& time) { return time < received.front(); });
    EXPECT_EQ(received, stored);
  }

  MqttBroker broker_{
      "allow_anonymous true\npersistence true\npersistence_location DIR/\n"
      "max_queued_messages 0\n"};
};

TEST_F(Mqtt, PublishesAndTakesCommandsOverTheEndsOfGatewayAndBroker) {
  ASSERT_TRUE(broker_.Start());
  MqttListener listener(broker_.port(), "baudgate/#", "observer");
  const auto relay = StartTwin("bay", "spaj140c", "1", {"--think", "1ms"});
  auto daemon = StartDaemon(Yaml());
  ASSERT_TRUE(listener.WaitFor(Topic("status"), "online"));
  EXPECT_TRUE(listener.WaitFor(Point("current_l1"), "\"quality\":\"good\""));
  EXPECT_TRUE(listener.WaitFor(Topic("events"), "\"seq\":"));
  EXPECT_TRUE(listener.WaitFor(Topic("alarms"), "["));
  EXPECT_EQ(Status()["mqtt"]["state"], "connected");
  EXPECT_TRUE(Status()["mqtt"]["advice"].empty()) << Status()["mqtt"];
  listener.Publish(Point("current_l1/set"), "1");
  EXPECT_TRUE(listener.WaitFor(Point("current_l1/result"), "denied"));
  const std::string writer = "mqtt:baudgate-" + gateway();
  EXPECT_TRUE(Eventually([&] {
    return Ask({"writes", "--json"}).output.find(writer) != std::string::npos;
  }));

  EXPECT_TRUE(listener.WaitFor(Point("current_l1/history"), "value"));

  daemon->Signal(SIGKILL);
  daemon->WaitForEnd();
  EXPECT_TRUE(listener.WaitFor(Topic("status"), "offline"));
  daemon = StartDaemon(Yaml());
  EXPECT_TRUE(listener.WaitFor(Topic("status"), "online"));
  broker_.Kill(SIGTERM);
  EXPECT_TRUE(Eventually(
      [&] { return Status()["mqtt"]["advice"].dump().find("[\"the broker mqtt://") == 0; }));
  ASSERT_TRUE(broker_.Start());
  EXPECT_TRUE(Eventually([&] { return Status()["mqtt"]["state"] == "connected"; }));
  CheckStored(listener);
  daemon->Signal(SIGTERM);
  daemon->WaitForEnd();
  EXPECT_TRUE(listener.WaitFor(Topic("status"), "offline"));
  EXPECT_TRUE(listener.WaitFor(Point("current_l1"), "\"quality\":\"bad\""));
  std::set<std::int64_t> seqs;
  for (const std::string& event : listener.Payloads(Topic("events"))) {
    seqs.insert(Json::parse(event)["seq"].get<std::int64_t>());
  }
  ASSERT_FALSE(seqs.empty());
  EXPECT_EQ(*seqs.begin(), 1);
  EXPECT_EQ(static_cast<std::int64_t>(seqs.size()), *seqs.rbegin()) << "no event is missing";
}

}  // namespace
}  // namespace baudgate::system_test
