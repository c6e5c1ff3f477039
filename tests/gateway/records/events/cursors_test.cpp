// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/records/events/event_feed.h"

namespace baudgate::events {
namespace {

TEST(CursorBook, GoesOnWhereTheFileSays) {
  CursorBook book({"dds"});
  EXPECT_FALSE(book.Of("dds"));
  EXPECT_FALSE(book.Due());
  book.OnOpened({{"dds", {40, true}}});
  EXPECT_EQ(book.Of("dds"), (Cursor{40, true}));
  EXPECT_FALSE(book.Due()) << "the file has it so";
  EXPECT_TRUE(book.Set("dds", {41, false}));
  EXPECT_FALSE(book.Set("dds", {42, false})) << "the file is to hear of it already";
  const auto due = book.Due();
  ASSERT_TRUE(due);
  EXPECT_EQ(*due, (Cursors{{"dds", {42, false}}}));
  book.Set("dds", {43, false});
  book.OnKept(*due);
  EXPECT_TRUE(book.Due()) << "what came meanwhile";
  book.OnKept(*book.Due());
  EXPECT_FALSE(book.Due());
  EXPECT_FALSE(book.Set("dds", {43, false}));
}

TEST(CursorBook, ForgetsWhoIsNoConsumerAnyMore) {
  CursorBook book({"dds"});
  book.OnOpened({{"dds", {4, true}}, {"mqtt", {2, true}}});
  EXPECT_FALSE(book.Of("mqtt"));
  EXPECT_EQ(*book.Due(), (Cursors{{"dds", {4, true}}})) << "the file's is removed";
  EXPECT_FALSE(book.Set("page", {1, true}));
  EXPECT_FALSE(book.Of("page"));
}

TEST(CursorBook, TellsANewFile) {
  CursorBook book({"dds"});
  book.OnOpened({});
  book.Set("dds", {7, false});
  book.OnKept(*book.Due());
  book.OnOpened({});
  EXPECT_EQ(*book.Due(), (Cursors{{"dds", {7, false}}})) << "numbers go on in it";
}

std::vector<EventRecord> EventsOf(std::int64_t first, std::int64_t last) {
  std::vector<EventRecord> events;
  for (; first <= last; ++first) events.emplace_back().seq = first;
  return events;
}

TEST(Backlog, IsReadForWhoeverAsks) {
  Backlog backlog;
  EXPECT_FALSE(backlog.wanted());
  EXPECT_FALSE(backlog.Take(40, 2));
  EXPECT_FALSE(backlog.Take(7, 2)) << "another";
  EXPECT_EQ(backlog.wanted(), 7);
  backlog.Supply(7, EventsOf(8, 9));
  EXPECT_EQ(backlog.wanted(), 40);
  backlog.Supply(40, EventsOf(41, 45));
  EXPECT_FALSE(backlog.wanted());
  EXPECT_EQ(backlog.Take(40, 2)->back().seq, 42);
  EXPECT_EQ(backlog.Take(42, 2)->back().seq, 44);
  EXPECT_EQ(backlog.Take(44, 2)->back().seq, 45);
  EXPECT_FALSE(backlog.Take(45, 2)) << "it is to be read";
  EXPECT_EQ(backlog.Take(7, 2)->size(), 2U);
}

TEST(Backlog, DoesNotWaitForWhatIsNotThere) {
  Backlog backlog;
  EXPECT_FALSE(backlog.Take(3, 9));
  backlog.Supply(3, {});
  EXPECT_TRUE(backlog.Take(3, 9)->empty());
}

}  // namespace
}  // namespace baudgate::events
