// Tests that every event of a relay is in the file exactly once, in order, with the time at which
// it was raised. Requests and replies are damaged and lost, programs are killed, and power cuts
// leave only synced data. A relay drops events when the next request L confirms them.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "gateway/base/bytes.h"
#include "gateway/base/text.h"
#include "tests/protocols/runs/event_keeper.h"
#include "tests/protocols/runs/mishaps.h"
#include "tests/protocols/runs/rig.h"
#include "tests/support/long_run.h"

namespace baudgate::protocols {
namespace {

using events::EventRecord;

struct Raised {
  std::uint32_t code = 0;
  WallTime time{};
};

class RelayStation {
 public:
  RelayStation(unsigned seed, Troubles troubles)
      : mishaps_(seed, troubles),
        rig_(RealLine("Spa9600"),
             [](config::Line& line) {
               for (config::Device& device : line.devices) device.events = true;
             }),
        keeper_({NameOf(0), NameOf(1)}),
        raised_(rig_.devices()) {
    rig_->keep_sent = false;
    rig_->keep = [this](const bus::ReportedEvents& reported) {
      return keeper_.Keep(reported, rig_.device(reported.device));
    };
    for (std::uint32_t i = 0; i < rig_.devices(); ++i) SpoilWire(rig_->twin(i).manner);
    Begin();
    rig_->Open();
  }

  void RunFor(Duration time) {
    const Duration until = rig_->elapsed() + time;
    while (rig_->elapsed() < until) {
      rig_->RunFor(std::chrono::milliseconds(1 + mishaps_.Below(3000)));
      if (mishaps_.Below(3) == 0) Raise();
      if (keeper_.power_failed() || mishaps_.Kills(40)) Restart();
    }
  }

  void End() {
    mishaps_.End();
    Restart();
    rig_->RunFor(2min);
  }

  void Check() {
    std::vector<std::vector<EventRecord>> kept(rig_.devices());
    for (const EventRecord& record : keeper_.ReadAll()) {
      for (std::uint32_t i = 0; i < rig_.devices(); ++i) {
        if (record.device == NameOf(i)) kept[i].push_back(record);
      }
    }
    for (std::uint32_t i = 0; i < rig_.devices(); ++i) CheckDevice(raised_[i], kept[i]);
    repeats += keeper_.repeats();
    asked_again = keeper_.asked_again;
  }

  std::size_t raised() const { return serial_; }
  std::size_t restarts = 0;
  std::size_t asked_again = 0;  ///< batches that were read from the relay's backup (B)
  std::uint64_t repeats = 0;
  std::size_t guessed = 0;  ///< events whose minute was estimated

 private:
  std::string NameOf(std::uint32_t device) { return rig_.device(device).name; }

  void SpoilWire(Manner& manner) {
    manner.distort = [this, &manner](Bytes reply) {
      manner.dead = false;
      return mishaps_.Carry(std::move(reply));
    };
  }

  /// Raises a burst of up to a dozen events, as many as the register of the relay holds.
  void Raise() {
    const auto device = mishaps_.Below(rig_.devices());
    for (std::size_t i = 0; i <= mishaps_.Below(12); ++i) {
      const DeviceEvent event{device, ++serial_, {}, {}};
      ASSERT_TRUE(rig_->twin(device).twin->Raise(event, rig_->now()));
      raised_[device].push_back({serial_, rig_->now().wall});
    }
    rig_->twin(device).manner.dead = mishaps_.StrikesWire();
    if (rig_->twin(device).manner.dead) {
      rig_->RunFor(300ms);
      rig_->twin(device).manner.dead = false;
    }
  }

  void Begin() { keeper_.Begin(mishaps_.PowerLeft(400)); }
  void Restart() {
    ++restarts;
    repeats += keeper_.repeats();
    keeper_.End(mishaps_.random());
    Begin();
    rig_->Restart();
  }

  void CheckDevice(const std::vector<Raised>& raised, const std::vector<EventRecord>& kept) {
    ASSERT_EQ(kept.size(), raised.size()) << "lost or doubled";
    for (std::size_t i = 0; i < kept.size(); ++i) {
      ASSERT_EQ(kept[i].code, raised[i].code) << "in order";
      if (kept[i].clock == events::ClockQuality::minute_guessed) ++guessed;
      const Duration away = kept[i].device_time - raised[i].time;
      ASSERT_LE(std::chrono::abs(away), 5ms) << Name(kept[i].clock) << " event " << i;
    }
  }

