// SPDX-License-Identifier: Apache-2.0
#include "gateway/events/event_log.h"

#include <fmt/format.h>
#include <pthread.h>

#include <algorithm>
#include <map>
#include <utility>

#include "gateway/base/shown.h"

namespace baudgate::events {

EventLog::EventLog(Options options)
    : options_(std::move(options)),
      sources_(options_.sources),
      file_(options_.file, sources_, options_.vfs, options_.turn) {
  {
    const MutexLock lock(mutex_);
    state_.file = options_.file.string();
    state_.since = options_.clocks().wall;
    if (options_.file.empty()) Show(Disk::failing, options_.why_no_file);
  }
  thread_ = std::thread([this] { Run(); });
}

EventLog::~EventLog() {
  {
    const MutexLock lock(mutex_);
    if (tells_end_) book_.Tell(Own(OwnCode::stops, "the gateway ends"), options_.clocks().instant);
    stop_ = true;
  }
  due_.notify_one();
  thread_.join();
  const MutexLock lock(mutex_);
  if (book_.waiting() > 0) {
    options_.warn(fmt::format(
        "events: the gateway ends, and the last events of {} devices are not kept; it will ask for "
        "them once more: {}",
        book_.waiting(), state_.trouble));
  }
  if (book_.waiting_own() > 0) {
    options_.warn(fmt::format("events: the gateway ends, and {} of its own are not kept: {}",
                              Plural(book_.waiting_own(), "event"), state_.trouble));
  }
}

void EventLog::Add(Batch batch) {
  {
    const MutexLock lock(mutex_);
    book_.Add(std::move(batch));
  }
  due_.notify_one();
}

void EventLog::Tell(EventRecord record) {
  const Instant now = options_.clocks().instant;
  {
    const MutexLock lock(mutex_);
    book_.Tell(std::move(record), now);
  }
  due_.notify_one();
}

void EventLog::Started(const std::string& version) {
  if (!options_.tells_own) return;
  {
    const MutexLock lock(mutex_);
    started_ = Own(OwnCode::started, "baudgate " + version + " has started");
    tells_end_ = true;
  }
  due_.notify_one();
}

EventRecord EventLog::Own(OwnCode code, std::string text) const {
  EventRecord record;
  record.received = record.device_time = options_.clocks().wall;
  record.clock = ClockQuality::gateway;
  record.code = CodeOf(code);
  record.text = std::move(text);
  Shorten(record.text);
  return record;
}

void EventLog::WhenOpened(std::function<void()> opened) {
  {
    const MutexLock lock(mutex_);
    if (!opened_) {
      tell_opened_ = std::move(opened);
      return;
    }
  }
  opened();
}

void EventLog::Renumber(SourceNames sources) {
  const MutexLock lock(mutex_);
  const SourceNames& before = renumbered_ ? *renumbered_ : sources_;
  std::map<Source, Source> moved;
  for (std::size_t now = 0; now < sources.size(); ++now) {
    if (sources[now].second.empty()) continue;
    const auto was = std::ranges::find(before, sources[now]);
    if (was == before.end() || was - before.begin() == static_cast<std::ptrdiff_t>(now)) continue;
    moved.emplace(static_cast<Source>(was - before.begin()), static_cast<Source>(now));
  }
  book_.Move(moved);
  if (options_.feed) options_.feed->Move(moved);
  renumbered_ = std::move(sources);
}

std::string EventLog::said(Source source) const {
  const MutexLock lock(mutex_);
  return book_.said(source);
}

EventsState EventLog::state() const {
  const MutexLock lock(mutex_);
  EventsState state = state_;
  state.waiting = book_.waiting();
  state.newest = book_.newest();
  state.repeats = book_.repeats();
  state.left_out = book_.left_out();
  for (const auto& [key, alarm] : book_.alarms()) {
    state.alarms_active += IsActive(alarm.state) ? 1 : 0;
    state.alarms_unacknowledged += IsUnacknowledged(alarm.state) ? 1 : 0;
  }
  return state;
}

std::vector<Alarm> EventLog::Alarms() const {
  std::vector<Alarm> alarms;
  const MutexLock lock(mutex_);
  for (const auto& [key, alarm] : book_.alarms()) alarms.push_back(alarm);
  return alarms;
}

void EventLog::Acknowledge(const AckQuery& query, std::function<void(const Acknowledged&)> done) {
  Acknowledged now;
  {
    const MutexLock lock(mutex_);
    for (const auto& [key, alarm] : book_.alarms()) {
      if (!IsUnacknowledged(alarm.state) || !query.Means(alarm)) continue;
      EventRecord record =
          Own(OwnCode::acknowledged, "acknowledged by " + query.by + ": " + alarm.text);
      record.line = alarm.line;
      record.device = alarm.device;
      record.subject = alarm.name;
      record.mark = {.step = AlarmMark::Step::acknowledge, .by = query.by, .seq = query.seq};
      book_.TellAlways(std::move(record));
      ++now.alarms;
    }
    now.trouble = state_.trouble;
    if (now.alarms > 0 && now.trouble.empty()) {
      acks_.push_back({now.alarms, std::exchange(done, nullptr)});
    }
  }
  due_.notify_one();
  if (done) done(now);
}

Result<Page> EventLog::Read(const PageQuery& query) const {
  if (options_.file.empty()) return Error{options_.why_no_file};
  if (state().disk == Disk::opening) return Page{.records = {}, .next = query.after};
  return ReadPage(options_.file, query);
}

// ---------------------------------------------------------------- the writing thread

void EventLog::Run() {
  pthread_setname_np(pthread_self(), "events");
  while (Sleep()) WriteDue();
  WriteDue();
  // The end of a trouble is told, too.
  const MutexLock lock(mutex_);
  if (state_.disk != Disk::fine || book_.empty()) return;
  const auto due = book_.Due();
  if (file_.Write(due)) book_.Kept(due.size());
}

bool EventLog::Sleep() {
  MutexLock lock(mutex_);
  const Instant tick = options_.clocks().instant + kTick;
  // A disk that fails is left in peace until then.
  while (!stop_) {
    const bool rests = state_.disk == Disk::failing;
    if (!rests && !IsIdle()) break;
    const auto until = rests ? tick : book_.LeftOutAt();
    if (!until) {
      lock.Wait(due_);
    } else if (!lock.WaitUntil(due_, *until)) {
      break;
    }
  }
  return !stop_;
}

bool EventLog::IsIdle() const { return state_.disk != Disk::opening && book_.empty() && !started_; }

Status EventLog::Open() {
  auto opened = file_.Open();
  if (!opened) return {};
  if (!opened->put_aside.empty()) options_.warn("events: " + opened->put_aside);
  if (!opened->ok) return Error{opened->error};
  if (options_.feed) options_.feed->Begin(std::move(opened->contents.image));
  std::function<void()> tell;
  {
    const MutexLock lock(mutex_);
    book_.OnOpened(opened->contents.last, opened->contents.said, opened->contents.alarms);
    restores_ = last_run_.has_value();
    if (!restores_) OnFirstOpened(opened->contents);
    opened_ = true;
    tell = std::exchange(tell_opened_, {});
  }
  if (tell) tell();
  return {};
}

/// An alarm that nobody watches any more would be active for ever.
void EventLog::OnFirstOpened(const EventTable::Contents& contents) {
  last_run_ = contents.last_run;
  for (const Alarm& alarm : contents.alarms) {
    if (!IsActive(alarm.state) || !options_.watches || options_.watches(alarm)) continue;
    EventRecord record =
        Own(OwnCode::not_watched, "not in the configuration any more: " + alarm.text);
    record.line = alarm.line;
    record.device = alarm.device;
    record.state = config::EventState::off;
    record.subject = alarm.name;
    record.mark = {.step = AlarmMark::Step::clear};
    book_.TellAlways(std::move(record));
  }
}

Status EventLog::RestoreAlarms() {
  if (!restores_) return {};
  const Status status = file_.WriteAlarms(Alarms());
  if (status) restores_ = false;
  return status;
}

void EventLog::TakeNumbers() {
  if (renumbered_) sources_ = std::move(*std::exchange(renumbered_, std::nullopt));
}

void EventLog::WriteDue() {
  if (options_.file.empty()) return;
  {
    const MutexLock lock(mutex_);
    TakeNumbers();
  }
  Status status = Open();
  if (status) status = RestoreAlarms();
  std::vector<Batch> due;
  std::vector<Ack> acks;
  if (status) {
    due = TakeDue(acks);
    status = file_.Write(due);
  }
  std::vector<Source> kept;
  {
    const MutexLock lock(mutex_);
    if (status) kept = book_.Kept(due.size());
    if (!status && acks.empty()) acks.swap(acks_);
    Show(status ? Disk::fine : Disk::failing, status ? std::string() : status.error());
  }
  if (status) Feed(due);
  if (!kept.empty()) options_.kept(kept);
  for (const Ack& ack : acks) ack.done({ack.alarms, status ? std::string() : status.error()});
}

/// What the gateway has seen of a device is shown with that device.
void EventLog::Feed(const std::vector<Batch>& batches) {
  if (!options_.feed) return;
  std::vector<FedEvent> fed;
  for (const Batch& batch : batches) {
    for (const EventRecord& event : batch.events) {
      const bool own = batch.source == kGateway;
      fed.push_back({own ? SourceOf(sources_, event.device) : batch.source, event});
    }
  }
  options_.feed->Add(fed);
}

std::vector<Batch> EventLog::TakeDue(std::vector<Ack>& acks) {
  const Now now = options_.clocks();
  const MutexLock lock(mutex_);
  TakeNumbers();
  if (started_) {
    if (last_run_->end == LastRun::End::in_order) {
      started_->text += "; the one before had ended in order";
    } else if (last_run_->end == LastRun::End::broken_off) {
      started_->text += "; the one before was broken off after " + FormatWallTime(last_run_->last);
    }
    book_.TellFirst(*std::exchange(started_, std::nullopt));
  }
  if (state_.disk == Disk::fine) book_.TellLeftOut(now);
  acks.swap(acks_);
  return book_.Due();
}

/// The log hears of the first trouble and of its end.
void EventLog::Show(Disk disk, const std::string& trouble) {
  std::string was = std::exchange(state_.trouble, trouble);
  const WallTime since = state_.since;
  if (std::exchange(state_.disk, disk) != disk) state_.since = options_.clocks().wall;
  if (!trouble.empty() && was.empty()) {
    options_.warn(fmt::format(
        "events: {}; devices are not asked for events until it works again, and keep them as long "
        "as they have room",
        trouble));
  } else if (trouble.empty() && !was.empty()) {
    options_.inform("events: they are kept again in " + state_.file);
    if (!options_.tells_own) return;
    const std::string file = state_.file + ": ";
    if (was.starts_with(file)) was.erase(0, file.size());
    book_.Tell(Own(OwnCode::disk_trouble,
                   "no event could be kept since " + FormatWallTime(since) + ": " + was),
               options_.clocks().instant);
  }
}

}  // namespace baudgate::events
