// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/output/event_samples.h"

#include <algorithm>

namespace baudgate::dds {

std::vector<dds::EventSample> EventSamples::Take(std::uint64_t after, std::size_t most) {
  std::vector<dds::EventSample> samples;
  if (!events_) return samples;
  for (const events::FedEvent& event : feed_->Take(static_cast<std::int64_t>(after), most)) {
    samples.push_back(SampleOf(event));
  }
  return samples;
}

std::optional<dds::EventSupply::Place> EventSamples::place() const {
  const auto cursor = cursors_ ? cursors_->Of(kConsumer) : std::nullopt;
  if (!cursor) return std::nullopt;
  return Place{static_cast<std::uint64_t>(std::max<std::int64_t>(cursor->seq, 0)), cursor->sure};
}

void EventSamples::Keep(Place place) {
  if (!cursors_) return;
  cursors_->Set(kConsumer, {static_cast<std::int64_t>(place.seq), place.sure});
}

std::vector<dds::EventSupply::Alarm> EventSamples::TakeAlarms(std::uint64_t after,
                                                              std::size_t most) {
  std::vector<Alarm> alarms;
  for (const events::AlarmBoard::Change& change : feed_->alarms().Take(after, most)) {
    const events::Alarm& alarm = change.alarm;
    dds::AlarmSample& sample = alarms.emplace_back(Alarm{change.version, {}}).sample;
    sample.gateway = gateway_;
    sample.line = alarm.line;
    sample.device = alarm.device;
    dds::AssignBounded(sample.name, alarm.name, dds::kMaxAlarmName);
    sample.point = alarm.point;
    sample.state = static_cast<std::uint16_t>(alarm.state);
    sample.priority = static_cast<std::uint16_t>(alarm.priority);
    sample.seq = static_cast<std::uint64_t>(alarm.seq);
    sample.raised_time_ns = alarm.raised.time_since_epoch() / 1ns;
    sample.changed_time_ns = alarm.changed.time_since_epoch() / 1ns;
    dds::AssignBounded(sample.text, alarm.text, dds::kMaxText);
    dds::AssignBounded(sample.acknowledged_by, alarm.by, dds::kMaxKey);
  }
  return alarms;
}

void EventSamples::OnNew(std::function<void()> wake) {
  if (const auto listener = std::exchange(listener_, std::nullopt))
    feed_->listeners().Leave(*listener);
  if (wake) listener_ = feed_->listeners().Listen(std::move(wake));
}

dds::EventSample EventSamples::SampleOf(const events::FedEvent& event) const {
  const events::EventRecord& record = event.record;
  dds::EventSample sample;
  const bool known = event.source != events::kGateway || record.device.empty();
  if (known) sample.gateway = gateway_;
  sample.device = record.device;
  sample.seq = static_cast<std::uint64_t>(record.seq);
  sample.device_time_ns = record.device_time.time_since_epoch() / 1ns;
  sample.receive_time_ns = record.received.time_since_epoch() / 1ns;
  sample.clock_quality = static_cast<std::uint16_t>(record.clock);
  sample.channel = static_cast<std::uint16_t>(std::min<std::uint32_t>(record.channel, 0xFFFF));
  sample.code = record.code;
  // A sample has no field for the line, so the text begins with it: "line bay-1: port down".
  const bool of_line = record.device.empty() && !record.line.empty();
  dds::AssignBounded(sample.text,
                     of_line ? "line " + record.line + ": " + record.text : record.text,
                     dds::kMaxText);
  return sample;
}

}  // namespace baudgate::dds