  Mishaps mishaps_;
  Rig rig_;
  EventKeeper keeper_;
  std::uint32_t serial_ = 0;
  std::vector<std::vector<Raised>> raised_;
};

TEST(SpaEvents, ArriveOnceAndInOrderOverAGoodLine) {
  RelayStation station(1, {});
  station.RunFor(10min);
  station.End();
  station.Check();
  EXPECT_GT(station.raised(), 300U);
  EXPECT_LT(station.guessed, station.raised() / 20)
      << "only what came before the first empty reply";
}

TEST(SpaEvents, ArriveOnceAndInOrderOverABadLine) {
  const std::size_t seeds = LongRun(6);
  std::size_t asked_again = 0;
  for (unsigned seed = 1; seed <= seeds && !::testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    RelayStation station(seed, {.wire_one_in = seed % 2 != 0 ? 20U : 100U});
    station.RunFor(15min);
    station.End();
    station.Check();
    asked_again += station.asked_again;
  }
  EXPECT_GT(asked_again, 3 * seeds) << "no reply was lost";
}

TEST(SpaEvents, SurviveKillsAndPowerCutsOverABadLine) {
  const std::size_t seeds = LongRun(40);
  std::size_t restarts = 0;
  std::uint64_t repeats = 0;
  for (unsigned seed = 1; seed <= seeds && !::testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    RelayStation station(seed, {.wire_one_in = 100, .kills = seed % 2 != 0, .power_cuts = true});
    station.RunFor(10min);
    station.End();
    station.Check();
    restarts += station.restarts;
    repeats += station.repeats;
  }
  EXPECT_GT(restarts, 5 * seeds);
  EXPECT_GT(repeats, 0U) << "nothing came once more";
}

using Said = std::function<std::string(char asked)>;

/// Runs a minute in which device 0 answers L and B with `said`; null: with its own events.
struct Minute {
  explicit Minute(const Said& said) {
    Rig rig(RealLine("Spa9600"), [](config::Line& line) {
      for (config::Device& device : line.devices) device.events = true;
    });
    if (said) rig->twin(0).manner.instead = [&](View request) { return Instead(request, said); };
    rig->Open();
    rig->RunFor(10s);
    rig->sent.clear();
    rig->RunFor(1min);
    for (const Sent& sent : rig->sent) Count(sent);
  }

  std::size_t polls = 0;
  Duration longest{};
  std::size_t asked = 0;

 private:
  static bool AsksForEvents(std::string_view text) {
    return text.starts_with(">1RL:") || text.starts_with(">1RB:");
  }
  static std::optional<Bytes> Instead(View request, const Said& said) {
    const std::string_view text = AsText(request);
    if (!AsksForEvents(text)) return std::nullopt;
    Bytes reply = ToBytes("<1D:" + said(text[3]) + ":");
    const std::string checksum = HexByte(Xor8(reply));
    Append(reply, checksum + "\r\n");
    return reply;
  }
  void Count(const Sent& sent) {
    if (AsksForEvents(sent.text)) ++asked;
    if (!sent.text.starts_with(">2R")) return;
    ++polls;
    const auto [last, is_first] = last_.try_emplace(sent.text, sent.at);
    if (!is_first) longest = std::max<Duration>(longest, sent.at - last->second);
    last->second = sent.at;
  }

  std::map<std::string, Instant> last_;
};

TEST(EventFlood, AnEndlesslyRepeatedEventIsReadOncePerPoll) {
  const Minute in_peace({});
  const Minute same([](char) { return "12.345 0E1"; });
  EXPECT_GE(same.polls + 2, in_peace.polls);
  EXPECT_LE(same.longest, in_peace.longest + 1s);
  EXPECT_LE(same.asked, 2 * 62U) << "L and B a second";
}

TEST(EventFlood, EndlessNewEventsTakeARoundOfTheLine) {
  const Minute in_peace({});
  int number = 0;
  const Minute flooded([&number](char asked) {
    if (asked == 'L') ++number;
    return std::to_string(10 + number / 1000 % 50) + "." + std::to_string(100 + number % 900) +
           " 0E1";
  });
  EXPECT_GE(flooded.polls + 2, in_peace.polls);
  EXPECT_LE(flooded.longest, in_peace.longest + 1s);
  EXPECT_GT(flooded.asked, 200U);
  EXPECT_LE(flooded.asked, in_peace.polls + 200) << "as many as others ask, and its turns";
  RecordProperty("asked", static_cast<int>(flooded.asked));
}

// ---------------- Events that are read after a lost request wait until the relay has sent its
// name, because the relay could have been replaced. If it sends no name, the events are stored
// nevertheless.

class EventOwner : public ::testing::Test {
 protected:
  EventOwner() {
    rig_->Open();
    EXPECT_TRUE(rig_->RunUntil([this] { return rig_.AllGood(); }, 2min));
    rig_->RunFor(10s);
    rig_->twin(0).manner.instead = [this](View request) { return Instead(request); };
  }

