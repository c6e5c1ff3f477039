// Frames of DCON: the worked examples of the reference as golden vectors, checksums, addresses.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/codec.h"

#include <gtest/gtest.h>

#include "gateway/base/bytes.h"
#include "gateway/base/text.h"

namespace baudgate::protocols::dcon {
namespace {

struct Vector {
  std::string_view body;
  std::string_view frame;
};

/// Worked examples of protocols/dcon/README.md, requests.
constexpr Vector kRequests[] = {
    {"#01", "#0184\r"},     {"#4A", "#4A98\r"},
    {"$012", "$012B7\r"},   {"#017", "#017BB\r"},
    {"$0A6", "$0A6CB\r"},   {"#0A1301", "#0A130159\r"},
    {"@0A3C", "@0A3C27\r"}, {"#0B2+07.500", "#0B2+07.5001C\r"},
    {"$0BM", "$0BME3\r"},   {"~**", "~**D2\r"},
    {"#**", "#**77\r"},     {"%0B0C400640", "%0B0C40064038\r"},
};

constexpr Vector kReplies[] = {
    {">+100.23+34.050+124.56+07.331-101.45+1038.9-50.501+05.880",
     ">+100.23+34.050+124.56+07.331-101.45+1038.9-50.501+05.880FC\r"},
    {">+1.2-33.44+555.666", ">+1.2-33.44+555.666BD\r"},
    {">+100.23+34.050", ">+100.23+34.050E2\r"},
    {"!01200600", "!01200600AA\r"},
    {">-02.471", ">-02.47197\r"},
    {">7FFF8000000040000000000000000000", ">7FFF800000004000000000000000000093\r"},
    {">+9999.9-9999.9", ">+9999.9-9999.92C\r"},
    {"!2A1500", "!2A15005A\r"},
    {">", ">3E\r"},
    {"!", "!21\r"},
    {"?", "?3F\r"},
    {"?01", "?01A0\r"},
    {"?0A", "?0AB0\r"},
    {"!0B+07.500", "!0B+07.500E8\r"},
    {"!0B7060", "!0B706060\r"},
    {">0C1+012.50", ">0C1+012.5033\r"},
    {"!0B00042", "!0B0004289\r"},
    {">0001E240", ">0001E240DA\r"},
    {"!0C", "!0C94\r"},
};

TEST(DconCodec, RequestsOfTheWorkedExamples) {
  for (const Vector& vector : kRequests) {
    SCOPED_TRACE(vector.frame);
    const auto parsed = ParseRequest(ToBytes(vector.frame), true);
    ASSERT_TRUE(parsed.has_value());
    EXPECT_EQ(parsed->text.front(), vector.body.front());
    EXPECT_EQ(parsed->text.substr(1), vector.body.substr(3));
    if (vector.body.substr(1, 2) == "**") {
      EXPECT_TRUE(parsed->broadcast);
      continue;
    }
    EXPECT_EQ(HexByte(parsed->address), vector.body.substr(1, 2));
    EXPECT_EQ(AsText(BuildRequest(parsed->text, parsed->address, true)), vector.frame);
    EXPECT_EQ(AsText(BuildRequest(parsed->text, parsed->address, false)),
              std::string(vector.body) + "\r");
  }
}

TEST(DconCodec, TheSampleBroadcastNeedsNoLineEnd) {
  const auto bare = ParseRequest(ToBytes("#**"), false);
  EXPECT_TRUE(bare && bare->broadcast);
  const auto summed = ParseRequest(ToBytes("#**77"), true);
  EXPECT_TRUE(summed && summed->broadcast);
  EXPECT_FALSE(ParseRequest(ToBytes("#**"), true));
  EXPECT_FALSE(ParseRequest(ToBytes("#01"), false));
}

TEST(DconCodec, RepliesOfTheWorkedExamples) {
  for (const Vector& vector : kReplies) {
    SCOPED_TRACE(vector.frame);
    EXPECT_EQ(AsText(BuildReply(vector.body, true)), vector.frame);
    const auto parsed = ParseReply(ToBytes(vector.frame), kChecksum);
    ASSERT_TRUE(parsed.has_value());
    EXPECT_EQ(parsed->lead, vector.body.front());
    EXPECT_EQ(parsed->body, vector.body.substr(1));
    const auto bare = ParseReply(ToBytes(std::string(vector.body) + "\r"), kNoChecksum);
    ASSERT_TRUE(bare.has_value());
    EXPECT_EQ(bare->body, vector.body.substr(1));
  }
}

TEST(DconCodec, EveryDamagedCharacterIsNoticed) {
  for (const Vector& vector : kReplies) {
    for (std::size_t i = 0; i < vector.frame.size(); ++i) {
      Bytes damaged = ToBytes(vector.frame);
      damaged[i] = static_cast<std::uint8_t>(damaged[i] + 1);
      EXPECT_FALSE(ParseReply(damaged, kChecksum).has_value()) << Printable(damaged);
    }
  }
}

TEST(DconCodec, ChecksumInEitherCase) {
  EXPECT_TRUE(ParseReply(ToBytes(">+1.2-33.44+555.666bd\r"), kChecksum).has_value());
  EXPECT_TRUE(ParseRequest(ToBytes("$0A6cb\r"), true).has_value());
}

TEST(DconCodec, CounterChecksumInFront) {
  const Bytes frame = ToBytes(">D40000001E\r");
  EXPECT_EQ(BuildCounterReplyFront("0000001E"), frame);
  for (const int variant : {kChecksumEither, kChecksumFront}) {
    const auto reply = ParseReply(frame, variant);
    ASSERT_TRUE(reply.has_value());
    EXPECT_EQ(reply->body, "0000001E");
    EXPECT_FALSE(reply->ambiguous);
  }
  EXPECT_FALSE(ParseReply(frame, kChecksum).has_value());
  const Bytes behind = ToBytes(">0001E240DA\r");
  EXPECT_EQ(ParseReply(behind, kChecksumEither)->body, "0001E240");
  EXPECT_FALSE(ParseReply(behind, kChecksumFront).has_value());
  EXPECT_TRUE(ParseReply(ToBytes("?0AB0\r"), kChecksumFront).has_value());
}

/// Some counts fit both ways; they must be known as such, because only one reading is true.
TEST(DconCodec, CounterChecksumThatFitsBothWaysIsAmbiguous) {
  int ambiguous = 0;
  for (unsigned count = 0; count < 0x10000; ++count) {
    const std::string data = "0000" + HexByte(static_cast<std::uint8_t>(count >> 8U)) +
                             HexByte(static_cast<std::uint8_t>(count));
    const auto reply = ParseReply(BuildCounterReplyFront(data), kChecksumEither);
    ASSERT_TRUE(reply.has_value());
    if (reply->ambiguous) {
      ++ambiguous;
    } else {
      ASSERT_EQ(reply->body, data);
    }
    ASSERT_EQ(ParseReply(BuildCounterReplyFront(data), kChecksumFront)->body, data);
  }
  EXPECT_GT(ambiguous, 0);
}

TEST(DconCodec, RequestsThatAreNone) {
  EXPECT_FALSE(ParseRequest(ToBytes("#0184"), true));    // no CR
  EXPECT_FALSE(ParseRequest(ToBytes("#0185\r"), true));  // checksum
  EXPECT_FALSE(ParseRequest(ToBytes("#01\r"), true));    // none
  EXPECT_FALSE(ParseRequest(ToBytes("#0G\r"), false));   // address
  EXPECT_FALSE(ParseRequest(ToBytes("#0\r"), false));
  EXPECT_FALSE(ParseRequest(ToBytes(">01\r"), false));
  EXPECT_FALSE(ParseRequest(ToBytes("#01\n\r"), false));
  EXPECT_FALSE(ParseRequest(Bytes{}, false));
}

TEST(DconCodec, Addresses) {
  EXPECT_EQ(ParseAddress("0").value(), 0);
  EXPECT_EQ(ParseAddress("74").value(), 0x4A);
  EXPECT_EQ(ParseAddress("0x4A").value(), 0x4A);
  EXPECT_EQ(ParseAddress("255").value(), 255);
  for (const std::string_view bad : {"", "256", "-1", "4A", "0x", "0x100", "1 ", "*"}) {
    const auto parsed = ParseAddress(bad);
    ASSERT_FALSE(parsed) << bad;
    EXPECT_NE(parsed.error().find("0...255"), std::string::npos);
  }
  EXPECT_EQ(AsText(BuildRequest("#", ParseAddress("74").value(), true)), "#4A98\r");
}

TEST(DconCodec, ChecksumIsTheSumOfAllCharacters) {
  EXPECT_EQ(Sum8(ToBytes("#01")), 0x84);
  EXPECT_TRUE(ChecksumFits("#0184", kChecksum));
  EXPECT_FALSE(ChecksumFits("84", kChecksum));
  EXPECT_FALSE(ChecksumFits("", kChecksum));
}

}  // namespace
}  // namespace baudgate::protocols::dcon
