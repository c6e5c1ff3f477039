// `decode` on what a trace says of itself, for programs and for people.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/decode.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "tests/config/shipped.h"

namespace baudgate {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

struct Said {
  int code = 0;
  std::string out;
  std::string err;
};

Said DecodeText(const std::string& text, const DecodeOptions& options = {}) {
  std::istringstream in(text);
  std::ostringstream out;
  std::ostringstream err;
  const int code = RunDecode(options, baudgate::testing::Shipped(), in, out, err);
  return {code, out.str(), err.str()};
}

std::string Eight(const std::string& text) {
  std::string all;
  for (int i = 0; i < 8; ++i) all += text;
  return all;
}

const std::string kFileHead =
    "# baudgate 1.2.3: the last exchanges of a line\n"
    "# line io, port /dev/ttyUSB0 9600 8N1, protocol dcon\n"
    "# device ai-1, protocol dcon, profile icpdas-i-7017\n"
    "# device ai-2, protocol dcon\n";
const std::string kFileTrace =
    "04:05:06.123456 ai-1 > 23 30 31 0D | #01.\n"
    "04:05:06.140000 ai-1 < 3E" +
    Eight(" 2B 30 31 2E 35 30 30") +
    " 0D | >+01.500+01.500\n"
    "04:05:06.140300 ai-1 = ok, 16.8 ms\n"
    "04:05:07.000000 ai-2 > 23 30 32 0D | #02.\n"
    "04:05:07.500000 ai-2 = no_reply: no reply after 500 ms\n";

TEST(Decode, TakesProtocolAndProfileFromTheHead) {
  const Said decoded = DecodeText(kFileHead + kFileTrace);
  EXPECT_EQ(decoded.code, 0) << decoded.err;
  EXPECT_THAT(decoded.out, HasSubstr(R"("point":"input_0","value":1.5,"unit":"V")"));
  EXPECT_THAT(decoded.out, HasSubstr(R"({"outcome":"no_reply","reason":"no reply after 500 ms")"));
}

TEST(Decode, WhatTheWordsSayHoldsForAll) {
  const Said decoded = DecodeText(kFileHead + kFileTrace, {.protocol = "dcon"});
  EXPECT_EQ(decoded.code, 0) << decoded.err;
  EXPECT_THAT(decoded.out, HasSubstr(R"({"point":"#[0]","value":1.5,"quality")"));
}

TEST(Decode, SaysThatItHasToBeToldTheProtocol) {
  const Said decoded = DecodeText(kFileTrace);
  EXPECT_EQ(decoded.code, 2);
  EXPECT_EQ(decoded.err, "baudgate: --protocol is missing, and no head of a trace names one\n");
}

TEST(Decode, PrintsProseForPeople) {
  const Said decoded = DecodeText(kFileHead + kFileTrace, {.prose = true, .width = 40});
  EXPECT_THAT(decoded.out,
              StartsWith("04:05:06.123456 ai-1: ok\n  input_0 1.5 V\n  input_1 1.5 V\n"));
  EXPECT_THAT(decoded.out, EndsWith("04:05:07.000000 ai-2: no_reply: no reply\n  after 500 ms\n"));
}

}  // namespace
}  // namespace baudgate
