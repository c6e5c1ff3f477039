// Fixtures of the DDS tests. `Published` collects the samples that subscribers receive.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <condition_variable>
#include <functional>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "config/model/config.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/outputs/dds/fast/fast_writer.h"
#include "gateway/outputs/dds/fast/subscriber.h"
#include "gateway/outputs/dds/link/link_server.h"
#include "gateway/outputs/dds/publisher.h"

namespace baudgate::dds::testing {

/// Returns a domain that depends on the process id, so that test processes that run at the same
/// time rarely share a domain.
inline int TestDomain() { return 100 + static_cast<int>(::getpid() % 100); }

inline config::Config MakeConfig(std::size_t devices, std::size_t points_each) {
  config::Config config;
  config.name = "substation-7";
  config.dds.domain = TestDomain();
  config::Line line;
  line.name = "bay";
  for (std::size_t d = 0; d < devices; ++d) {
    config::Device device;
    device.name = "feeder-" + std::to_string(d);
    for (std::size_t p = 0; p < points_each; ++p) {
      config::Point point;
      point.name = "p" + std::to_string(p);
      point.unit = "A";
      device.points.push_back(point);
    }
    line.devices.push_back(device);
  }
  config.lines.push_back(line);
  return config;
}

inline void Set(bus::PointStore& store, std::uint32_t device, std::uint32_t point, Value value,
                Quality quality = Quality::good) {
  const bus::Sample sample{point, std::move(value), quality};
  store.Update(device, std::span(&sample, 1), ReadClocks(), 5ms);
}

class Published {
 public:
  using Key = std::pair<std::string, std::string>;

  SubscriberCallbacks Callbacks() {
    return {.on_point =
                [this](const PointSample& s, const Origin& origin) {
                  Note([&] {
                    points[{s.device, s.point}] = s, ++samples, writers.insert(origin.writer);
                  });
                },
            .on_point_gone =
                [this](const PointSample& s, Gone why) {
                  Note([&] { gone[{s.device, s.point}] = why, points.erase({s.device, s.point}); });
                },
            .on_device = [this](const DeviceSample& s,
                                const Origin&) { Note([&] { devices[s.device] = s; }); },
            .on_device_gone =
                [this](const DeviceSample& s, Gone why) {
                  Note([&] { devices_gone[s.device] = why, devices.erase(s.device); });
                },
            .on_gateway = [this](const GatewaySample& s,
                                 const Origin&) { Note([&] { starts[s.gateway] = s; }); },
            .on_gateway_gone = [this](const GatewaySample& s,
                                      Gone) { Note([&] { starts.erase(s.gateway); }); },
            .on_gateways = [this](int count) { Note([&] { gateways = count; }); },
            .on_publisher_left =
                [this](const PublisherId& id) { Note([&] { publishers_left.insert(id); }); },
            .on_rejected = [this](std::uint64_t count) { Note([&] { rejected = count; }); }};
  }

  bool WaitFor(const std::function<bool()>& condition) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::seconds(20), condition);
  }

  // Threads of Fast DDS change these members. Read them inside WaitFor, or when all publishers have
  // ended.
  std::map<Key, PointSample> points;
  std::map<Key, Gone> gone;
  std::map<std::string, DeviceSample> devices;
  std::map<std::string, Gone> devices_gone;
  std::map<std::string, GatewaySample> starts;
  std::set<WriterId> writers;
  std::set<PublisherId> publishers_left;
  int gateways = 0;
  std::size_t samples = 0;
  std::uint64_t rejected = 0;

 private:
  void Note(const std::function<void()>& change) {
    {
      const std::lock_guard lock(mutex_);
      change();
    }
    changed_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable changed_;
};

inline SubscriberOptions TestSubscriber() {
  return {.participant = {.domain = TestDomain(), .interfaces = {"127.0.0.1"}}};
}

/// Writes samples as the gateway does, and passes them encoded to a LinkServer, the receiving end
/// in the DDS process.
class ThroughLink : public SampleWriter {
 public:
  explicit ThroughLink(std::unique_ptr<SampleWriter> writer)
      : held_(std::move(writer)), writer_(held_.get()) {
    EXPECT_TRUE(server_.Take(EncodeOpen({})));
    server_.Answer(Instant());
  }
  Sent Write(const PointSample& sample) override { return Put(LinkKind::point, sample); }
  Sent Write(const DeviceSample& sample) override { return Put(LinkKind::device, sample); }
  Sent Write(const GatewaySample& sample) override { return Put(LinkKind::gateway, sample); }
  bool WaitAcknowledged(Duration) override {
    writer_ = nullptr;
    while (const auto next = server_.Leave(ReadClocks().instant)) {
      std::this_thread::sleep_until(*next);
    }
    return server_.Answer(ReadClocks().instant) == EncodeBare(LinkKind::left);
  }
  Sent Reopen(const Room& room) override {
    LinkOpen open;
    open.room = room;
    EXPECT_TRUE(server_.Take(EncodeOpen(open)));
    server_.Answer(ReadClocks().instant);
    return Sent::yes;
  }
  Subscribers subscribers() const override {
    const SampleWriter* const writer = writer_;
    return writer == nullptr ? Subscribers{} : writer->subscribers();
  }
  DatagramCounters datagrams() const override {
    const SampleWriter* const writer = writer_;
    return writer == nullptr ? DatagramCounters{} : writer->datagrams();
  }
  std::uint64_t session() const override {
    const SampleWriter* const writer = writer_;
    return writer == nullptr ? 0 : writer->session();
  }

 private:
  template <typename Sample>
  Sent Put(LinkKind kind, const Sample& sample) {
    Bytes packet(kMaxLinkMessage);
    packet.resize(EncodeSample(kind, sample, packet));
    EXPECT_TRUE(server_.Take(packet));
    return Sent::yes;
  }

  // Empty once `server_` has opened the link and taken the writer.
  std::unique_ptr<SampleWriter> held_;
  std::atomic<SampleWriter*> writer_;
  LinkServer server_{[this](const LinkOpen&) { return Result(std::move(held_)); }};
};

inline std::unique_ptr<DdsPublisher> Publish(const config::Config& config, bus::PointStore& store) {
  auto writer = CreateFastWriter(config, store);
  EXPECT_TRUE(writer.ok()) << writer.error();
  if (!writer.ok()) return nullptr;
  auto publisher =
      DdsPublisher::Create(config, store, std::make_unique<ThroughLink>(std::move(*writer)));
  EXPECT_TRUE(publisher.ok()) << publisher.error();
  return publisher.ok() ? std::move(*publisher) : nullptr;
}

}  // namespace baudgate::dds::testing
