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

// TakingThread is the thread on which a subscriber takes its samples. It rests after each take,
// because each take makes Fast DDS 2.9 walk through all instances: without rests, the thread could
// not keep up.

/// Returns the rest after a take: nine times the duration of the take, at most 50 ms. So samples of
/// a few points are taken immediately, and those of thousands of points in batches.
Duration RestAfter(Duration round);

class TakingThread {
 public:
  /// `round` takes all samples, and returns how long the library was busy.
  explicit TakingThread(std::function<Duration()> round);

  void Stop() { worker_.Stop(); }  ///< ends the thread; `round` does not run after this
  /// To be called when samples have arrived. Any thread may call it; it never waits for a take.
  void Wake();

 private:
  Instant Take();

  const std::function<Duration()> round_;
  std::atomic<bool> work_ = false;
  Instant rests_until_{};
  Worker worker_;
};

enum class Gone : std::uint8_t {
  disposed,  ///< a writer has disposed the instance; gateways never do
  /// The gateway has left, or was silent for its lease. After an orderly stop, the last samples
  /// have the quality "not connected" (0x08).
  no_writers,
};

struct SubscriberOptions {
  ParticipantOptions participant{.domain = 0, .interfaces = {"127.0.0.1"}};
  /// Most points that are stored; samples of further points are rejected.
  std::size_t max_instances = 100'000;
};

/// The callbacks are called one at a time, on a thread of the subscriber. Their arguments are valid
/// during the call.
struct SubscriberCallbacks {
  std::function<void(const PointSample&, const Origin&)> on_point;
  /// Called when a point is gone. Only the sample's key is valid; its other fields are those of the
  /// last sample.
  std::function<void(const PointSample&, Gone)> on_point_gone;
  std::function<void(const DeviceSample&, const Origin&)> on_device;
  std::function<void(const DeviceSample&, Gone)> on_device_gone;
  /// Called when a gateway has started; the sample contains the time of the start and the version.
  std::function<void(const GatewaySample&, const Origin&)> on_gateway{};
  std::function<void(const GatewaySample&, Gone)> on_gateway_gone{};
  std::function<void(int gateways)> on_gateways;
  /// Called when the last writer of a participant that publishes points has left, or was silent for
  /// its lease.
  std::function<void(const PublisherId&)> on_publisher_left;
  /// Called with the number of samples of points that were lost so far because max_instances is too
  /// small.
  std::function<void(std::uint64_t samples)> on_rejected;
  /// Called with the newest events of each device, at most 1000, then with each new event. An event
  /// can come twice, with the same `seq`. Null: events are not subscribed to.
  std::function<void(const EventSample&, const Origin&)> on_event{};
  /// Called with the present state of each alarm, then after each change; state 0: the alarm is
  /// over and acknowledged. Null: alarms are not subscribed to.
  std::function<void(const AlarmSample&, const Origin&)> on_alarm{};
  std::function<void(const AlarmSample&, Gone)> on_alarm_gone{};
};

/// Counts of all topics since the start.
struct SubscriberCounters {
  std::uint64_t takes = 0;    ///< calls of take that returned samples
  std::uint64_t refused = 0;  ///< samples with a text beyond its bound, or in an unknown encoding
};

class DdsSubscriber {
 public:
  static Result<std::unique_ptr<DdsSubscriber>> Create(const SubscriberOptions& options,
                                                       SubscriberCallbacks callbacks);
  ~DdsSubscriber();  ///< no callback runs after this

  DatagramCounters datagrams() const;
  SubscriberCounters counters() const;

 private:
  struct Impl;
  explicit DdsSubscriber(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace baudgate::dds
