// Publisher and subscriber over loopback with the real Fast DDS: images, late joiners, ends.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "gateway/outputs/dds/fast/subscriber.h"
#include "gateway/outputs/dds/publisher.h"
#include "tests/gateway/outputs/dds/fixture.h"

namespace baudgate::dds {
namespace {

using testing::MakeConfig;
using testing::Publish;
using testing::Published;
using testing::Set;
using testing::TestSubscriber;

std::unique_ptr<DdsSubscriber> Subscribe(Published& heard) {
  auto subscriber = DdsSubscriber::Create(TestSubscriber(), heard.Callbacks());
  EXPECT_TRUE(subscriber.ok()) << subscriber.error();
  return subscriber.ok() ? std::move(*subscriber) : nullptr;
}

TEST(Loopback, ASubscriberSeesImageChangeAndDevice) {
  const config::Config config = MakeConfig(1, 3);
  PointStore store(config);
  Published heard;
  const auto subscriber = Subscribe(heard);
  const auto publisher = Publish(config, store);
  ASSERT_TRUE(heard.WaitFor([&] { return heard.points.size() == 3 && heard.devices.size() == 1; }));
  ASSERT_TRUE(heard.WaitFor([&] { return heard.gateways == 1; }));
  Set(store, 0, 2, 2.5);
  ASSERT_TRUE(heard.WaitFor([&] { return heard.points[{"feeder-0", "p2"}].seq == 1; }));
  const PointSample sample = heard.points[{"feeder-0", "p2"}];
  EXPECT_EQ(sample.gateway, "substation-7");
  EXPECT_EQ(sample.value, 2.5);
  EXPECT_EQ(sample.unit, "A");
  EXPECT_EQ(sample.quality, 0xC0);
  EXPECT_TRUE(std::isnan(heard.points[{"feeder-0", "p0"}].value));
  store.UpdateStatus(0, [](DeviceStatus& status) { status.state = DeviceState::online; });
  EXPECT_TRUE(heard.WaitFor([&] { return heard.devices["feeder-0"].state == 1; }));
}

TEST(Loopback, TwoThousandPointsArriveWhole) {
  const config::Config config = MakeConfig(20, 100);
  PointStore store(config);
  Published heard;
  const auto subscriber = Subscribe(heard);
  const auto publisher = Publish(config, store);
  ASSERT_TRUE(heard.WaitFor([&] { return heard.points.size() == 2000; }));
  for (std::uint32_t device = 0; device < 20; ++device) {
    for (std::uint32_t point = 0; point < 100; ++point) Set(store, device, point, point + 0.5);
  }
  EXPECT_TRUE(heard.WaitFor([&] {
    for (const auto& [key, sample] : heard.points) {
      if (sample.seq != 1) return false;
    }
    return true;
  }));
  EXPECT_EQ(heard.rejected, 0U);
  EXPECT_EQ(publisher->counters().failed, 0U);
  EXPECT_EQ(publisher->counters().subscribers.points, 1U);
}

TEST(Loopback, ALargeGatewayIsOneGatewayAndArrivesWhole) {
  const config::Config config = MakeConfig(90, 100);
  PointStore store(config);
  Published heard;
  const auto subscriber = Subscribe(heard);
  auto publisher = Publish(config, store);
  ASSERT_TRUE(heard.WaitFor([&] { return heard.points.size() == 9000; }));
  EXPECT_TRUE(heard.WaitFor([&] { return heard.gateways == 1; }));
  EXPECT_EQ(publisher->counters().subscribers.points, 1U);
  publisher.reset();
  EXPECT_TRUE(heard.WaitFor([&] { return heard.gone.size() == 9000 && heard.gateways == 0; }));
}

TEST(Loopback, ALateJoinerGetsTheLatestOfAll) {
  const config::Config config = MakeConfig(4, 100);
  PointStore store(config);
  const auto publisher = Publish(config, store);
  Published first;
  auto early = Subscribe(first);
  ASSERT_TRUE(first.WaitFor([&] { return first.points.size() == 400; }));
  Set(store, 3, 99, 7.0);
  ASSERT_TRUE(first.WaitFor([&] { return first.points[{"feeder-3", "p99"}].seq == 1; }));
  early.reset();

  Published heard;
  const auto late = Subscribe(heard);
  ASSERT_TRUE(heard.WaitFor([&] { return heard.points.size() == 400; }));
  EXPECT_EQ(heard.points[Published::Key("feeder-3", "p99")].value, 7.0);
}

TEST(Loopback, AtAnOrderlyStopTheLastSamplesAreNotConnected) {
  const config::Config config = MakeConfig(2, 50);
  PointStore store(config);
  Set(store, 1, 7, 7.5);
  Published heard;
  std::map<Published::Key, PointSample> last;
  SubscriberCallbacks callbacks = heard.Callbacks();
  callbacks.on_point_gone = [&, note = callbacks.on_point_gone](const PointSample& s, Gone why) {
    last[{s.device, s.point}] = s;
    note(s, why);
  };
  auto subscriber = DdsSubscriber::Create(TestSubscriber(), callbacks);
  ASSERT_TRUE(subscriber.ok()) << subscriber.error();
  auto publisher = Publish(config, store);
  ASSERT_TRUE(
      heard.WaitFor([&] { return heard.points.size() == 100 && heard.devices.size() == 2; }));
  publisher.reset();
  ASSERT_TRUE(
      heard.WaitFor([&] { return heard.gone.size() == 100 && heard.devices_gone.size() == 2; }));
  EXPECT_TRUE(heard.WaitFor([&] { return heard.gateways == 0; }));
  subscriber->reset();
  ASSERT_EQ(last.size(), 100U);
  for (const auto& [key, sample] : last) EXPECT_EQ(sample.quality, 0x08) << key.second;
  EXPECT_EQ(last[Published::Key("feeder-1", "p7")].value, 7.5);
  for (const auto& [key, why] : heard.gone) EXPECT_EQ(why, Gone::no_writers) << key.second;
}

TEST(Loopback, WhatAReloadTakesOutIsGoneForThoseThatAreThereAndForThoseThatComeLater) {
  const config::Config config = MakeConfig(2, 3);
  PointStore store(config);
  Published heard;
  const auto subscriber = Subscribe(heard);
  const auto publisher = Publish(config, store);
  const auto has = [](Published& in, std::size_t points, std::size_t devices) {
    return in.WaitFor([&, points, devices] {
      return in.points.size() == points && in.devices.size() == devices;
    });
  };
  ASSERT_TRUE(has(heard, 6, 2));
  std::vector<config::Line> lines(5, config.lines[0]);
  for (int round = 0; round < 5; ++round) {
    config::Line& line = lines[static_cast<std::size_t>(round)];
    line.devices[0].name = "renamed-" + std::to_string(round);
    store.Append(line);
    store.Retire(static_cast<std::uint32_t>(round));
    publisher->OnReload();
    const Published::Key now{line.devices[0].name, "p2"};
    ASSERT_TRUE(heard.WaitFor([&] { return heard.points.contains(now); }));
    EXPECT_TRUE(has(heard, 6, 2)) << "round " << round;
  }
  Published late;
  const auto another = Subscribe(late);
  EXPECT_TRUE(has(late, 6, 2));
  EXPECT_TRUE(late.devices.contains("feeder-1"));
  EXPECT_TRUE(late.devices.contains("renamed-4"));
}

TEST(Loopback, ASubscriberIsToldWhenTheGatewayWasStarted) {
  const config::Config config = MakeConfig(1, 1);
  PointStore store(config);
  const std::int64_t before = ReadClocks().wall.time_since_epoch().count();
  auto publisher = Publish(config, store);
  Published heard;
  const auto subscriber = Subscribe(heard);
  ASSERT_TRUE(heard.WaitFor([&] { return heard.starts.size() == 1; }));
  const GatewaySample told = heard.starts["substation-7"];
  EXPECT_GE(told.start_time_ns, before);
  EXPECT_LE(told.start_time_ns, ReadClocks().wall.time_since_epoch().count());
  EXPECT_FALSE(told.version.empty());
  publisher.reset();
  EXPECT_TRUE(heard.WaitFor([&] { return heard.starts.empty(); }));
}

TEST(Loopback, AWriterThatLeavesWithoutAWordIsReportedAsSuch) {
  Published heard;
  const auto subscriber = Subscribe(heard);
  auto writer = CreateFastWriter(TestSubscriber().participant, {.points = 1, .devices = 1});
  ASSERT_TRUE(writer.ok()) << writer.error();
  PointSample sample;
  sample.gateway = "g", sample.device = "d", sample.point = "p";
  ASSERT_EQ((*writer)->Write(sample), Sent::yes);
  ASSERT_TRUE(heard.WaitFor([&] { return heard.points.size() == 1; }));
  writer->reset();
  ASSERT_TRUE(heard.WaitFor([&] { return heard.gone.size() == 1; }));
  EXPECT_EQ(heard.gone.begin()->second, Gone::no_writers);
}

TEST(Loopback, GatewaysOfOneDomainAreToldApart) {
  const config::Config config = MakeConfig(1, 1);
  config::Config other = config;
  other.name = "substation-8";
  PointStore store(config);
  PointStore other_store(other);
  std::mutex mutex;
  std::set<std::string> gateways;
  Published heard;
  SubscriberCallbacks callbacks = heard.Callbacks();
  callbacks.on_point = [&, note = callbacks.on_point](const PointSample& sample,
                                                      const Origin& origin) {
    {
      const std::lock_guard lock(mutex);
      gateways.insert(sample.gateway);
    }
    note(sample, origin);
  };
  auto subscriber = DdsSubscriber::Create(TestSubscriber(), callbacks);
  ASSERT_TRUE(subscriber.ok());
  const auto publisher = Publish(config, store);
  const auto other_publisher = Publish(other, other_store);
  EXPECT_TRUE(heard.WaitFor([&] {
    const std::lock_guard lock(mutex);
    return gateways == std::set<std::string>{"substation-7", "substation-8"};
  }));
}

TEST(Loopback, TheReaderSaysWhatItHadNoRoomFor) {
  const config::Config config = MakeConfig(1, 30);
  PointStore store(config);
  Published heard;
  SubscriberOptions options = TestSubscriber();
  options.max_instances = 10;
  auto subscriber = DdsSubscriber::Create(options, heard.Callbacks());
  ASSERT_TRUE(subscriber.ok());
  const auto publisher = Publish(config, store);
  ASSERT_TRUE(heard.WaitFor([&] { return heard.points.size() == 10; }));
  EXPECT_TRUE(heard.WaitFor([&] { return heard.rejected == 20; })) << heard.rejected;
}

TEST(Loopback, AnAddressThatIsNotOursIsRefused) {
  config::Config config = MakeConfig(1, 1);
  config.dds.interfaces = {"192.0.2.1"};
  const PointStore store(config);
  const auto writer = CreateFastWriter(config, store);
  ASSERT_FALSE(writer.ok());
  EXPECT_THAT(writer.error(), ::testing::HasSubstr("192.0.2.1"));
}

}  // namespace
}  // namespace baudgate::dds
