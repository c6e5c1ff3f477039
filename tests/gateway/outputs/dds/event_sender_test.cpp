// Tests of `EventSender`, with a supply that forgets old events.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>

#include "gateway/outputs/dds/notice_sender.h"
#include "gateway/outputs/dds/publisher.h"
#include "tests/gateway/outputs/dds/remembering_writer.h"

namespace baudgate::dds {
namespace {

class Supply final : public EventSupply {
 public:
  void Happen(std::uint64_t count = 1, const std::string& gateway = "g") {
    for (; count > 0; --count) {
      EventSample event;
      event.gateway = gateway, event.device = "d0", event.seq = ++last;
      kept.push_back(event);
    }
    if (kept.size() > most) kept.erase(kept.begin(), kept.end() - static_cast<long>(most));
  }
  std::vector<EventSample> Take(std::uint64_t after, std::size_t count) override {
    const auto from = std::ranges::upper_bound(kept, after, {}, &EventSample::seq);
    const auto left = static_cast<std::size_t>(kept.end() - from);
    return {from, from + static_cast<long>(std::min(left, count))};
  }
  std::uint64_t newest() const override { return last; }
  std::optional<Place> place() const override { return kept_place; }
  void Keep(Place place) override { kept_place = place; }
  std::vector<Alarm> TakeAlarms(std::uint64_t after, std::size_t count) override {
    std::vector<Alarm> behind;
    for (const Alarm& alarm : alarms) {
      if (alarm.version > after && behind.size() < count) behind.push_back(alarm);
    }
    return behind;
  }
  void Change(const std::string& name, std::uint16_t state) {
    std::erase_if(alarms, [&](const Alarm& alarm) { return alarm.sample.name == name; });
    Alarm& alarm = alarms.emplace_back();
    alarm.version = ++version;
    alarm.sample.name = name;
    alarm.sample.state = state;
  }
  void OnNew(std::function<void()> wake) override { on_new = std::move(wake); }

