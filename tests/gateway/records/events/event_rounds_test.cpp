// The rounds of the writing thread alone: what a round that fails leaves for the next one.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <string>

#include "gateway/records/events/event_log.h"
#include "gateway/records/events/event_queue.h"

namespace baudgate::events {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class EventRoundsTest : public ::testing::Test {
 protected:
  EventRoundsTest() {
    rounds_.OnOpened({.ok = true});
    EventRounds::Round first = rounds_.Take();
    rounds_.Done(first, {});
  }
  static LogOptions OptionsAt(const Instant& now) {
    LogOptions options;
    options.file = "/events.db";
    options.sources = {{"bay-1", "feeder-1"}};
    options.clocks = [&now] { return Now{now, {}}; };
    options.warn = options.inform = [](const std::string&) {};
    return options;
  }
  void Add(const std::string& said) {
    queue_.Add({.source = 0, .said = said, .events = {{}}, .line = "bay-1", .device = "feeder-1"});
  }

  Instant now_{1h};
  const LogOptions options_ = OptionsAt(now_);
  PendingEvents pending_{options_, [] {}};
  EventRounds rounds_{options_, pending_};
  EventQueue queue_{options_, pending_};
};

/// Its device would be asked for more, and would throw away what is not on the disk.
TEST_F(EventRoundsTest, ABatchIsKeptOnlyByARoundThatSucceeds) {
  Add("a");
  EventRounds::Round fails = rounds_.Take();
  EXPECT_THAT(rounds_.Done(fails, Error{"it is full"}), IsEmpty());
  EventRounds::Round next = rounds_.Take();
  ASSERT_EQ(next.batches.size(), 1U);
  EXPECT_EQ(next.batches[0].said, "a");
  EXPECT_THAT(rounds_.Done(next, {}), ElementsAre(0U));
}

TEST_F(EventRoundsTest, ADiskThatFailsIsLeftInPeaceForASecond) {
  Add("a");
  ASSERT_TRUE(rounds_.Begin());
  EventRounds::Round round = rounds_.Take();
  rounds_.Done(round, Error{"it is full"});
  EXPECT_FALSE(rounds_.Begin());
  EXPECT_EQ(rounds_.NextRound(), now_ + 1s);
  now_ += 1s;
  EXPECT_TRUE(rounds_.Begin());
}

}  // namespace
}  // namespace baudgate::events
