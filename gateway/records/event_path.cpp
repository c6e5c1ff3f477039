// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/event_path.h"

#include <optional>
#include <set>
#include <utility>

#include "gateway/base/log.h"
#include "gateway/base/text.h"
#include "gateway/bus/devices/device_health.h"
#include "gateway/records/events/event_queue.h"
#include "gateway/records/events/own_records.h"
#include "protocols/modbus_pdu/modbus_pdu.h"

namespace baudgate::records {

namespace {

using events::OwnAlarms;
using events::Trouble;

/// Two requests to a unit without a reply raise its alarm if the second comes at least this long
/// after the first.
constexpr Duration kLongSilence = 30s;
/// AlarmService forgets a unit that no client has addressed for this time.
constexpr Duration kForgotten = 1h;

/// Returns the reason for the text of an alarm; empty for "no reply", because the alarm's name
/// expresses it.
std::string WhyOf(const std::string& reason) {
  return reason == Name(Outcome::no_reply) ? std::string() : reason;
}

/// True if the gateway at the remote end of a route answers that its slave does not reply.
bool IsNoTarget(const bus::RoutedReply& reply) {
  return reply.outcome == Outcome::refused && reply.pdu.size() == 2 &&
         (reply.pdu[1] == modbus::kNoPath || reply.pdu[1] == modbus::kNoTarget);
}

}  // namespace

void AlarmService::TellAll(OwnAlarms::Records records) {
  for (events::EventRecord& record : records) tell_(std::move(record));
}

void AlarmService::OnNews(const std::string& line, const std::string& device, const bus::News& news,
                          Now at) {
  const OwnAlarms::Subject place{line, device};
  const MutexLock lock(mutex_);
  if (news.what == bus::News::What::not_in_use || news.what == bus::News::What::port_lent) {
    return TellAll(alarms_.SetInUse(place, news.over, at));
  }
  const auto trouble = KindOf(news.what).trouble;
  if (!trouble) return;
  if (trouble == Trouble::replaced) return TellAll(alarms_.Happen(*trouble, place, news.text, at));
  if (news.over) return TellAll(alarms_.End(*trouble, place, at));
  alarms_.Begin(*trouble, place, WhyOf(news.text), at);
}

void AlarmService::OnUnused(const std::string& line, const std::string& device, Now now) {
  const MutexLock lock(mutex_);
  TellAll(alarms_.SetInUse({line, device}, false, now));
}

/// A request that was not sent says nothing about the slave. If a line is down, the line itself has
/// an alarm, so its units need none.
void AlarmService::OnRouted(const RoutedEnd& end, Now now) {
  const config::Route& route = end.route;
  const OwnAlarms::Subject unit{route.line, events::UnitName(end.unit)};
  const bool answered = end.slave == RoutedEnd::Slave::answered;
  const MutexLock lock(mutex_);
  if (route.line.empty()) {
    const OwnAlarms::Subject server{"", HostAndPort(route.host, route.port)};
    if (answered) TellAll(alarms_.End(Trouble::server_away, server, now));
    if (!answered && end.reply.outcome == Outcome::line_down) {
      alarms_.Begin(Trouble::server_away, server, end.reply.reason, now);
    }
  } else if (end.reply.outcome == Outcome::line_down) {
    return;
  }
  if (answered && !IsNoTarget(end.reply)) {
    OnAnswered(unit, now);
  } else if (answered) {
    OnUnanswered(unit, "the remote gateway answers exception " + HexByte(end.reply.pdu[1]), now);
  } else if (end.slave == RoutedEnd::Slave::silent) {
    OnUnanswered(unit, WhyOf(end.reply.reason), now);
  }
}

void AlarmService::OnAnswered(const OwnAlarms::Subject& unit, Now now) {
  unanswered_.erase(unit);
  TellAll(alarms_.End(Trouble::unit_silent, unit, now));
}

/// A single lost reply does not raise the alarm. The alarm needs kOfflineCount requests in a row
/// without a reply, or two with kLongSilence between them. The delay of the alarm counts from the
/// first of these requests.
void AlarmService::OnUnanswered(const OwnAlarms::Subject& unit, const std::string& why, Now now) {
  Unanswered& its = unanswered_.try_emplace(unit, Unanswered{.first = now}).first->second;
  ++its.requests;
  its.last = now.instant;
  const Duration since = now.instant - its.first.instant;
  const bool many = its.requests >= bus::DeviceHealth::kOfflineCount;
  const bool long_ago = its.requests > 1 && since >= kLongSilence;
  if (many || long_ago) alarms_.Begin(Trouble::unit_silent, unit, why, its.first);
}

/// Ends the alarms of units that no client has addressed for kForgotten, because it is unknown
/// whether these units would answer.
void AlarmService::Forget(Now now) {
  for (auto one = unanswered_.begin(); one != unanswered_.end();) {
    if (now.instant - one->second.last < kForgotten) {
      ++one;
      continue;
    }
    TellAll(alarms_.End(Trouble::unit_silent, one->first, now));
    one = unanswered_.erase(one);
  }
}

void AlarmService::OnCertificates(const std::string& why, Now now) {
  const MutexLock lock(mutex_);
  if (why.empty()) {
    TellAll(alarms_.End(events::Trouble::certificate_ends, {}, now));
  } else {
    alarms_.Begin(events::Trouble::certificate_ends, {}, why, now);
  }
}

void AlarmService::OnOutlet(const std::string& outlet, const std::string& away,
                            const std::string& refused, Now now) {
  using events::Trouble;
  const MutexLock lock(mutex_);
  for (const auto& [trouble, why] :
       {std::pair(Trouble::receiver_away, &away), std::pair(Trouble::values_refused, &refused)}) {
    if (why->empty()) {
      TellAll(alarms_.End(trouble, {"", outlet}, now));
    } else {
      alarms_.Begin(trouble, {"", outlet}, *why, now);
    }
  }
}

void AlarmService::Look(std::span<const DiskState> disks, Now now) {
  const MutexLock lock(mutex_);
  for (const DiskState& one : disks) {
    if (one.disk == Disk::opening) continue;
    if (one.disk == Disk::fine) {
      TellAll(alarms_.End(one.trouble, {}, now));
    } else {
      alarms_.Begin(one.trouble, {}, one.why, now);
    }
  }
  Forget(now);
  TellAll(alarms_.Look(now));
}

void AlarmService::Renew(std::shared_ptr<const config::Config> config,
                         const std::set<std::string>& begun) {
  const MutexLock lock(mutex_);
  alarms_.Renew(std::move(config), begun);
}

namespace {

/// The end of the gateway waits this long at most for its last event, so that outputs end even if a
/// disk hangs.
constexpr Duration kEndTime = 300ms;

events::SourceNames SourcesOf(const config::Config& config) {
  events::SourceNames sources;
  for (const config::Line& line : config.lines) {
    for (const config::Device& device : line.devices) sources.emplace_back(line.name, device.name);
  }
  return sources;
}

void TellState(const events::Alarm& alarm, events::AlarmState state, log::Level level) {
  const log::About about{.line = alarm.line,
                         .device = alarm.device,
                         .fields = {{"ALARM", alarm.name},
                                    {"PRIORITY_OF_ALARM", std::string(Name(alarm.priority))},
                                    {"STATE", std::string(Name(state))},
                                    {"POINT", alarm.point},
                                    {"SEQ", std::to_string(alarm.seq)}}};
  log::WriteAct(level, about,
                fmt::format("alarm {}, priority {}: {}{}", Name(state), Name(alarm.priority),
                            alarm.text, alarm.by.empty() ? "" : " (" + alarm.by + ")"));
}

/// Logs each change of an alarm as one message, with fields by which other programs select
/// messages. An event that raises and clears an alarm at once makes two messages. Only the message
/// "active" is a warning or an error.
void TellJournal(const events::Alarm& alarm, bool raised) {
  using events::AlarmState;
  const bool high = alarm.priority == config::AlarmPriority::high;
  if (raised) {
    TellState(alarm, AlarmState::active, high ? log::Level::error : log::Level::warning);
  }
  if (!raised || alarm.state != AlarmState::active) {
    TellState(alarm, alarm.state, log::Level::info);
  }
}

events::EventLog::Options OptionsOf(const config::Config& config, const EventsPlace& place,
                                    std::shared_ptr<events::EventFeed> feed,
                                    std::shared_ptr<events::CursorBook> cursors,
                                    events::RecordService& records,
                                    std::function<void(events::Source)> kept) {
  events::EventLog::Options options;
  options.file = place.file;
  options.why_no_file = place.why_no_file;
  options.in_memory = place.in_memory;
  options.writer = place.writer;
  options.sources = SourcesOf(config);
  options.clocks = ReadClocks;
  options.feed = std::move(feed);
  options.cursors = std::move(cursors);
  options.tells_own = config.events.given;
  options.watches = [&config](const events::Alarm& alarm) {
    return events::PriorityOf(config, alarm);
  };
  options.kept = [kept = std::move(kept)](const std::vector<events::Source>& sources) {
    for (const events::Source source : sources) kept(source);
  };
  options.owed = [&records](const std::vector<events::OwedRecord>& owed) { records.Owe(owed); };
  options.alarm = TellJournal;
  options.warn = [](const std::string& text) { log::Warn("{}", text); };
  options.inform = [](const std::string& text) { log::Info("{}", text); };
  return options;
}

}  // namespace

EventPath::EventPath(const config::Config& config, const bus::PointStore& store,
                     const EventsPlace& place, bus::CommandSink& commands, Kept kept)
    : store_(store),
      tells_own_(config.events.given),
      in_memory_(place.in_memory),
      kept_(std::move(kept)),
      facts_(config),
      feed_(std::make_shared<events::EventFeed>()),
      cursors_(std::make_shared<events::CursorBook>(place.consumers)),
      records_(
          store,
          {.clocks = ReadClocks,
           .ask = [&commands](
                      bus::WriteCommand command) { return commands.Submit(std::move(command)); },
           .keep = [this](events::KeptRecord record) { queue().Keep(std::move(record)); }}),
      log_(OptionsOf(config, place, feed_, cursors_, records_,
                     [this](events::Source source) { kept_(source, queue().said(source), true); })),
      alarms_(std::shared_ptr<const config::Config>(std::shared_ptr<void>(), &config),
              [this](events::EventRecord record) { queue().Tell(std::move(record)); }) {
  for (std::uint32_t line = 0; line < config.lines.size(); ++line) AddEntries(store.LineAt(line));
}

void EventPath::AddEntries(const std::shared_ptr<const config::Line>& line) {
  for (const config::Device& device : line->devices) {
    DeviceEntry& its =
        entries_.Append(line, static_cast<std::size_t>(&device - line->devices.data()));
    if (!device.enabled) alarms_.OnUnused(line->name, device.name, ReadClocks());
    const auto number = static_cast<std::uint32_t>(entries_.size() - 1);
    const auto [present, is_new] = present_.try_emplace({line->name, device.name}, number);
    const std::uint32_t before = std::exchange(present->second, number);
    if (!device.point_events) continue;
    const std::shared_ptr<const config::Device> shared(line, &device);
    auto watch = std::make_unique<events::DeviceWatch>(line->name, shared);
    if (!is_new) {
      const MutexLock lock(entries_[before].mutex);
      if (entries_[before].watch) watch->GoOn(*entries_[before].watch);
    }
    const MutexLock lock(its.mutex);
    its.watch = std::move(watch);
  }
  records_.Add(line);
}

EventPath::Named EventPath::Find(std::uint32_t device) const {
  const DeviceEntry& entry = entries_[device];
  Named named{entry.line.lock()};
  if (named.line) named.device = &named.line->devices[entry.place];
  return named;
}

void EventPath::Renumber(const std::shared_ptr<const config::Config>& config,
                         std::span<const std::shared_ptr<const config::Line>> begun) {
  queue().Renumber(SourcesOf(*config), [config](const events::Alarm& alarm) {
    return events::PriorityOf(*config, alarm);
  });
  std::set<std::string> names;
  for (const auto& line : begun) names.insert(line->name);
  for (const events::Fact& ended : EndedBy(*config, names)) {
    if (tells_own_) queue().Tell(events::FactRecord(ended, ReadClocks().wall));
  }
  alarms_.Renew(config, names);
  const events::SourceNames sources = SourcesOf(*config);
  const std::set<events::SourceName> all(sources.begin(), sources.end());
  std::erase_if(present_, [&all](const auto& one) { return !all.contains(one.first); });
  for (const auto& line : begun) AddEntries(line);
  for (std::uint32_t device = 0; device < entries_.size(); ++device) {
    if (!store_.gone(device)) continue;
    const MutexLock lock(entries_[device].mutex);
    entries_[device].watch.reset();
  }
}

std::vector<events::Fact> EventPath::EndedBy(const config::Config& config,
                                             const std::set<std::string>& begun) {
  const MutexLock lock(facts_mutex_);
  return facts_.Renew(config, begun);
}

void EventPath::Begun(std::uint32_t first_device, std::size_t devices) {
  records_.TakeOver();
  Tell(first_device, devices);
}

void EventPath::Start() {
  records_.Start();
  queue().WhenOpened([this] { Tell(0, entries_.size()); });
}

void EventPath::Tell(std::uint32_t first_device, std::size_t devices) {
  if (!queue().opened()) return;  // Start calls Tell again when the file is open
  const std::size_t end = std::min(first_device + devices, entries_.size());
  for (std::uint32_t device = first_device; device < end; ++device) {
    const Named its = Find(device);
    if (its.line && its.device->events) kept_(device, queue().said(device), false);
  }
}

void EventPath::End() { queue().End(kEndTime); }

void EventPath::OnReported(bus::ReportedEvents reported) {
  if (in_memory_) return;  // without a file, devices are not asked for events
  const Named its = Find(reported.device);
  if (!its.line) return;
  auto records = events::RecordsOf(reported.batch, its.line->name, *its.device,
                                   reported.received.wall, reported.oldest);
  queue().Add({.source = reported.device,
               .said = std::move(reported.batch.said),
               .again = reported.batch.again,
               .events = std::move(records),
               .past = std::move(reported.batch.past),
               .line = its.line->name,
               .device = its.device->name});
}

void EventPath::OnNews(const config::Line& line, const bus::News& news, Now at) {
  events::Fact fact{
      .code = KindOf(news.what).code, .over = news.over, .line = line.name, .why = news.text};
  if (const Named its = news.device ? Find(*news.device) : Named(); its.line) {
    fact.device = its.device->name;
  }
  if (tells_own_ && IsNews(fact, news.first)) queue().Tell(events::FactRecord(fact, at.wall));
  alarms_.OnNews(fact.line, fact.device, news, at);
}

bool EventPath::IsNews(const events::Fact& fact, bool first) {
  const MutexLock lock(facts_mutex_);
  return facts_.IsNews(fact, first);
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
  queue().Tell(std::move(record));
}

void EventPath::OnClock(std::uint32_t device, bool corrected, const std::string& text, Now at) {
  if (!tells_own_) return;
  const auto code = corrected ? events::OwnCode::clock_corrected : events::OwnCode::clock_left;
  const auto line = store_.line(device);
  const auto its = store_.device(device);
  if (!line || !its) return;
  queue().Tell(events::FactRecord(
      {.code = code, .line = line->name, .device = its->name, .why = text}, at.wall));
}

void EventPath::OnRead(std::uint32_t device, std::span<const std::uint32_t> points, Now at) {
  records_.OnRead(device, at.instant);
  DeviceEntry& entry = entries_[device];
  const MutexLock lock(entry.mutex);
  events::DeviceWatch* const watch = entry.watch.get();
  if (watch == nullptr) return;
  struct Seen {
    std::uint32_t point = 0;
    Value value;
    Quality quality;
  };
  std::vector<Seen> seen;
  store_.Read(device, [&](const bus::DeviceRecord& record) {
    for (const std::uint32_t point : points) {
      if (!watch->Watches(point)) continue;
      seen.push_back({point, record.points[point].value, QualityAt(record, point, at.instant)});
    }
  });
  for (const Seen& one : seen) {
    for (auto& record : watch->Take(one.point, one.value, one.quality, at)) {
      queue().Tell(std::move(record));
    }
  }
}

}  // namespace baudgate::records
