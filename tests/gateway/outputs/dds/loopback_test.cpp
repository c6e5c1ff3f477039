// Tests of publisher and subscriber over loopback with the real Fast DDS.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <future>

#include "gateway/base/text.h"
#include "gateway/outputs/dds/fast/subscriber.h"
#include "gateway/outputs/dds/fast/types.h"
#include "gateway/outputs/dds/published_types.h"
#include "gateway/outputs/dds/publisher.h"
#include "tests/gateway/outputs/dds/fixture.h"
#include "tests/gateway/outputs/dds/raw_writer.h"

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
  bus::PointStore store(config);
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
  store.UpdateStatus(0, [](bus::DeviceStatus& status) { status.state = bus::DeviceState::online; });
  EXPECT_TRUE(heard.WaitFor([&] { return heard.devices["feeder-0"].state == 1; }));
}

TEST(Loopback, TwoThousandPointsArriveWhole) {
  const config::Config config = MakeConfig(20, 100);
  bus::PointStore store(config);
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

TEST(Loopback, ALargeGatewayArrivesCompleteAsOneGateway) {
  const config::Config config = MakeConfig(90, 100);
  bus::PointStore store(config);
  Published heard;
  const auto subscriber = Subscribe(heard);
  auto publisher = Publish(config, store);
  ASSERT_TRUE(heard.WaitFor([&] { return heard.points.size() == 9000; }));
  EXPECT_TRUE(heard.WaitFor([&] { return heard.gateways == 1; }));
  EXPECT_EQ(publisher->counters().subscribers.points, 1U);
  publisher.reset();
  EXPECT_TRUE(heard.WaitFor([&] { return heard.gone.size() == 9000 && heard.gateways == 0; }));
}

TEST(Loopback, ALateSubscriberGetsTheLatestSampleOfAllPoints) {
  const config::Config config = MakeConfig(4, 100);
  bus::PointStore store(config);
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

TEST(Loopback, AnOrderlyStopSendsFinalSamplesWithQualityNotConnected) {
  const config::Config config = MakeConfig(2, 50);
  bus::PointStore store(config);
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

TEST(Loopback, ReloadedOutDevicesAreGoneForPresentAndLateSubscribers) {
  const config::Config config = MakeConfig(2, 3);
  bus::PointStore store(config);
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
    store.Append(std::make_shared<const config::Line>(line));
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

TEST(Loopback, ASubscriberReceivesTheStartTimeOfTheGateway) {
  const config::Config config = MakeConfig(1, 1);
  bus::PointStore store(config);
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

TEST(Loopback, ALostWriterIsReportedAsNoWriters) {
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

TEST(Loopback, GatewaysOfADomainAreDistinguished) {
  const config::Config config = MakeConfig(1, 1);
  config::Config other = config;
  other.name = "substation-8";
  bus::PointStore store(config);
  bus::PointStore other_store(other);
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

TEST(Loopback, TheReaderCountsSamplesWithoutRoom) {
  const config::Config config = MakeConfig(1, 30);
  bus::PointStore store(config);
  Published heard;
  SubscriberOptions options = TestSubscriber();
  options.max_instances = 10;
  auto subscriber = DdsSubscriber::Create(options, heard.Callbacks());
  ASSERT_TRUE(subscriber.ok());
  const auto publisher = Publish(config, store);
  ASSERT_TRUE(heard.WaitFor([&] { return heard.points.size() == 10; }));
  EXPECT_TRUE(heard.WaitFor([&] { return heard.rejected == 20; })) << heard.rejected;
}

TEST(Loopback, AnInterfaceAddressOfAnotherMachineIsRefused) {
  config::Config config = MakeConfig(1, 1);
  config.dds.interfaces = {"192.0.2.1"};
  const bus::PointStore store(config);
  const auto writer = CreateFastWriter(config, store);
  ASSERT_FALSE(writer.ok());
  EXPECT_THAT(writer.error(), ::testing::HasSubstr("192.0.2.1"));
}

TEST(KeyHash, MatchesTheHashOfOtherVendors) {
  PointSample point;
  point.gateway = "sub-7", point.device = "feeder-1", point.point = "current_l1";
  EXPECT_EQ(ToHex(HashKey(point)), "DE 56 C3 97 F6 81 9A 85 FD B6 E3 03 A4 F1 59 7F");
  point.value = 7;
  EXPECT_EQ(ToHex(HashKey(point)), "DE 56 C3 97 F6 81 9A 85 FD B6 E3 03 A4 F1 59 7F");
  DeviceSample device;
  device.gateway = "sub-7", device.device = "feeder-1";
  EXPECT_EQ(ToHex(HashKey(device)), "85 15 01 FE B4 1F 4A E8 6E 90 8F F1 06 94 FA 6B");
  GatewaySample gateway;
  gateway.gateway = "sub-7", gateway.start_time_ns = 7;
  EXPECT_EQ(ToHex(HashKey(gateway)), "2C C4 20 7D 86 5D 85 C9 56 B2 53 AC 57 6B 24 86");
  RequestSample request;
  request.gateway = "sub-7", request.client = "plc-1", request.seq = 7;
  EXPECT_EQ(ToHex(HashKey(request)), "95 F9 18 16 00 1F 3F F8 E6 FC 89 D5 9D 2B 83 E7");
  ReplySample reply;
  reply.gateway = "sub-7", reply.client = "plc-1";
  EXPECT_EQ(HashKey(reply), HashKey(request));
}

using testing::RawWriter;

PointSample Named(std::string point, std::uint64_t seq) {
  PointSample sample;
  sample.gateway = "g", sample.device = "d", sample.point = std::move(point), sample.seq = seq;
  return sample;
}

Bytes Encoded(const PointSample& sample) {
  Bytes bytes(kMaxBytes<PointSample>);
  bytes.resize(Encode(sample, bytes));
  return bytes;
}

TEST(Subscriber, FiveThousandPointsAreReadInAFewTakes) {
  constexpr std::size_t kPoints = 5000;
  Published heard;
  std::promise<void> first;
  std::promise<void> go_on;
  SubscriberCallbacks callbacks = heard.Callbacks();
  callbacks.on_point = [&, note = callbacks.on_point](const PointSample& sample,
                                                      const Origin& origin) {
    if (sample.seq == 0) first.set_value(), go_on.get_future().wait();
    note(sample, origin);
  };
  auto writer = CreateFastWriter(TestSubscriber().participant, {.points = kPoints, .devices = 1});
  ASSERT_TRUE(writer.ok()) << writer.error();
  const auto subscriber = DdsSubscriber::Create(TestSubscriber(), callbacks);
  ASSERT_TRUE(subscriber.ok()) << subscriber.error();
  ASSERT_EQ((*writer)->Write(Named("p0", 0)), Sent::yes);
  first.get_future().wait();
  for (std::size_t i = 0; i < kPoints; ++i) {
    ASSERT_EQ((*writer)->Write(Named("p" + std::to_string(i), 1)), Sent::yes);
  }
  EXPECT_TRUE((*writer)->WaitAcknowledged(20s));
  go_on.set_value();
  ASSERT_TRUE(heard.WaitFor([&] { return heard.samples == 1 + kPoints; }));
  EXPECT_EQ(heard.points.size(), kPoints);
  EXPECT_LE((*subscriber)->counters().takes, 1U + 2U);
  EXPECT_EQ((*subscriber)->counters().refused, 0U);
}

TEST(Subscriber, UndecodableSamplesAreCountedAndNotShown) {
  Published heard;
  const auto subscriber = DdsSubscriber::Create(TestSubscriber(), heard.Callbacks());
  ASSERT_TRUE(subscriber.ok()) << subscriber.error();
  RawWriter writer(kPointTopic, "baudgate::v1::PointSample");
  Bytes strange = Encoded(Named("strange", 1));
  strange[1] = 3;
  Bytes cut = Encoded(Named("cut", 1));
  cut.pop_back();
  Bytes over_long = Encoded(Named(std::string(kMaxKey, 'x'), 1));
  const auto name = std::search_n(over_long.begin(), over_long.end(), kMaxKey, 'x');
  *(name - 4) += 1;
  *(name + kMaxKey) = 'x';
  for (const Bytes& bytes : {strange, cut, over_long, Encoded(Named("good", 1))}) {
    ASSERT_TRUE(writer.Write(bytes));
  }
  ASSERT_TRUE(heard.WaitFor([&] { return heard.samples == 1; }));
  ASSERT_TRUE(writer.Write(Encoded(Named("good too", 1))));
  ASSERT_TRUE(heard.WaitFor([&] { return heard.samples == 2; }));
  EXPECT_EQ((*subscriber)->counters().refused, 3U);
  EXPECT_TRUE(heard.points.contains({"d", "good"}));
}

TEST(Subscriber, NamesTheWriterAndReportsItsLeaving) {
  Published heard;
  const auto subscriber = DdsSubscriber::Create(TestSubscriber(), heard.Callbacks());
  ASSERT_TRUE(subscriber.ok()) << subscriber.error();
  auto writer = std::make_unique<RawWriter>(kPointTopic, "baudgate::v1::PointSample");
  ASSERT_TRUE(writer->Write(Encoded(Named("p", 1))));
  ASSERT_TRUE(heard.WaitFor([&] { return heard.writers.size() == 1; }));
  const WriterId id = *heard.writers.begin();
  EXPECT_EQ(Text(id), writer->guid());
  EXPECT_EQ(Text(id.publisher), writer->guid().substr(0, writer->guid().find('|')));
  writer.reset();
  EXPECT_TRUE(heard.WaitFor([&] { return heard.publishers_left.contains(id.publisher); }));
}

}  // namespace
}  // namespace baudgate::dds
