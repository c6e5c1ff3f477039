// Who takes events out of a gateway, in a run under virtual time: DDS with a subscriber behind it,
// and a Modbus client that reads the ring. Both stay while the gateway dies; each checks that it
// has got 1, 2, 3 … once and in order.
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
  /// The gateway starts; its events are kept there.
  void Begin(EventKeeper& keeper);
  /// Some of what is there now; some samples are still on their way then.
  void Take(std::mt19937& random);
  /// All samples arrive and are confirmed, as far as the gateway has them.
  void End();
  /// The gateway was killed: what was on its way is lost.
  void Kill();

  std::int64_t of_dds() const { return subscriber_; }     ///< the last that it has got
  std::int64_t of_modbus() const { return wanted_ - 1; }  ///< likewise
  std::size_t again = 0;  ///< samples that the subscriber had, and knew by their numbers

 private:
  void Send();
  void Arrive(std::size_t count);
  void ReadRing();

  /// As many as the library keeps of a device, at most.
  static constexpr std::size_t kOnTheWay = 500;

  std::shared_ptr<events::EventFeed> feed_;
  std::shared_ptr<events::CursorBook> cursors_;
  std::unique_ptr<dds::EventSamples> samples_;
  std::optional<dds::EventSender> sender_;
  std::deque<std::int64_t> on_the_way_;
  std::int64_t subscriber_ = 0;
  std::int64_t wanted_ = 1;
  bool may_repeat_ = false;  ///< the gateway has not ended in order before
};

}  // namespace baudgate::protocols
