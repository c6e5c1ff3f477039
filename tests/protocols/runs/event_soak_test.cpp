// Tests that the events of relays and meters reach each consumer as 1, 2, 3 … N, without loss or
// repeat. The consumers are the file, a DDS subscriber, and a client that reads the event registers
// over Modbus. The lines damage one exchange in a hundred. The gateway is killed, is restarted in
// an orderly way, or loses its power, which leaves only synced data. A relay drops events when the
// next request L confirms them; a meter drops a record after ten newer ones.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cstdio>
#include <map>
#include <random>

#include "tests/protocols/runs/bad_wire.h"
#include "tests/protocols/runs/event_consumers.h"
#include "tests/protocols/runs/event_keeper.h"
#include "tests/protocols/runs/rig.h"
#include "tests/support/long_run.h"

namespace baudgate::protocols {
namespace {

constexpr unsigned kSpoiledOneIn = 100;
constexpr std::size_t kEventsOfAStation = 20'000;

std::size_t Wanted() { return Setting("BAUDGATE_SOAK_EVENTS", LongRun(3000)); }

struct SoakTally {
  std::size_t events = 0;
  std::size_t of_meters = 0;
  std::size_t kills = 0;
  std::size_t power_cuts = 0;
  std::size_t orderly = 0;
  std::size_t spoiled = 0;
  std::size_t sent_again = 0;
};

class SoakStation {
 public:
  explicit SoakStation(unsigned seed)
      : random_(seed),
        relays_(RealLine("Spa9600"), [](config::Line& line) { Prepare(line); }),
        meters_(RealLine("Set4tm9600"),
                [](config::Line& line) {
                  Prepare(line);
                  line.options.Set("time_zone", std::string("+03:00"));
                  for (config::Device& device : line.devices) {
                    device.options.Set("time_zone", std::string("+03:00"));
                    device.points.resize(30);
                  }
                }),
        keeper_({"relay-1", "relay-2", "meter-1", "meter-2"}) {
    Connect(relays_, 0);
    Connect(meters_, relays_.devices());
    Begin();
  }

  void Run(std::size_t events) {
    while (raised_ < events && !::testing::Test::HasFailure()) {
      const Duration time = std::chrono::milliseconds(1 + random_() % 500);
      relays_->RunFor(time);
      meters_->RunFor(time);
      Raise();
      const bool fails = keeper_.power_failed() || !keeper_.Serve();
      if (fails || random_() % 100 == 0) {
        Restart();
      } else {
        consumers_.Take(random_);
      }
    }
  }

  void End() {
    peace_ = true;
    Restart();
    for (int minute = 0; minute < 10; ++minute) {
      relays_->RunFor(1min);
      meters_->RunFor(1min);
      ASSERT_TRUE(keeper_.Serve());
      consumers_.Take(random_);
      ASSERT_TRUE(keeper_.Serve());
    }
    consumers_.End();
  }

  void Check() {
    std::map<std::string, std::vector<std::uint32_t>> kept;
    const auto all = keeper_.ReadAll();
    for (const events::EventRecord& record : all)
      kept[KeyOf(record.device, record.code)].push_back(record.code);
    EXPECT_EQ(kept, told_);
    EXPECT_EQ(all.size(), raised_);
    EXPECT_EQ(consumers_.of_dds(), static_cast<std::int64_t>(all.size()));
    EXPECT_EQ(consumers_.of_modbus(), static_cast<std::int64_t>(all.size()));
    tally.events = raised_;
    tally.sent_again = consumers_.again;
  }

  SoakTally tally;

 private:
  static void Prepare(config::Line& line) {
    for (config::Device& device : line.devices) device.events = true;
  }
  bool IsMeter(std::uint32_t device) { return device >= relays_.devices(); }

  void Connect(Rig& rig, std::uint32_t first) {
    rig->keep_sent = false;
    rig->said = [this, first](std::uint32_t device) { return keeper_.Said(first + device); };
    rig->keep = [this, &rig, first](const bus::ReportedEvents& reported) {
      bus::ReportedEvents numbered = reported;
      numbered.device += first;
      config::Device device = rig.device(reported.device);
      device.name = Name(numbered.device);
      if (!keeper_.Keep(numbered, device)) return false;
      for (const DeviceEvent& event : reported.batch.events) {
        std::size_t& left = outstanding_[KeyOf(device.name, event.code)];
        if (left > 0) --left;
      }
      return true;
    };
    for (std::uint32_t i = 0; i < rig.devices(); ++i) {
      rig->twin(i).manner.distort = [this](Bytes reply) {
        if (peace_ || random_() % kSpoiledOneIn != 0) return reply;
        ++tally.spoiled;
        return Spoiled(std::move(reply), random_);
      };
    }
  }
  static std::string Name(std::uint32_t device) {
    static const std::string kNames[] = {"relay-1", "relay-2", "meter-1", "meter-2"};
    return kNames[device];
  }
  static std::string KeyOf(const std::string& device, std::uint32_t code) {
    return device.starts_with("meter") ? device + " " + std::to_string(code / 10) : device;
  }

