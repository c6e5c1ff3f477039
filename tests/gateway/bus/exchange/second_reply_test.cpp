// Tests of `SecondReply`: copies, other replies and noise behind an accepted reply.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "gateway/bus/exchange/line.h"
#include "tests/support/toy_protocol.h"

namespace baudgate::bus {
namespace {

const Bytes kReply = ToyReply("A1=5");
const Bytes kOther = ToyReply("A1=6");

Bytes Joined(const std::vector<Bytes>& parts) {
  Bytes all;
  for (const Bytes& part : parts) Append(all, part);
  return all;
}

struct Behind {
  std::string name;
  Bytes at_once;  // bytes behind the reply in the same read
  Bytes later;
  bool alone = true;
  bool only_copies = true;
  int told = 0;
};

class SecondReplyTest : public ::testing::TestWithParam<Behind> {
 protected:
  bool Come(View behind) {
    protocols::Assembler assembler;
    assembler.Begin(ToyProtocol().reply_rule, ToyProtocol().expect(ToBytes("?A1\r"), {}));
    assembler.Feed(Joined({kReply, Bytes(behind.begin(), behind.end())}));
    const Bytes frame = assembler.Next(false).value();
    EXPECT_EQ(frame, kReply);
    return second_.IsAlone(frame, assembler);
  }

  SecondReply second_;
};

TEST_P(SecondReplyTest, ASecondReplyIsFoundInAnyFragmentation) {
  const Behind& one = GetParam();
  for (std::size_t cut = 0; cut <= one.later.size(); ++cut) {
    SCOPED_TRACE(cut);
    second_ = {};
    ASSERT_EQ(Come(one.at_once), one.alone);
    if (!one.alone) return;
    EXPECT_EQ(second_.only_copies(), one.only_copies);
    second_.Take(kReply);
    int told = second_.FoundIn(View(one.later).first(cut)) ? 1 : 0;
    told += second_.FoundIn(View(one.later).subspan(cut)) ? 1 : 0;
    EXPECT_EQ(told, one.told);
  }
}

const std::vector<Behind> kBehind = {
    {"NoFurtherBytes", {}, {}},
    {"ACopyAtOnce", kReply, {}},
    {"ACopyLater", {}, kReply},
    {"CopiesAtOnceAndLater", Joined({kReply, kReply}), Joined({kReply, kReply, kReply})},
    {"ADifferentReplyAtOnce", kOther, {}, false},
    {"ADifferentReplyAfterACopy", Joined({kReply, kOther}), {}, false},
    {"ADifferentReplyLater", {}, kOther, true, true, 1},
    {"ADifferentReplyLaterAfterCopies",
     {},
     Joined({kReply, kReply, kReply, kOther}),
     true,
     true,
     1},
    {"ADifferentReplyThatBeganAtOnce", Bytes(kOther.begin(), kOther.begin() + 3),
     Bytes(kOther.begin() + 3, kOther.end()), true, false, 1},
    {"TwoDifferentRepliesAreReportedOnce", {}, Joined({kOther, kOther}), true, true, 1},
    {"NoiseAtOnce", ToBytes("!A1="), {}, true, false},
    {"NoiseLater", {}, Joined({ToBytes("\x01!A1=\xFF"), Bytes(4096, 'U')})}};

INSTANTIATE_TEST_SUITE_P(SecondReply, SecondReplyTest, ::testing::ValuesIn(kBehind),
                         [](const auto& info) { return info.param.name; });

TEST_F(SecondReplyTest, ARejectedReplyHasNoSecondReply) {
  ASSERT_TRUE(Come({}));
  EXPECT_FALSE(second_.FoundIn(kOther)) << "the reply was refused";
}

TEST(SecondReply, OnlyALineWithoutCharactersIsEmpty) {
  EXPECT_TRUE(IsEmptyLine(ToBytes("\r\n")));
  EXPECT_FALSE(IsEmptyLine(ToBytes("0\r\n")));
}

}  // namespace
}  // namespace baudgate::bus
