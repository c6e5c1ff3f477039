// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/event_rounds.h"

#include <fmt/format.h>

#include <utility>

#include "gateway/base/shown.h"

namespace baudgate::events {

EventRounds::EventRounds(const LogOptions& options, PendingEvents& pending)
    : options_(options), pending_(pending) {
  const MutexLock lock(pending_.mutex);
  if (options_.file.empty() && !options_.in_memory) SetDisk(Disk::failing, options_.why_no_file);
}

std::vector<Batch> EventRounds::Watch() {
  std::vector<WaitingAck> acks;
  std::vector<Batch> batches;
  std::string trouble;
  {
    const MutexLock lock(pending_.mutex);
    const bool late = watch_.Tick(!pending_.IsIdle());
    if (watch_.look_due()) {
      timer_.Look({});
      pending_.wake();
    }
    if (!late || pending_.disk.is_opening() || pending_.disk.is_failing()) return {};
    SetDisk(Disk::stalled, "the disk does not answer in time");
    batches = pending_.book.Ahead();
    pending_.book.OnTold(batches.size());
    acks = std::exchange(pending_.acks, {});
    trouble = pending_.disk.trouble();
  }
  pending_.changed.notify_all();
  AnswerAcks(acks, trouble);
  return batches;
}

void EventRounds::Look(bool now) {
  {
    const MutexLock lock(pending_.mutex);
    timer_.Look(now ? Instant() : options_.clocks().instant + kTick);
  }
  pending_.wake();
}

void EventRounds::Doubt() const {
  const MutexLock lock(pending_.mutex);
  watch_.Doubt();
}

// ---------------------------------------------------------------- the writing thread

bool EventRounds::Begin() {
  const MutexLock lock(pending_.mutex);
  if (NextRoundAt() > options_.clocks().instant) return false;
  timer_.Begin();
  watch_.Begin();
  return true;
}

Instant EventRounds::NextRound() const {
  const MutexLock lock(pending_.mutex);
  return NextRoundAt();
}

Instant EventRounds::NextRoundAt() const {
  return timer_.At(pending_.disk.is_failing(), pending_.IsIdle(), pending_.book.LeftOutAt());
}

bool EventRounds::OnOpened(const EventTable::Contents& contents) {
  std::function<void()> opened;
  bool first = false;
  {
    const MutexLock lock(pending_.mutex);
    first = !pending_.book.opened();
    pending_.book.OnOpened(contents.last, contents.said, contents.alarms);
    if (first) {
      pending_.run.OnOpened(contents.last_run);
      pending_.watched.Follow(pending_.book, options_.clocks().wall);
    }
    opened = std::exchange(pending_.on_opened, {});
  }
  if (opened) opened();
  return first;
}

void EventRounds::SetPutAside(std::vector<std::string> files) {
  const MutexLock lock(pending_.mutex);
  pending_.disk.SetPutAside(std::move(files));
}

EventRounds::Round EventRounds::Take() {
  const Now now = options_.clocks();
  const MutexLock lock(pending_.mutex);
  if (auto start = pending_.run.TakeStart()) pending_.book.TellFirst(std::move(*start));
  if (pending_.disk.is_fine()) pending_.book.TellLeftOut(now);
  return {.look = watch_.TakeLook(),
          .batches = pending_.book.Prepare(),
          .records = pending_.records,
          .acks = std::exchange(pending_.acks, {}),
          .ends_alarms = pending_.watched.TakeDue()};
}

std::vector<Source> EventRounds::Done(Round& round, const Status& status, std::int64_t oldest) {
  std::vector<Source> kept;
  {
    const Now now = options_.clocks();
    const MutexLock lock(pending_.mutex);
    watch_.End();
    pending_.book.TakeTold(round.batches);
    if (status) {
      for (const SourceName& name : pending_.book.Kept(round.batches.size())) {
        if (const auto source = pending_.numbers.Find(name)) kept.push_back(*source);
      }
      pending_.records.erase(
          pending_.records.begin(),
          pending_.records.begin() + static_cast<std::ptrdiff_t>(round.records.size()));
      if (round.ends_alarms) pending_.watched.Follow(pending_.book, now.wall);
    } else {
      if (round.ends_alarms) pending_.watched.SetDue();
      if (round.acks.empty()) round.acks = std::exchange(pending_.acks, {});
      timer_.Rest(now.instant + kTick);
    }
    if (oldest > 0) pending_.oldest = oldest;  // known as well while the disk is full
    SetDisk(status ? Disk::fine : Disk::failing, status ? std::string() : status.error());
  }
  pending_.changed.notify_all();
  return kept;
}

std::vector<Batch> EventRounds::Unsaved() {
  const MutexLock lock(pending_.mutex);
  std::vector<Batch> batches = pending_.book.Prepare();
  pending_.book.OnTold(batches.size());
  return batches;
}

bool EventRounds::goes_on() const {
  const MutexLock lock(pending_.mutex);
  return pending_.disk.is_fine() && !pending_.IsIdle();
}

std::vector<std::string> EventRounds::LeftBehind() const {
  std::vector<std::string> lines;
  const MutexLock lock(pending_.mutex);
  if (pending_.book.waiting() > 0) {
    lines.push_back(fmt::format(
        "events: the gateway ends, and the last events of {} devices are not kept; it will ask for "
        "them once more: {}",
        pending_.book.waiting(), pending_.disk.trouble()));
  }
  if (pending_.book.waiting_own() > 0) {
    lines.push_back(fmt::format("events: the gateway ends with {} of its own not saved: {}",
                                Plural(pending_.book.waiting_own(), "event"),
                                pending_.disk.trouble()));
  }
  return lines;
}

/// Logs a trouble when it begins and when it ends; a trouble that has ended is an event, too.
void EventRounds::SetDisk(Disk disk, const std::string& trouble) {
  const Now now = options_.clocks();
  const DiskCondition::News news = pending_.disk.Set(disk, trouble, now.wall);
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
  pending_.book.Tell(DiskTroubleRecord(file, news.ended->trouble, news.ended->since, now.wall),
                     now.instant);
}

}  // namespace baudgate::events
