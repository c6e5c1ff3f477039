// Fuzzes the reader of the audit file. The first byte of the input chooses: damage to a good file
// (positions of two bytes, each with the byte to write there); or rows of any type and size in a
// table without constraints. Each field of a row is a byte for its type and its content.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/status/records_json.h"
#include "gateway/records/audit/audit_log.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/target.h"
#include "tests/gateway/records/audit/faulty_disk.h"

namespace baudgate::fuzz {
namespace {

using namespace audit;

constexpr const char* kFile = "/nowhere/events.db";
constexpr int kRows = 30;
constexpr int kFields = 16;

WriteRecord Example(int i) {
  WriteRecord record;
  record.time = record.last = WallTime(std::chrono::seconds(1'790'000'000 + i));
  record.client = "192.0.2.5:" + std::to_string(40'000 + i);
  record.line = "bay-1";
  record.device = "feeder-1";
  record.point = "group";
  record.value = i % 2 == 0 ? Value(std::int64_t{i}) : Value(0.5 * i);
  return record;
}

std::vector<char> GoodFile() {
  FaultyDisk disk;
  {
    AuditFile file(kFile, disk.vfs());
    AuditBook book;
    for (int i = 0; i < kRows; ++i) {
      const auto ticket = book.Begin(Example(i));
      if (i % 3 != 0) book.End(*ticket, {WriteEnd::ok, {}, 5ms});
    }
    Require(file.Open()->ok, "a new file can be made");
    std::vector<Draft> drafts = book.Due();
    Require(file.Write(drafts).ok(), "and written");
  }
  return disk.files.at(kFile)->now;
}

void ReadAll(records::Database& database, PageQuery query) {
  for (int pages = 0; pages < 5; ++pages) {
    const auto page = ReadPage(database, query);
    if (!page) return Require(!page.error().empty(), "a refusal has words");
    Require(page->records.size() <= kPage, "a page is bounded");
    for (const WriteRecord& record : page->records) {
      Require(record.client.size() <= audit::kLongestText + 3, "texts are bounded");
      Require(record.count >= 1 && record.took >= Duration::zero(), "numbers are in their range");
    }
    const std::string text = status::PageJson(*page).dump(
        -1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
    Require(text.size() < 2'000'000 && text.find('\n') == std::string::npos, "one bounded line");
    Require(page->next > query.after || page->records.empty(), "pages go on");
    if (!page->more) return;
    query.after = page->next;
  }
}

void ReadDamaged(Input& input) {
  static const std::vector<char> good = GoodFile();
  FaultyDisk disk;
  auto file = std::make_shared<FaultyDisk::File>();
  file->now = good;
  while (!input.empty()) {
    const std::size_t place = static_cast<std::size_t>(input.U8() << 8U | input.U8());
    file->now[place % good.size()] = static_cast<char>(input.U8());
  }
  file->synced = file->now;
  disk.files[kFile] = file;
  {
    records::Database database(kFile, records::Database::Mode::write, disk.vfs());
    if (database.is_open()) ReadAll(database, {});
  }
  const records::OpenedEvents opened = records::OpenEvents(kFile, disk.vfs());
  Require(opened.database || !opened.error.empty(), "a refusal has words");
}

Value AnyField(Input& input) {
  switch (input.Below(5)) {
    case 0:
      return {};
    case 1: {
      std::uint64_t bits = 0;
      for (const std::uint8_t byte : input.Take(8)) bits = bits << 8U | byte;
      return static_cast<std::int64_t>(bits);
    }
    case 2:
      return 1e300 * static_cast<double>(input.U8()) - 1e302;
    case 3:
      return std::string(1000, static_cast<char>(input.U8()));
    default: {
      const View text = input.TakeCounted();
      return std::string(text.begin(), text.end());
    }
  }
}

void ReadRows(Input& input) {
  records::Database database(":memory:", records::Database::Mode::write);
  database.Execute(
      "CREATE TABLE writes (seq, kind, time, last, client, line, device, point, old, first, new, "
      "outcome, reason, took, count, settled)");
  const bool settled = input.U8() % 2 == 1;
  while (!input.empty()) {
    records::Statement insert(database,
                              "INSERT INTO writes VALUES (?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?)");
    for (int field = 1; field <= kFields; ++field) insert.Bind(field, AnyField(input));
    Require(insert.Run(), "a row goes in");
  }
  const auto ok = database.First("SELECT count(*) FROM writes WHERE outcome='ok' AND seq>0");
  const auto page = ReadPage(database, {});
  if (!page) return Require(!page.error().empty(), "a refusal has words");
  std::int64_t claimed = 0;
  for (const WriteRecord& record : page->records) claimed += record.end == WriteEnd::ok ? 1 : 0;
  Require(claimed <= std::get<std::int64_t>(ok), "only ok is a success");
  PageQuery query;
  if (settled) query.order = PageQuery::Order::settled;
  query.since = WallTime{};
  if (const auto since = ReadPage(database, query)) status::PageJson(*since);
}

void FuzzAuditPage(View bytes) {
  Input input(bytes);
  if (input.U8() % 2 == 0) {
    ReadDamaged(input);
  } else {
    ReadRows(input);
  }
}

const Registered kAuditPage("audit_page", FuzzAuditPage);

}  // namespace
}  // namespace baudgate::fuzz
