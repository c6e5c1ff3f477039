// SPDX-License-Identifier: Apache-2.0
#include "gateway/events/event_log.h"

#include <algorithm>
#include <utility>

namespace baudgate::events {

EventLog::EventLog(Options options)
    : options_(std::move(options)),
      writer_(options_.writer ? options_.writer : std::make_shared<EventsWriter>()),
      pending_(options_, [this] { worker_.Wake(); }),
      queue_(options_, pending_),
      rounds_(options_, pending_),
      file_(options_.file, options_.vfs, writer_),
      worker_(writer_->thread, [this](bool last) { return Round(last); }) {
  if (options_.feed) options_.feed->Renumber(options_.sources);
  if (options_.feed) options_.feed->ServeWith([this](bool now) { rounds_.Look(now); });
  worker_.Start();
}

EventLog::~EventLog() {
  if (options_.feed) options_.feed->ServeWith({});
  queue_.TellEnd();
  worker_.Stop();
  for (const std::string& line : rounds_.LeftBehind()) options_.warn(line);
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
  bool damaged = false;
  auto page = ReadPage(options_.file, query, &damaged);
  if (damaged) rounds_.Doubt();
  return page;
}

Result<PastPage> EventLog::ReadPast(const PastQuery& query) const {
  if (options_.file.empty()) return Error{options_.why_no_file};
  if (state().disk == Disk::opening) return PastPage{.rows = {}, .next = query.after};
  bool damaged = false;
  auto page = events::ReadPast(options_.file, query, &damaged);
  if (damaged) rounds_.Doubt();
  return page;
}

/// The commit that ends a trouble of the disk adds an event, so the last round needs another
/// commit.
Instant EventLog::Round(bool last) {
  if (!last && !rounds_.Begin()) return rounds_.NextRound();
  do {
    WriteDue();
  } while (last && rounds_.goes_on());
  return rounds_.NextRound();
}

void EventLog::WriteDue() {
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

Status EventLog::Write(EventRounds::Round& round) {
  const auto cursors = options_.feed ? options_.feed->cursors().Due() : std::nullopt;
  round = rounds_.Take();
  if (options_.in_memory) return {};
  if (round.look.whole) {
    if (Status status = file_.Check(); !status) return status;
  }
  if (round.look.due) rounds_.SetPutAside(file_.PutAside());
  Status status = file_.Write(round.batches, cursors ? &*cursors : nullptr, round.records);
  if (status && cursors) options_.feed->cursors().OnKept(*cursors);
  return status;
}

void EventLog::TellAlarms(const std::vector<Batch>& batches) const {
  if (!options_.alarm) return;
  for (const Batch& batch : batches) {
    if (batch.told) continue;
    for (const EventRecord& event : batch.events) {
      if (event.alarm) options_.alarm(*event.alarm, event.alarm->seq == event.seq);
    }
  }
}

Status EventLog::Open() {
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
  if (options_.feed) {
    options_.feed->cursors().OnOpened(opened->contents.cursors);
    options_.feed->Begin(std::move(opened->contents.image));
  }
  const bool first = rounds_.OnOpened(opened->contents);
  if (first && options_.owed && !opened->contents.owed.empty()) {
    options_.owed(opened->contents.owed);
  }
  return {};
}

/// Reads one page a round, so that the audit, which shares the thread, need not wait for all pages.
void EventLog::ReadBacklog() {
  const auto after = options_.feed ? options_.feed->wanted() : std::nullopt;
  if (!after) return;
  auto events = options_.in_memory ? Result<std::vector<EventRecord>>(std::vector<EventRecord>())
                                   : file_.ReadBehind(*after);
  if (!events) return rounds_.Look(false);
  options_.feed->Supply(*after, std::move(*events));
  if (options_.feed->wanted()) rounds_.Look(true);
}

void EventLog::TellOwed(const std::vector<Batch>& batches) const {
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

void EventLog::Feed(const std::vector<Batch>& batches) {
  if (!options_.feed) return;
  std::vector<EventRecord> fed;
  for (const Batch& batch : batches) {
    for (const EventRecord& event : batch.events) {
      fed.push_back(event);
      fed.back().kept.reset();  // outputs have no use for it
    }
  }
  options_.feed->Add(std::move(fed));
}

}  // namespace baudgate::events
