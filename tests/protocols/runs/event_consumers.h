// EventConsumers simulates the consumers of events in a run in virtual time: DDS with a subscriber,
// and a Modbus client that reads the event registers. They survive restarts of the gateway. Each
// consumer checks that it receives the event numbers 1, 2, 3 … once and in order.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <random>

#include "gateway/outputs/dds/notice_sender.h"
#include "gateway/outputs/dds/output/event_samples.h"
#include "gateway/records/events/event_feed.h"
#include "tests/protocols/runs/event_keeper.h"

namespace baudgate::protocols {

class EventConsumers {
 public:
  void Begin(EventKeeper& keeper);
  void Take(std::mt19937& random);
  void End();
  /// Call this when the gateway is killed: undelivered samples are lost.
  void Kill();

  /// The last event that the subscriber received.
  std::int64_t of_dds() const { return subscriber_; }
  /// The last event that the Modbus client read.
  std::int64_t of_modbus() const { return wanted_ - 1; }
  std::size_t again = 0;  ///< number of samples that the subscriber received again

 private:
  void Send();
  void Arrive(std::size_t count);
  void ReadRing();

  /// The most undelivered samples that the simulated DDS library stores for one device.
  static constexpr std::size_t kOnTheWay = 500;

  std::shared_ptr<events::EventFeed> feed_;
  std::shared_ptr<events::CursorBook> cursors_;
  std::unique_ptr<dds::EventSamples> samples_;
  std::optional<dds::EventSender> sender_;
  std::deque<std::int64_t> on_the_way_;
  std::int64_t subscriber_ = 0;
  std::int64_t wanted_ = 1;
  bool may_repeat_ = false;
};

}  // namespace baudgate::protocols
