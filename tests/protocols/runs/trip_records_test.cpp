// What a relay has recorded of a trip is kept with that trip, whole, and never with another: over a
// line that damages and loses, kills of the program and power cuts. The registers of the relays
// show the number of their latest trip.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <map>

#include "gateway/records/events/record_service.h"
#include "tests/protocols/runs/event_keeper.h"
#include "tests/protocols/runs/mishaps.h"
#include "tests/protocols/runs/rig.h"
#include "tests/support/long_run.h"

namespace baudgate {
namespace {

using events::KeptRecord;
using events::RecordState;

constexpr std::uint32_t kTripped = 3;

/// V6 and V11…V58.
bool IsOfRecord(const config::Point& point) {
  return point.name == "trip_phases" || point.name.starts_with("record");
}

void WithRecords(config::Line& line) {
  for (config::Device& device : line.devices) {
    device.events = true;
    config::Record trip{"trip", {}};
    for (std::uint32_t i = 0; i < device.points.size(); ++i) {
      if (IsOfRecord(device.points[i])) trip.points.push_back(i);
    }
    device.records = {trip};
  }
}

class TripStation {
 public:
  TripStation(unsigned seed, Troubles troubles)
      : mishaps_(seed, troubles),
        rig_(RealLine("Spa9600"), WithRecords),
        keeper_({rig_.device(0).name, rig_.device(1).name}) {
    rig_->keep_sent = false;
    rig_->keep = [this](const ReportedEvents& reported) {
      const bool kept = keeper_.Keep(reported, rig_.device(reported.device));
      if (kept) service_->Owe(keeper_.TakeOwed());
      return kept;
    };
    rig_->drained = [this](std::uint32_t device, Instant asked) {
      service_->OnDrained(device, asked);
    };
    rig_->read = [this](std::uint32_t device, Instant at) { service_->OnRead(device, at); };
    rig_->always = [this] { Work(); };
    for (std::uint32_t i = 0; i < rig_.devices(); ++i) SpoilWire(rig_->twin(i).manner);
    Begin();
    rig_->Open();
  }

  void RunFor(Duration time) {
    const Duration until = rig_->elapsed() + time;
    while (rig_->elapsed() < until) {
      rig_->RunFor(
          std::chrono::milliseconds(1 + mishaps_.Below(mishaps_.Below(4) == 0 ? 500 : 20'000)));
      Trip();
      if (keeper_.power_failed() || mishaps_.Kills(10)) Restart();
    }
  }

  /// In peace, until all is told and read.
  void End() {
    mishaps_.End();
    Restart();
    rig_->RunFor(5min);
  }

  void Check() {
    std::map<std::int64_t, KeptRecord> records;
    for (KeptRecord& record : keeper_.ReadRecords()) {
      const auto event = record.event;
      ASSERT_TRUE(records.emplace(event, std::move(record)).second) << "kept twice";
    }
    for (const events::EventRecord& event : keeper_.ReadAll()) {
      const auto found = records.find(event.seq);
      ASSERT_NE(found, records.end()) << "event " << event.seq << " has none";
      CheckRecord(event.text.substr(event.text.rfind(' ') + 1), found->second);
    }
    EXPECT_TRUE(keeper_.TakeOwed().empty());
  }

  std::size_t read = 0;
  std::size_t superseded = 0;
  std::size_t not_read = 0;
  std::size_t restarts = 0;

 private:
  void CheckRecord(const std::string& number, const KeptRecord& record) {
    read += record.state == RecordState::read ? 1U : 0U;
    superseded += record.state == RecordState::superseded ? 1U : 0U;
    not_read += record.state == RecordState::not_read ? 1U : 0U;
    if (record.state != RecordState::read) {
      ASSERT_TRUE(record.values.empty());
      ASSERT_NE(record.text, "");
      return;
    }
    ASSERT_EQ(record.values.size(), 41U);
    for (const events::RecordValue& value : record.values) {
      ASSERT_TRUE(IsGood(value.quality)) << Name(value.quality);
      ASSERT_EQ(ToText(value.value), number) << value.name << " of another trip";
    }
  }

  void SpoilWire(Manner& manner) {
    manner.distort = [this](Bytes reply) { return mishaps_.Carry(std::move(reply)); };
  }

  void Trip() {
    const auto device = mishaps_.Below(rig_.devices());
    const std::string number = std::to_string(++serial_);
    ASSERT_TRUE(rig_->twin(device).twin->Raise({0, kTripped, {}, number}, rig_->now()));
    const auto& points = rig_.device(device).points;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!IsOfRecord(points[i])) continue;
      const bool whole = points[i].type == config::Type::uint16;
      rig_->twin(device).values.Set(
          i, whole ? Value(std::int64_t{serial_}) : Value(static_cast<double>(serial_)));
    }
  }

  /// What the service wanted while the poller was at work.
  void Work() {
    for (WriteCommand& command : std::exchange(asked_, {})) {
      const std::uint32_t device = command.device;
      if (!rig_->Submit(std::move(command))) ADD_FAILURE() << "device " << device;
    }
    std::erase_if(kept_, [this](const KeptRecord& record) { return keeper_.Keep(record); });
  }

  void Begin() {
    keeper_.Begin(mishaps_.PowerLeft(600));
    asked_.clear();
    kept_.clear();
    const std::size_t generation = restarts;
    services_.push_back(std::make_unique<RecordService>(
        rig_->store(), RecordService::Ends{.clocks = [this] { return rig_->now(); },
                                           .ask =
                                               [this, generation](WriteCommand command) {
                                                 if (generation != restarts) return false;
                                                 asked_.push_back(std::move(command));
                                                 return true;
                                               },
                                           .keep =
                                               [this, generation](KeptRecord record) {
                                                 if (generation == restarts)
                                                   kept_.push_back(std::move(record));
                                               }}));
    service_ = services_.back().get();
    for (const config::Line& line : rig_->config().lines) service_->Add(line);
    service_->Start();
    service_->Owe(keeper_.TakeOwed());
  }
  void Restart() {
    ++restarts;
    keeper_.End(mishaps_.random());
    Begin();
    rig_->Restart();
  }

  Mishaps mishaps_;
  Rig rig_;
  EventKeeper keeper_;
  std::vector<std::unique_ptr<RecordService>>
      services_;  // of before, too: what they asked may end late
  RecordService* service_ = nullptr;
  std::vector<WriteCommand> asked_;
  std::vector<KeptRecord> kept_;
  std::uint32_t serial_ = 0;
};

TEST(TripRecords, AreKeptWithTheirTripsOverAGoodLine) {
  TripStation station(1, {});
  station.RunFor(15min);
  station.End();
  station.Check();
  EXPECT_GT(station.read, 25U);
  EXPECT_GT(station.superseded, 5U);
  EXPECT_EQ(station.not_read, 0U);
}

TEST(TripRecords, AreNeverThoseOfAnotherTripOverABadLineKillsAndPowerCuts) {
  const std::size_t seeds = LongRun(6);
  std::size_t read = 0;
  std::size_t restarts = 0;
  for (unsigned seed = 1; seed <= seeds && !::testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    TripStation station(seed,
                        {.wire_one_in = 30, .kills = seed % 2 != 0, .power_cuts = seed % 3 == 1});
    station.RunFor(10min);
    station.End();
    station.Check();
    read += station.read;
    restarts += station.restarts;
  }
  EXPECT_GT(read, 10 * seeds);
  EXPECT_GT(restarts, 2 * seeds);
}

}  // namespace
}  // namespace baudgate
