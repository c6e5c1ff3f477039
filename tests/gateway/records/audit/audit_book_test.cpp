// What waits for the disk: coalesced, in order, bounded.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/records/audit/audit_log.h"
#include "tests/gateway/records/audit/fixture.h"

namespace baudgate::audit {
namespace {

/// As the file does it: each new record gets the next number.
std::vector<Draft> Write(AuditBook& book, std::int64_t& seq) {
  std::vector<Draft> drafts = book.Due();
  for (Draft& draft : drafts) {
    if (draft.record.seq == 0) draft.record.seq = ++seq;
  }
  book.OnWritten(drafts);
  return drafts;
}

TEST(AuditBook, ARecordIsInsertedAndThenCompleted) {
  AuditBook book;
  std::int64_t seq = 0;
  const Ticket ticket = *book.Begin(WrittenPoint("a"));
  EXPECT_EQ(book.unwritten(), 1U);
  EXPECT_LT(book.newest_written(), ticket);
  auto drafts = Write(book, seq);
  ASSERT_EQ(drafts.size(), 1U);
  EXPECT_FALSE(drafts[0].ended);
  EXPECT_EQ(book.newest_written(), ticket);
  EXPECT_FALSE(book.due());
  book.End(ticket, {WriteEnd::refused, "no", 7ms});
  drafts = Write(book, seq);
  ASSERT_EQ(drafts.size(), 1U);
  EXPECT_TRUE(drafts[0].ended);
  EXPECT_EQ(drafts[0].record.seq, 1) << "the same row";
  EXPECT_EQ(drafts[0].record.end, WriteEnd::refused);
  EXPECT_EQ(drafts[0].record.reason, "no");
  book.End(ticket, {WriteEnd::ok});
  EXPECT_FALSE(book.due()) << "it has ended once";
}

TEST(AuditBook, WhatEndsBeforeItIsWrittenIsOneRow) {
  AuditBook book;
  std::int64_t seq = 0;
  book.End(*book.Begin(WrittenPoint("a")), {WriteEnd::ok});
  EXPECT_EQ(Write(book, seq).size(), 1U);
  EXPECT_EQ(seq, 1);
  EXPECT_FALSE(book.due());
}

TEST(AuditBook, AChangeDuringTheWriteIsDueAgain) {
  AuditBook book;
  const Ticket ticket = *book.Begin(WrittenPoint("a"));
  auto drafts = book.Due();
  book.End(ticket, {WriteEnd::ok});
  drafts[0].record.seq = 4;
  book.OnWritten(drafts);
  ASSERT_TRUE(book.due());
  EXPECT_EQ(book.Due()[0].record.seq, 4);
  EXPECT_EQ(book.Due()[0].record.end, WriteEnd::ok);
}

TEST(AuditBook, IsBoundedByKindAndCountsWhatIsLost) {
  AuditBook book;
  const std::size_t most = AuditBook::kLimits[static_cast<std::size_t>(Kind::route)];
  for (std::size_t i = 0; i < most; ++i) ASSERT_TRUE(book.Begin(RouteWrite("a", 1)));
  EXPECT_FALSE(book.Begin(RouteWrite("a", 1)));
  EXPECT_EQ(book.lost(), 1U);
  EXPECT_TRUE(book.Begin(WrittenPoint("b"))) << "routes take no room of points";
}

TEST(AuditBook, AnotherFileHasNothingOfIt) {
  AuditBook book;
  std::int64_t seq = 6;
  const Ticket ticket = *book.Begin(WrittenPoint("a"));
  Write(book, seq);
  book.NewFile();
  EXPECT_EQ(book.unwritten(), 1U);
  ASSERT_EQ(book.Due().size(), 1U);
  EXPECT_EQ(book.Due()[0].record.seq, 0);
  seq = 0;
  Write(book, seq);
  book.End(ticket, {WriteEnd::ok});
  EXPECT_EQ(book.Due()[0].record.seq, 1);
}

}  // namespace
}  // namespace baudgate::audit