  void Raise() {
    const auto device = static_cast<std::uint32_t>(random_() % 2);
    for (std::size_t i = random_() % 12; i > 0 && outstanding_[Name(device)] < 20; --i) {
      Happen(relays_, device, ++serial_, device);
    }
    if (random_() % 2 == 0) RaiseInMeter(static_cast<std::uint32_t>(random_() % 2));
  }

  /// Raises an event in a meter, unless six events of the journal are not stored by the gateway yet
  /// (a journal holds ten records), or the journal has an event of the same second, which could not
  /// be distinguished.
  void RaiseInMeter(std::uint32_t device) {
    constexpr std::uint32_t kCodes[] = {22, 51, 61, 601};
    const std::uint32_t code = kCodes[random_() % 4];
    const std::uint32_t number = relays_.devices() + device;
    const std::int64_t second = meters_->now().wall.time_since_epoch() / 1s;
    std::int64_t& last = last_second_[{number, code}];
    if (last == second || outstanding_[KeyOf(Name(number), code)] >= 6) return;
    last = second;
    Happen(meters_, device, code, number);
    ++tally.of_meters;
  }

  void Happen(Rig& rig, std::uint32_t device, std::uint32_t code, std::uint32_t number) {
    const std::uint32_t channel = IsMeter(number) ? 0 : device;
    ASSERT_TRUE(rig->twin(device).twin->Raise({channel, code, {}, {}}, rig->now()));
    told_[KeyOf(Name(number), code)].push_back(code);
    ++outstanding_[KeyOf(Name(number), code)];
    ++raised_;
  }

  void Begin() {
    keeper_.Begin(peace_ || random_() % 2 == 0 ? -1 : static_cast<int>(1 + random_() % 600));
    consumers_.Begin(keeper_);
    relays_->Restart();
    meters_->Restart();
  }
  void Restart() {
    const bool power = !keeper_.power_failed();
    if (power && random_() % 3 == 0 && keeper_.Serve()) {
      consumers_.End();
      if (keeper_.Serve()) {
        ++tally.orderly;
      } else {
        consumers_.Kill();
      }
    } else {
      consumers_.Kill();
      ++(power ? tally.kills : tally.power_cuts);
    }
    keeper_.End(random_);
    Begin();
  }

  std::mt19937 random_;
  Rig relays_;
  Rig meters_;
  EventKeeper keeper_;
  EventConsumers consumers_;
  bool peace_ = false;
  std::uint32_t serial_ = 0;
  std::size_t raised_ = 0;
  std::map<std::string, std::size_t> outstanding_;  // events not stored yet, by KeyOf()
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::int64_t> last_second_;
  std::map<std::string, std::vector<std::uint32_t>> told_;
};

TEST(EventSoak, EventsReachEachConsumerOnceAndInOrder) {
  SoakTally all;
  for (unsigned seed = 1; all.events < Wanted() && !::testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SoakStation station(seed);
    station.Run(std::min(Wanted() - all.events, kEventsOfAStation));
    station.End();
    station.Check();
    all.events += station.tally.events;
    all.of_meters += station.tally.of_meters;
    all.kills += station.tally.kills;
    all.power_cuts += station.tally.power_cuts;
    all.orderly += station.tally.orderly;
    all.spoiled += station.tally.spoiled;
    all.sent_again += station.tally.sent_again;
  }
  std::printf(
      "%zu events, %zu of meters; %zu kills, %zu power cuts, %zu orderly ends, %zu replies "
      "spoiled; "
      "on DDS %zu came again and were known\n",
      all.events, all.of_meters, all.kills, all.power_cuts, all.orderly, all.spoiled,
      all.sent_again);
  EXPECT_GT(all.kills, 0U);
  EXPECT_GT(all.orderly, 0U);
  EXPECT_GT(all.spoiled, 0U);
  EXPECT_GT(all.sent_again, 0U);
}

}  // namespace
}  // namespace baudgate::protocols
