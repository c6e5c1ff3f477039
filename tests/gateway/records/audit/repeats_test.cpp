// Writes that come again and again are one record a minute, and hostile ones never fill the memory.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>

#include "gateway/records/audit/audit_log.h"
#include "tests/gateway/records/audit/fixture.h"

namespace baudgate::audit {
namespace {

class RepeatsTest : public ::testing::Test {
 protected:
  /// What the file has after all due records went to it.
  const std::vector<WriteRecord>& Rows() {
    std::vector<Draft> drafts = book_.Due();
    for (Draft& draft : drafts) {
      WriteRecord& record = draft.record;
      if (record.seq == 0) {
        record.seq = static_cast<std::int64_t>(rows_.size()) + 1;
        rows_.emplace_back();
      }
      rows_[static_cast<std::size_t>(record.seq) - 1] = record;
    }
    book_.OnWritten(drafts);
    return rows_;
  }
  void Add(WriteRecord record) {
    record.last = kWall + (now_ - kStart);
    repeats_.Add(std::move(record), now_);
  }

  AuditBook book_;
  Repeats repeats_{book_};
  Instant now_ = kStart;
  std::vector<WriteRecord> rows_;
};

TEST_F(RepeatsTest, ASetPointEvery30MsIsARowAMinute) {
  for (std::int64_t i = 0; i < 4000; ++i, now_ += 30ms) {
    Add(RouteWrite("192.0.2.5:40312", i));
    if (i % 33 == 0) repeats_.Tick(now_);
  }
  repeats_.Close();
  const auto& rows = Rows();
  ASSERT_GE(rows.size(), 2U);
  ASSERT_LE(rows.size(), 3U);
  std::uint64_t count = 0;
  for (const WriteRecord& row : rows) count += row.count;
  EXPECT_EQ(count, 4000U);
  EXPECT_EQ(ToText(rows[0].first), "0");
  EXPECT_EQ(std::get<std::int64_t>(rows[0].value), static_cast<std::int64_t>(rows[0].count) - 1);
  EXPECT_GT(rows[0].last, rows[0].time + 59s);
  EXPECT_EQ(ToText(rows.back().value), "3999");
}

TEST_F(RepeatsTest, TheFirstIsThereAtOnceAndASingleOneIsNoRepeat) {
  Add(RouteWrite("a", 5));
  ASSERT_EQ(Rows().size(), 1U);
  EXPECT_FALSE(HasValue(Rows()[0].first));
  EXPECT_EQ(Rows()[0].count, 1U);
}

TEST_F(RepeatsTest, AnotherOutcomeRegisterOrClientIsAnotherRow) {
  Add(RouteWrite("192.0.2.5:1", 5));
  Add(RouteWrite("192.0.2.5:2", 5));  // it has connected anew
  WriteRecord refused = RouteWrite("192.0.2.5:1", 5);
  refused.end = WriteEnd::refused;
  Add(refused);
  WriteRecord other = RouteWrite("192.0.2.5:1", 5);
  other.point = "06 holding 101";
  Add(other);
  Add(RouteWrite("192.0.2.6:1", 5));
  repeats_.Tick(now_ + 1s);
  ASSERT_EQ(Rows().size(), 4U);
  EXPECT_EQ(Rows()[0].count, 2U);
}

TEST_F(RepeatsTest, ManyAddressesShareOneRecord) {
  constexpr int kWrites = 10'000;
  for (int i = 0; i < kWrites; ++i) {
    WriteRecord denied =
        WrittenPoint("10.0." + std::to_string(i / 256) + "." + std::to_string(i % 256) + ":502");
    denied.kind = Kind::denied;
    denied.end = WriteEnd::denied;
    Add(denied);
  }
  repeats_.Close();
  const auto& rows = Rows();
  EXPECT_EQ(rows.size(), Repeats::kMost + 1);
  std::uint64_t count = 0;
  for (const WriteRecord& row : rows) count += row.count;
  EXPECT_EQ(count, static_cast<std::uint64_t>(kWrites)) << "all are counted";
  EXPECT_EQ(rows.back().client, Repeats::kManyClients);
  EXPECT_EQ(book_.unwritten(), 0U);
}

TEST_F(RepeatsTest, AFloodHidesNobodyElse) {
  for (int i = 0; i < 5000; ++i) {
    WriteRecord record = RouteWrite("192.0.2.66:" + std::to_string(i), i);
    record.point = "06 holding " + std::to_string(i);
    Add(record);
    record.kind = Kind::denied;
    record.client = "10.1." + std::to_string(i / 256) + "." + std::to_string(i % 256) + ":1";
    Add(record);
  }
  Add(RouteWrite("192.0.2.5:40312", 7));
  repeats_.Tick(now_ + 1s);
  const auto& rows = Rows();
  EXPECT_EQ(rows.size(), Repeats::kMostOfClient + 1 + Repeats::kMost + 1 + 1);
  EXPECT_EQ(rows.back().client, "192.0.2.5:40312");
  EXPECT_EQ(rows.back().point, "06 holding 100");
  const auto shared = std::ranges::find(rows, Repeats::kManyPoints, &WriteRecord::point);
  ASSERT_NE(shared, rows.end());
  EXPECT_EQ(AddressOf(shared->client), "192.0.2.66");
  EXPECT_EQ(shared->count, 5000U - Repeats::kMostOfClient);
  repeats_.Tick(now_ + 2min);
  EXPECT_TRUE(repeats_.empty());
  Add(RouteWrite("192.0.2.66:1", 7));
  EXPECT_EQ(Rows().back().point, "06 holding 100") << "it has room again";
}

TEST_F(RepeatsTest, AddressesLoseTheirPort) {
  EXPECT_EQ(AddressOf("192.0.2.5:40312"), "192.0.2.5");
  EXPECT_EQ(AddressOf("[2001:db8::1]:502"), "[2001:db8::1]");
  EXPECT_EQ(AddressOf("user:root"), "user:root");
  EXPECT_EQ(AddressOf("/dev/ttyS1"), "/dev/ttyS1");
}

}  // namespace
}  // namespace baudgate::audit
