// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/event_path.h"

#include <array>
#include <utility>

#include "gateway/base/log.h"

namespace baudgate {
namespace {

events::EventLog::Options OptionsOf(const config::Config& config, const EventsPlace& place,
                                    std::function<void(std::uint32_t)> kept) {
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
  options.tells_own = config.events.given;
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

EventPath::EventPath(const config::Config& config, const EventsPlace& place,
                     std::function<void(std::uint32_t)> kept)
    : tells_own_(config.events.given), log_(OptionsOf(config, place, std::move(kept))) {
  for (const config::Line& line : config.lines) {
    for (const config::Device& device : line.devices) places_.push_back({&line, &device});
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
  if (record.text.size() > events::kLongestText) record.text.resize(events::kLongestText);
  log_.Tell(std::move(record));
}

void EventPath::OnRead(std::uint32_t, std::span<const std::uint32_t>, Now) {}

}  // namespace baudgate
