// SPDX-License-Identifier: Apache-2.0
#include "gateway/events/event_queue.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <tuple>
#include <utility>

#include "gateway/base/shown.h"

namespace baudgate::events {

EventQueue::EventQueue(const LogOptions& options, std::function<void()> wake)
    : options_(options),
      wake_(std::move(wake)),
      numbers_(options.sources),
      watched_(options.watches),
      disk_(options.clocks().wall) {
  const MutexLock lock(mutex_);
  if (options_.file.empty() && !options_.in_memory) SetDisk(Disk::failing, options_.why_no_file);
}

void EventQueue::Add(Batch batch) {
  {
    const MutexLock lock(mutex_);
    if (const auto names = numbers_.NamesOf(batch.source)) {
      std::tie(batch.line, batch.device) = *names;
    }
    book_.Add(std::move(batch));
  }
  wake_();
}

void EventQueue::Tell(EventRecord record) {
  const Instant now = options_.clocks().instant;
  {
    const MutexLock lock(mutex_);
    book_.Tell(std::move(record), now);
  }
  wake_();
}

/// While the disk fails as many wait as events of the gateway's own.
void EventQueue::Keep(KeptRecord record) {
  {
    const MutexLock lock(mutex_);
    if (records_.size() < EventBook::kMostOwn) records_.push_back(std::move(record));
  }
  wake_();
}

void EventQueue::Started(const std::string& version) {
  if (!options_.tells_own) return;
  {
    const MutexLock lock(mutex_);
    run_.OnStarted(version, options_.clocks().wall);
  }
  wake_();
}

void EventQueue::TellEnd() {
  book_.TellLeftOut(options_.clocks(), true);
  if (auto end = run_.TakeEnd(options_.clocks().wall)) book_.TellAlways(std::move(*end));
}

void EventQueue::End(Duration most) {
  const Instant until = options_.clocks().instant + most;
  MutexLock lock(mutex_);
  TellEnd();
  wake_();
  while (!IsIdle() && disk_.trouble().empty() && lock.WaitUntil(done_, until)) {
  }
}

std::size_t EventQueue::Acknowledge(const AckQuery& query, AckService::Done done) {
  Acknowledged now;
  {
    const MutexLock lock(mutex_);
    now.at = options_.clocks().wall;
    now.alarms = AckService::Tell(query, book_.Alarms(disk_.holds_up()), book_, now.at);
    now.trouble = disk_.trouble();
    if (now.alarms > 0 && now.trouble.empty()) {
      acks_.Wait({now.alarms, now.at, std::exchange(done, nullptr)});
    }
  }
  wake_();
  if (done) done(now);
  return now.alarms;
}

void EventQueue::WhenOpened(std::function<void()> opened) {
  {
    const MutexLock lock(mutex_);
    if (!book_.opened()) {
      tell_opened_ = std::move(opened);
      return;
    }
  }
  opened();
}

/// What was told up to now may raise alarms of lines that have ended: it is kept first.
void EventQueue::Renumber(SourceNames sources, Watched watches) {
  const Now at = options_.clocks();
  const MutexLock lock(mutex_);
  watched_.Renew(std::move(watches));
  book_.TellLeftOut(at, true);
  const std::map<Source, Source> moved = numbers_.Renew(std::move(sources));
  book_.Move(moved);
  if (options_.feed) options_.feed->Move(moved);
  wake_();
}

std::string EventQueue::said(Source source) const {
  const MutexLock lock(mutex_);
  return book_.said(source);
}

EventsState EventQueue::state() const {
  const MutexLock lock(mutex_);
  EventsState state;
  disk_.Fill(state);
  state.put_aside = disk_.put_aside();
  state.file = options_.file.string();
  state.in_memory = options_.in_memory;
  state.oldest = oldest_;
  state.waiting = book_.waiting();
  state.newest = book_.newest();
  state.repeats = book_.repeats();
  state.left_out = book_.left_out();
  for (const Alarm& alarm : book_.Alarms(disk_.holds_up())) {
    state.alarms_active += IsActive(alarm.state) ? 1 : 0;
    state.alarms_unacknowledged += IsUnacknowledged(alarm.state) ? 1 : 0;
  }
  return state;
}

std::vector<Alarm> EventQueue::Alarms() const {
  const MutexLock lock(mutex_);
  return book_.Alarms(disk_.holds_up());
}

// ---------------------------------------------------------------- the writing thread

bool EventQueue::Begin() {
  const MutexLock lock(mutex_);
  if (NextRoundAt() > options_.clocks().instant) return false;
  timer_.Begin();
  watch_.Begin();
  return true;
}

Instant EventQueue::NextRound() const {
  const MutexLock lock(mutex_);
  return NextRoundAt();
}

Instant EventQueue::NextRoundAt() const {
  return timer_.At(disk_.is_failing(), IsIdle(), book_.LeftOutAt());
}

std::vector<Batch> EventQueue::Watch() {
  std::vector<AckService::Ack> acks;
  std::vector<Batch> batches;
  std::string trouble;
  {
    const MutexLock lock(mutex_);
    const bool late = watch_.Tick(!IsIdle());
    if (watch_.look_due()) {
      timer_.Look({});
      wake_();
    }
    if (!late || disk_.is_opening() || disk_.is_failing()) return {};
    SetDisk(Disk::stalled, "the disk does not answer in time");
    batches = book_.Ahead();
    book_.OnTold(batches.size());
    acks = acks_.Take();
    trouble = disk_.trouble();
  }
  done_.notify_all();
  AckService::Answer(acks, trouble);
  return batches;
}

void EventQueue::Look(bool now) {
  {
    const MutexLock lock(mutex_);
    timer_.Look(now ? Instant() : options_.clocks().instant + kTick);
  }
  wake_();
}

void EventQueue::Doubt() const {
  const MutexLock lock(mutex_);
  watch_.Doubt();
}

bool EventQueue::IsIdle() const {
  return !disk_.is_opening() && book_.empty() && records_.empty() && !run_.waits() &&
         !watched_.due();
}

bool EventQueue::goes_on() const {
  const MutexLock lock(mutex_);
  return disk_.is_fine() && !IsIdle();
}

void EventQueue::TellEndOnce() {
  const MutexLock lock(mutex_);
  TellEnd();
}

bool EventQueue::OnOpened(const EventTable::Contents& contents) {
  std::function<void()> tell;
  bool first = false;
  {
    const MutexLock lock(mutex_);
    first = !book_.opened();
    book_.OnOpened(contents.last, contents.said, contents.alarms);
    if (first) {
      run_.OnOpened(contents.last_run);
      watched_.Follow(book_, options_.clocks().wall);
    }
    tell = std::exchange(tell_opened_, {});
  }
  if (tell) tell();
  return first;
}

std::optional<SourceNames> EventQueue::TakeNumbers() {
  const MutexLock lock(mutex_);
  return numbers_.Take();
}

EventQueue::Round EventQueue::Take() {
  const Now now = options_.clocks();
  const MutexLock lock(mutex_);
  if (auto start = run_.TakeStart()) book_.TellFirst(std::move(*start));
  if (disk_.is_fine()) book_.TellLeftOut(now);
  return {watch_.TakeLook(), book_.Due(),     records_,
          acks_.Take(),      numbers_.Take(), watched_.TakeDue()};
}

void EventQueue::SetPutAside(std::vector<std::string> files) {
  const MutexLock lock(mutex_);
  disk_.SetPutAside(std::move(files));
}

std::vector<Source> EventQueue::Done(Round& round, const Status& status, std::int64_t oldest) {
  std::vector<Source> kept;
  {
    const MutexLock lock(mutex_);
    watch_.End();
    book_.TakeTold(round.batches);
    if (status) {
      kept = book_.Kept(round.batches.size());
      records_.erase(records_.begin(),
                     records_.begin() + static_cast<std::ptrdiff_t>(round.records.size()));
      if (round.ends_alarms) watched_.Follow(book_, options_.clocks().wall);
    } else if (round.ends_alarms) {
      watched_.SetDue();
    }
    if (oldest > 0) oldest_ = oldest;  // known as well while the disk is full
    if (!status && round.acks.empty()) round.acks = acks_.Take();
    if (!status) timer_.Rest(options_.clocks().instant + kTick);
    SetDisk(status ? Disk::fine : Disk::failing, status ? std::string() : status.error());
  }
  done_.notify_all();
  return kept;
}

std::vector<Batch> EventQueue::Unsaved() {
  const MutexLock lock(mutex_);
  std::vector<Batch> batches = book_.Due();
  book_.OnTold(batches.size());
  return batches;
}

std::vector<std::string> EventQueue::LeftBehind() const {
  std::vector<std::string> lines;
  const MutexLock lock(mutex_);
  if (book_.waiting() > 0) {
    lines.push_back(fmt::format(
        "events: the gateway ends, and the last events of {} devices are not kept; it will ask for "
        "them once more: {}",
        book_.waiting(), disk_.trouble()));
  }
  if (book_.waiting_own() > 0) {
    lines.push_back(fmt::format("events: the gateway ends with {} of its own not saved: {}",
                                Plural(book_.waiting_own(), "event"), disk_.trouble()));
  }
  return lines;
}

/// The log hears of the first trouble and of its end.
void EventQueue::SetDisk(Disk disk, const std::string& trouble) {
  const Now now = options_.clocks();
  const DiskCondition::News news = disk_.Set(disk, trouble, now.wall);
  if (news.begun) {
    options_.warn(fmt::format(
        "events: {}; devices are not asked for events until it works again, and keep them as long "
        "as they have room",
        trouble));
  }
  if (!news.ended) return;
  const std::string file = options_.file.string();
  options_.inform("events: they are kept again in " + file);
  if (!options_.tells_own) return;
  book_.Tell(DiskTroubleRecord(file, news.ended->trouble, news.ended->since, now.wall),
             now.instant);
}

}  // namespace baudgate::events
