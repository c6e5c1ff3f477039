// SPDX-License-Identifier: Apache-2.0
#include "gateway/events/event_log.h"

#include <fmt/format.h>
#include <pthread.h>

#include <utility>

namespace baudgate::events {

EventLog::EventLog(Options options)
    : options_(std::move(options)),
      file_(options_.file, options_.sources, options_.vfs, options_.turn) {
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
    stop_ = true;
  }
  due_.notify_one();
  thread_.join();
  const MutexLock lock(mutex_);
  if (book_.waiting() == 0) return;
  options_.warn(fmt::format(
      "events: the gateway ends, and the last events of {} devices are not kept; it will ask for "
      "them once more: {}",
      book_.waiting(), state_.trouble));
}

void EventLog::Add(Batch batch) {
  {
    const MutexLock lock(mutex_);
    book_.Add(std::move(batch));
  }
  due_.notify_one();
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
}

EventsState EventLog::state() const {
  const MutexLock lock(mutex_);
  EventsState state = state_;
  state.waiting = book_.waiting();
  state.newest = book_.newest();
  state.repeats = book_.repeats();
  return state;
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
}

bool EventLog::Sleep() {
  MutexLock lock(mutex_);
  const Instant tick = options_.clocks().instant + kTick;
  // A disk that fails is left in peace until then.
  while (!stop_) {
    const bool rests = state_.disk == Disk::failing;
    if (state_.disk == Disk::opening || (book_.waiting() > 0 && !rests)) break;
    if (!rests) {
      lock.Wait(due_);
    } else if (!lock.WaitUntil(due_, tick)) {
      break;
    }
  }
  return !stop_;
}

Status EventLog::Open() {
  const auto opened = file_.Open();
  if (!opened) return {};
  if (!opened->put_aside.empty()) options_.warn("events: " + opened->put_aside);
  if (!opened->ok) return Error{opened->error};
  std::function<void()> tell;
  {
    const MutexLock lock(mutex_);
    book_.OnOpened(opened->contents.last, opened->contents.said);
    opened_ = true;
    tell = std::exchange(tell_opened_, {});
  }
  if (tell) tell();
  return {};
}

void EventLog::WriteDue() {
  if (options_.file.empty()) return;
  Status status = Open();
  std::vector<Batch> due;
  if (status) {
    {
      const MutexLock lock(mutex_);
      due = book_.Due();
    }
    status = file_.Write(due);
  }
  std::vector<Source> kept;
  {
    const MutexLock lock(mutex_);
    if (status) kept = book_.Kept(due.size());
    Show(status ? Disk::fine : Disk::failing, status ? std::string() : status.error());
  }
  if (!kept.empty()) options_.kept(kept);
}

/// The log hears of the first trouble and of its end.
void EventLog::Show(Disk disk, const std::string& trouble) {
  const bool was_in_trouble = !std::exchange(state_.trouble, trouble).empty();
  if (std::exchange(state_.disk, disk) != disk) state_.since = options_.clocks().wall;
  if (!trouble.empty() && !was_in_trouble) {
    options_.warn(fmt::format(
        "events: {}; devices are not asked for events until it works again, and keep them as long "
        "as they have room",
        trouble));
  } else if (trouble.empty() && was_in_trouble) {
    options_.inform("events: they are kept again in " + state_.file);
  }
}

}  // namespace baudgate::events