  std::uint64_t last = 0;
  std::size_t most = 4000;
  std::vector<EventSample> kept;
  std::optional<Place> kept_place;
  std::vector<Alarm> alarms;
  std::uint64_t version = 0;
  std::function<void()> on_new;
};

std::pair<std::uint64_t, std::uint64_t> SendAll(EventSender& sender) {
  std::pair<std::uint64_t, std::uint64_t> sent{0, 0};
  while (const EventSample* event = sender.Next()) {
    if (sent.first == 0) sent.first = event->seq;
    if (sent.second != 0) {
      EXPECT_EQ(event->seq, sent.second + 1);
    }
    sent.second = event->seq;
    sender.OnSent();
  }
  return sent;
}

using Sent2 = std::pair<std::uint64_t, std::uint64_t>;

TEST(EventSender, SendsEachEventOnceAndTheNewestToNewSubscribers) {
  Supply supply;
  EventSender sender(&supply);
  EXPECT_EQ(sender.Next(), nullptr);
  supply.Happen(5000);
  EXPECT_EQ(SendAll(sender), Sent2(4001, 5000)) << "what was there before is no more than an image";
  EXPECT_EQ(sender.Next(), nullptr);
  supply.Happen();
  EXPECT_EQ(SendAll(sender), Sent2(5001, 5001));
  sender.StartAnew();
  EXPECT_EQ(SendAll(sender), Sent2(4002, 5001));
  sender.StartAnew();
  supply.Happen(2499);
  EXPECT_EQ(SendAll(sender), Sent2(4002, 7500)) << "those that nobody had, too";
  EXPECT_EQ(sender.skipped(), 0U);
  EXPECT_EQ(sender.sent(), 1000U + 1 + 1000 + 3499);
}

TEST(EventSender, CountsEventsThatWereDroppedBeforeSending) {
  Supply supply;
  supply.most = 100;
  EventSender sender(&supply);
  supply.Happen(10);
  EXPECT_EQ(SendAll(sender), Sent2(1, 10));
  supply.Happen(150);
  EXPECT_EQ(SendAll(sender), Sent2(61, 160));
  EXPECT_EQ(sender.skipped(), 50U);
  sender.StartAnew();
  EXPECT_EQ(SendAll(sender), Sent2(61, 160));
}

TEST(EventSender, SkipsEventsOfRemovedDevices) {
  Supply supply;
  supply.Happen(100, "");
  supply.Happen(2);
  supply.Happen(100, "");
  EventSender sender(&supply);
  EXPECT_EQ(SendAll(sender), Sent2(101, 102));
  supply.Happen();
  EXPECT_EQ(SendAll(sender), Sent2(203, 203));
  EXPECT_EQ(sender.skipped(), 0U);
}

TEST(EventSender, ContinuesAfterAnOrderlyStop) {
  Supply supply;
  supply.Happen(3000);
  {
    EventSender sender(&supply);
    SendAll(sender);
    EXPECT_FALSE(supply.kept_place->sure);
    sender.Confirm();
    EXPECT_TRUE(supply.kept_place->sure);
  }
  EventSender sender(&supply);
  EXPECT_EQ(sender.Next(), nullptr) << "nothing twice";
  supply.Happen(2);
  EXPECT_EQ(SendAll(sender), Sent2(3001, 3002));
}

TEST(EventSender, RepeatsPossiblyLostEventsAfterAKill) {
  Supply supply;
  supply.Happen(3000);
  {
    EventSender sender(&supply);
    SendAll(sender);
    sender.Confirm();
    supply.Happen(2);
    SendAll(sender);
  }
  supply.Happen(8);
  EventSender sender(&supply);
  EXPECT_EQ(SendAll(sender), Sent2(2003, 3010));
}

TEST(EventSender, SendsAllUnsentEventsAfterALongKill) {
  Supply supply;
  supply.Happen(100);
  {
    EventSender sender(&supply);
    SendAll(sender);
  }
  supply.Happen(3000);
  {
    EventSender sender(&supply);
    EXPECT_EQ(sender.Next()->seq, 1U);
    sender.Confirm();
    EXPECT_FALSE(supply.kept_place->sure) << "some came once more, and not all of them";
  }
  supply.kept_place = {9999, true};
  EventSender sender(&supply);
  EXPECT_EQ(sender.Next(), nullptr) << "an older file was put back";
  supply.Happen();
  EXPECT_EQ(SendAll(sender), Sent2(3101, 3101));
}

TEST(EventSender, HasNoEventsWithoutASupply) {
  EventSender sender(nullptr);
  sender.StartAnew();
  EXPECT_EQ(sender.Next(), nullptr);
}

config::Config OnePoint() {
  config::Config config;
  config.name = "substation-7";
  config::Line& line = config.lines.emplace_back();
  line.name = "bay";
  config::Device& device = line.devices.emplace_back();
  device.name = "d0";
  device.points.emplace_back().name = "p0";
  return config;
}

struct SampleLoad {
  void RunFor(Duration time) {
    const Instant end = now.instant + time;
    for (;;) {
      bus::Changes changes;
      if (sender.idle()) {
        feed->Drain(Instant(), changes);
        sender.Add(changes);
      }
      const Instant next = sender.Send(now.instant);
      if (next > end) break;
      now.instant = std::max(next, now.instant);
    }
    now.instant = end;
  }

