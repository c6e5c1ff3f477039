// What a reader answers behind a tag is kept with that tag as one, and never with another: through
// kills, with tags that come at any time, also between the command and its answer.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <map>
#include <random>

#include "config/catalog/option_values.h"
#include "gateway/base/text.h"
#include "gateway/records/events/record_service.h"
#include "protocols/reader/codec.h"
#include "protocols/reader/protocol.h"
#include "tests/protocols/runs/event_keeper.h"
#include "tests/support/long_run.h"
#include "tests/support/virtual_line.h"

namespace baudgate {
namespace {

using events::KeptRecord;
using events::RecordState;

const std::string kNoTag = "0000000000";

config::Line GateLine() {
  config::Device device;
  device.name = "gate";
  device.address = "1";
  device.protocol = "reader";
  device.options = config::DefaultOptions(ReaderProtocol());
  device.options.Set("commands", std::string("ask"));
  device.never_old = true;
  device.events = true;
  for (const char* read : {"message", "present"}) {
    config::Point point;
    point.name = point.read = read;
    point.group = config::Group::daily;
    const bool text = std::string_view(read) == "message";
    point.type = text ? config::Type::string : config::Type::boolean;
    point.text_length = text ? 10 : 0;
    device.points.push_back(point);
  }
  device.records = {{"transponder", {0, 1}}};
  config::EventText& tag = device.event_texts.emplace_back();
  tag.code = 1;
  tag.text = "tag";
  tag.record = "transponder";
  config::Line line;
  line.name = "line";
  line.protocol = "reader";
  line.serial = ReaderProtocol().serial;
  line.devices = {std::move(device)};
  return line;
}

class Gate {
 public:
  explicit Gate(unsigned seed) : random_(seed), line_(GateLine(), {&ReaderProtocol()}) {
    line_.keep = [this](const ReportedEvents& reported) {
      const bool kept = keeper_.Keep(reported, line_.config().lines[0].devices[0]);
      if (kept) service_->Owe(keeper_.TakeOwed());
      return kept;
    };
    line_.drained = [this](std::uint32_t device, Instant asked) {
      service_->OnDrained(device, asked);
    };
    line_.read = [this](std::uint32_t device, Instant at) { service_->OnRead(device, at); };
    line_.always = [this] { Work(); };
    line_.twin(0).manner.instead = [this](View request) -> std::optional<Bytes> {
      if (request[0] != 'r') return std::nullopt;
      return protocols::reader::EncodeTag(there_);
    };
    Begin();
    line_.Open();
  }

  void Pass(const std::string& tag, Duration stays) {
    line_.Inject(protocols::reader::EncodeTag(tag));
    there_ = tag;
    line_.RunFor(stays);
    there_ = kNoTag;
  }
  void RunFor(Duration time) { line_.RunFor(time); }
  void Restart() {
    ++restarts_;
    keeper_.End(random_);
    Begin();
    line_.Restart();
  }
  void LosePort(Duration time) {
    line_.Close();
    line_.RunFor(time);
    line_.Open();
  }

  struct Kept {
    std::string tag;
    KeptRecord record;
  };
  /// In the order of the events.
  std::vector<Kept> ReadAll() {
    std::map<std::int64_t, KeptRecord> records;
    for (KeptRecord& record : keeper_.ReadRecords()) {
      EXPECT_TRUE(records.emplace(record.event, record).second) << "kept twice";
    }
    std::vector<Kept> all;
    for (const events::EventRecord& event : keeper_.ReadAll()) {
      EXPECT_TRUE(records.contains(event.seq)) << "event " << event.seq << " has none";
      all.push_back({event.text.substr(5), records[event.seq]});
    }
    return all;
  }

  std::mt19937 random_;

 private:
  /// What the service wanted while the poller was at work.
  void Work() {
    for (WriteCommand& command : std::exchange(asked_, {})) line_.Submit(std::move(command));
    std::erase_if(kept_, [this](const KeptRecord& record) { return keeper_.Keep(record); });
  }
  void Begin() {
    keeper_.Begin(-1);
    asked_.clear();
    kept_.clear();
    const auto alive = [this, generation = restarts_] { return generation == restarts_; };
    RecordService::Ends ends;
    ends.clocks = [this] { return line_.now(); };
    ends.ask = [this, alive](WriteCommand command) {
      if (!alive()) return false;
      asked_.push_back(std::move(command));
      return true;
    };
    ends.keep = [this, alive](KeptRecord record) {
      if (alive()) kept_.push_back(std::move(record));
    };
    services_.push_back(std::make_unique<RecordService>(line_.store(), std::move(ends)));
    service_ = services_.back().get();
    service_->Add(line_.config().lines[0]);
    service_->Start();
    service_->Owe(keeper_.TakeOwed());
  }

