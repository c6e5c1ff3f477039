// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/audit/audited_writes.h"

#include <fmt/format.h>

#include <array>
#include <utility>

#include "protocols/modbus_pdu/modbus_pdu.h"

namespace baudgate::audit {

std::string_view Name(Kind kind) {
  constexpr std::array<std::string_view, kKinds> kNames = {"point", "route", "denied", "loan"};
  return kNames[static_cast<std::size_t>(kind)];
}

std::string Clipped(std::string text) {
  if (text.size() <= kLongestText) return text;
  std::size_t end = kLongestText;
  // The cut must not be within a character of UTF-8.
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U) --end;
  text.resize(end);
  return text + "…";
}

std::string_view OutcomeOf(const WriteRecord& record) {
  return record.end ? Name(*record.end) : std::string_view("pending");
}

std::optional<WriteEnd> EndNamed(std::string_view name) {
  for (std::size_t i = 0; i < kWriteEnds; ++i) {
    const auto end = static_cast<WriteEnd>(i);
    if (Name(end) == name) return end;
  }
  return std::nullopt;
}

std::optional<Kind> KindNamed(std::string_view name) {
  for (std::size_t i = 0; i < kKinds; ++i) {
    if (Name(static_cast<Kind>(i)) == name) return static_cast<Kind>(i);
  }
  return std::nullopt;
}

namespace {

/// The record of a telegram has this text in place of a point's name.
constexpr const char* kTelegramPoint = "telegram";

/// If a command writes several points, only its first point is reported.
bus::DeniedWrite NotTaken(const bus::WriteCommand& command, WriteEnd end) {
  bus::DeniedWrite denied{
      .client = command.client, .request = command.request, .device = command.device, .end = end};
  if (!command.writes().empty()) denied.point = command.writes().front().point;
  return denied;
}

}  // namespace

