// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/audit/audit_log.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace baudgate::audit {

std::optional<Ticket> AuditBook::Begin(WriteRecord record) {
  const auto kind = static_cast<std::size_t>(record.kind);
  if (held_[kind] >= kLimits[kind]) {
    ++lost_;
    return std::nullopt;
  }
  ++held_[kind];
  const Ticket ticket = next_++;
  Entry& entry = entries_[ticket];
  entry.record = std::move(record);
  entry.record.seq = 0;
  ++due_;
  ++unwritten_;
  return ticket;
}

void AuditBook::Changed(Entry& entry) {
  if (entry.written_version == entry.version) ++due_;
  ++entry.version;
}

void AuditBook::End(Ticket ticket, const Ending& ending) {
  const auto found = entries_.find(ticket);
  if (found == entries_.end() || found->second.ended) return;
  Entry& entry = found->second;
  Changed(entry);
  entry.ended = true;
  entry.record.end = ending.end;
  entry.record.reason = Clipped(ending.reason);
  entry.record.took = ending.took;
  if (ending.before) entry.record.before = *ending.before;
}

void AuditBook::Change(Ticket ticket, const WriteRecord& record, bool last) {
  const auto found = entries_.find(ticket);
  if (found == entries_.end() || found->second.ended) return;
  Entry& entry = found->second;
  Changed(entry);
  entry.ended = last;
  const std::int64_t seq = entry.record.seq;
  entry.record = record;
  entry.record.seq = seq;
}

std::vector<Draft> AuditBook::Due() const {
  std::vector<Draft> drafts;
  drafts.reserve(due_);
  for (const auto& [ticket, entry] : entries_) {
    if (entry.written_version == entry.version) continue;
    drafts.push_back({ticket, entry.version, entry.ended, entry.record});
  }
  return drafts;
}

void AuditBook::OnWritten(const std::vector<Draft>& drafts) {
  for (const Draft& draft : drafts) {
    newest_written_ = std::max(newest_written_, draft.ticket);
    const auto found = entries_.find(draft.ticket);
    if (found == entries_.end()) continue;
    Entry& entry = found->second;
    if (entry.written_version == 0) --unwritten_;
    entry.written_version = draft.version;
    entry.record.seq = draft.record.seq;
    if (entry.version != draft.version) continue;
    --due_;
    if (!entry.ended) continue;
    --held_[static_cast<std::size_t>(entry.record.kind)];
    entries_.erase(found);
  }
}

void AuditBook::NewFile() {
  for (auto& [ticket, entry] : entries_) {
    if (entry.written_version == entry.version) ++due_;
    if (entry.written_version != 0) ++unwritten_;
    entry.written_version = 0;
    entry.record.seq = 0;
  }
}

namespace {

/// Returns the reason without its numbers, so that the reasons "40.1 is above the maximum, 40" and
/// "41 is above the maximum, 40" are equal.
std::string ReasonOf(const WriteRecord& record) {
  std::string reason = record.reason;
  std::erase_if(reason, [](char c) { return (c >= '0' && c <= '9') || c == '.' || c == '-'; });
  return reason;
}

std::string KeyOf(const WriteRecord& record) {
  return fmt::format("{}\n{}\n{}\n{}\n{}\n{}", Name(record.kind), AddressOf(record.client),
                     record.line, record.device, record.point, OutcomeOf(record));
}

std::string ClientOf(const WriteRecord& record) {
  return fmt::format("{}\n{}", Name(record.kind), AddressOf(record.client));
}

}  // namespace

std::string AddressOf(const std::string& client) {
  const auto colon = client.rfind(':');
  if (colon == std::string::npos || colon + 1 == client.size()) return client;
  const bool port = std::all_of(client.begin() + static_cast<std::ptrdiff_t>(colon) + 1,
                                client.end(), [](char c) { return c >= '0' && c <= '9'; });
  return port ? client.substr(0, colon) : client;
}

WriteRecord Repeats::Shared(WriteRecord record) const {
  const auto client = of_client_.find(ClientOf(record));
  const bool many_points = client != of_client_.end() && client->second >= kMostOfClient;
  const bool many_clients = of_kind_[static_cast<std::size_t>(record.kind)] >= kMost;
  if (many_points || many_clients) {
    record.line = record.device = {};
    record.point = kManyPoints;
    record.before = record.value = {};
  }
  if (many_clients) record.client = kManyClients;
  return record;
}

