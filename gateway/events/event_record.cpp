// SPDX-License-Identifier: Apache-2.0
#include "gateway/events/event_record.h"

namespace baudgate::events {
namespace {

std::string TextOf(const config::EventText* known, const std::string& said) {
  std::string text = known == nullptr ? std::string() : known->text;
  if (!said.empty()) text += (text.empty() ? "" : ": ") + said;
  if (text.size() > kLongestText) text.resize(kLongestText);
  return text;
}

}  // namespace

std::vector<EventRecord> RecordsOf(const EventBatch& batch, const std::string& line,
                                   const config::Device& device, WallTime received,
                                   std::optional<Duration> oldest) {
  std::vector<std::optional<SaidTime>> said;
  for (const DeviceEvent& event : batch.events) said.push_back(event.time);
  const std::vector<PlacedTime> times = Place(said, received, oldest);
  std::vector<EventRecord> records;
  for (std::size_t i = 0; i < times.size(); ++i) {
    const DeviceEvent& event = batch.events[i];
    const auto* known = config::FindEvent(device.event_texts, event.channel, event.code);
    EventRecord& record = records.emplace_back();
    record.received = received;
    record.device_time = times[i].time;
    record.clock = times[i].quality;
    record.line = line;
    record.device = device.name;
    record.channel = event.channel;
    record.code = event.code;
    if (known != nullptr) record.state = known->state;
    record.text = TextOf(known, event.text);
  }
  return records;
}

}  // namespace baudgate::events
