// Tests of `RequestBook` and `CommandRoom`: a repeated request must be carried out only once.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/writes/request_book.h"

#include <gmock/gmock.h>

#include <limits>
#include <vector>

#include "gateway/bus/writes/write_command.h"
#include "tests/support/times.h"

namespace baudgate::bus {
namespace {

using ::testing::HasSubstr;
using What = RequestBook::Verdict::What;

RequestId RequestOf(std::uint64_t seq, const std::string& client = "plc-1") {
  return {client, seq, "feeder-1 setting_group 1"};
}

class RequestBookTest : public ::testing::Test {
 protected:
  What Begin(const RequestId& request) {
    last_ = book_.Begin(request, now_);
    return last_.what;
  }
  void Do(std::uint64_t seq, const std::string& client = "plc-1") {
    ASSERT_EQ(Begin(RequestOf(seq, client)), What::fresh) << client << ' ' << seq;
    book_.End(client, seq, {WriteEnd::ok, "", 7us});
  }

  RequestBook book_;
  RequestBook::Verdict last_;
  Instant now_ = kStart;
};

TEST_F(RequestBookTest, ADuplicateIsAnsweredAndNotRepeated) {
  EXPECT_EQ(Begin(RequestOf(7)), What::fresh);
  EXPECT_EQ(Begin(RequestOf(7)), What::under_way);
  book_.End("plc-1", 7, {WriteEnd::differs, "shows 2", 250us});
  for (int again = 0; again < 3; ++again) {
    now_ += 1h;
    EXPECT_EQ(Begin(RequestOf(7)), What::answered);
    EXPECT_EQ(last_.answer.end, WriteEnd::differs);
    EXPECT_EQ(last_.answer.reason, "shows 2");
    EXPECT_EQ(last_.answer.took, 250us);
  }
  EXPECT_EQ(Begin(RequestOf(7, "plc-2")), What::fresh) << "another client's numbers are its own";
}

TEST_F(RequestBookTest, TheSameNumberForAnotherRequestIsRefused) {
  Do(7);
  EXPECT_EQ(Begin({"plc-1", 7, "feeder-1 setting_group 2"}), What::refused);
  EXPECT_EQ(last_.answer.end, WriteEnd::denied);
  EXPECT_THAT(last_.answer.reason, HasSubstr("another request"));
  EXPECT_EQ(Begin(RequestOf(7)), What::answered);
}

TEST_F(RequestBookTest, ARequestOfAnEarlierRunIsNotRepeated) {
  // The audit log is still being read. Later it returns the requests of earlier runs, the latest
  // first.
  std::optional<PastRequests> past;
  book_ = RequestBook([&past] { return past; });
  EXPECT_EQ(Begin(RequestOf(40)), What::refused);
  EXPECT_EQ(last_.answer.end, WriteEnd::busy) << "it is not known yet";
  past = PastRequests{{}, false};
  for (std::uint64_t seq = 40; seq > 0; --seq) {
    past->all.push_back({RequestOf(seq), WriteEnd::ok, "", 3ms});
  }
  EXPECT_EQ(Begin(RequestOf(40)), What::answered);
  EXPECT_EQ(last_.answer.end, WriteEnd::ok);
  EXPECT_EQ(last_.answer.took, 3ms);
  EXPECT_EQ(Begin({"plc-1", 40, "feeder-1 setting_group 2"}), What::refused);
  EXPECT_EQ(Begin(RequestOf(9)), What::answered);
  EXPECT_EQ(Begin(RequestOf(8)), What::refused) << "there was no room for it";
  EXPECT_EQ(Begin(RequestOf(41)), What::fresh);
  past->all = {{RequestOf(41), WriteEnd::unknown, "stopped"}};
  EXPECT_EQ(Begin(RequestOf(41)), What::under_way);
}

TEST_F(RequestBookTest, RequestsOfEarlierRunsStayWithinTheClientLimit) {
  PastRequests past;
  for (std::size_t i = 0; i < 2 * RequestBook::kClients; ++i) {
    past.all.push_back({RequestOf(1, "plc-" + std::to_string(i)), WriteEnd::ok, ""});
  }
  book_ = RequestBook([&past] { return std::optional(past); });
  EXPECT_EQ(Begin(RequestOf(1, "plc-0")), What::answered) << "the latest";
  EXPECT_EQ(book_.clients(), RequestBook::kClients);
}

TEST_F(RequestBookTest, AForgottenRequestIsRefusedAndNeverRepeated) {
  for (std::uint64_t seq = 10; seq < 10 + RequestBook::kRemembered; ++seq) Do(seq);
  Do(3);
  EXPECT_EQ(Begin(RequestOf(10)), What::refused);
  EXPECT_EQ(last_.answer.end, WriteEnd::denied);
  EXPECT_THAT(last_.answer.reason, HasSubstr("only the last 32 requests"));
  EXPECT_EQ(Begin(RequestOf(5)), What::refused) << "below what is forgotten";
  EXPECT_EQ(Begin(RequestOf(3)), What::answered);
  EXPECT_EQ(Begin(RequestOf(11)), What::answered);
  Do(1000);
  EXPECT_EQ(Begin(RequestOf(500)), What::fresh) << "gaps may be filled";
}

TEST_F(RequestBookTest, TheHighestSequenceNumberIsRemembered) {
  constexpr std::uint64_t kHighest = std::numeric_limits<std::uint64_t>::max();
  Do(0);
  Do(kHighest);
  EXPECT_EQ(Begin(RequestOf(0)), What::answered);
  EXPECT_EQ(Begin(RequestOf(kHighest)), What::answered);
}

TEST_F(RequestBookTest, RequestsUnderWayAreLimitedPerClient) {
  for (std::uint64_t seq = 1; seq <= RequestBook::kUnderWay; ++seq) {
    EXPECT_EQ(Begin(RequestOf(seq)), What::fresh);
  }
  EXPECT_EQ(Begin(RequestOf(9)), What::refused);
  EXPECT_EQ(last_.answer.end, WriteEnd::busy);
  EXPECT_EQ(Begin(RequestOf(9)), What::answered) << "it was not done and never will be";
  EXPECT_EQ(last_.answer.end, WriteEnd::busy);
  EXPECT_EQ(Begin(RequestOf(1, "plc-2")), What::fresh);
  book_.End("plc-1", 4, {});
  EXPECT_EQ(Begin(RequestOf(9)), What::answered);
  EXPECT_EQ(Begin(RequestOf(10)), What::fresh);
  // A flood of new requests must not make the book forget requests under way.
  for (std::uint64_t seq = 100; seq < 1000; ++seq) EXPECT_EQ(Begin(RequestOf(seq)), What::refused);
  EXPECT_EQ(Begin(RequestOf(1)), What::under_way);
}

TEST_F(RequestBookTest, ClientsAreLimitedAndRecentClientsAreRemembered) {
  for (std::size_t i = 0; i < RequestBook::kClients; ++i) Do(1, "plc-" + std::to_string(i));
  EXPECT_EQ(Begin(RequestOf(1, "one too many")), What::refused);
  EXPECT_EQ(last_.answer.end, WriteEnd::busy);
  now_ += RequestBook::kKept - 1s;
  EXPECT_EQ(Begin(RequestOf(1, "plc-0")), What::answered);
  EXPECT_EQ(Begin(RequestOf(2, "plc-1")), What::fresh);
  now_ += 1s;
  EXPECT_EQ(Begin(RequestOf(1, "one too many")), What::fresh) << "who was silent has left";
  EXPECT_EQ(Begin(RequestOf(1, "plc-0")), What::answered);
  EXPECT_EQ(book_.clients(), RequestBook::kClients);
  now_ += 24h;
  for (std::size_t i = 0; i < 10 * RequestBook::kClients; ++i) {
    EXPECT_EQ(Begin(RequestOf(1, "other " + std::to_string(i))),
              i < RequestBook::kClients - 2 ? What::fresh : What::refused)
        << i;
  }
  EXPECT_EQ(Begin(RequestOf(2, "plc-1")), What::under_way) << "never forgotten before its end";
}

TEST_F(RequestBookTest, EndingAnUnknownOrEndedRequestDoesNothing) {
  book_.End("plc-1", 7, {});
  Do(7);
  book_.End("plc-1", 7, {WriteEnd::refused, "late"});
  EXPECT_EQ(Begin(RequestOf(7)), What::answered);
  EXPECT_EQ(last_.answer.end, WriteEnd::ok);
}

using ::testing::SizeIs;

std::size_t TakeAll(CommandRoom& room, const std::string& client) {
  std::size_t taken = 0;
  while (room.Take(client)) ++taken;
  return taken;
}

TEST(CommandRoom, AClientTakesAtMostHalfOfTheFreeRoom) {
  CommandRoom room(32);
  EXPECT_EQ(TakeAll(room, "a"), 16U);
  EXPECT_EQ(TakeAll(room, "b"), 8U);
  EXPECT_EQ(TakeAll(room, "c"), 4U);
  EXPECT_TRUE(room.Take("d"));
}

TEST(CommandRoom, AHostLeavesRoomForOthersWithAnyNumberOfConnections) {
  CommandRoom room(32);
  std::size_t taken = 0;
  for (int port = 40000; port < 40040; ++port)
    taken += TakeAll(room, "10.0.0.7:" + std::to_string(port));
  EXPECT_EQ(taken, 24U);
  EXPECT_EQ(TakeAll(room, "10.0.0.8:40000"), 4U);
}

TEST(CommandRoom, ReturnedRoomIsAvailableAgain) {
  CommandRoom room(8);
  std::vector<CommandRoom::Ticket> tickets;
  while (const auto ticket = room.Take("a")) tickets.push_back(*ticket);
  EXPECT_THAT(tickets, SizeIs(4));
  for (const CommandRoom::Ticket ticket : tickets) room.Give(ticket);
  EXPECT_EQ(TakeAll(room, "b"), 4U);
}

TEST(CommandRoom, AbandonedCommandsTakeNoRoomButAreLimited) {
  CommandRoom room(4);
  for (std::size_t i = 0; i < CommandRoom::kMostAbandoned; ++i) {
    const auto left = std::make_shared<std::atomic<bool>>(false);
    ASSERT_TRUE(room.Take("b" + std::to_string(i), left)) << i;
    *left = true;
  }
  EXPECT_FALSE(room.Take("a")) << "memory is bounded";
  room.Give(1);
  EXPECT_TRUE(room.Take("a"));
}

TEST(CommandRoom, RefusesCommandsWhenAllRoomIsTaken) {
  CommandRoom room(4);
  for (const char* client : {"a", "b", "c"}) room.Take(client);
  EXPECT_TRUE(room.Take("d"));
  EXPECT_FALSE(room.Take("e"));
}

}  // namespace
}  // namespace baudgate::bus
