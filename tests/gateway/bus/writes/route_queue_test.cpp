// Tests of `RouteQueue`: which of the waiting routed requests goes next.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/writes/route_queue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "gateway/base/text.h"

namespace baudgate::bus {
namespace {

using config::Priority;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr const char* kRead = "03 00 00 00 01";
constexpr const char* kBlock = "03 03 E7 00 78";
constexpr const char* kWrite = "06 00 08 00 02";
constexpr const char* kStop = "06 00 08 00 00";

std::string BlockWrite() {
  std::string pdu = "10 03 E7 00 28 50";
  for (int i = 0; i < 80; ++i) pdu += " 00";
  return pdu;
}

class RouteQueueTest : public ::testing::Test {
 protected:
  void Push(std::uint64_t client, const std::string& pdu, std::uint8_t slave = 20,
            Priority priority = Priority::normal, Duration deadline = 1s, std::uint64_t host = 0) {
    RoutedRequest request;
    request.client = client;
    request.host = host;
    request.slave = slave;
    request.pdu = ParseHex(pdu).value();
    request.priority = priority;
    request.deadline = Instant() + deadline;
    request.done = [this](const RoutedReply& reply) {
      EXPECT_EQ(reply.outcome, Outcome::no_reply);
      ++(reply.sent ? left_sent_ : left_unsent_);
    };
    queue.Push(std::move(request));
  }

  static std::vector<std::string> Names(const RouteQueue::Batch& batch) {
    std::vector<std::string> names;
    for (const RoutedRequest& request : batch) {
      names.push_back(std::to_string(request.client) + ":" + ToHex(request.pdu));
    }
    return names;
  }
  std::vector<std::string> Urgent() { return Names(queue.TakeUrgent(may_ask)); }
  std::vector<std::string> Take(Priority priority = Priority::normal) {
    return Names(queue.Take(priority, may_ask));
  }
  static std::string Of(int client, const std::string& pdu) {
    return std::to_string(client) + ":" + pdu;
  }