void Repeats::Count(const Open& open, bool more) {
  if (open.shared) return;
  const auto client = of_client_.try_emplace(ClientOf(open.record)).first;
  std::size_t& of_kind = of_kind_[static_cast<std::size_t>(open.record.kind)];
  client->second = more ? client->second + 1 : client->second - 1;
  of_kind = more ? of_kind + 1 : of_kind - 1;
  if (client->second == 0) of_client_.erase(client);
}

void Repeats::Add(WriteRecord record, Instant now) {
  Key key = KeyOf(record) + "\n" + ReasonOf(record);
  auto found = open_.find(key);
  bool shared = false;
  if (found == open_.end()) {
    record = Shared(std::move(record));
    shared = record.point == kManyPoints;
    if (shared) key = KeyOf(record);
    found = open_.find(key);
  }
  if (found == open_.end()) {
    const auto ticket = book_.Begin(record);
    if (!ticket) return;
    const Open open{std::move(record), *ticket, now + kWindow, false, shared};
    Count(open, true);
    open_.emplace(std::move(key), open);
    return;
  }
  Open& open = found->second;
  WriteRecord& kept = open.record;
  if (kept.count++ == 1) kept.first = kept.value;
  kept.last = record.last;
  kept.value = std::move(record.value);
  kept.reason = std::move(record.reason);
  kept.took = record.took;
  open.changed = true;
}

void Repeats::Tick(Instant now) {
  for (auto entry = open_.begin(); entry != open_.end();) {
    Open& open = entry->second;
    const bool over = open.until <= now;
    if (over || open.changed) book_.Change(open.ticket, open.record, over);
    open.changed = false;
    if (over) Count(open, false);
    entry = over ? open_.erase(entry) : std::next(entry);
  }
}

void Repeats::Close() {
  for (auto& [key, open] : open_) book_.Change(open.ticket, open.record, true);
  open_.clear();
  of_kind_ = {};
  of_client_.clear();
}

namespace {

constexpr const char* kStalled = "the disk does not answer in time (check it with dmesg)";

AuditLog::Options WithWriter(AuditLog::Options options) {
  if (!options.writer) options.writer = std::make_shared<records::EventsWriter>();
  return options;
}

}  // namespace

AuditLog::AuditLog(Options options)
    : options_(WithWriter(std::move(options))),
      file_(options_.file, options_.vfs, kRooms, options_.writer),
      disk_(options_.clocks().wall),
      worker_(options_.writer->thread, [this](bool last) { return Round(last); }) {
  {
    const MutexLock lock(mutex_);
    if (options_.file.empty()) SetDisk(records::Disk::failing, options_.why_no_file);
  }
  worker_.Start();
}

AuditLog::~AuditLog() {
  worker_.Stop();
  const MutexLock lock(mutex_);
  if (book_.unwritten() == 0) return;
  options_.warn(fmt::format("audit: the gateway stops, and {} records of writes are lost: {}",
                            book_.unwritten(), disk_.trouble()));
}

std::optional<Ticket> AuditLog::Begin(WriteRecord record) {
  std::optional<Ticket> ticket;
  {
    const MutexLock lock(mutex_);
    ticket = book_.Begin(std::move(record));
  }
  worker_.Wake();
  return ticket;
}

void AuditLog::End(Ticket ticket, const Ending& ending) {
  {
    const MutexLock lock(mutex_);
    book_.End(ticket, ending);
  }
  worker_.Wake();
}

void AuditLog::Note(WriteRecord record, Instant asked) {
  const Instant now = options_.clocks().instant;
  record.took = now - asked;
  bool due = false;
  {
    const MutexLock lock(mutex_);
    repeats_.Add(std::move(record), now);
    due = book_.due();
  }
  if (due) worker_.Wake();  // a repeat becomes due at the next Repeats::Tick
}

WriteLog::Written AuditLog::WaitFor(Ticket ticket, Instant until) {
  MutexLock lock(mutex_);
  while (book_.newest_written() < ticket) {
    if (disk_.is_failing()) return Written::failing;
    if (disk_.is_stalled()) return Written::late;
    if (lock.WaitUntil(changed_, until) || book_.newest_written() >= ticket) continue;
    if (disk_.is_fine()) SetDisk(records::Disk::stalled, kStalled);
    return Written::late;
  }
  return Written::yes;
}

void AuditLog::Watch() {
  {
    const MutexLock lock(mutex_);
    const bool late = watch_.Tick(book_.due());
    if (late && disk_.is_fine()) SetDisk(records::Disk::stalled, kStalled);
    if (!watch_.look_due()) return;
    look_at_ = {};
  }
  worker_.Wake();
}

std::string AuditLog::Trouble() const {
  const MutexLock lock(mutex_);
  if (disk_.is_opening()) return options_.file.string() + " is being checked";
  return disk_.trouble();
}

