// Tests of `AuditedWrites`: a write waits until its record is stored, and its result is added to
// the record.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/audit/audited_writes.h"

#include <gmock/gmock.h>

#include <thread>

#include "tests/gateway/records/audit/fixture.h"
#include "tests/gateway/records/audit/remembering_log.h"

namespace baudgate::audit {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

struct Lines final : bus::CommandSink {
  bool Submit(bus::WriteCommand command) override {
    if (full) return false;
    commands.push_back(std::move(command));
    return true;
  }
  void OnNotTaken(const bus::DeniedWrite& one) override { denied += one.point ? 1 : 0; }
  bool full = false;
  int denied = 0;
  std::vector<bus::WriteCommand> commands;
};

const bus::RequestId kRequest = {"hmi-1", 7, "feeder-1 group 3"};

config::Config OneDevice() {
  config::Config config;
  config::Line line;
  line.name = "bay-1";
  config::Device device;
  device.name = "feeder-1";
  for (const char* name : {"current", "set_point", "group"}) {
    config::Point point;
    point.name = name;
    point.scale = 0.1;
    device.points.push_back(point);
  }
  line.devices.push_back(device);
  config.lines.push_back(line);
  return config;
}

class AuditedWritesTest : public ::testing::Test {
 protected:
  void Make(config::Audit audit = config::Audit::best_effort) {
    writes_.emplace(store_, lines_, log_, audit, [this] { return Now{now_, kWall}; });
  }
  bus::WriteCommand Command(std::vector<std::uint32_t> points = {1}) {
    bus::WriteCommand command;
    command.device = 0;
    command.client = "192.0.2.5:40312";
    for (const std::uint32_t point : points) {
      std::get<bus::Writes>(command.kind).push_back({point, std::int64_t{303}, 12.5, 30.3});
    }
    command.deadline = now_ + 5s;
    command.done = [this](const WriteResult& result) { results_.push_back(result); };
    return command;
  }
  static void End(bus::WriteCommand& command, const WriteResult& result) {
    for (const auto state :
         {bus::WriteState::queued, bus::WriteState::sent, bus::WriteState::reading_back}) {
      if (MayEnd(state, result.end)) command.state = state;
    }
    command.End(result);
  }
  std::vector<std::string> Ends() const {
    std::vector<std::string> all;
    for (const auto& [ticket, endings] : log_.ends) {
      for (const Ending& ending : endings) all.emplace_back(Name(ending.end));
    }
    return all;
  }

