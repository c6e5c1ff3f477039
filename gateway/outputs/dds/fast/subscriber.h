// `DdsSubscriber` subscribes to everything that the gateways of a DDS domain publish, and passes
// the samples to callbacks. `baudgate watch` and tests use it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>
#include <memory>

#include "gateway/base/result.h"
#include "gateway/base/worker.h"
#include "gateway/outputs/dds/domain.h"
#include "gateway/outputs/dds/fast/datagram_check.h"
#include "gateway/outputs/dds/samples.h"

namespace baudgate::dds {

// The thread on which a subscriber takes its samples. It rests after each take, because Fast DDS
// 2.9 walks through all instances with every take: a thread that takes at each sample would fall
// behind.

/// Nine times the last round, at most 50 ms: a few points are taken at once, thousands in batches.
Duration RestAfter(Duration round);

class TakingThread {
 public:
  /// `round` takes what is there, and returns how long the library was busy.
  explicit TakingThread(std::function<Duration()> round);

  void Stop() { worker_.Stop(); }  ///< `round` does not run after this
  /// There is something to take. Any thread may call it; it never waits for a round.
  void Wake();

 private:
  Instant Take();

  const std::function<Duration()> round_;
  std::atomic<bool> work_ = false;
  Instant rests_until_{};
  Worker worker_;
};

/// Why there will be no more samples of a point or device.
enum class Gone : std::uint8_t {
  disposed,  ///< a writer has disposed it; gateways never do
  /// Its gateway has left, or was silent for its lease. After an orderly stop, the last samples
  /// have the quality "not connected" (0x08).
  no_writers,
};

struct SubscriberOptions {
  ParticipantOptions participant{.domain = 0, .interfaces = {"127.0.0.1"}};
  std::size_t max_instances = 100'000;  ///< of points; samples beyond are counted as rejected
};

/// Called one at a time, on a thread of the subscriber. The arguments are valid during the call.
struct SubscriberCallbacks {
  std::function<void(const PointSample&, const Origin&)> on_point;
  /// Only the key of the sample is valid; its other fields are those of the last sample.
  std::function<void(const PointSample&, Gone)> on_point_gone;
  std::function<void(const DeviceSample&, const Origin&)> on_device;
  std::function<void(const DeviceSample&, Gone)> on_device_gone;
  /// The start of a gateway: its time and version.
  std::function<void(const GatewaySample&, const Origin&)> on_gateway{};
  std::function<void(const GatewaySample&, Gone)> on_gateway_gone{};
  /// Number of publishers of points that are connected now.
  std::function<void(int gateways)> on_gateways;
  /// A publisher of points has left, or was silent for its lease.
  std::function<void(const PublisherId&)> on_publisher_left;
  /// Samples of points that were lost so far because max_instances is too small.
  std::function<void(std::uint64_t samples)> on_rejected;
  /// First the newest events of each device, at most 1000, then each new one. An event may come
  /// twice, with the same `seq`. Null: events are not subscribed to.
  std::function<void(const EventSample&, const Origin&)> on_event{};
  /// First each alarm in its present state, then changes; state 0 is over. Null: alarms are not
  /// subscribed to.
  std::function<void(const AlarmSample&, const Origin&)> on_alarm{};
  std::function<void(const AlarmSample&, Gone)> on_alarm_gone{};
};

/// Counts since the start, of all topics.
struct SubscriberCounters {
  std::uint64_t takes = 0;    ///< calls of take that returned samples
  std::uint64_t refused = 0;  ///< samples longer than their bounds, or in an unknown encoding
};

class DdsSubscriber {
 public:
  static Result<std::unique_ptr<DdsSubscriber>> Create(const SubscriberOptions& options,
                                                       SubscriberCallbacks callbacks);
  ~DdsSubscriber();  ///< no callback runs after this

  /// Any thread may call these.
  DatagramCounters datagrams() const;
  SubscriberCounters counters() const;

 private:
  struct Impl;
  explicit DdsSubscriber(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace baudgate::dds