  int left_sent_ = 0;
  int left_unsent_ = 0;
  RouteQueue queue;
  RouteQueue::MayAsk may_ask = [](const RoutedRequest&) { return true; };
};

TEST_F(RouteQueueTest, ClientsOfOnePriorityTakeTurns) {
  for (int i = 0; i < 3; ++i) Push(1, "03 00 0" + std::to_string(i) + " 00 01");
  Push(2, kRead, 21);
  Push(3, kRead, 22);
  EXPECT_THAT(Take(), ElementsAre(Of(1, "03 00 00 00 01")));
  EXPECT_THAT(Take(), ElementsAre(Of(2, kRead)));
  EXPECT_THAT(Take(), ElementsAre(Of(3, kRead)));
  Push(2, kRead, 21);
  EXPECT_THAT(Take(), ElementsAre(Of(1, "03 00 01 00 01")));
  EXPECT_THAT(Take(), ElementsAre(Of(2, kRead)));
  EXPECT_THAT(Take(), ElementsAre(Of(1, "03 00 02 00 01")));
  EXPECT_THAT(Take(), IsEmpty());
  EXPECT_TRUE(queue.empty());
}

TEST_F(RouteQueueTest, AClientThatReconnectsForEachRequestGainsNothing) {
  Push(1, kRead, 20);
  Push(2, kRead, 21);
  EXPECT_THAT(Take(), ElementsAre(Of(1, kRead)));
  Push(3, kRead, 22);
  EXPECT_THAT(Take(), ElementsAre(Of(2, kRead)));
}

TEST_F(RouteQueueTest, RequestsAreTakenByPriority) {
  Push(1, kRead, 20, Priority::low);
  Push(2, kRead, 21, Priority::high);
  EXPECT_EQ(queue.Clients(Priority::high), 1U);
  EXPECT_EQ(queue.Clients(Priority::normal), 0U);
  EXPECT_THAT(Take(Priority::normal), IsEmpty());
  EXPECT_THAT(Take(Priority::high), ElementsAre(Of(2, kRead)));
  EXPECT_THAT(Take(Priority::low), ElementsAre(Of(1, kRead)));
}

TEST_F(RouteQueueTest, ShortWritesOvertakeReadsWhateverTheirPriority) {
  Push(1, kBlock, 20, Priority::high);
  Push(2, BlockWrite(), 21);
  Push(3, kWrite, 20, Priority::low);
  EXPECT_TRUE(queue.HasAny(RouteQueue::IsShortWrite));
  EXPECT_THAT(Urgent(), ElementsAre(Of(3, kWrite)));
  EXPECT_THAT(Urgent(), IsEmpty());
  EXPECT_FALSE(queue.HasAny(RouteQueue::IsShortWrite));
}

TEST_F(RouteQueueTest, AWriteOfEightRegistersIsShortAndAWriteOfNineIsNot) {
  std::string eight = "10 00 00 00 08 10";
  for (int i = 0; i < 16; ++i) eight += " 00";
  Push(1, "10 00 00 00 09 12" + eight.substr(17) + " 00 00");
  EXPECT_THAT(Urgent(), IsEmpty());
  Push(2, eight, 21);
  EXPECT_THAT(Urgent(), ElementsAre(Of(2, eight)));
}

std::size_t PlacesTaken(FairPlaces& places, std::uint64_t host, Priority priority,
                        const std::string& pdu = kRead) {
  RoutedRequest request;
  request.host = host;
  request.priority = priority;
  request.pdu = ParseHex(pdu).value();
  std::size_t taken = 0;
  while (RouteQueue::TakePlace(places, request)) ++taken;
  return taken;
}

TEST_F(RouteQueueTest, AHostWithoutEndLeavesPlacesForOtherHostsAndHigherPriorities) {
  FairPlaces low_first(RouteQueue::kLimit);
  EXPECT_EQ(PlacesTaken(low_first, 1, Priority::low), 1024U);
  EXPECT_EQ(PlacesTaken(low_first, 1, Priority::normal), 512U) << "of the same host";
  EXPECT_EQ(PlacesTaken(low_first, 1, Priority::high), 256U);
  EXPECT_EQ(PlacesTaken(low_first, 2, Priority::low), 128U) << "of another host";
  FairPlaces high_first(RouteQueue::kLimit);
  EXPECT_EQ(PlacesTaken(high_first, 1, Priority::high), 1792U);
  EXPECT_EQ(PlacesTaken(high_first, 2, Priority::normal), 192U);
}

TEST_F(RouteQueueTest, ShortWritesHavePlacesOfTheirOwn) {
  FairPlaces places(RouteQueue::kLimit);
  for (std::uint64_t host = 1; host <= 12; ++host) PlacesTaken(places, host, Priority::high);
  for (const std::string& pdu : {std::string(kRead), BlockWrite(), std::string("2B 0E 01 00")}) {
    EXPECT_EQ(PlacesTaken(places, 13, Priority::high, pdu), 0U) << pdu;
  }
  EXPECT_GE(PlacesTaken(places, 13, Priority::low, kStop), 100U);
}

TEST_F(RouteQueueTest, HostsTakeTurnsBeforeTheConnectionsOfAHost) {
  for (std::uint64_t client = 1; client <= 4; ++client) {
    Push(client, "03 00 0" + std::to_string(client) + " 00 01", 20, Priority::normal, 1s, 7);
  }
  Push(9, "03 00 08 00 01", 20, Priority::normal, 1s, 8);
  Push(9, "03 00 09 00 01", 20, Priority::normal, 1s, 8);
  std::vector<std::string> order;
  for (int i = 0; i < 6; ++i) order.push_back(Take().at(0).substr(0, 2));
  EXPECT_THAT(order, ElementsAre("1:", "9:", "2:", "9:", "3:", "4:"));
}

TEST_F(RouteQueueTest, WritesToOneSlaveKeepTheirOrderAcrossClients) {
  Push(1, BlockWrite());
  Push(2, kWrite, 20, Priority::low);
  Push(3, kStop, 20, Priority::high);
  EXPECT_THAT(Urgent(), ElementsAre(Of(1, BlockWrite())));
  EXPECT_THAT(Urgent(), ElementsAre(Of(2, kWrite)));
  EXPECT_THAT(Urgent(), ElementsAre(Of(3, kStop)));
}

TEST_F(RouteQueueTest, AReadDoesNotOvertakeItsOwnClientsWrite) {
  Push(1, BlockWrite());
  Push(1, kRead, 20, Priority::high);
  Push(2, kRead, 20, Priority::high);
  EXPECT_THAT(Take(Priority::high), ElementsAre(Of(2, kRead)));
  EXPECT_THAT(Take(Priority::high), IsEmpty());
  EXPECT_THAT(Take(), ElementsAre(Of(1, BlockWrite())));
  EXPECT_THAT(Take(Priority::high), ElementsAre(Of(1, kRead)));
}

TEST_F(RouteQueueTest, ABroadcastKeepsItsPlaceAmongTheWritesToAll) {
  Push(1, BlockWrite(), 20);
  Push(2, kWrite, 0);
  Push(3, kStop, 21);
  EXPECT_THAT(Urgent(), ElementsAre(Of(1, BlockWrite())));
  EXPECT_THAT(Urgent(), ElementsAre(Of(2, kWrite)));
  EXPECT_THAT(Urgent(), ElementsAre(Of(3, kStop)));
}

TEST_F(RouteQueueTest, IdenticalReadsShareOneExchange) {
  Push(1, kRead);
  Push(2, kRead);
  Push(3, kRead, 21);
  Push(4, BlockWrite());
  Push(4, kRead);
  Push(5, "04 00 00 00 01");
  Push(6, kRead, 20, Priority::low);
  EXPECT_THAT(Take(), ElementsAre(Of(1, kRead), Of(2, kRead), Of(6, kRead)));
  EXPECT_THAT(Take(), ElementsAre(Of(3, kRead)));
}

TEST_F(RouteQueueTest, IdenticalWritesAndUnknownFunctionsNeverShare) {
  Push(1, kWrite);
  Push(2, kWrite);
  EXPECT_THAT(Urgent(), ElementsAre(Of(1, kWrite)));
  EXPECT_THAT(Urgent(), ElementsAre(Of(2, kWrite)));
  Push(1, "2B 0E 01 00");
  Push(2, "2B 0E 01 00");
  EXPECT_THAT(Take(), ElementsAre(Of(1, "2B 0E 01 00")));
}

TEST_F(RouteQueueTest, ASlaveThatMayNotBeAskedDoesNotBlockOthers) {
  may_ask = [](const RoutedRequest& request) { return request.slave != 20; };
  Push(1, kWrite, 20);
  Push(1, kRead, 21);
  EXPECT_THAT(Urgent(), IsEmpty());
  EXPECT_THAT(Take(), ElementsAre(Of(1, kRead)));
  EXPECT_FALSE(queue.empty());
}

TEST_F(RouteQueueTest, ExpiredAndAbandonedRequestsAreRemoved) {
  Push(1, kRead, 20, Priority::normal, 100ms);
  Push(2, kWrite, 20, Priority::normal, 200ms);
  Push(2, kRead, 21, Priority::normal, 300ms);
  EXPECT_EQ(queue.Deadline(), Instant() + 100ms);
  EXPECT_THAT(Names(queue.TakeExpired(Instant() + 99ms)), IsEmpty());
  EXPECT_THAT(Names(queue.TakeExpired(Instant() + 100ms)), ElementsAre(Of(1, kRead)));
  RouteQueue::Batch tried = queue.TakeFor(21);
  tried[0].tries = 1;
  queue.Return(std::move(tried));
  EXPECT_EQ(queue.size(), 2U);
  queue.Abandon(2);
  EXPECT_EQ(left_sent_, 1);
  EXPECT_EQ(left_unsent_, 1);
  EXPECT_TRUE(queue.empty());
  EXPECT_FALSE(queue.Deadline().has_value());
}

TEST_F(RouteQueueTest, OneReadOfASilentSlaveStaysQueued) {
  Push(1, kRead);
  Push(2, kBlock);
  Push(3, kWrite);
  Push(4, kRead, 21);
  EXPECT_THAT(Names(queue.TakeReads(20, 1)), ElementsAre(Of(2, kBlock)));
  EXPECT_THAT(Names(queue.TakeFor(20)), ElementsAre(Of(3, kWrite)));
  EXPECT_THAT(Names(queue.TakeFor(20)), ElementsAre(Of(1, kRead)));
  EXPECT_THAT(Names(queue.TakeFor(20)), IsEmpty());
  EXPECT_THAT(queue.Slaves(), ElementsAre(21));
}

TEST_F(RouteQueueTest, AProbeTakesNoWritePastAnEarlierBroadcast) {
  Push(1, kWrite, 0);
  Push(2, kStop);
  EXPECT_FALSE(queue.HasFor(20));
  EXPECT_THAT(Names(queue.TakeFor(20)), IsEmpty());
  Push(3, kRead);
  EXPECT_TRUE(queue.HasFor(20));
  EXPECT_THAT(Names(queue.TakeFor(20)), ElementsAre(Of(3, kRead)));
}

TEST_F(RouteQueueTest, AReturnedBatchGoesToTheFrontAgain) {
  Push(1, kBlock);
  RouteQueue::Batch batch = queue.Take(Priority::normal, may_ask);
  Push(1, kRead);
  Push(2, kWrite);
  queue.Return(std::move(batch));
  EXPECT_THAT(Urgent(), ElementsAre(Of(2, kWrite)));
  EXPECT_THAT(Take(), ElementsAre(Of(1, kBlock)));
  EXPECT_THAT(Take(), ElementsAre(Of(1, kRead)));
}

/// A simple model of the queue: it applies the rules literally, so it is slow but easy to check.
class Model {
 public:
  void Push(const RoutedRequest& request) { waiting_.push_back(request); }
  void Remove(const RoutedRequest& request) {
    std::erase_if(waiting_, [&](const auto& one) { return one.sequence == request.sequence; });
  }
  bool empty() const { return waiting_.empty(); }