  const config::Config config_ = OneDevice();
  bus::PointStore store_{config_};
  Lines lines_;
  RememberingLog log_;
  Instant now_ = kStart;
  std::vector<WriteResult> results_;
  std::optional<AuditedWrites> writes_;
};

TEST_F(AuditedWritesTest, TheRecordComesFirstAndIsCompleted) {
  Make();
  ASSERT_TRUE(writes_->Submit(Command()));
  ASSERT_EQ(log_.begun.size(), 1U);
  EXPECT_TRUE(lines_.commands.empty()) << "not before its record is kept";
  const WriteRecord& record = log_.begun[0];
  EXPECT_EQ(record.line + "." + record.device + "." + record.point, "bay-1.feeder-1.set_point");
  EXPECT_EQ(record.client, "192.0.2.5:40312");
  EXPECT_EQ(record.before, Value(12.5));
  EXPECT_EQ(record.value, Value(30.3)) << "in units of the value, with the digits of a float32";
  EXPECT_EQ(record.end, std::nullopt);
  EXPECT_TRUE(writes_->HandOn());
  EXPECT_EQ(log_.waited.at(0).second, kStart + AuditedWrites::kWaitForRecord);
  ASSERT_EQ(lines_.commands.size(), 1U);
  now_ += 45ms;
  End(lines_.commands[0], {.read_back = true, .written = 1});
  ASSERT_EQ(results_.size(), 1U);
  EXPECT_EQ(log_.ends[1].at(0).end, WriteEnd::ok);
  EXPECT_EQ(log_.ends[1].at(0).took, 45ms);
  EXPECT_FALSE(writes_->HandOn());
}

TEST_F(AuditedWritesTest, WritesKeepTheirOrder) {
  Make();
  for (std::uint32_t point = 0; point < 3; ++point) writes_->Submit(Command({point}));
  while (writes_->HandOn()) {
  }
  ASSERT_EQ(lines_.commands.size(), 3U);
  for (std::uint32_t i = 0; i < 3; ++i) EXPECT_EQ(lines_.commands[i].writes()[0].point, i);
}

TEST_F(AuditedWritesTest, RecordsAndCommandsOfManyThreadsHaveTheSameOrder) {
  Make();
  std::vector<std::thread> clients;
  for (int client = 0; client < 4; ++client) {
    clients.emplace_back([this, client] {
      for (int i = 0; i < 200; ++i) {
        bus::WriteCommand command = Command();
        command.client = std::to_string(client) + " " + std::to_string(i);
        writes_->Submit(std::move(command));
      }
    });
  }
  for (std::thread& client : clients) client.join();
  while (writes_->HandOn()) {
  }
  ASSERT_EQ(lines_.commands.size(), 800U);
  for (std::size_t i = 0; i < lines_.commands.size(); ++i) {
    ASSERT_EQ(lines_.commands[i].client, log_.begun[i].client) << i;
  }
}

TEST_F(AuditedWritesTest, BestEffortSendsWithoutARecord) {
  Make();
  for (const auto kept : {WriteLog::Written::late, WriteLog::Written::failing}) {
    log_.written = kept;
    writes_->Submit(Command());
    EXPECT_TRUE(writes_->HandOn());
  }
  EXPECT_EQ(lines_.commands.size(), 2U);
  log_.full = true;
  writes_->Submit(Command());
  EXPECT_TRUE(writes_->HandOn());
  ASSERT_EQ(lines_.commands.size(), 3U);
  End(lines_.commands[2], {.written = 1});
  EXPECT_EQ(results_.size(), 1U);
}

TEST_F(AuditedWritesTest, RequireRefusesWithoutARecord) {
  Make(config::Audit::require);
  log_.written = WriteLog::Written::late;
  writes_->Submit(Command());
  writes_->HandOn();
  log_.full = true;
  writes_->Submit(Command());
  writes_->HandOn();
  EXPECT_TRUE(lines_.commands.empty());
  ASSERT_EQ(results_.size(), 2U);
  EXPECT_EQ(results_[0].end, WriteEnd::denied);
  EXPECT_THAT(results_[0].reason, HasSubstr("the disk is full"));
  EXPECT_EQ(lines_.denied, 2) << "who counts";
  EXPECT_EQ(results_[1].end, WriteEnd::denied);
  EXPECT_THAT(Ends(), ElementsAre("denied")) << "its record, should it get to the disk, says so";
  bus::WriteCommand by_hand = Command({});
  by_hand.kind = std::make_shared<bus::Telegram>();
  writes_->Submit(std::move(by_hand));
  writes_->HandOn();
  EXPECT_EQ(results_.size(), 3U);
  EXPECT_EQ(lines_.denied, 2) << "a telegram is no write to a point";
}

TEST_F(AuditedWritesTest, AFullLineIsRecordedAsBusy) {
  Make();
  lines_.full = true;
  ASSERT_TRUE(writes_->Submit(Command()));
  writes_->HandOn();
  ASSERT_EQ(results_.size(), 1U);
  EXPECT_EQ(results_[0].end, WriteEnd::busy);
  EXPECT_THAT(Ends(), ElementsAre("busy"));
}

TEST_F(AuditedWritesTest, TooManyWaitingWritesAreRefusedAndRecorded) {
  Make();
  for (std::size_t i = 0; i < AuditedWrites::kLimit / 2; ++i) {
    ASSERT_TRUE(writes_->Submit(Command()));
  }
  EXPECT_FALSE(writes_->Submit(Command()));
  ASSERT_EQ(log_.noted.size(), 1U);
  EXPECT_EQ(log_.noted[0].end, WriteEnd::busy);
  EXPECT_EQ(log_.noted[0].kind, Kind::denied);
  EXPECT_EQ(lines_.denied, 1) << "who counts";
  EXPECT_TRUE(results_.empty()) << "done is not called where Submit says no";
}

TEST_F(AuditedWritesTest, EachPointOfAWriteHasARecord) {
  Make();
  const auto end = [this](const WriteResult& result) {
    log_.ends.clear();
    writes_->Submit(Command({0, 1, 2}));
    writes_->HandOn();
    End(lines_.commands.back(), result);
    return Ends();
  };
  EXPECT_THAT(end({.written = 3}), ElementsAre("ok", "ok", "ok"));
  EXPECT_THAT(end({.end = WriteEnd::refused, .written = 1, .tried = 2}),
              ElementsAre("ok", "refused", "not_sent"));
  EXPECT_THAT(end({.end = WriteEnd::unknown, .written = 0, .tried = 2}),
              ElementsAre("unknown", "unknown", "not_sent"))
      << "two went out together";
  EXPECT_THAT(end({.end = WriteEnd::not_sent}), ElementsAre("not_sent", "not_sent", "not_sent"));
  EXPECT_THAT(end({.end = WriteEnd::not_sent, .written = 1, .tried = 1}),
              ElementsAre("ok", "not_sent", "not_sent"));
  EXPECT_THAT(end({.end = WriteEnd::differs, .written = 3}),
              ElementsAre("differs", "differs", "differs"));
}

TEST_F(AuditedWritesTest, DeniedWritesAreRecordedAndForwarded) {
  Make();
  writes_->OnNotTaken({"192.0.2.9:1", kRequest, 0, 2, Value(99.0), "not selected"});
  ASSERT_EQ(log_.noted.size(), 1U);
  EXPECT_EQ(log_.noted[0].kind, Kind::denied);
  EXPECT_EQ(log_.noted[0].end, WriteEnd::denied);
  EXPECT_EQ(log_.noted[0].point, "group");
  EXPECT_EQ(log_.noted[0].reason, "not selected");
  EXPECT_EQ(log_.noted[0].request, kRequest);
  EXPECT_EQ(lines_.denied, 1);
  writes_->OnNotTaken({"192.0.2.9:1", {}, 0, 2, Value(99.0), "too many", WriteEnd::busy});
  EXPECT_EQ(log_.noted.at(1).kind, Kind::denied);
  EXPECT_EQ(log_.noted.at(1).end, WriteEnd::busy);
  writes_->OnNotTaken({.client = "user:anna", .value = std::string("3E **"), .reason = "no"});
  EXPECT_EQ(log_.noted.at(2).point, "telegram");
  EXPECT_EQ(ToText(log_.noted.at(2).value), "3E **");
}

TEST_F(AuditedWritesTest, StopSendsAllWaitingWrites) {
  Make();
  for (int i = 0; i < 100; ++i) writes_->Submit(Command());
  writes_->Start();
  writes_->Stop();
  EXPECT_EQ(lines_.commands.size(), 100U);
  EXPECT_FALSE(writes_->Submit(Command()));
}

}  // namespace
}  // namespace baudgate::audit
