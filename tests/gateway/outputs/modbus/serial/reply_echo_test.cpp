// What is echo of the gateway's own reply, by bytes, by frames and by time.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <string>

#include "gateway/base/text.h"
#include "gateway/outputs/modbus/serial/serial_listener.h"

namespace baudgate::modbus {
namespace {

using enum config::Listener::Echo;

constexpr Instant kUntil{1s};
const std::string kReadFrame = "14 03 00 C8 00 01 07 31";
const std::string kValueFrame = "14 03 02 09 C4 B2 44";
const std::string kWriteFrame = "14 06 00 08 00 02 8B 0C";

Bytes Hex(const std::string& text) { return ParseHex(text).value(); }

std::string Filter(ReplyEcho& echo, const std::string& bytes) {
  return ToHex(echo.Filter(Hex(bytes)));
}

TEST(ReplyEcho, BeforeTheFirstReplyEverythingPasses) {
  for (const auto mode : {off, strip}) {
    ReplyEcho echo(mode);
    EXPECT_EQ(Filter(echo, kWriteFrame), kWriteFrame);
    EXPECT_FALSE(echo.IsEcho(Hex(kWriteFrame), kUntil));
  }
}

TEST(ReplyEcho, OffBytesPassAndFramesAreKnown) {
  struct Row {
    std::string reply, frame;
    Instant ended;
    bool echo;
  };
  for (const Row& row :
       {Row{kWriteFrame, kWriteFrame, kUntil, true}, Row{kValueFrame, kValueFrame, kUntil, true},
        Row{kWriteFrame, kWriteFrame, kUntil + 1ns, false},
        Row{kWriteFrame, kReadFrame, kUntil, false}}) {
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
    echo.OnSent(Hex(kValueFrame), kUntil);
    EXPECT_EQ(Filter(echo, kValueFrame.substr(0, 3 * cut)), "");
    EXPECT_TRUE(echo.holding());
    EXPECT_EQ(Filter(echo, kValueFrame.substr(3 * cut) + kReadFrame), kReadFrame);
    EXPECT_FALSE(echo.holding());
  }
}

TEST(ReplyEcho, StripGivesBackWhatOnlyBeginsLikeTheReply) {
  ReplyEcho echo(strip);
  echo.OnSent(Hex(kValueFrame), kUntil);
  EXPECT_EQ(Filter(echo, "14 03"), "");
  EXPECT_EQ(Filter(echo, "00 C8 00 01 07 31"), kReadFrame);
  echo.OnSent(Hex(kValueFrame), kUntil);
  EXPECT_EQ(Filter(echo, "14 03"), "");
  EXPECT_EQ(ToHex(echo.OnSilence()), "14 03");
}

TEST(ReplyEcho, StripOneReplyHasOneEcho) {
  ReplyEcho echo(strip);
  echo.OnSent(Hex(kWriteFrame), kUntil);
  EXPECT_EQ(Filter(echo, kWriteFrame), "");
  EXPECT_EQ(Filter(echo, kWriteFrame), kWriteFrame);
  EXPECT_FALSE(echo.IsEcho(Hex(kWriteFrame), kUntil)) << "the master writes the same at once";
}

TEST(ReplyEcho, StripFindsAnEchoBehindNoise) {
  ReplyEcho echo(strip);
  echo.OnSent(Hex(kWriteFrame), kUntil);
  EXPECT_EQ(Filter(echo, "FF " + kWriteFrame), "FF " + kWriteFrame);
  EXPECT_TRUE(echo.IsEcho(Hex(kWriteFrame), kUntil));
}

}  // namespace
}  // namespace baudgate::modbus
