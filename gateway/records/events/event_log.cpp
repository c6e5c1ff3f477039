// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/event_log.h"

#include <fmt/format.h>

#include <utility>

#include "gateway/base/shown.h"

namespace baudgate::events {

EventRounds::EventRounds(const LogOptions& options, PendingEvents& pending)
    : options_(options), pending_(pending) {
  const MutexLock lock(pending_.mutex);
  if (options_.file.empty() && !options_.in_memory)
    SetDisk(records::Disk::failing, options_.why_no_file);
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
    SetDisk(records::Disk::stalled, "the disk does not answer in time (check it with dmesg)");
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
    if (oldest > 0) pending_.oldest = oldest;
    SetDisk(status ? records::Disk::fine : records::Disk::failing,
            status ? std::string() : status.error());
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
    lines.push_back(
        fmt::format("events: the gateway stops, and the last events of {} devices are not saved: "
                    "{}. The gateway reads these events again after its next start",
                    pending_.book.waiting(), pending_.disk.trouble()));
  }
  if (pending_.book.waiting_own() > 0) {
    lines.push_back(
        fmt::format("events: the gateway stops without having saved {} of the gateway itself: {}",
                    Plural(pending_.book.waiting_own(), "event"), pending_.disk.trouble()));
  }
  return lines;
}

/// Logs when a disk trouble begins and when it ends. The end is also stored as an event.
void EventRounds::SetDisk(records::Disk disk, const std::string& trouble) {
  const Now now = options_.clocks();
  const records::DiskCondition::News news = pending_.disk.Set(disk, trouble, now.wall);
  if (news.begun) {
    options_.warn(
        fmt::format("events: {}; devices are not polled for events until the file can be written. "
                    "The devices keep new events until their memory is full",
                    trouble));
  }
  if (!news.ended) return;
  const std::string file = options_.file.string();
  options_.inform("events: events are recorded again in " + file);
  if (!options_.tells_own) return;
  pending_.book.Tell(DiskTroubleRecord(file, news.ended->trouble, news.ended->since, now.wall),
                     now.instant);
}

RoundWriter::RoundWriter(const LogOptions& options, const EventQueue& queue, EventRounds& rounds)
    : options_(options),
      queue_(queue),
      rounds_(rounds),
      file_(options.file, options.vfs, options.writer),
      feed_(options.feed.get()),
      cursors_(options.cursors.get()) {}

void RoundWriter::Serve() {
  if (feed_ != nullptr) {
    feed_->Renumber(options_.sources);
    feed_->ServeWith([this] { rounds_.Look(true); });
  }
  if (cursors_ != nullptr) cursors_->OnDue([this] { rounds_.Look(false); });
}

void RoundWriter::StopServing() {
  if (feed_ != nullptr) feed_->ServeWith({});
  if (cursors_ != nullptr) cursors_->OnDue({});
}

std::vector<Consumer> RoundWriter::Consumers(std::int64_t oldest) const {
  std::vector<Consumer> consumers;
  if (cursors_ == nullptr) return consumers;
  for (const auto& [name, cursor] : cursors_->all()) {
    consumers.push_back({name, cursor.seq, std::max<std::int64_t>(0, oldest - 1 - cursor.seq)});
  }
  return consumers;
}

/// In the last round, a commit can add an event, for example that the disk works again, so commits
/// go on until nothing waits.
Instant RoundWriter::Run(bool last) {
  if (!last && !rounds_.Begin()) return rounds_.NextRound();
  do {
    WriteDue();
  } while (last && rounds_.goes_on());
  return rounds_.NextRound();
}

void RoundWriter::WriteDue() {
  Status status = Open();
  if (status && file_.lacks_alarms()) status = file_.WriteAlarms(queue_.Alarms());
  EventRounds::Round round;
  if (status) status = Write(round);
  if (status) Feed(round.batches);
  if (status) TellOwed(round.batches);
  const std::vector<Source> kept = rounds_.Done(round, status, file_.oldest());
  TellAlarms(status ? round.batches : rounds_.Unsaved());
  if (status) ReadBacklog();
  if (!kept.empty()) options_.kept(kept);
  AnswerAcks(round.acks, status ? std::string() : status.error());
}

Status RoundWriter::Write(EventRounds::Round& round) {
  const auto cursors = cursors_ != nullptr ? cursors_->Due() : std::nullopt;
  round = rounds_.Take();
  if (options_.in_memory) return {};
  if (round.look.whole) {
    if (Status status = file_.Check(); !status) return status;
  }
  if (round.look.due) rounds_.SetPutAside(file_.PutAside());
  Status status = file_.Write(round.batches, cursors ? &*cursors : nullptr, round.records);
  if (status && cursors) cursors_->OnKept(*cursors);
  return status;
}