  static bool Asks(View request, char category) {
    return request.size() > 3 && request[2] == 'R' && request[3] == category;
  }
  static Bytes Said(std::string_view data) {
    Bytes frame = ToBytes("<1D:" + std::string(data) + ":");
    Append(frame, HexByte(Xor8(frame)) + "\r\n");
    return frame;
  }

  std::optional<Bytes> Instead(View request) {
    if (Asks(request, 'L') && loses_) {
      loses_ = false;
      lost_ = true;
      return Bytes();
    }
    if (lost_ && Asks(request, 'B')) ++backups_;
    if (lost_ && Asks(request, 'F') && name_) return name_->empty() ? Bytes() : Said(*name_);
    return std::nullopt;
  }

  /// Raises an event. The relay removes it from its register with the next L, and the reply is
  /// lost.
  void Raise(std::uint32_t code) {
    ASSERT_TRUE(rig_->twin(0).twin->Raise({1, code, {}, {}}, rig_->now()));
    loses_ = true;
  }

  Rig rig_{RealLine("Spa9600"), [](config::Line& line) {
             for (config::Device& device : line.devices) {
               device.events = true;
               device.identity.others = {{"SPAU130C", "spau130c"}};
             }
           }};
  bool loses_ = false;
  bool lost_ = false;
  int backups_ = 0;
  /// Replaces the name of the relay; empty text: the relay does not answer.
  std::optional<std::string> name_;
};

TEST_F(EventOwner, EventsOfTheConfiguredRelayAreReported) {
  Raise(7);
  rig_->RunFor(5s);
  EXPECT_TRUE(lost_);
  EXPECT_GE(backups_, 1);
  ASSERT_EQ(rig_->events.size(), 1U);
  EXPECT_EQ(rig_->events[0].batch.events[0].code, 7U);
}

TEST_F(EventOwner, EventsOfAnotherRelayAreHeldBack) {
  name_ = "SPAU 130 C";
  Raise(7);
  rig_->RunFor(1min);
  EXPECT_GE(backups_, 1);
  EXPECT_TRUE(rig_->events.empty()) << "filed under the name of the one before";
  EXPECT_FALSE(rig_.AnyUsable(0));

  name_.reset();
  rig_->RunFor(3min);
  ASSERT_EQ(rig_->events.size(), 1U) << "the right one is back, and has kept its own";
  EXPECT_EQ(rig_->events[0].batch.events[0].code, 7U);
}

TEST_F(EventOwner, EventsOfARelayWithoutANameAreHeldBack) {
  name_ = "";
  Raise(7);
  rig_->RunFor(20s);
  EXPECT_GE(backups_, 1);
  EXPECT_TRUE(rig_->events.empty());

  name_.reset();
  rig_->RunFor(3min);
  ASSERT_EQ(rig_->events.size(), 1U) << "neither lost nor doubled";
  EXPECT_EQ(rig_->events[0].batch.events[0].code, 7U);
}

// ---------------- Every record of a meter's journals is in the file exactly once, in order and
// with the meter's time, in spite of faults, kills and power cuts.

using Told = std::vector<std::pair<std::uint32_t, std::int64_t>>;
using History = std::map<std::uint32_t, Told>;

class Meters {
 public:
  Meters(unsigned seed, Troubles troubles)
      : mishaps_(seed, troubles),
        rig_(RealLine("Set4tm9600"),
             [](config::Line& line) {
               line.options.Set("time_zone", std::string("+03:00"));
               for (config::Device& device : line.devices) {
                 device.events = true;
                 device.options.Set("time_zone", std::string("+03:00"));
                 device.points.resize(30);
               }
             }),
        keeper_({rig_.device(0).name, rig_.device(1).name}),
        raised_(rig_.devices()) {
    rig_->keep_sent = false;
    rig_->said = [this](std::uint32_t device) { return keeper_.Said(device); };
    rig_->keep = [this](const bus::ReportedEvents& reported) {
      return keeper_.Keep(reported, rig_.device(reported.device));
    };
    for (std::uint32_t i = 0; i < rig_.devices(); ++i) SpoilWire(rig_->twin(i).manner);
    Begin();
    rig_->Restart();
  }

