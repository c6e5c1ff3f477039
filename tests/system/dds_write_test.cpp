// Tests writes by a client of another DDS vendor, which is built from baudgate's IDL only.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <signal.h>

#include "tests/system/station.h"

namespace baudgate::system_test {
namespace {

using ::testing::HasSubstr;
using ::testing::MatchesRegex;
using ::testing::Not;
using ::testing::StartsWith;

constexpr int kIo = 1;
constexpr int kRelay = 2;

class DdsWrites : public Station {
 protected:
  std::string Yaml(const std::string& dds, const std::string& io = "allow") const {
    std::string head = Head(true);
    head.insert(head.find("dds: { ") + 7, dds);
    return WithSocket(head) +
           Line("io", "dcon",
                "address: 0x1F, profile: icpdas-i-7024, unit: 1, poll: 100ms, write: " + io) +
           Line("relay", "spabus",
                "address: 2, profile: spaj140c, unit: 2, poll: 200ms, slow: 1h, write: "
                "[setting_group], points: [{ name: setting_group, select: true }]");
  }
  void StartAll(const std::string& dds, const std::string& io = "allow") {
    io_ = StartTwin("io", "icpdas-i-7024", "0x1F");
    relay_ = StartTwin("relay", "spaj140c", "2");
    Run(dds, io);
    ASSERT_TRUE(EventuallyFloat(*client_, kIo, 0, 1.5F));
    ASSERT_TRUE(Eventually([&] { return client_->Register(kRelay, 100) == 0; }));
  }

  void Run(const std::string& dds, const std::string& io = "allow") {
    daemon_.reset();
    daemon_ = StartDaemon(Yaml(dds, io));
    client_ = std::make_unique<ModbusClient>(port());
  }