AuditedWrites::AuditedWrites(const bus::PointStore& store, bus::CommandSink& inner, WriteLog& log,
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

bool AuditedWrites::Submit(bus::WriteCommand command) {
  const bool telegram = command.telegram() && !command.telegram()->reads;
  if (command.writes().empty() && !telegram) return inner_.Submit(std::move(command));
  const Now now = clocks_();
  // The lock is held until the command is queued, so that records and commands have the same order
  // even if several threads submit.
  const MutexLock lock(mutex_);
  if (stop_) return false;
  const auto place = room_.Take(command.client, command.abandoned);
  if (!place) {
    NoteBusy(command, now);
    return false;
  }
  Waiting waiting;
  waiting.place = *place;
  waiting.until = now.instant + kWaitForRecord;
  std::vector<Ticket> tickets;  // 0: there was no room for the record
  for (WriteRecord& record : RecordsOf(command, now)) {
    const auto ticket = log_.Begin(std::move(record));
    tickets.push_back(ticket.value_or(0));
    waiting.has_room = waiting.has_room && ticket;
    if (ticket) waiting.last = *ticket;
  }
  command.observers.push_back([this, tickets = std::move(tickets), began = now.instant](
                                  const bus::WriteCommand& ended, const WriteResult& result) {
    const Duration took = clocks_().instant - began;
    for (std::size_t i = 0; i < tickets.size(); ++i) {
      if (tickets[i] == 0) continue;
      const WriteResult one = ResultOf(result, i);
      Ending ending{one.end, one.reason, took};
      if (i < ended.before.size()) ending.before = ended.before[i];
      log_.End(tickets[i], ending);
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
  if (!point) record.point = kTelegramPoint;
  store_.Read(device, [&](const bus::DeviceRecord& its) {
    record.line = Clipped(its.line->name);
    record.device = Clipped(its.device->name);
    if (point) record.point = Clipped(its.device->points[*point].name);
  });
  return record;
}

WriteRecord AuditedWrites::RecordOf(const bus::WriteCommand& command, const bus::PointWrite& write,
                                    Now now) const {
  WriteRecord record = Named(Kind::point, command.device, write.point);
  record.time = record.last = now.wall;
  record.client = Clipped(command.client);
  record.request = command.request;
  record.before = write.before;
  record.value = write.shown;
  return record;
}

std::vector<WriteRecord> AuditedWrites::RecordsOf(const bus::WriteCommand& command, Now now) const {
  std::vector<WriteRecord> records;
  for (const bus::PointWrite& write : command.writes())
    records.push_back(RecordOf(command, write, now));
  if (!command.telegram()) return records;
  WriteRecord record = Named(Kind::point, command.device, std::nullopt);
  record.time = record.last = now.wall;
  record.client = Clipped(command.client);
  record.value = Clipped(command.telegram()->shown);
  records.push_back(std::move(record));
  return records;
}

void AuditedWrites::NoteBusy(const bus::WriteCommand& command, Now now) {
  for (WriteRecord& record : RecordsOf(command, now)) {
    record.kind = Kind::denied;
    record.end = WriteEnd::busy;
    record.reason = "not sent, because too many writes wait to be recorded";
    log_.Note(std::move(record), now.instant);
  }
  inner_.OnNotTaken(NotTaken(command, WriteEnd::busy));
}

void AuditedWrites::OnNotTaken(const bus::DeniedWrite& denied) {
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
  room_.Give(next->place);
  const bool kept =
      next->has_room && log_.WaitFor(next->last, next->until) == WriteLog::Written::yes;
  if (!kept && require_) {
    const std::string why = next->has_room ? log_.Trouble() : "too many writes wait to be recorded";
    inner_.OnNotTaken(NotTaken(next->command, WriteEnd::denied));
    next->command.End(
        {.end = WriteEnd::denied,
         .reason = "not sent, because the write cannot be recorded (audit: require): " + why});
  } else if (!inner_.Submit(next->command)) {
    next->command.End(
        {.end = WriteEnd::busy,
         .reason = "not sent, because too many writes wait for this line; try again"});
  }
  return true;
}

namespace {

constexpr const char* kLent = "lent";
constexpr const char* kBack = "back";

WriteRecord RecordOf(const Loan& loan, WallTime at) {
  WriteRecord record;
  record.kind = Kind::loan;
  record.time = record.last = at;
  record.client = Clipped(loan.client);
  record.line = loan.line;
  record.point = "port";
  return record;
}

void Keep(WriteLog& log, WriteRecord record, const std::string& how, Duration took) {
  if (const auto ticket = log.Begin(std::move(record))) {
    log.End(*ticket, {WriteEnd::ok, Clipped(how), took});
  }
}

}  // namespace

void BeginLoan(WriteLog& log, const Loan& loan, const std::string& how) {
  WriteRecord record = RecordOf(loan, loan.began.wall);
  record.value = std::string(kLent);
  Keep(log, std::move(record), how, {});
}

void EndLoan(WriteLog& log, const Loan& loan, const std::string& how, Now now) {
  WriteRecord record = RecordOf(loan, now.wall);
  record.before = std::string(kLent);
  record.value = std::string(kBack);
  Keep(log, std::move(record), how, now.instant - loan.began.instant);
}

namespace {

constexpr std::size_t kMostValues = 16;
constexpr std::size_t kMaskSize = 7;          // function, address, AND, OR
constexpr std::size_t kReadWriteHeader = 10;  // function, range to read, range to write, byte count

unsigned WordAt(View pdu, std::size_t place) {
  return static_cast<unsigned>(pdu[place] << 8U | pdu[place + 1]);
}

std::string Range(std::string_view what, unsigned start, unsigned count) {
  if (count == 1) return fmt::format("{} {}", what, start);
  return fmt::format("{} {}-{}", what, start, start + count - 1);
}

template <typename ValueAt>
Value ValuesOf(unsigned count, ValueAt value_at) {
  if (count == 1) return std::int64_t{value_at(0)};
  std::string text;
  for (unsigned i = 0; i < count; ++i) {
    if (i == kMostValues) return text + fmt::format(" … ({})", count);
    text += fmt::format("{}{}", i == 0 ? "" : " ", value_at(i));
  }
  return text;
}

Value RegistersOf(View data, unsigned count) {
  return ValuesOf(count, [data](unsigned i) { return WordAt(data, std::size_t{2} * i); });
}

void FillPlain(const modbus::PlainRequest& plain, WriteRecord& record) {
  const bool bits = modbus::IsAboutBits(plain.function);
  record.point = fmt::format("{:02} {}", static_cast<unsigned>(plain.function),
                             Range(bits ? "coil" : "holding", plain.start, plain.count));
  if (plain.function == modbus::kWriteCoil) {
    record.value = std::int64_t{plain.data[0] != 0};
  } else if (bits) {
    record.value = ValuesOf(plain.count, [&](unsigned i) {
      return (static_cast<unsigned>(plain.data[i / 8]) >> (i % 8)) & 1U;
    });
  } else {
    record.value = RegistersOf(plain.data, plain.count);
  }
}

/// Returns false if the lengths in the request do not fit each other.
bool FillReadWrite(View pdu, WriteRecord& record) {
  if (pdu.size() <= kReadWriteHeader) return false;
  const unsigned start = WordAt(pdu, 5);
  const unsigned count = WordAt(pdu, 7);
  const View data = pdu.subspan(kReadWriteHeader);
  if (count == 0 || count > modbus::kMostWrittenRegisters ||
      data.size() != std::size_t{2} * count) {
    return false;
  }
  record.point = "23 " + Range("holding", start, count);
  record.value = RegistersOf(data, count);
  return true;
}

/// Fills point and value from a request that writes. Returns false if the lengths in the request do
/// not fit each other.
bool Fill(View pdu, WriteRecord& record) {
  modbus::PlainRequest plain;
  if (modbus::IsPlainWrite(pdu[0])) {
    if (modbus::ParseRequest(pdu, plain) != modbus::kNoException) return false;
    FillPlain(plain, record);
  } else if (pdu[0] == modbus::kMaskWrite) {
    if (pdu.size() != kMaskSize) return false;
    record.point = fmt::format("22 holding {}", WordAt(pdu, 1));
    record.value = fmt::format("and {} or {}", WordAt(pdu, 3), WordAt(pdu, 5));
  } else if (pdu[0] == modbus::kReadWrite) {
    return FillReadWrite(pdu, record);
  }
  return true;
}

Ending EndingOf(const bus::RoutedReply& reply, bool broadcast) {
  if (reply.outcome == Outcome::refused) {
    const std::string why =
        reply.pdu.size() < 2 ? std::string("refused") : modbus::ExceptionText(reply.pdu[1]);
    return {WriteEnd::refused, why};
  }
  if (reply.outcome == Outcome::ok && !broadcast) return {WriteEnd::ok, {}};
  if (broadcast && (reply.sent || reply.outcome == Outcome::ok)) {
    return {WriteEnd::unknown, "no slave answers a broadcast"};
  }
  return {bus::EndUnheard(reply.sent), reply.reason};
}

}  // namespace

WriteRecord RecordOf(const RoutedWrite& write) {
  WriteRecord record;
  record.kind = Kind::route;
  record.time = record.last = write.asked.wall;
  record.client = Clipped(write.client);
  record.line = Clipped(write.target);
  record.device = fmt::format("unit {}", write.unit);
  record.point = fmt::format("{:02}", write.pdu[0]);
  // A slave may act on a request with odd lengths, so its record has at least the first address.
  const std::size_t place = write.pdu[0] == modbus::kReadWrite ? 5 : 1;
  if (!Fill(write.pdu, record) && write.pdu.size() >= place + 2) {
    record.point += fmt::format(" {} {}", modbus::IsAboutBits(write.pdu[0]) ? "coil" : "holding",
                                WordAt(write.pdu, place));
    record.value = fmt::format("{} bytes in an unusual form", write.pdu.size());
  }
  return record;
}

Witness::Witness(WriteLog& log, const RoutedWrite& write)
    : log_(log),
      record_(RecordOf(write)),
      asked_(write.asked.instant),
      broadcast_(write.broadcast) {}

Witness::~Witness() {
  if (!told_) Tell({WriteEnd::unknown, "the gateway got no result for this write"});
}

Witness::Done Witness::Watch(std::shared_ptr<Witness> witness, Done done) {
  return [witness = std::move(witness), done = std::move(done)](bus::RoutedReply reply) {
    witness->Tell(EndingOf(reply, witness->broadcast_));
    done(std::move(reply));
  };
}

void Witness::Deny(WriteEnd end, const std::string& reason) {
  record_.kind = Kind::denied;
  Tell({end, reason});
}

void Witness::Tell(const Ending& ending) {
  told_ = true;
  record_.end = ending.end;
  record_.reason = Clipped(ending.reason);
  log_.Note(record_, asked_);
}

}  // namespace baudgate::audit
