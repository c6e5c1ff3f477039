// Tests that `baudgate writes` lists all writes, and that a gateway killed at any moment has a
// record of every write on the wire. $BAUDGATE_AUDIT_KILLS: the number of kills, by default 5.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <csignal>
#include <map>
#include <random>
#include <set>
#include <thread>

#include "tests/support/long_run.h"
#include "tests/support/rtu_slave.h"
#include "tests/system/route_station.h"

namespace baudgate::system_test {
namespace {

using ::testing::HasSubstr;

constexpr int kPointUnit = 1;
constexpr int kRouteUnit = 20;
constexpr int kRegister = 4;
constexpr int kFirstValue = 100;

class Slave {
 public:
  explicit Slave(const std::string& link)
      : slave_(link, [this](View request) { return Answer(request); }) {}

  std::vector<int> Written() const {
    std::vector<int> values;
    for (const Bytes& request : slave_.heard()) {
      const bool to_point = request[0] == kPointUnit && AddressOf(request) == kRegister;
      if (to_point && request[1] == 6) values.push_back(request[4] << 8U | request[5]);
    }
    return values;
  }

 private:
  std::vector<Piece> Answer(View request) {
    if (request[1] == 6) {
      held_ = static_cast<std::uint16_t>(request[4] << 8U | request[5]);
      return {{0ms, Bytes(request.begin(), request.end())}};
    }
    const auto base = static_cast<std::uint16_t>(held_ - AddressOf(request));
    return {{0ms, RegistersReply(request, base)}};
  }

  std::uint16_t held_ = 1;
  ScriptedSlave slave_;
};

class Audit : public RouteStation {
 protected:
  std::string YamlOf(const std::vector<std::string>& routes = {
                         "{ units: 20, line: drive }"}) const {
    return Yaml(
        routes,
        Line("drive", "modbus_rtu",
             "address: 1, unit: 1, poll: 100ms, write: allow, points: [{ name: set_point, read: "
             "\"holding 4\", type: uint16, access: rw, modbus: 0 }]"));
  }
  Finished Writes(std::vector<std::string> more = {}) const {
    more.insert(more.begin(), "writes");
    return Ask(more);
  }
  std::vector<Json> Records() const {
    const Finished writes = Writes({"--json"});
    EXPECT_EQ(writes.code, 0) << writes.errors;
    return JsonLines(writes.output);
  }
};

TEST_F(Audit, RecordsTheClientAndTheValueOfEachWrite) {
  Slave slave(LinkOf("drive"));
  auto daemon = StartGateway(YamlOf());
  ModbusClient client(port());
  ASSERT_TRUE(Eventually([&] { return client.Register(kPointUnit, 0) == 1; })) << daemon->Errors();
  EXPECT_THAT(Writes().output, HasSubstr("nothing has been written yet"));
  ASSERT_EQ(client.WriteRegister(kPointUnit, 0, 7), kNoException);
  ASSERT_EQ(client.WriteRegister(kRouteUnit, 30, 9), kNoException);
  ASSERT_TRUE(Eventually([&] {
    const auto records = Records();
    return records.size() == 2 && records[0]["outcome"] == "ok" && records[1]["outcome"] == "ok";
  })) << Writes({"--json"}).output;
  const Json point = Records()[0];
  EXPECT_EQ(point["seq"], 1);
  EXPECT_EQ(point["kind"], "point");
  EXPECT_EQ(point["line"], "drive");
  EXPECT_EQ(point["device"], "drive-1");
  EXPECT_EQ(point["point"], "set_point");
  EXPECT_EQ(point["old"], 1);
  EXPECT_EQ(point["new"], 7);
  EXPECT_EQ(point["count"], 1);
  EXPECT_TRUE(point["took_ms"].is_number());
  const Json route = Records()[1];
  EXPECT_EQ(route["kind"], "route");
  EXPECT_THAT(route["client"].get<std::string>(), HasSubstr("127.0.0.1:"));
  EXPECT_EQ(route["device"], "unit 20");
  EXPECT_EQ(route["point"], "06 holding 30");
  EXPECT_EQ(route["new"], 9);
  EXPECT_THAT(Writes().output, HasSubstr("drive.drive-1.set_point"));
  EXPECT_EQ(Status()["audit"]["state"], "fine");

  daemon->Signal(SIGTERM);
  ASSERT_EQ(daemon->WaitForEnd(), 0);
  daemon = StartGateway(YamlOf());
  EXPECT_EQ(Records().size(), 2U) << "it outlives the gateway";
  EXPECT_THAT(Writes({"--since", "1h"}).output, HasSubstr("1 -> 7"));
  EXPECT_THAT(Writes({"--since", "2200-01-01"}).output,
              HasSubstr("nothing has been written since"));
  EXPECT_EQ(Writes({"--since", "yesterday"}).code, 2);
}

TEST_F(Audit, FollowShowsNewWrites) {
  Slave slave(LinkOf("drive"));
  const auto daemon = StartGateway(YamlOf());
  const auto follower = Start({"writes", "--follow", "--json", "--socket", socket()});
  ModbusClient client(port());
  ASSERT_TRUE(Eventually([&] { return client.Register(kPointUnit, 0) == 1; }));
  for (const int value : {11, 12}) {
    ASSERT_EQ(client.WriteRegister(kPointUnit, 0, static_cast<std::uint16_t>(value)), kNoException);
    EXPECT_TRUE(Eventually([&] {
      return follower->Output().find("\"new\":" + std::to_string(value)) != std::string::npos;
    }));
  }
  follower->Signal(SIGINT);
  EXPECT_EQ(follower->WaitForEnd(), 0);
}

TEST_F(Audit, AGatewayWithoutWritablePointsReportsIt) {
  Slave slave(LinkOf("drive"));
  const auto daemon = StartDaemon(
      WithSocket(Head()) +
      Line("drive", "modbus_rtu",
           "address: 1, unit: 1, points: [{ name: a, read: \"holding 4\", type: uint16 }]"));
  const Finished writes = Writes();
  EXPECT_EQ(writes.code, 4);
  EXPECT_THAT(writes.errors, HasSubstr("this gateway permits no writes"));
  EXPECT_FALSE(std::filesystem::exists(directory() / "state"));
}

class NumberWriter {
 public:
  explicit NumberWriter(std::uint16_t port) : client_(port) {}
  void Run(std::atomic<bool>& stop, int& next) {
    while (!stop) {
      const int value = next++;
      if (client_.WriteRegister(kPointUnit, 0, static_cast<std::uint16_t>(value)) == kNoException) {
        confirmed.insert(value);
      }
    }
  }
  std::set<int> confirmed;

