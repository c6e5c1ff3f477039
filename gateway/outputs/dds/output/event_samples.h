// `EventSamples` converts the events and alarms of gateway/records/events into the samples that
// gateway/outputs/dds publishes.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "gateway/outputs/dds/notice_sender.h"
#include "gateway/records/events/event_feed.h"

namespace baudgate::dds {

class EventSamples final : public dds::EventSupply {
 public:
  /// The name of DDS in the CursorBook, which stores for each output the last event that was sent.
  static constexpr char kConsumer[] = "dds";

  /// `events` false: only alarms are supplied, because the events are not stored and their numbers
  /// restart at each start. `cursors` null: the number of the last sent event is not stored.
  EventSamples(std::string gateway, std::shared_ptr<events::EventFeed> feed,
               std::shared_ptr<events::CursorBook> cursors, bool events = true)
      : gateway_(std::move(gateway)),
        feed_(std::move(feed)),
        cursors_(std::move(cursors)),
        events_(events) {}
  ~EventSamples() override { OnNew({}); }

  std::vector<dds::EventSample> Take(std::uint64_t after, std::size_t most) override;
  std::uint64_t newest() const override {
    return events_ ? static_cast<std::uint64_t>(feed_->newest()) : 0;
  }
  std::optional<Place> place() const override;
  void Keep(Place place) override;
  std::vector<Alarm> TakeAlarms(std::uint64_t after, std::size_t most) override;
  void OnNew(std::function<void()> wake) override;

 private:
  dds::EventSample SampleOf(const events::FedEvent& event) const;

  const std::string gateway_;
  const std::shared_ptr<events::EventFeed> feed_;
  const std::shared_ptr<events::CursorBook> cursors_;
  const bool events_;
  std::optional<events::FeedListeners::Listener> listener_;
};

}  // namespace baudgate::dds