  std::vector<std::string> Words(const std::string& device, const std::string& point,
                                 std::vector<std::string> more) const {
    std::vector<std::string> words = {CYCLONE_WRITER, "--domain", std::to_string(domain()),
                                      "--gateway",    gateway(),  "--client",
                                      "plc-1",        "--device", device,
                                      "--point",      point};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  std::string Ask(const std::string& device, const std::string& point,
                  std::vector<std::string> more) const {
    const Finished asked = RunToEnd(Words(device, point, std::move(more)), directory());
    EXPECT_EQ(asked.code, 0) << asked.output << asked.errors << daemon_->Errors();
    EXPECT_THAT(asked.output, StartsWith("matched\n"));
    return asked.output.substr(std::min(asked.output.size(), std::size_t{8}));
  }
  std::vector<Json> Records() const {
    const Finished writes = Station::Ask({"writes", "--json"});
    EXPECT_EQ(writes.code, 0) << writes.errors;
    return JsonLines(writes.output);
  }
  Json DdsStatus() const { return Status()["dds"]; }
  pid_t Process() const { return ChildOf(*daemon_); }

  std::unique_ptr<Child> io_;
  std::unique_ptr<Child> relay_;
  std::unique_ptr<Child> daemon_;
  std::unique_ptr<ModbusClient> client_;
};

TEST_F(DdsWrites, ASetPointIsWrittenAnsweredAndRecorded) {
  StartAll("write: allow, ");
  EXPECT_EQ(Ask("io-1", "output_0", {"--value", "2.25"}), "1 ok \n");
  EXPECT_TRUE(EventuallyFloat(*client_, kIo, 0, 2.25F));
  EXPECT_THAT(Ask("io-1", "output_0", {"--seq", "2", "--value", "11"}),
              StartsWith("2 denied 'output_0': 11 is above"));
  EXPECT_THAT(Ask("io-1", "output_0", {"--seq", "3", "--value", "nan"}), HasSubstr("not a number"));
  EXPECT_EQ(client_->Float(kIo, 0), 2.25F);

  // A point that trips a breaker needs a selection (or --confirm) before the write.
  EXPECT_THAT(Ask("relay-1", "setting_group", {"--seq", "4", "--value", "1"}),
              HasSubstr("4 denied 'setting_group' has to be selected"));
  EXPECT_EQ(client_->Register(kRelay, 100), 0);
  EXPECT_EQ(Ask("relay-1", "setting_group", {"--seq", "5", "--text", "1", "--confirm"}), "5 ok \n");
  EXPECT_TRUE(Eventually([&] { return client_->Register(kRelay, 100) == 1; }));
  EXPECT_THAT(Ask("relay-1", "current_l1", {"--seq", "6", "--value", "1"}),
              HasSubstr("can only be read"));
  EXPECT_THAT(Ask("io-1", "output_0", {"--seq", "7", "--value", "3", "--not-after", "-1"}),
              StartsWith("7 not_sent "));
  EXPECT_EQ(client_->Float(kIo, 0), 2.25F);

  std::vector<Json> records;
  ASSERT_TRUE(Eventually([&] { return (records = Records()).size() == 7; })) << records.size();
  for (const Json& record : records) {
    EXPECT_THAT(record["client"].get<std::string>(),
                MatchesRegex("dds:([0-9a-f]{2}[.]){11}[0-9a-f]{2}[|][0-9a-f.]+"));
  }
  const auto of = [&](const std::string& point, const std::string& outcome) {
    return std::ranges::count_if(records, [&](const Json& record) {
      return record["point"] == point && record["outcome"] == outcome;
    });
  };
  EXPECT_EQ(of("output_0", "ok"), 1);
  EXPECT_EQ(of("output_0", "denied"), 2);
  EXPECT_EQ(of("output_0", "not_sent"), 1);
  EXPECT_EQ(of("setting_group", "ok"), 1);
  EXPECT_EQ(of("setting_group", "denied"), 1);
  EXPECT_EQ(of("current_l1", "denied"), 1);
  EXPECT_EQ(DdsStatus()["requests"]["taken"], 7);
}

TEST_F(DdsWrites, DuplicatesAreAnsweredAgainAlsoByANewProcess) {
  StartAll("write: allow, ");
  EXPECT_EQ(Ask("io-1", "output_0", {"--value", "2.25", "--repeat", "3"}), "1 ok \n1 ok \n1 ok \n");
  const pid_t before = Process();
  ASSERT_GT(before, 0);
  ::kill(before, SIGKILL);
  ASSERT_TRUE(Eventually([&] { return Process() > 0 && Process() != before; }));
  ASSERT_TRUE(Eventually([&] { return DdsStatus()["state"] == "up"; }));
  EXPECT_EQ(client_->WriteRegisters(kIo, 0, {0x4080, 0}), kNoException);
  EXPECT_EQ(Ask("io-1", "output_0", {"--value", "2.25"}), "1 ok \n");
  EXPECT_THAT(Ask("io-1", "output_0", {"--value", "2.5"}),
              HasSubstr("1 denied nothing was written, because this client has"));
  EXPECT_EQ(client_->Float(kIo, 0), 4.0F) << "done once";
}

TEST_F(DdsWrites, TheSameRequestIsNotWrittenAgainByTheNextRun) {
  StartAll("write: allow, ");
  EXPECT_EQ(Ask("io-1", "output_0", {"--seq", "7", "--value", "2.25"}), "7 ok \n");
  daemon_->Signal(SIGTERM);
  ASSERT_EQ(daemon_->WaitForEnd(), 0);
  Run("write: allow, ");
  EXPECT_EQ(client_->WriteRegisters(kIo, 0, {0x4080, 0}), kNoException);
  EXPECT_EQ(Ask("io-1", "output_0", {"--seq", "7", "--value", "2.25"}), "7 ok \n");
  EXPECT_THAT(Ask("io-1", "output_0", {"--seq", "7", "--value", "2.5"}),
              HasSubstr("7 denied nothing was written, because this client has"));
  EXPECT_EQ(client_->Float(kIo, 0), 4.0F) << "done once";
  std::vector<Json> records;
  ASSERT_TRUE(Eventually([&] { return (records = Records()).size() == 3; })) << records.size();
  EXPECT_EQ(records[0]["request"], (Json{{"client", "plc-1"}, {"seq", 7}}));
  EXPECT_EQ(records[1]["request"], nullptr) << "by Modbus";
}

/// A client without an answer repeats its request unchanged every two seconds.
TEST_F(DdsWrites, ARequestInterruptedByAKillIsUnknownToTheNextRun) {
  StartAll("write: allow, ");
  io_->Signal(SIGSTOP);
  Child asks(Words("io-1", "output_0", {"--seq", "7", "--value", "2.25", "--seconds", "60"}),
             directory());
  ASSERT_TRUE(Eventually([&] {
    const auto records = Records();
    return records.size() == 1 && records[0]["outcome"] == "pending";
  }));
  daemon_->Signal(SIGKILL);
  daemon_->WaitForEnd();
  io_->Signal(SIGCONT);
  Run("write: allow, ");
  ASSERT_TRUE(Eventually([&] { return asks.Output().find("7 ") != std::string::npos; }));
  EXPECT_THAT(asks.Output(), HasSubstr("7 unknown the gateway was stopped before it had ended"));
  EXPECT_EQ(Records().size(), 1U);
}

/// The killed gateway has not acknowledged the request, so Cyclone DDS delivers it to the next
/// gateway.
TEST_F(DdsWrites, ARequestToADeadGatewayIsNotDoneByTheNextRun) {
  StartAll("write: allow, ");
  Child asks(
      Words("io-1", "output_0", {"--value", "9", "--deadline", "1000", "--once", "--pause", "3"}),
      directory());
  ASSERT_TRUE(Eventually([&] { return asks.Output().starts_with("matched\n"); }));
  const pid_t process = Process();
  daemon_->Signal(SIGSTOP);
  ASSERT_EQ(::kill(process, SIGSTOP), 0);
  ASSERT_TRUE(Eventually([&] { return asks.Errors().find("has asked") != std::string::npos; }));
  daemon_->Signal(SIGKILL);
  ::kill(process, SIGKILL);
  daemon_->WaitForEnd();
  Run("write: allow, ");
  EXPECT_EQ(Ask("io-1", "output_0", {"--client", "plc-2", "--value", "2.25"}), "1 ok \n");
  EXPECT_TRUE(Eventually([&] {
    return asks.Output().find("1 denied too old") != asks.Output().npos;
  })) << asks.Output();
  EXPECT_EQ(client_->Float(kIo, 0), 2.25F);
}

TEST_F(DdsWrites, AreDeniedByDefault) {
  StartAll("");
  const Finished asked =
      RunToEnd(Words("io-1", "output_0", {"--value", "2.25", "--seconds", "4"}), directory());
  EXPECT_EQ(asked.code, 1);
  EXPECT_EQ(asked.output, "") << "nobody listens";
  EXPECT_EQ(client_->Float(kIo, 0), 1.5F);
  EXPECT_EQ(DdsStatus()["requests"], nullptr);
}

TEST_F(DdsWrites, NeedThePermissionOfTheDeviceAsWell) {
  StartAll("write: allow, ", "deny");
  EXPECT_THAT(Ask("io-1", "output_0", {"--value", "2.25"}),
              StartsWith("1 denied 'output_0' may not be written: add it to 'write' of the device "
                         "in the configuration"));
  EXPECT_EQ(Ask("relay-1", "setting_group", {"--seq", "2", "--value", "1", "--confirm"}),
            "2 ok \n");
  EXPECT_EQ(client_->Float(kIo, 0), 1.5F);
}

// Cyclone DDS stores samples of a transient local writer, and sends them to volatile readers on
// request.
TEST_F(DdsWrites, ARequestFromBeforeTheStartOfTheGatewayIsNeverDone) {
  Child early(Words("io-1", "output_0", {"--value", "9", "--early", "--seconds", "40"}),
              directory());
  StartAll("write: allow, ");
  ASSERT_TRUE(Eventually([&] { return early.Output().starts_with("matched\n"); }));
  EXPECT_EQ(Ask("io-1", "output_0", {"--client", "plc-2", "--value", "2.25"}), "1 ok \n");
  EXPECT_THAT(early.Output(), Not(HasSubstr("ok")));
  EXPECT_TRUE(EventuallyFloat(*client_, kIo, 0, 2.25F));
  for (const Json& record : Records()) {
    EXPECT_EQ(record["outcome"], record["new"] == 9 ? "denied" : "ok") << record;
  }
}

TEST_F(DdsWrites, AFloodOfRequestsDoesNotDisturbOtherClients) {
  StartAll("write: allow, ");
  Child flood(Words("io-1", "output_0",
                    {"--value", "99", "--flood", "--count", "20000", "--seconds", "15"}),
              directory());
  ASSERT_TRUE(Eventually([&] { return flood.Output().find("denied") != std::string::npos; }));
  for (int round = 0; round < 50; ++round) ASSERT_EQ(client_->Float(kIo, 1 * 2), 2.5F);
  EXPECT_EQ(Ask("io-1", "output_0", {"--client", "plc-2", "--value", "2.25"}), "1 ok \n");
  ASSERT_EQ(flood.WaitForEnd(40s), 0);
  EXPECT_THAT(flood.Output(), Not(HasSubstr(" ok ")));
  const Json requests = DdsStatus()["requests"];
  EXPECT_GT(requests["taken"], 100) << requests;
  EXPECT_EQ(client_->Float(kIo, 0), 2.25F);
  EXPECT_LE(Records().size(), 10U) << "repeats share a record";
}

}  // namespace
}  // namespace baudgate::system_test