 private:
  ModbusClient client_;
};

TEST_F(Audit, AKilledGatewayHasARecordOfEveryWriteOnTheWire) {
  const std::size_t kills = Setting("BAUDGATE_AUDIT_KILLS", 5);
  Slave slave(LinkOf("drive"));
  std::mt19937 random(static_cast<unsigned>(::getpid()));
  std::set<int> confirmed;
  int next = kFirstValue;
  for (std::size_t kill = 0; kill < kills; ++kill) {
    const auto daemon = StartGateway(YamlOf());
    ModbusClient reader(port());
    ASSERT_TRUE(Eventually([&] { return reader.Register(kPointUnit, 0).has_value(); }));
    NumberWriter writer(port());
    std::atomic<bool> stop = false;
    std::thread thread([&] { writer.Run(stop, next); });
    const std::size_t before = slave.Written().size();
    EXPECT_TRUE(Eventually([&] { return slave.Written().size() > before; }));
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 300'000));
    daemon->Signal(SIGKILL);
    daemon->WaitForEnd();
    stop = true;
    thread.join();
    confirmed.insert(writer.confirmed.begin(), writer.confirmed.end());
  }
  const auto daemon = StartGateway(YamlOf());
  std::map<int, std::string> recorded;
  std::int64_t seq = 0;
  ASSERT_TRUE(Eventually([&] { return Status()["audit"]["state"] == "fine"; }));
  for (const Json& record : Records()) {
    EXPECT_EQ(record["seq"], ++seq);
    const int value = record["new"].get<int>();
    EXPECT_TRUE(recorded.emplace(value, record["outcome"].get<std::string>()).second)
        << value << " is doubled";
  }
  const auto on_wire = slave.Written();
  const std::set<int> wire(on_wire.begin(), on_wire.end());
  for (const int value : wire) EXPECT_EQ(recorded.count(value), 1U) << value << " has no record";
  std::size_t unknown = 0;
  for (const auto& [value, outcome] : recorded) {
    if (outcome == "ok") {
      EXPECT_EQ(wire.count(value), 1U) << value << " never was on the wire";
    } else if (outcome == "not_sent") {
      EXPECT_EQ(wire.count(value), 0U) << value << " was on the wire";
    }
    EXPECT_TRUE(outcome == "ok" || outcome == "unknown" || outcome == "not_sent") << outcome;
    unknown += outcome == "unknown" ? 1 : 0;
  }
  for (const int value : confirmed) {
    const auto found = recorded.find(value);
    ASSERT_NE(found, recorded.end()) << value << " was confirmed to its client";
    EXPECT_NE(found->second, "not_sent");
  }
  EXPECT_GE(wire.size(), static_cast<std::size_t>(kills));
  EXPECT_LE(unknown, 3 * static_cast<std::size_t>(kills)) << "only what a kill has cut off";
  std::cout << kills << " kills, " << wire.size() << " writes on the wire, " << recorded.size()
            << " records, " << unknown << " of them unknown\n";
}

}  // namespace
}  // namespace baudgate::system_test