  VirtualLine line_;
  EventKeeper keeper_{{"gate"}};
  std::vector<std::unique_ptr<RecordService>>
      services_;  // of before, too: what they asked may end late
  RecordService* service_ = nullptr;
  std::vector<WriteCommand> asked_;
  std::vector<KeptRecord> kept_;
  std::string there_ = kNoTag;
  int restarts_ = 0;
};

TEST(ReaderRecords, WhatItAnswersIsKeptWithItsTagAsOne) {
  Gate gate(1);
  gate.RunFor(5s);
  gate.Pass("0000000001", 5s);
  gate.RunFor(10s);
  gate.Pass("0000000002", 1ms);  // gone before it is read
  gate.RunFor(10s);
  const auto all = gate.ReadAll();
  ASSERT_EQ(all.size(), 2U);
  for (const auto& [tag, record] : all) {
    EXPECT_EQ(record.state, RecordState::read) << record.text;
    EXPECT_EQ(record.name, "transponder");
    ASSERT_EQ(record.values.size(), 2U);
    EXPECT_TRUE(IsGood(record.values[0].quality));
    EXPECT_EQ(ToText(record.values[1].value), tag == "0000000001" ? "1" : "0");
    EXPECT_LT(record.read - record.device_time, 200ms);
  }
  EXPECT_EQ(ToText(all[0].record.values[0].value), "0000000001");
  EXPECT_EQ(ToText(all[1].record.values[0].value), kNoTag);
}

TEST(ReaderRecords, AreNeverThoseOfAnotherTag) {
  const std::size_t seeds = LongRun(6);
  std::size_t read = 0;
  std::size_t superseded = 0;
  for (unsigned seed = 1; seed <= seeds && !::testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Gate gate(seed);
    constexpr int kTags = 150;
    for (int tag = 1; tag <= kTags; ++tag) {
      auto& random = gate.random_;
      gate.RunFor(std::chrono::milliseconds(random() % (random() % 3 == 0 ? 60 : 4000)));
      gate.Pass(fmt::format("{:010X}", tag),
                std::chrono::milliseconds(17 + random() % (random() % 2 == 0 ? 100 : 3000)));
      if (seed % 2 != 0 && tag % 10 == 0) gate.Restart();
      if (seed % 3 == 1 && tag % 8 == 0) gate.LosePort(1s * (random() % 30));
    }
    gate.RunFor(5min);
    gate.Pass(fmt::format("{:010X}", kTags + 1), 5s);
    gate.RunFor(1min);
    std::string last;
    for (const auto& [tag, record] : gate.ReadAll()) {
      EXPECT_GT(tag, last) << "doubled, or out of order";
      last = tag;
      if (record.state != RecordState::read) {
        EXPECT_EQ(record.state, RecordState::superseded) << record.text;
        ++superseded;
        continue;
      }
      ++read;
      const std::string said = ToText(record.values[0].value);
      EXPECT_TRUE(said == tag || said == kNoTag) << said << " with tag " << tag;
      EXPECT_EQ(ToText(record.values[1].value), said == tag ? "1" : "0");
    }
  }
  EXPECT_GT(read, 50 * seeds);
  EXPECT_GT(superseded, seeds);
}

/// The reader was unplugged behind the tag, while the program was stopped.
TEST(StoppedReader, ShowsATagAsOldAsTheStop) {
  for (const bool timers_first : {false, true}) {
    VirtualLine line(GateLine(), {&ReaderProtocol()});
    line.Open();
    line.RunFor(5s);
    line.Inject(protocols::reader::EncodeTag("0A00112233"), 1s);
    line.Stop(60s, timers_first);
    line.RunFor(100ms);
    EXPECT_GE(line.AgeOf(0, 0), 60s);
    line.RunFor(2s);
    line.Inject(protocols::reader::EncodeTag("0A00112244"));
    line.RunFor(10ms);
    EXPECT_LE(line.AgeOf(0, 0), 10ms);
  }
}

}  // namespace
}  // namespace baudgate
