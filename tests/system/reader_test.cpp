// Tests a tag reader on a pty with the whole program: registers, events, a port that disappears.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <signal.h>

#include "tests/system/station.h"

namespace baudgate::system_test {
namespace {

using ::testing::HasSubstr;

class ReaderOnAPty : public Station {
 protected:
  std::string Yaml() const {
    return "events: {}\n" + WithSocket(Head(), "state: " + LinkOf("state") + ", ") +
           Line("gate", "reader", "address: 1, unit: 1, profile: olimex-mod-rfid125");
  }
  std::unique_ptr<Child> StartReader(const std::string& events) const {
    auto twin = Start({"simulate", "--profile", "olimex-mod-rfid125", "--address", "1", "--pty",
                       LinkOf("gate"), "--events", events});
    EXPECT_TRUE(Eventually([&] { return !twin->Output().empty(); })) << twin->Errors();
    return twin;
  }
  std::vector<std::string> Tags() const {
    std::vector<std::string> tags;
    for (const Json& event : JsonLines(Ask({"events", "--json"}).output)) {
      const std::string text = event["text"];
      if (event["device"] == "gate-1" && text.starts_with("tag: ")) tags.push_back(text.substr(5));
    }
    return tags;
  }
  Json Device() const { return Status("gate.gate-1"); }
};

std::uint32_t Double(const std::vector<std::uint16_t>& registers, std::size_t at) {
  return std::uint32_t{registers[at]} << 16U | registers[at + 1];
}

/// Tags are numbered, so a consistent snapshot contains n, n-1, n-2 and so on.
TEST_F(ReaderOnAPty, EveryReadReturnsTheLatestTagsConsistently) {
  const auto daemon = StartDaemon(Yaml());
  ModbusClient client(port());
  EXPECT_EQ(client.Input(1, 0, 7).exception, 0x0B) << "nothing was read yet";
  EXPECT_EQ(client.Input(1, 20000, 1).values, std::vector<std::uint16_t>{8}) << "no such port yet";
  const auto twin = StartReader("every:30ms,numbered");
  ASSERT_TRUE(Eventually([&] { return client.Input(1, 0, 56).ok(); })) << daemon->Errors();
  std::uint32_t last = 0;
  for (int read = 0; read < 200 || (last <= 10 && read < 100'000); ++read) {
    const Registers registers = client.Input(1, 0, 56);
    ASSERT_TRUE(registers.ok());
    const std::uint32_t counter = Double(registers.values, 3);
    ASSERT_GE(counter, last);
    last = counter;
    const std::uint32_t tag = Double(registers.values, 1);
    for (std::uint32_t back = 0; back < 8; ++back) {
      const std::size_t at = std::size_t{7} * back;
      const bool there = back < counter;
      ASSERT_EQ(Double(registers.values, at + 3), there ? counter - back : 0) << back;
      ASSERT_EQ(Double(registers.values, at + 1), there ? tag - back : 0) << back;
    }
  }
  EXPECT_GT(last, 3U);
  EXPECT_EQ(client.DiscreteInputs(1, 0, 1).values, std::vector<std::uint8_t>{1});
}

TEST_F(ReaderOnAPty, EachTagIsOneEventAndNumbersContinueAfterAKill) {
  auto daemon = StartDaemon(Yaml());
  auto twin = StartReader("every:50ms,numbered");
  ASSERT_TRUE(Eventually([&] { return Tags().size() >= 10; })) << daemon->Errors();
  daemon->Signal(SIGKILL);
  daemon->WaitForEnd();
  daemon = StartDaemon(Yaml());
  const std::size_t before = Tags().size();
  ASSERT_TRUE(Eventually([&] { return Tags().size() >= before + 5; })) << daemon->Errors();
  const auto tags = Tags();
  for (std::size_t i = 1; i < tags.size(); ++i) EXPECT_LT(tags[i - 1], tags[i]) << i;
  ModbusClient client(port());
  EXPECT_TRUE(Eventually([&] {
    const Registers counter = client.Input(1, 3, 2);
    return counter.ok() && Double(counter.values, 0) >= before;
  })) << "not from 1 on";
}

TEST_F(ReaderOnAPty, SilenceIsNoOutageButALostPortIs) {
  const auto daemon = StartDaemon(Yaml());
  auto twin = StartReader("every:1h");
  ASSERT_TRUE(EventuallyLogged(*daemon, "open ("));
  EXPECT_THAT(Device().dump(), HasSubstr("has sent nothing yet, which is normal"));
  twin->Signal(SIGTERM);
  EXPECT_EQ(twin->WaitForEnd(10s), 0);
  ASSERT_TRUE(EventuallyLogged(*daemon, "down: "));
  twin = StartReader("every:500ms");
  ASSERT_TRUE(Eventually([&] { return !Tags().empty(); })) << daemon->Errors();
  EXPECT_EQ(Device()["lines"][0]["devices"][0]["state"], "online") << Device().dump();
  EXPECT_EQ(Device()["lines"][0]["devices"][0]["unasked"], true) << Device().dump();
}

}  // namespace
}  // namespace baudgate::system_test