  void RunFor(Duration time) {
    const Duration until = rig_->elapsed() + time;
    while (rig_->elapsed() < until) {
      rig_->RunFor(std::chrono::milliseconds(1 + mishaps_.Below(60'000)));
      if (mishaps_.Below(2) == 0) Raise();
      if (keeper_.power_failed() || mishaps_.Kills(10)) Restart();
    }
  }

  void Sleep(int events) {
    rig_->Close();
    for (int i = 0; i < events; ++i) {
      rig_->RunFor(1min);
      Happen(0, 51);
    }
    Restart();
  }

  void End() {
    mishaps_.End();
    Restart();
    rig_->RunFor(10min);
  }

  void Check() {
    std::vector<History> kept(rig_.devices());
    for (const EventRecord& record : keeper_.ReadAll()) {
      const std::uint32_t device = record.device == rig_.device(0).name ? 0 : 1;
      if (record.code % 10 == 9) {
        gaps.push_back(record.text);
        continue;
      }
      ASSERT_EQ(record.clock, events::ClockQuality::device) << record.text;
      kept[device][record.code / 10].emplace_back(record.code,
                                                  record.device_time.time_since_epoch() / 1s);
      ++told;
    }
    if (!gaps.empty()) return;
    ASSERT_EQ(kept, raised_);
  }

  std::size_t restarts = 0;
  std::size_t told = 0;
  std::vector<std::string> gaps;

 private:
  void SpoilWire(Manner& manner) {
    manner.distort = [this, &manner](Bytes reply) {
      manner.think = mishaps_.StrikesLate() ? 1s : 20ms;
      return mishaps_.Carry(std::move(reply));
    };
  }

  void Happen(std::uint32_t device, std::uint32_t code) {
    ASSERT_TRUE(rig_->twin(device).twin->Raise({0, code, {}, {}}, rig_->now()));
    raised_[device][code / 10].emplace_back(code, rig_->now().wall.time_since_epoch() / 1s);
  }

  void Raise() {
    const auto device = mishaps_.Below(rig_.devices());
    for (std::size_t i = 0; i <= mishaps_.Below(3); ++i) {
      constexpr std::uint32_t kMoments[] = {22, 51, 61, 601};
      constexpr std::uint32_t kIntervals[] = {11, 71, 81, 91, 101};
      if (mishaps_.Below(3) == 0) {
        Happen(device, kMoments[mishaps_.Below(4)]);
        continue;
      }
      const std::uint32_t code = kIntervals[mishaps_.Below(5)];
      bool& under_way = under_way_[{device, code}];
      Happen(device, under_way ? code + 1 : code);
      under_way = !under_way;
    }
  }

  void Begin() { keeper_.Begin(mishaps_.PowerLeft(400)); }
  void Restart() {
    ++restarts;
    keeper_.End(mishaps_.random());
    Begin();
    rig_->Restart();
  }

  Mishaps mishaps_;
  Rig rig_;
  EventKeeper keeper_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, bool> under_way_;
  std::vector<History> raised_;
};

TEST(MeterJournals, ArriveOnceAndInOrderOverAGoodLine) {
  Meters meters(1, {});
  meters.RunFor(1h);
  meters.End();
  meters.Check();
  EXPECT_TRUE(meters.gaps.empty());
  EXPECT_GT(meters.told, 100U);
}

TEST(MeterJournals, ArriveOnceOverABadLineWithLateReplies) {
  for (unsigned seed = 1; seed <= LongRun(2) && !::testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Meters meters(seed, {.wire_one_in = 30, .late_one_in = seed % 2 != 0 ? 40U : 0U});
    meters.RunFor(40min);
    meters.End();
    meters.Check();
    EXPECT_TRUE(meters.gaps.empty());
  }
}

TEST(MeterJournals, SurviveKillsAndPowerCutsOverABadLine) {
  const std::size_t seeds = LongRun(4);
  std::size_t restarts = 0;
  for (unsigned seed = 1; seed <= seeds && !::testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Meters meters(seed, {.wire_one_in = 100, .kills = true, .power_cuts = seed % 2 != 0});
    meters.RunFor(40min);
    meters.End();
    meters.Check();
    EXPECT_TRUE(meters.gaps.empty());
    restarts += meters.restarts;
  }
  EXPECT_GT(restarts, 3 * seeds);
}

TEST(MeterJournals, ReportAGapIfTheyWereOverwritten) {
  Meters meters(1, {});
  meters.Sleep(10);
  meters.End();
  meters.Sleep(12);
  meters.End();
  meters.Check();
  ASSERT_EQ(meters.gaps.size(), 1U);
  EXPECT_EQ(meters.told, 20U);
}

}  // namespace
}  // namespace baudgate::protocols
