// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/simulate/twin_events.h"

#include <vector>

#include "gateway/base/text.h"

namespace baudgate {
namespace {

constexpr std::size_t kMostAtATime = 1000;
constexpr Duration kLongest = 24h;

}  // namespace

Result<EventSchedule> ParseEventSchedule(std::string_view text) {
  const Error error{"'" + std::string(text) +
                    "' is no schedule of events; write for example every:5s, or "
                    "every:1s,count=3,numbered"};
  constexpr std::string_view kEvery = "every:";
  if (!text.starts_with(kEvery)) return error;
  const auto parts = Split(text.substr(kEvery.size()), ',');
  EventSchedule schedule;
  const auto every = ParseDuration(parts.front());
  if (!every || *every < 1ms || *every > kLongest) return error;
  schedule.every = *every;
  constexpr std::string_view kCount = "count=";
  for (std::size_t i = 1; i < parts.size(); ++i) {
    if (parts[i] == "numbered") {
      schedule.numbered = true;
      continue;
    }
    if (!parts[i].starts_with(kCount)) return error;
    const auto count = ParseInteger<std::size_t>(parts[i].substr(kCount.size()));
    if (!count || *count < 1 || *count > kMostAtATime) return error;
    schedule.count = *count;
  }
  return schedule;
}

DeviceEvent TwinEvents::Next(const config::Device& device) const {
  DeviceEvent event{0, 1, {}, {}};
  std::vector<const config::EventText*> known;
  for (const config::EventText& one : device.event_texts) {
    if (one.state != config::EventState::message) known.push_back(&one);
  }
  if (!known.empty()) {
    const config::EventText& one = *known[raised_ % known.size()];
    event.channel = one.channel.value_or(0);
    event.code = one.code;
  }
  if (schedule_.numbered) event.text = std::to_string(raised_ + 1);
  return event;
}

void TwinEvents::CatchUp(Twin& twin, const config::Device& device, Now now) {
  for (;;) {
    const Duration due = static_cast<std::int64_t>(rounds_ + 1) * schedule_.every;
    if (start_.instant + due > now.instant) return;
    ++rounds_;
    for (std::size_t i = 0; i < schedule_.count; ++i) {
      const bool taken = twin.Raise(Next(device), {start_.instant + due, start_.wall + due});
      ++(taken ? raised_ : refused_);
    }
  }
}

}  // namespace baudgate
