// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/audit/audited_writes.h"

#include <utility>
#include <vector>

#include "gateway/bus/points/conversion.h"

namespace baudgate::audit {
namespace {

/// In the place of a point's name.
constexpr const char* kTelegramPoint = "telegram";

/// Its first point stands for all.
DeniedWrite NotTaken(const WriteCommand& command, WriteEnd end) {
  DeniedWrite denied{
      .client = command.client, .request = command.request, .device = command.device, .end = end};
  if (!command.writes().empty()) denied.point = command.writes().front().point;
  return denied;
}

}  // namespace

AuditedWrites::AuditedWrites(const PointStore& store, CommandSink& inner, WriteLog& log,
                             config::Audit audit, std::function<Now()> clocks)
    : store_(store),
      inner_(inner),
      log_(log),
      require_(audit == config::Audit::require),
      clocks_(std::move(clocks)),
      worker_("audit wait", [this](bool) {
        while (HandOn()) {
        }
        return kWhenWoken;
      }) {}

bool AuditedWrites::Submit(WriteCommand command) {
  const bool telegram = command.telegram() && !command.telegram()->reads;
  if (command.writes().empty() && !telegram) return inner_.Submit(std::move(command));  // it reads
  const Now now = clocks_();
  // Held until it waits: records and commands have one order, also if several threads submit.
  const MutexLock lock(mutex_);
  if (stop_) return false;
  if (waiting_.full()) {
    NoteBusy(command, now);
    return false;
  }
  Waiting waiting;
  waiting.until = now.instant + kWaitForRecord;
  std::vector<Ticket> tickets;  // 0: there was no room for it
  for (WriteRecord& record : RecordsOf(command, now)) {
    const auto ticket = log_.Begin(std::move(record));
    tickets.push_back(ticket.value_or(0));
    waiting.has_room = waiting.has_room && ticket;
    if (ticket) waiting.last = *ticket;
  }
  command.observers.push_back(
      [this, tickets = std::move(tickets), began = now.instant](const WriteResult& result) {
        const Duration took = clocks_().instant - began;
        for (std::size_t i = 0; i < tickets.size(); ++i) {
          if (tickets[i] == 0) continue;
          const WriteResult one = ResultOf(result, i);
          log_.End(tickets[i], {one.end, one.reason, took});
        }
      });
  waiting.command = std::move(command);
  waiting_.Put(std::move(waiting));
  worker_.Wake();
  return true;
}

WriteRecord AuditedWrites::Named(Kind kind, std::uint32_t device,
                                 std::optional<std::uint32_t> point) const {
  WriteRecord record;
  record.kind = kind;
  record.line = Clipped(store_.line(device).name);
  record.device = Clipped(store_.device(device).name);
  record.point = point ? Clipped(store_.device(device).points[*point].name) : kTelegramPoint;
  return record;
}

WriteRecord AuditedWrites::RecordOf(const WriteCommand& command, const PointWrite& write,
                                    Now now) const {
  const config::Point& point = store_.device(command.device).points[write.point];
  WriteRecord record = Named(Kind::point, command.device, write.point);
  record.time = record.last = now.wall;
  record.client = Clipped(command.client);
  record.request = command.request;
  record.before = write.before;
  record.value = ToSample(point, {write.point, write.raw}).value;
  return record;
}

std::vector<WriteRecord> AuditedWrites::RecordsOf(const WriteCommand& command, Now now) const {
  std::vector<WriteRecord> records;
  for (const PointWrite& write : command.writes()) records.push_back(RecordOf(command, write, now));
  if (!command.telegram()) return records;
  WriteRecord record = Named(Kind::point, command.device, std::nullopt);
  record.time = record.last = now.wall;
  record.client = Clipped(command.client);
  record.value = Clipped(command.telegram()->shown);
  records.push_back(std::move(record));
  return records;
}

void AuditedWrites::NoteBusy(const WriteCommand& command, Now now) {
  for (WriteRecord& record : RecordsOf(command, now)) {
    record.kind = Kind::denied;
    record.end = WriteEnd::busy;
    record.reason = "too many writes wait for their records";
    log_.Note(std::move(record), now.instant);
  }
  inner_.OnNotTaken(NotTaken(command, WriteEnd::busy));
}

void AuditedWrites::OnNotTaken(const DeniedWrite& denied) {
  const Now now = clocks_();
  WriteRecord record = Named(Kind::denied, denied.device, denied.point);
  record.time = record.last = now.wall;
  record.client = Clipped(denied.client);
  record.request = denied.request;
  record.value = denied.value;
  record.end = denied.end;
  record.reason = Clipped(denied.reason);
  log_.Note(std::move(record), now.instant);
  inner_.OnNotTaken(denied);
}

void AuditedWrites::Stop() {
  {
    const MutexLock lock(mutex_);
    stop_ = true;
  }
  worker_.Stop();
}

bool AuditedWrites::HandOn() {
  auto next = waiting_.Take();
  if (!next) return false;
  const bool kept =
      next->has_room && log_.WaitFor(next->last, next->until) == WriteLog::Written::yes;
  if (!kept && require_) {
    const std::string why = next->has_room ? log_.Trouble() : "too many records wait already";
    inner_.OnNotTaken(NotTaken(next->command, WriteEnd::denied));
    next->command.End({.end = WriteEnd::denied, .reason = "its record cannot be kept: " + why});
  } else if (!inner_.Submit(next->command)) {
    next->command.End({.end = WriteEnd::busy, .reason = "too many writes wait for the line"});
  }
  return true;
}

}  // namespace baudgate::audit