void RoundWriter::TellAlarms(const std::vector<Batch>& batches) const {
  if (!options_.alarm) return;
  for (const Batch& batch : batches) {
    if (batch.told) continue;
    for (const EventRecord& event : batch.events) {
      if (event.alarm) options_.alarm(*event.alarm, event.alarm->seq == event.seq);
    }
  }
}

Status RoundWriter::Open() {
  if (options_.in_memory) {
    if (!queue_.opened()) rounds_.OnOpened({});
    return {};
  }
  if (options_.file.empty()) return Error{options_.why_no_file};
  auto opened = file_.Open();
  if (!opened) return {};
  if (!opened->put_aside.empty()) options_.warn("events: " + opened->put_aside);
  if (opened->lost) options_.warn("events: " + *opened->lost);
  if (!opened->ok) return Error{opened->error};
  rounds_.SetPutAside(file_.PutAside());
  if (cursors_ != nullptr) cursors_->OnOpened(opened->contents.cursors);
  if (feed_ != nullptr) feed_->Begin(std::move(opened->contents.image));
  const bool first = rounds_.OnOpened(opened->contents);
  if (first && options_.owed && !opened->contents.owed.empty()) {
    options_.owed(opened->contents.owed);
  }
  return {};
}

/// Reads one page in each round, so that the audit, which uses the same thread, does not wait for
/// all pages.
void RoundWriter::ReadBacklog() {
  const auto after = feed_ != nullptr ? feed_->wanted() : std::nullopt;
  if (!after) return;
  auto events = options_.in_memory ? Result<std::vector<EventRecord>>(std::vector<EventRecord>())
                                   : file_.ReadBehind(*after);
  if (!events) return rounds_.Look(false);
  feed_->Supply(*after, std::move(*events));
  if (feed_->wanted()) rounds_.Look(true);
}

void RoundWriter::TellOwed(const std::vector<Batch>& batches) const {
  std::vector<OwedRecord> owed;
  for (const Batch& batch : batches) {
    for (const EventRecord& event : batch.events) {
      if (event.record.empty() || event.kept) continue;
      owed.push_back(
          {event.seq, event.line, event.device, event.record, event.device_time, event.clock});
    }
  }
  if (options_.owed && !owed.empty()) options_.owed(owed);
}

void RoundWriter::Feed(const std::vector<Batch>& batches) {
  if (feed_ == nullptr) return;
  std::vector<EventRecord> fed;
  for (const Batch& batch : batches) {
    for (const EventRecord& event : batch.events) {
      fed.push_back(event);
      fed.back().kept.reset();  // outputs do not use the record's values
    }
  }
  feed_->Add(std::move(fed));
}

namespace {

LogOptions WithWriter(LogOptions options) {
  if (!options.writer) options.writer = std::make_shared<records::EventsWriter>();
  return options;
}

}  // namespace

EventLog::EventLog(Options options)
    : options_(WithWriter(std::move(options))),
      pending_(options_, [this] { worker_.Wake(); }),
      queue_(options_, pending_),
      rounds_(options_, pending_),
      round_writer_(options_, queue_, rounds_),
      worker_(options_.writer->thread, [this](bool last) { return round_writer_.Run(last); }) {
  round_writer_.Serve();
  worker_.Start();
}

EventLog::~EventLog() {
  round_writer_.StopServing();
  queue_.TellEnd();
  worker_.Stop();
  for (const std::string& line : rounds_.LeftBehind()) options_.warn(line);
}

EventsState EventLog::state() const {
  EventsState state = queue_.state();
  state.consumers = round_writer_.Consumers(state.oldest);
  return state;
}

Result<Page> EventLog::Read(const PageQuery& query) const {
  if (options_.file.empty()) return Error{options_.why_no_file};
  if (state().disk == records::Disk::opening) return Page{.records = {}, .next = query.after};
  bool damaged = false;
  auto page = ReadPage(options_.file, query, &damaged);
  if (damaged) rounds_.Doubt();
  return page;
}

Result<PastPage> EventLog::ReadPast(const PastQuery& query) const {
  if (options_.file.empty()) return Error{options_.why_no_file};
  if (state().disk == records::Disk::opening) return PastPage{.rows = {}, .next = query.after};
  bool damaged = false;
  auto page = events::ReadPast(options_.file, query, &damaged);
  if (damaged) rounds_.Doubt();
  return page;
}

}  // namespace baudgate::events
