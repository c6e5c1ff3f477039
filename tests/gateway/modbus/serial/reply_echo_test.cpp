// What is echo of the gateway's own reply, by bytes, by frames and by time.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/modbus/serial/reply_echo.h"

#include <gtest/gtest.h>

#include <string>

#include "gateway/base/text.h"

namespace baudgate::modbus {
namespace {

using enum config::Listener::Echo;

constexpr Instant kUntil{1s};
const std::string kRead = "14 03 00 C8 00 01 07 31";
const std::string kValue = "14 03 02 09 C4 B2 44";
const std::string kWrite = "14 06 00 08 00 02 8B 0C";

Bytes Hex(const std::string& text) { return ParseHex(text).value(); }

std::string Filter(ReplyEcho& echo, const std::string& bytes) {
  return ToHex(echo.Filter(Hex(bytes)));
}

TEST(ReplyEcho, BeforeTheFirstReplyEverythingPasses) {
  for (const auto mode : {off, strip}) {
    ReplyEcho echo(mode);
    EXPECT_EQ(Filter(echo, kWrite), kWrite);
    EXPECT_FALSE(echo.IsEcho(Hex(kWrite), kUntil));
  }
}

TEST(ReplyEcho, OffBytesPassAndFramesAreKnown) {
  struct Row {
    std::string reply, frame;
    Instant ended;
    bool echo;
  };
  for (const Row& row :
       {Row{kWrite, kWrite, kUntil, true}, Row{kValue, kValue, kUntil, true},
        Row{kWrite, kWrite, kUntil + 1ns, false}, Row{kWrite, kRead, kUntil, false}}) {
    ReplyEcho echo(off);
    echo.OnSent(Hex(row.reply), kUntil);
    EXPECT_EQ(Filter(echo, row.frame), row.frame);
    EXPECT_FALSE(echo.holding());
    EXPECT_EQ(echo.IsEcho(Hex(row.frame), row.ended), row.echo) << row.frame;
    EXPECT_FALSE(echo.IsEcho(Hex(row.reply), kUntil)) << "only the first frame can be the echo";
  }
}

TEST(ReplyEcho, StripTakesAnEchoOutInAnyPieces) {
  for (std::size_t cut = 1; cut < 7; ++cut) {
    ReplyEcho echo(strip);
    echo.OnSent(Hex(kValue), kUntil);
    EXPECT_EQ(Filter(echo, kValue.substr(0, 3 * cut)), "");
    EXPECT_TRUE(echo.holding());
    EXPECT_EQ(Filter(echo, kValue.substr(3 * cut) + kRead), kRead);
    EXPECT_FALSE(echo.holding());
  }
}

TEST(ReplyEcho, StripGivesBackWhatOnlyBeginsLikeTheReply) {
  ReplyEcho echo(strip);
  echo.OnSent(Hex(kValue), kUntil);
  EXPECT_EQ(Filter(echo, "14 03"), "");
  EXPECT_EQ(Filter(echo, "00 C8 00 01 07 31"), kRead);
  echo.OnSent(Hex(kValue), kUntil);
  EXPECT_EQ(Filter(echo, "14 03"), "");
  EXPECT_EQ(ToHex(echo.OnSilence()), "14 03");
}

TEST(ReplyEcho, StripOneReplyHasOneEcho) {
  ReplyEcho echo(strip);
  echo.OnSent(Hex(kWrite), kUntil);
  EXPECT_EQ(Filter(echo, kWrite), "");
  EXPECT_EQ(Filter(echo, kWrite), kWrite);
  EXPECT_FALSE(echo.IsEcho(Hex(kWrite), kUntil)) << "the master writes the same at once";
}

TEST(ReplyEcho, StripFindsAnEchoBehindNoise) {
  ReplyEcho echo(strip);
  echo.OnSent(Hex(kWrite), kUntil);
  EXPECT_EQ(Filter(echo, "FF " + kWrite), "FF " + kWrite);
  EXPECT_TRUE(echo.IsEcho(Hex(kWrite), kUntil));
}

}  // namespace
}  // namespace baudgate::modbus
