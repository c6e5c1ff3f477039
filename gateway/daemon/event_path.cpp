// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/event_path.h"

#include <algorithm>
#include <utility>

#include "gateway/base/log.h"

namespace baudgate {
namespace {

events::EventLog::Options OptionsOf(const config::Config& config, const EventsPlace& place,
                                    std::function<void(events::Source)> kept) {
  events::EventLog::Options options;
  options.file = place.file;
  options.why_no_file = place.why_no_file;
  options.turn = place.turn;
  for (const config::Line& line : config.lines) {
    for (const config::Device& device : line.devices) {
      options.sources.emplace_back(line.name, device.name);
    }
  }
  options.clocks = ReadClocks;
  options.kept = [kept = std::move(kept)](const std::vector<events::Source>& sources) {
    for (const events::Source source : sources) kept(source);
  };
  options.warn = [](const std::string& text) { log::Warn("{}", text); };
  options.inform = [](const std::string& text) { log::Info("{}", text); };
  return options;
}

}  // namespace

bool AsksForEvents(const config::Config& config) {
  return std::ranges::any_of(config.lines, [](const config::Line& line) {
    return std::ranges::any_of(line.devices, &config::Device::events);
  });
}

EventPath::EventPath(const config::Config& config, const EventsPlace& place, Kept kept)
    : kept_(std::move(kept)), log_(OptionsOf(config, place, [this](events::Source source) {
        kept_(source, log_.said(source), true);
      })) {
  for (const config::Line& line : config.lines) {
    for (const config::Device& device : line.devices) places_.push_back({&line, &device});
  }
}

void EventPath::Start() {
  log_.WhenOpened([this] {
    for (std::uint32_t device = 0; device < places_.size(); ++device) {
      if (places_[device].device->events) kept_(device, log_.said(device), false);
    }
  });
}

void EventPath::Take(ReportedEvents reported) {
  const Place& place = places_[reported.device];
  auto records = events::RecordsOf(reported.batch, place.line->name, *place.device,
                                   reported.received.wall, reported.oldest);
  log_.Add(
      {reported.device, std::move(reported.batch.said), reported.batch.again, std::move(records)});
}

}  // namespace baudgate
