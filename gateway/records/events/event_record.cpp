// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/event_record.h"

#include <algorithm>
#include <array>

namespace baudgate::events {
namespace {

/// Returns the last moment, not after `until`, at which the device's clock shows `said`.
WallTime LastUpTo(WallTime until, const protocols::SaidTime& said) {
  const Duration since = until.time_since_epoch() - said.time;
  Duration beyond = since % said.period;
  if (beyond < Duration::zero()) beyond += said.period;
  return until - beyond;
}

PlacedTime PlaceOne(const protocols::SaidTime& said, WallTime until, WallTime received,
                    std::optional<Duration> oldest) {
  if (said.period <= Duration::zero()) return {WallTime(said.time), ClockQuality::device};
  const WallTime last = LastUpTo(until, said);
  if (!oldest) return {last, ClockQuality::minute_guessed};
  const WallTime from = received - *oldest - kClockTolerance;
  if (last < from) return {last, ClockQuality::out_of_step};
  const bool others = last - said.period >= from;
  return {last, others ? ClockQuality::minute_guessed : ClockQuality::device};
}

}  // namespace

std::string_view Name(ClockQuality quality) {
  constexpr std::array<std::string_view, kClockQualities> kNames = {
      "none", "gateway", "device", "minute guessed", "out of step"};
  return kNames[static_cast<std::size_t>(quality)];
}

ClockQuality ClockQualityOf(std::int64_t number) {
  const bool known = number >= 0 && number < static_cast<std::int64_t>(kClockQualities);
  return known ? static_cast<ClockQuality>(number) : ClockQuality::none;
}

/// Goes from the last event to the first, because the time of a later event limits the times of
/// earlier events.
std::vector<PlacedTime> Place(const std::vector<std::optional<protocols::SaidTime>>& said,
                              WallTime received, std::optional<Duration> oldest) {
  std::vector<PlacedTime> placed(said.size());
  WallTime until = received + kClockTolerance;
  for (std::size_t i = said.size(); i-- > 0;) {
    if (!said[i]) {
      placed[i] = {received, ClockQuality::none};
      continue;
    }
    placed[i] = PlaceOne(*said[i], until, received, oldest);
    // Without the tolerance, an event whose reported time is slightly later than that of its
    // successor would be placed a minute earlier.
    const bool fits = placed[i].quality != ClockQuality::out_of_step;
    if (fits) until = std::min(until, placed[i].time + kClockTolerance);
  }
  return placed;
}

namespace {

std::string TextOf(const config::EventText* known, const std::string& said) {
  std::string text = known == nullptr ? std::string() : known->text;
  if (!said.empty()) text += (text.empty() ? "" : ": ") + said;
  Shorten(text);
  return text;
}

/// Sets the alarm of a device's event. The alarm is named "channel:code" after the event that
/// raises it; an event that ends the alarm gets the same name.
void MarkAlarm(const config::Device& device, EventRecord& record) {
  const auto& table = device.event_texts;
  const auto name = [&](std::uint32_t code) {
    return std::to_string(record.channel) + ":" + std::to_string(code);
  };
  const auto* known = config::FindEvent(table, record.channel, record.code);
  if (known != nullptr && known->alarm != config::AlarmPriority::none) {
    record.subject = name(record.code);
    record.mark = {.step = known->until ? AlarmMark::Step::raise : AlarmMark::Step::pulse,
                   .priority = known->alarm};
  } else if (const auto* ended = config::FindEndedAlarm(table, record.channel, record.code)) {
    record.subject = name(ended->code);
    record.mark = {.step = AlarmMark::Step::clear, .priority = ended->alarm};
  }
}

}  // namespace

config::AlarmPriority PriorityOf(const EventRecord& record) {
  return record.alarm ? record.alarm->priority : record.mark.priority;
}

void Shorten(std::string& text) {
  if (text.size() <= kLongestText) return;
  std::size_t size = kLongestText;
  while (size > 0 && (static_cast<unsigned char>(text[size]) & 0xC0U) == 0x80U) --size;
  text.resize(size);
}

std::vector<EventRecord> RecordsOf(const protocols::EventBatch& batch, const std::string& line,
                                   const config::Device& device, WallTime received,
                                   std::optional<Duration> oldest) {
  std::vector<std::optional<protocols::SaidTime>> said;
  for (const protocols::DeviceEvent& event : batch.events) said.push_back(event.time);
  const std::vector<PlacedTime> times = Place(said, received, oldest);
  std::vector<EventRecord> records;
  for (std::size_t i = 0; i < times.size(); ++i) {
    const protocols::DeviceEvent& event = batch.events[i];
    const auto* known = config::FindEvent(device.event_texts, event.channel, event.code);
    EventRecord& record = records.emplace_back();
    record.received = received;
    record.device_time = times[i].time;
    record.clock = times[i].quality;
    record.line = line;
    record.device = device.name;
    record.channel = event.channel;
    record.code = event.code;
    if (known != nullptr) {
      record.state = known->state;
      record.record = known->record;
    }
    record.text = TextOf(known, event.text);
    MarkAlarm(device, record);
  }
  return records;
}

}  // namespace baudgate::events
