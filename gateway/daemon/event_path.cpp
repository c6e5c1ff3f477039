// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/event_path.h"

#include <algorithm>
#include <array>
#include <utility>

#include "gateway/base/log.h"

namespace baudgate {
namespace {

bool Watches(const config::Device& device, const events::Alarm& alarm) {
  const auto raises = [&](const config::EventText& text) {
    return text.alarm != config::AlarmPriority::none &&
           alarm.name.ends_with(":" + std::to_string(text.code));
  };
  if (alarm.point.empty()) {
    return device.events && std::ranges::any_of(device.event_texts, raises);
  }
  return device.point_events && std::ranges::any_of(device.points, [&](const auto& point) {
           return point.name == alarm.point &&
                  std::ranges::any_of(point.events, [&](const config::PointEvent& event) {
                    return event.alarm != config::AlarmPriority::none &&
                           events::SubjectOf(point, event) == alarm.name;
                  });
         });
}

bool Watches(const config::Config& config, const events::Alarm& alarm) {
  for (const config::Line& line : config.lines) {
    if (line.name != alarm.line) continue;
    for (const config::Device& device : line.devices) {
      if (device.name == alarm.device) return Watches(device, alarm);
    }
  }
  return false;
}

events::SourceNames SourcesOf(const config::Config& config) {
  events::SourceNames sources;
  for (const config::Line& line : config.lines) {
    for (const config::Device& device : line.devices) sources.emplace_back(line.name, device.name);
  }
  return sources;
}

events::EventLog::Options OptionsOf(const config::Config& config, const EventsPlace& place,
                                    std::shared_ptr<events::EventFeed> feed,
                                    std::function<void(events::Source)> kept) {
  events::EventLog::Options options;
  options.file = place.file;
  options.why_no_file = place.why_no_file;
  options.turn = place.turn;
  options.sources = SourcesOf(config);
  options.clocks = ReadClocks;
  options.feed = std::move(feed);
  options.tells_own = config.events.given;
  options.watches = [&config](const events::Alarm& alarm) { return Watches(config, alarm); };
  options.kept = [kept = std::move(kept)](const std::vector<events::Source>& sources) {
    for (const events::Source source : sources) kept(source);
  };
  options.warn = [](const std::string& text) { log::Warn("{}", text); };
  options.inform = [](const std::string& text) { log::Info("{}", text); };
  return options;
}

struct Fact {
  events::OwnCode code;
  const char* begins;
  const char* over;
  bool has_end = true;
};

const Fact& FactOf(News::What what) {
  using events::OwnCode;
  static constexpr std::array<Fact, 8> kFacts = {
      {{OwnCode::no_answer, "does not answer", "answers again"},
       {OwnCode::not_in_use, "taken out of use", "in use again"},
       {OwnCode::wrong_device, "not what it should be", "what it should be again"},
       {OwnCode::replaced, "another device", "", false},
       {OwnCode::port_down, "port down", "port open again"},
       {OwnCode::port_lent, "port lent to another program", "port taken back"},
       {OwnCode::collisions, "collisions", "no collisions for a minute"},
       {OwnCode::ring_open, "the ring is open", "the ring is closed again"}}};
  return kFacts[static_cast<std::size_t>(what)];
}

}  // namespace

EventPath::EventPath(const config::Config& config, const PointStore& store,
                     const EventsPlace& place, Kept kept)
    : store_(store),
      tells_own_(config.events.given),
      kept_(std::move(kept)),
      log_(OptionsOf(config, place, feed_,
                     [this](events::Source source) { kept_(source, log_.said(source), true); })) {
  for (const config::Line& line : config.lines) AddPlaces(line);
}

void EventPath::AddPlaces(const config::Line& line) {
  for (const config::Device& device : line.devices) {
    Place& its = places_.Append();
    its.line = &line;
    its.device = &device;
    if (!device.point_events) continue;
    its.watch = std::make_unique<events::DeviceWatch>(line.name, device);
  }
}

void EventPath::Renumber(const config::Config& config,
                         const std::function<const config::Line&(std::uint32_t line)>& line) {
  log_.Renumber(SourcesOf(config));
  std::size_t devices = 0;
  for (std::uint32_t i = 0; i < config.lines.size(); ++i) {
    if (devices >= places_.size()) AddPlaces(line(i));
    devices += config.lines[i].devices.size();
  }
}

void EventPath::Start() {
  log_.WhenOpened([this] { Tell(0, places_.size()); });
}

void EventPath::Tell(std::uint32_t first_device, std::size_t devices) {
  if (!log_.opened()) return;  // Start sees to it then
  const std::size_t end = std::min(first_device + devices, places_.size());
  for (std::uint32_t device = first_device; device < end; ++device) {
    if (places_[device].device->events) kept_(device, log_.said(device), false);
  }
}

void EventPath::OnReported(ReportedEvents reported) {
  const Place& place = places_[reported.device];
  auto records = events::RecordsOf(reported.batch, place.line->name, *place.device,
                                   reported.received.wall, reported.oldest);
  log_.Add(
      {reported.device, std::move(reported.batch.said), reported.batch.again, std::move(records)});
}

void EventPath::OnNews(const config::Line& line, const News& news, Now at) {
  if (!tells_own_) return;
  const Fact& fact = FactOf(news.what);
  events::EventRecord record;
  record.received = record.device_time = at.wall;
  record.clock = events::ClockQuality::gateway;
  record.line = line.name;
  if (news.device) record.device = places_[*news.device].device->name;
  record.code = events::CodeOf(fact.code);
  record.state = !fact.has_end ? config::EventState::message
                 : news.over   ? config::EventState::off
                               : config::EventState::on;
  record.text = news.over ? fact.over : fact.begins;
  if (!news.text.empty() && news.text != record.text) record.text += ": " + news.text;
  events::Shorten(record.text);
  log_.Tell(std::move(record));
}

void EventPath::OnReload(bool taken_back, const std::string& text) {
  if (!tells_own_) return;
  events::EventRecord record;
  record.received = record.device_time = ReadClocks().wall;
  record.clock = events::ClockQuality::gateway;
  record.code =
      events::CodeOf(taken_back ? events::OwnCode::taken_back : events::OwnCode::reloaded);
  record.text = text;
  events::Shorten(record.text);
  log_.Tell(std::move(record));
}

void EventPath::OnRead(std::uint32_t device, std::span<const std::uint32_t> points, Now at) {
  events::DeviceWatch* const watch = places_[device].watch.get();
  if (watch == nullptr) return;
  struct Seen {
    std::uint32_t point = 0;
    Value value;
    Quality quality;
  };
  std::vector<Seen> seen;
  store_.Read(device, [&](const DeviceRecord& record) {
    for (const std::uint32_t point : points) {
      if (!watch->Watches(point)) continue;
      seen.push_back({point, record.points[point].value, QualityAt(record, point, at.instant)});
    }
  });
  for (const Seen& one : seen) {
    for (auto& record : watch->Take(one.point, one.value, one.quality, at)) {
      log_.Tell(std::move(record));
    }
  }
}

}  // namespace baudgate
