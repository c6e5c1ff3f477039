// SPDX-License-Identifier: Apache-2.0
#include "gateway/events/event_log.h"

#include <pthread.h>

#include <algorithm>
#include <map>
#include <utility>

namespace baudgate::events {

EventLog::EventLog(Options options)
    : options_(std::move(options)),
      queue_(options_),
      sources_(options_.sources),
      file_(options_.file, sources_, options_.vfs, options_.turn) {
  if (options_.feed) options_.feed->ServeWith([this](bool now) { queue_.Look(now); });
  thread_ = std::thread([this] { Run(); });
}

EventLog::~EventLog() {
  if (options_.feed) options_.feed->ServeWith({});
  queue_.Stop();
  thread_.join();
<<<<<<< ours
  for (const std::string& line : queue_.LeftBehind()) options_.warn(line);
||||||| base
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

std::string EventLog::said(Source source) const {
  const MutexLock lock(mutex_);
  return book_.said(source);
=======
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
>>>>>>> theirs
}

EventsState EventLog::state() const {
  EventsState state = queue_.state();
  if (!options_.feed) return state;
  for (const auto& [name, cursor] : options_.feed->cursors().all()) {
    state.consumers.push_back(
        {name, cursor.seq, std::max<std::int64_t>(0, state.oldest - 1 - cursor.seq)});
  }
  return state;
}

Result<Page> EventLog::Read(const PageQuery& query) const {
  if (options_.file.empty()) return Error{options_.why_no_file};
  if (state().disk == Disk::opening) return Page{.records = {}, .next = query.after};
  return ReadPage(options_.file, query);
}

Result<PastPage> EventLog::ReadPast(const PastQuery& query) const {
  if (options_.file.empty()) return Error{options_.why_no_file};
  if (state().disk == Disk::opening) return PastPage{.rows = {}, .next = query.after};
  return events::ReadPast(options_.file, query);
}

/// The end of a trouble is told as well, in a commit behind the one that has ended it.
void EventLog::Run() {
  pthread_setname_np(pthread_self(), "events");
  while (queue_.Await()) WriteDue();
  do {
    WriteDue();
  } while (queue_.goes_on());
}

void EventLog::WriteDue() {
  if (options_.file.empty()) return;
  Status status = Open();
  if (status && file_.lacks_alarms()) status = file_.WriteAlarms(queue_.Alarms());
  EventQueue::Round round;
  if (status) {
    const auto cursors = options_.feed ? options_.feed->cursors().Due() : std::nullopt;
    round = queue_.Take();
    status = file_.Write(round.batches, cursors ? &*cursors : nullptr, round.records);
    if (status && cursors) options_.feed->cursors().OnKept(*cursors);
  }
  if (status) Feed(round.batches);
  if (status) TellOwed(round.batches);
  const std::vector<Source> kept = queue_.Done(round, status, file_.oldest());
  if (status) ReadBacklog();
  if (!kept.empty()) options_.kept(kept);
  AckDesk::Answer(round.acks, status ? std::string() : status.error());
}

Status EventLog::Open() {
  auto opened = file_.Open();
  if (!opened) return {};
  if (!opened->put_aside.empty()) options_.warn("events: " + opened->put_aside);
  if (!opened->ok) return Error{opened->error};
  if (options_.feed) {
    options_.feed->cursors().OnOpened(opened->contents.cursors);
    options_.feed->Begin(std::move(opened->contents.image));
  }
  const bool first = queue_.OnOpened(opened->contents);
  if (first && options_.owed && !opened->contents.owed.empty()) {
    options_.owed(opened->contents.owed);
  }
  return {};
}

void EventLog::ReadBacklog() {
  if (!options_.feed) return;
  while (const auto after = options_.feed->wanted()) {
    auto events = file_.ReadBehind(*after);
    if (!events) return queue_.Look(false);
    options_.feed->Supply(*after, std::move(*events));
  }
}

<<<<<<< ours
void EventLog::TellOwed(const std::vector<Batch>& batches) const {
  std::vector<OwedRecord> owed;
  for (const Batch& batch : batches) {
    for (const EventRecord& event : batch.events) {
      if (event.record.empty() || event.kept) continue;
      owed.push_back(
          {event.seq, event.line, event.device, event.record, event.device_time, event.clock});
    }
||||||| base
Status EventLog::RestoreAlarms() {
  if (!restores_) return {};
  const Status status = file_.WriteAlarms(Alarms());
  if (status) restores_ = false;
  return status;
}

void EventLog::WriteDue() {
  if (options_.file.empty()) return;
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
=======
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
>>>>>>> theirs
  }
  if (options_.owed && !owed.empty()) options_.owed(owed);
}

/// What the gateway has seen of a device is shown with that device.
void EventLog::Feed(const std::vector<Batch>& batches) {
  if (!options_.feed) return;
  std::vector<FedEvent> fed;
  for (const Batch& batch : batches) {
    for (const EventRecord& event : batch.events) {
      const bool own = batch.source == kGateway;
      fed.push_back({own ? SourceOf(sources_, event.device) : batch.source, event});
      fed.back().record.kept.reset();  // outputs have no use for it
    }
  }
  options_.feed->Add(fed);
}

<<<<<<< ours
||||||| base
std::vector<Batch> EventLog::TakeDue(std::vector<Ack>& acks) {
  const Now now = options_.clocks();
  const MutexLock lock(mutex_);
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

=======
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

>>>>>>> theirs
}  // namespace baudgate::events