  bool MayGo(const RoutedRequest& request) const {
    return std::ranges::none_of(waiting_, [&](const RoutedRequest& earlier) {
      if (earlier.sequence >= request.sequence || !IsWrite(earlier)) return false;
      return SameSlave(request, earlier) && (IsWrite(request) || request.client == earlier.client);
    });
  }
  bool IsUrgent(const RoutedRequest& request) const {
    return IsWrite(request) && MayGo(request) &&
           std::ranges::any_of(waiting_, [&](const RoutedRequest& later) {
             return later.sequence >= request.sequence && RouteQueue::IsShortWrite(later) &&
                    SameSlave(later, request);
           });
  }
  bool HasUrgent() const {
    return std::ranges::any_of(waiting_, [this](const auto& one) { return IsUrgent(one); });
  }
  bool HasFor(std::uint8_t slave) const {
    return std::ranges::any_of(waiting_,
                               [&](const auto& one) { return one.slave == slave && MayGo(one); });
  }
  bool HasTwin(const RoutedRequest& read) const {
    return std::ranges::any_of(waiting_, [&](const RoutedRequest& one) {
      return one.slave == read.slave && one.pdu == read.pdu && MayGo(one);
    });
  }

 private:
  static bool SameSlave(const RoutedRequest& a, const RoutedRequest& b) {
    return a.slave == b.slave || a.slave == 0 || b.slave == 0;
  }
  std::vector<RoutedRequest> waiting_;
};

TEST_F(RouteQueueTest, ARequestWaitsOnlyForTheRequestsItFollows) {
  const std::string pdus[] = {kRead, kBlock, kWrite, BlockWrite(), "2B 0E 01 00"};
  std::mt19937 random(7);
  const auto any = [&random](std::size_t count) { return random() % count; };
  for (int round = 0; round < 300; ++round) {
    Model model;
    for (std::size_t i = 0; i < 24; ++i) {
      RoutedRequest request;
      request.sequence = i;
      request.client = any(4);
      request.slave = static_cast<std::uint8_t>(any(4));
      request.pdu = ParseHex(pdus[any(std::size(pdus))]).value();
      request.priority = any(3) == 0 ? Priority::high : Priority::normal;
      model.Push(request);
      queue.Push(std::move(request));
    }
    while (!queue.empty()) {
      const auto slave = static_cast<std::uint8_t>(any(4));
      ASSERT_EQ(queue.HasFor(slave), model.HasFor(slave));
      RouteQueue::Batch batch = queue.TakeUrgent(may_ask);
      ASSERT_EQ(batch.empty(), !model.HasUrgent());
      ASSERT_TRUE(batch.empty() || model.IsUrgent(batch[0]));
      for (const Priority priority : {Priority::high, Priority::normal}) {
        if (batch.empty()) batch = queue.Take(priority, may_ask);
      }
      ASSERT_FALSE(batch.empty());
      for (const RoutedRequest& taken : batch) {
        ASSERT_TRUE(model.MayGo(taken));
        ASSERT_EQ(taken.pdu, batch[0].pdu);
        ASSERT_TRUE(!IsWrite(taken) || batch.size() == 1);
      }
      for (const RoutedRequest& taken : batch) model.Remove(taken);
      ASSERT_TRUE(IsWrite(batch[0]) || !model.HasTwin(batch[0])) << "identical reads go together";
    }
    ASSERT_TRUE(model.empty());
  }
}

}  // namespace
}  // namespace baudgate::bus
