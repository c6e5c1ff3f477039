// Tests of `LostReplies`, for slaves that only routes reach. Requests are single letters.
#include <gtest/gtest.h>

#include <string>
#include <string_view>

#include "gateway/bus/replies/whose_reply.h"
#include "tests/gateway/bus/poller/part_fixture.h"
#include "tests/support/times.h"

namespace baudgate::bus {
namespace {

class LostRepliesTest : public ::testing::Test, protected ToyMembers {
 protected:
  void Lose(std::string_view requests, Instant at = kStart) {
    for (const char request : requests) lost_.OnLost(a, Request(request), at);
  }
  /// Returns how often `request` must be sent until a reply certainly answers it. Replies to lost
  /// requests whose letter is in `like` look the same as its reply.
  std::size_t RepliesUntilOwn(char request, std::string_view like, Instant began = kStart) {
    for (std::size_t count = 1; count < 20; ++count) {
      const LostReplies::Older older =
          lost_.MayBe(a, Request(request), began, [&](const Bytes& lost) {
            return like.find(static_cast<char>(lost[0])) != std::string_view::npos;
          });
      if (lost_.OnReply(a, Request(request), older, count)) return count;
    }
    return 0;
  }
  static Bytes Request(char request) { return {static_cast<std::uint8_t>(request)}; }

  LostReplies lost_;
};

TEST_F(LostRepliesTest, AsManyRepliesAsWereLostMayComeFirst) {
  struct Case {
    const char* lost;
    const char* like;
    std::size_t replies;
  };
  for (const Case& one : {Case{"", "", 1}, Case{"y", "", 1}, Case{"y", "y", 2}, Case{"x", "x", 1},
                          Case{"yz", "yz", 3}, Case{"yz", "z", 3}, Case{"xy", "xy", 3},
                          Case{"yx", "y", 2}, Case{"abcdefgh", "abcdefgh", 9},
                          Case{"zabcdefgh", "abcdefgh", 9}, Case{"zabcdefgh", "z", 1}}) {
    SCOPED_TRACE(std::string(one.lost) + " lost, like x: " + one.like);
    lost_ = {};
    Lose(one.lost);
    EXPECT_EQ(RepliesUntilOwn('x', one.like), one.replies);
  }
}

TEST_F(LostRepliesTest, AReplyMatchedToAnEarlierRequestLeavesALaterOneOutstanding) {
  Lose("x");
  EXPECT_EQ(RepliesUntilOwn('x', "x"), 1U) << "to the first x, or to the second";
  EXPECT_EQ(RepliesUntilOwn('y', "x"), 2U) << "the first may be that to the second x";
  EXPECT_EQ(RepliesUntilOwn('z', "xy"), 1U) << "that showed that nothing is owed";
}

TEST_F(LostRepliesTest, LostRepliesThatCanNoLongerComeAreForgotten) {
  Lose("y");
  EXPECT_EQ(RepliesUntilOwn('x', ""), 1U) << "y is answered otherwise";
  EXPECT_EQ(RepliesUntilOwn('x', "y"), 1U)
      << "replies keep their order: y is not answered any more";
}

TEST_F(LostRepliesTest, ALostReplyMayComeForFiveSeconds) {
  Lose("y");
  EXPECT_TRUE(lost_.MayCome(a, kStart + 5s));
  EXPECT_FALSE(lost_.MayCome(a, kStart + 5001ms));
  EXPECT_FALSE(lost_.MayCome(b, kStart)) << "nothing of it was lost";
  EXPECT_EQ(RepliesUntilOwn('x', "y", kStart + 5001ms), 1U);
  Lose("y");
  Lose("z", kStart + 4s);
  EXPECT_TRUE(lost_.MayCome(a, kStart + 9s)) << "from the latest on";
  Lose("w", kStart + 20s);
  EXPECT_EQ(RepliesUntilOwn('x', "wyz", kStart + 20s), 2U) << "y and z are too long ago";
}

}  // namespace
}  // namespace baudgate::bus
