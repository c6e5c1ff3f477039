// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/round_writer.h"

#include <algorithm>
#include <utility>

namespace baudgate::events {

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

/// The commit that ends a trouble of the disk adds an event, so the last round needs another
/// commit.
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

/// Reads one page a round, so that the audit, which shares the thread, need not wait for all pages.
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
      fed.back().kept.reset();  // outputs have no use for it
    }
  }
  feed_->Add(std::move(fed));
}

}  // namespace baudgate::events