  Now now{Instant() + 1h, WallTime(77s)};
  const config::Config config = OnePoint();
  bus::PointStore store{config};
  std::shared_ptr<bus::ChangeFeed> feed = store.Subscribe();
  testing::RememberingWriter writer;
  Supply supply;
  SampleSender sender{config, store, writer, {}, now, &supply};
};

TEST(EventsOfASender, GoOutPacedAndInOrder) {
  SampleLoad run;
  run.supply.Happen(3000);
  run.RunFor(499ms);
  EXPECT_TRUE(run.writer.events.empty()) << "subscribers have to find the gateway first";
  run.RunFor(21ms);
  EXPECT_GE(run.writer.events.size(), 100U);
  EXPECT_LE(run.writer.events.size(), 600U);
  run.RunFor(1s);
  ASSERT_EQ(run.writer.events.size(), 1000U);
  EXPECT_EQ(run.writer.events.front().seq, 2001U);
  run.supply.Happen();
  run.RunFor(1ms);
  EXPECT_EQ(run.writer.events.back().seq, 3001U) << "at once";
  EXPECT_EQ(run.sender.counters().events, 1001U);
}

TEST(EventsOfASender, WaitForAFullWriter) {
  for (const Sent answer : {Sent::later, Sent::refused}) {
    SampleLoad run;
    run.RunFor(1s);
    run.writer.answer = answer;
    run.supply.Happen(3);
    run.RunFor(1ms);
    run.writer.answer = Sent::yes;
    run.RunFor(2s);
    ASSERT_EQ(run.writer.events.size(), 3U);
    EXPECT_EQ(run.writer.events[2].seq, 3U);
  }
}

TEST(EventsOfASender, AreRepeatedToANewSubscriber) {
  SampleLoad run;
  run.supply.Happen(3);
  run.RunFor(1s);
  run.sender.StartAnew(run.now.instant);
  run.supply.Happen(1);
  run.RunFor(1s);
  ASSERT_EQ(run.writer.events.size(), 7U);
  EXPECT_EQ(run.writer.events[3].seq, 1U);
  EXPECT_EQ(run.writer.events[6].seq, 4U);
}

TEST(AlarmsOfASender, AreSentWithTheirLatestState) {
  SampleLoad run;
  run.supply.Change("a", 1);
  run.supply.Change("b", 1);
  run.supply.Change("a", 2);
  run.RunFor(1s);
  ASSERT_EQ(run.writer.alarms.size(), 2U);
  EXPECT_EQ(run.writer.alarms[0].name, "b");
  EXPECT_EQ(run.writer.alarms[1].state, 2);
  run.writer.answer = Sent::refused;
  run.supply.Change("b", 3);
  run.RunFor(1ms);
  run.supply.Change("b", 0);
  run.writer.answer = Sent::yes;
  run.RunFor(2s);
  EXPECT_EQ(run.writer.alarms.back().name, "b");
  EXPECT_EQ(run.writer.alarms.back().state, 0);
  run.sender.StartAnew(run.now.instant);
  const std::size_t before = run.writer.alarms.size();
  run.RunFor(1s);
  EXPECT_EQ(run.writer.alarms.size(), before + 2) << "all, to whoever comes anew";
  run.supply.Change("c", 1);
  while (const auto next = run.sender.End(run.now.instant)) run.now.instant = *next;
  EXPECT_EQ(run.writer.alarms.back().name, "c");
}

TEST(EventsOfASender, WaitSomeSecondsForTheFirstReader) {
  for (const bool comes : {true, false}) {
    SampleLoad run;
    run.writer.there = {.points = 1};
    run.supply.Happen(3000);
    run.RunFor(10s);
    EXPECT_EQ(run.writer.events.size(), 0U);
    EXPECT_GT(run.writer.points.size(), 0U);
    if (comes) run.writer.there.events = 1;
    run.RunFor(comes ? 1s : 6s);
    EXPECT_EQ(run.writer.events.size(), 1000U) << "there was no place yet";
  }
}

TEST(EventsOfASender, AreSentBeforeTheSenderEnds) {
  SampleLoad run;
  run.RunFor(1s);
  run.supply.Happen(300);
  while (const auto next = run.sender.End(run.now.instant)) run.now.instant = *next;
  EXPECT_EQ(run.writer.events.size(), 300U);
}

}  // namespace
}  // namespace baudgate::dds
