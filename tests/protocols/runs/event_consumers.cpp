// SPDX-License-Identifier: Apache-2.0
#include "tests/protocols/runs/event_consumers.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace baudgate::protocols {

void EventConsumers::Begin(EventKeeper& keeper) {
  feed_ = std::make_shared<events::EventFeed>();
  cursors_ =
      std::make_shared<events::CursorBook>(std::set<std::string>{dds::EventSamples::kConsumer});
  samples_ = std::make_unique<dds::EventSamples>("plant", feed_, cursors_);
  sender_.emplace(samples_.get());
  keeper.SetFeed(feed_, cursors_);
}

void EventConsumers::Take(std::mt19937& random) {
  Send();
  Arrive(random() % (on_the_way_.size() + 1));
  if (on_the_way_.size() > kOnTheWay) Arrive(on_the_way_.size() - kOnTheWay);
  ReadRing();
}

void EventConsumers::Send() {
  while (const dds::EventSample* sample = sender_->Next()) {
    on_the_way_.push_back(static_cast<std::int64_t>(sample->seq));
    sender_->OnSent();
    if (on_the_way_.size() > kOnTheWay) return;
  }
}

void EventConsumers::Arrive(std::size_t count) {
  for (; count > 0; --count) {
    const std::int64_t seq = on_the_way_.front();
    on_the_way_.pop_front();
    if (seq <= subscriber_) {
      ++again;
      EXPECT_TRUE(may_repeat_) << "event " << seq << " twice without a kill";
    } else {
      EXPECT_EQ(seq, subscriber_ + 1) << "lost on DDS";
      subscriber_ = seq;
    }
  }
}

/// Reads the event registers as docs/modbus.md describes: seven events at a time, beginning with
/// the first unread event.
void EventConsumers::ReadRing() {
  for (;;) {
    const auto shown = feed_->Show(std::nullopt, static_cast<std::uint32_t>(wanted_), 7);
    EXPECT_EQ(shown.lost, 0U);
    for (const events::EventRecord& event : shown.events) {
      EXPECT_EQ(event.seq, wanted_) << "in the ring";
      wanted_ = event.seq + 1;
    }
    if (shown.events.size() < 7) return;
  }
}

void EventConsumers::End() {
  do {
    Send();
    Arrive(on_the_way_.size());
  } while (sender_->Next() != nullptr);
  ReadRing();
  sender_->Confirm();
  const auto kept = cursors_->Of(dds::EventSamples::kConsumer);
  may_repeat_ = !kept || !kept->sure;
}

void EventConsumers::Kill() {
  on_the_way_.clear();
  may_repeat_ = true;
}

}  // namespace baudgate::protocols
