// Helpers of the audit tests: a folder, records, and functions to read them back.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "gateway/records/audit/audit_log.h"

namespace baudgate::audit {

inline constexpr WallTime kWall = WallTime(std::chrono::hours(498'000));
inline constexpr Instant kStart = Instant(std::chrono::hours(1));

inline WriteRecord WrittenPoint(const std::string& client, std::int64_t value = 1,
                                const std::string& point = "group") {
  WriteRecord record;
  record.time = record.last = kWall;
  record.client = client;
  record.line = "bay-1";
  record.device = "feeder-1";
  record.point = point;
  record.before = std::int64_t{0};
  record.value = value;
  return record;
}

inline WriteRecord RouteWrite(const std::string& client, std::int64_t value) {
  WriteRecord record = WrittenPoint(client, value, "06 holding 100");
  record.kind = Kind::route;
  record.end = WriteEnd::ok;
  record.before = Value();
  return record;
}

inline std::vector<WriteRecord> ReadAll(records::Database& database,
                                        PageQuery::Order order = PageQuery::Order::seq) {
  std::vector<WriteRecord> all;
  PageQuery query;
  query.order = order;
  for (bool more = true; more;) {
    const auto page = ReadPage(database, query);
    if (!page) {
      ADD_FAILURE() << page.error();
      return all;
    }
    all.insert(all.end(), page->records.begin(), page->records.end());
    query.after = page->next;
    more = page->more;
  }
  return all;
}

inline std::vector<WriteRecord> ReadAll(const std::filesystem::path& file,
                                        const std::string& vfs = {}) {
  records::Database database(file.string(), records::Database::Mode::write, vfs);
  EXPECT_TRUE(database.is_open()) << database.error();
  return ReadAll(database);
}

class FolderTest : public ::testing::Test {
 protected:
  FolderTest() {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::path(::testing::TempDir()) /
              (std::string("baudgate-audit-") + test->test_suite_name() + "-" + test->name());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  ~FolderTest() override {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  std::filesystem::path file() const { return folder_ / "events.db"; }

  std::filesystem::path folder_;
};

inline Status Keep(AuditFile& file, AuditBook& book) {
  if (const auto opened = file.Open()) {
    if (opened->new_file) book.NewFile();
    if (!opened->ok) return Error{opened->error};
  }
  std::vector<Draft> drafts = book.Due();
  Status status = file.Write(drafts);
  if (status) book.OnWritten(drafts);
  return status;
}

}  // namespace baudgate::audit
