// A subscriber to everything that gateways publish: samples come from any gateway of a DDS domain
// and go to callbacks as plain structs. Used by `baudgate watch` and by tests. TakingThread takes
// the samples.
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

// The thread on which a subscriber takes its samples. Fast DDS 2.9 walks through all instances with
// every take: a thread that takes at each sample would fall behind, so it rests after each take.

/// Nine times as long as the last round took, and 50 ms at most: a few points are taken at once,
/// thousands in lots.
Duration RestAfter(Duration round);

class TakingThread {
 public:
  /// `round` takes what is there; it returns how long the library was busy with it.
  explicit TakingThread(std::function<Duration()> round);

  void Stop() { worker_.Stop(); }  ///< `round` does not run after it
  /// There is something to take. From any thread, never waits for a round.
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
  disposed,  ///< somebody said so; gateways do not
  /// Its gateway has left, or has not been heard of for its lease. When it stopped in an
  /// orderly way, its last samples are not connected (0x08).
  no_writers,
};

struct SubscriberOptions {
  ParticipantOptions participant{.domain = 0, .interfaces = {"127.0.0.1"}};
  std::size_t max_instances = 100'000;  ///< points; those beyond are counted as rejected
};

/// Called one at a time, on a thread of the subscriber's own; what they are given lives during the
/// call.
struct SubscriberCallbacks {
  std::function<void(const PointSample&, const Origin&)> on_point;
  /// Only the key of the sample is meant; its other fields are those of the last sample.
  std::function<void(const PointSample&, Gone)> on_point_gone;
  std::function<void(const DeviceSample&, const Origin&)> on_device;
  std::function<void(const DeviceSample&, Gone)> on_device_gone;
  /// When it was started, and as what.
  std::function<void(const GatewaySample&, const Origin&)> on_gateway{};
  std::function<void(const GatewaySample&, Gone)> on_gateway_gone{};
  std::function<void(int gateways)> on_gateways;  ///< publishers of points connected now
  /// A publisher of points has left, or has not been heard of for the lease.
  std::function<void(const PublisherId&)> on_publisher_left;
  /// Samples of points lost so far because max_instances is too small.
  std::function<void(std::uint64_t samples)> on_rejected;
  /// Up to the newest thousand of each device, then each as it comes; one may come twice, by its
  /// number. Null: they are not subscribed to.
  std::function<void(const EventSample&, const Origin&)> on_event{};
  /// Each as it is, then whenever it has changed; state 0 is over. Null: they are not subscribed
  /// to.
  std::function<void(const AlarmSample&, const Origin&)> on_alarm{};
  std::function<void(const AlarmSample&, Gone)> on_alarm_gone{};
};

/// Since the beginning, of all topics.
struct SubscriberCounters {
  std::uint64_t takes = 0;    ///< that the library was asked for samples and had some
  std::uint64_t refused = 0;  ///< samples beyond their bounds, or in an unknown encoding
};

class DdsSubscriber {
 public:
  static Result<std::unique_ptr<DdsSubscriber>> Create(const SubscriberOptions& options,
                                                       SubscriberCallbacks callbacks);
  ~DdsSubscriber();  ///< no callback runs after it

  /// From any thread.
  DatagramCounters datagrams() const;
  SubscriberCounters counters() const;

 private:
  struct Impl;
  explicit DdsSubscriber(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace baudgate::dds