AuditState AuditLog::state() const {
  const MutexLock lock(mutex_);
  AuditState state;
  disk_.Fill(state);
  state.put_aside = disk_.put_aside();
  state.file = options_.file.string();
  state.require = options_.require;
  state.waiting = book_.unwritten();
  state.lost = book_.lost();
  return state;
}

Result<Page> AuditLog::Read(const PageQuery& query) const {
  if (options_.file.empty()) return Error{options_.why_no_file};
  {
    const MutexLock lock(mutex_);
    if (disk_.is_stalled()) return Error{disk_.trouble()};
    if (disk_.is_opening()) return Page{.records = {}, .next = query.after};
  }
  bool damaged = false;
  auto page = ReadPage(options_.file, query, &damaged);
  if (damaged) {
    const MutexLock lock(mutex_);
    watch_.Doubt();
  }
  return page;
}

std::optional<bus::PastRequests> AuditLog::Past() const {
  if (options_.file.empty()) return bus::PastRequests();
  const MutexLock lock(mutex_);
  if (past_) return bus::PastRequests{*past_, true};
  // With `require`, no write is sent while the disk fails, so numbered requests can wait.
  if (options_.require || !disk_.is_failing()) return std::nullopt;
  return bus::PastRequests{{}, false};
}

Instant AuditLog::Round(bool last) {
  records::FileWatch::Look look;
  {
    const MutexLock lock(mutex_);
    const Instant now = options_.clocks().instant;
    if (!last && !IsTime(now)) return look_at_;
    repeats_.Tick(now);
    if (last) repeats_.Close();
    look = watch_.TakeLook();
    watch_.Begin();
  }
  WriteDue(look);
  const MutexLock lock(mutex_);
  const bool idle = !disk_.is_failing() && repeats_.empty();
  look_at_ = idle ? kWhenWoken : options_.clocks().instant + kTick;
  return look_at_;
}

/// True if records can be written now. A disk that has failed is not tried again before look_at_.
bool AuditLog::IsTime(Instant now) const {
  if (disk_.is_opening() || now >= look_at_) return true;
  return book_.due() && !disk_.is_failing();
}

void AuditLog::WriteDue(records::FileWatch::Look look) {
  if (options_.file.empty()) return;
  Status status;
  if (look.whole && file_.is_open()) status = file_.Check();
  if (!status) return OnWritten(status, {});
  if (const auto opened = file_.Open()) {
    if (!opened->put_aside.empty()) options_.warn("audit: " + opened->put_aside);
    if (opened->lost) options_.warn("audit: " + *opened->lost);
    if (!opened->ok) status = Error{opened->error};
    if (opened->ok && !std::exchange(was_open_, true)) {
      if (options_.unsettled) options_.unsettled(file_.unsettled());
      auto past = file_.PastRequestsAt(options_.clocks().wall);
      const MutexLock lock(mutex_);
      past_ = past ? std::move(*past) : std::vector<bus::PastRequest>();
    }
    const MutexLock lock(mutex_);
    if (opened->new_file) book_.NewFile();
    look.due = true;
  }
  if (look.due) SetPutAside();
  std::vector<Draft> drafts;
  if (status) {
    {
      const MutexLock lock(mutex_);
      drafts = book_.Due();
    }
    status = file_.Write(drafts);
  }
  OnWritten(status, drafts);
  if (status) file_.Tidy(options_.clocks());
}

void AuditLog::OnWritten(const Status& status, const std::vector<Draft>& drafts) {
  {
    const MutexLock lock(mutex_);
    watch_.End();
    if (status) book_.OnWritten(drafts);
    SetDisk(status ? records::Disk::fine : records::Disk::failing,
            status ? std::string() : status.error());
  }
  changed_.notify_all();
}

void AuditLog::SetPutAside() {
  std::vector<std::string> files = file_.PutAside();
  const MutexLock lock(mutex_);
  disk_.SetPutAside(std::move(files));
}

void AuditLog::SetDisk(records::Disk disk, const std::string& trouble) {
  const records::DiskCondition::News news = disk_.Set(disk, trouble, options_.clocks().wall);
  if (news.begun) options_.warn(fmt::format("audit: {}; {}", trouble, Consequence()));
  if (news.ended) {
    options_.inform("audit: writes are recorded again in " + options_.file.string());
  }
}

std::string AuditLog::Consequence() const {
  return options_.require
             ? "writes to points are refused until the file can be written (audit: require)"
             : "writes are still sent, and their records wait in memory until the file can be "
               "written (audit: best_effort)";
}

}  // namespace baudgate::audit
