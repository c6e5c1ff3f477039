// Records of a trace as whole frames, decoded.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "gateway/base/text.h"
#include "gateway/diagnosis/decode/exchange_decoder.h"
#include "gateway/tools/cli/offline/decode.h"
#include "protocols/all_protocols.h"
#include "tests/support/file_cases.h"

namespace baudgate {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

const config::Catalog& Protocols() {
  static const config::Catalog catalog = [] {
    config::Catalog all;
    for (const Protocol* protocol : AllProtocols()) all.protocols.emplace(protocol->name, protocol);
    return all;
  }();
  return catalog;
}

const std::vector<std::string> kTraceHead = {"# line io, port /dev/ttyUSB0 9600 8N1, protocol dcon",
                                             "# device ai-1, protocol dcon"};

std::string Frames(const std::string& records) {
  FrameLines frames(DecodersOf(kTraceHead, Protocols()));
  std::string text;
  const auto print = [&text](const std::vector<std::string>& lines) {
    for (const std::string& line : lines) text += line + "\n";
  };
  std::istringstream in(records);
  for (std::string record; std::getline(in, record);) print(frames.Take(record));
  print(frames.Flush());
  return text;
}

struct FrameCase {
  std::string what;
  std::string records{};
  std::string frames{};
};

std::vector<FrameCase> FrameCases() {
  std::vector<FrameCase> cases;
  for (const auto& read : ReadFileCases("tests/gateway/tools/cli/frames.txt")) {
    FrameCase& one = cases.emplace_back(FrameCase{read.given[0]});
    for (std::size_t i = 1; i < read.given.size(); ++i) one.records += read.given[i] + "\n";
    for (const auto& [sign, line] : read.results) one.frames += line + "\n";
  }
  EXPECT_EQ(cases.size(), 7U);
  return cases;
}

TEST(FrameLines, AreWholeAndDecoded) {
  for (const FrameCase& one : FrameCases()) EXPECT_EQ(Frames(one.records), one.frames) << one.what;
}

std::string RecordOf(const std::string& time, const std::string& bytes) {
  return time + " - < " + ToHex(ToBytes(bytes)) + " | " + Printable(ToBytes(bytes)) + "\n";
}

/// Messages that come unasked, in pieces and behind damage: in a trace, and decoded from the trace
/// and from lines that somebody has written.
TEST(FrameLines, WhatADeviceSaysByItselfIsDecoded) {
  config::Catalog catalog = Protocols();
  catalog.profile_dirs = {"config/profiles"};  // tests run at the root of the source tree
  const std::string head = "# device wind, protocol telegram, profile nmea-0183-weather";
  const std::string sentence = "$WIMWV,045,R,011.63,N,A*09\r\n";
  const std::string records = RecordOf("12:00:00.000000", sentence.substr(0, 9)) +
                              RecordOf("12:00:00.020000", sentence.substr(9)) +
                              RecordOf("12:00:01.000000", "$WIMWV,046,R,011.63,N,A*09\r\n") +
                              RecordOf("12:00:02.000000", sentence + sentence);
  FrameLines frames(DecodersOf({head}, catalog));
  std::vector<std::string> lines;
  std::istringstream in(records);
  for (std::string record; std::getline(in, record);) {
    for (std::string& line : frames.Take(record)) lines.push_back(std::move(line));
  }
  for (std::string& line : frames.Flush()) lines.push_back(std::move(line));
  const std::string means = " 0A | wind_angle 45 deg, wind_speed 11.63 kn";
  ASSERT_EQ(lines.size(), 4U);
  EXPECT_THAT(lines[0], AllOf(HasSubstr("12:00:00.000000 - < 24 57"), HasSubstr(means)));
  EXPECT_THAT(lines[1], AllOf(HasSubstr("12:00:01"), Not(HasSubstr("wind_angle"))));
  EXPECT_THAT(lines[2], HasSubstr(means));
  EXPECT_THAT(lines[3], HasSubstr(means));

  const auto decoded = [&](const DecodeOptions& options, const std::string& text) {
    std::istringstream file(text);
    std::ostringstream out;
    std::ostringstream err;
    RunDecode(options, catalog, file, out, err);
    return out.str() + err.str();
  };
  const std::string good = R"({"point":"wind_angle","value":45.0,"unit":"deg","quality":192})";
  const std::string of_trace = decoded({}, head + "\n" + records);
  std::size_t found = 0;
  for (auto at = of_trace.find(good); at != std::string::npos; at = of_trace.find(good, at + 1)) {
    ++found;
  }
  EXPECT_EQ(found, 3U) << of_trace;
  EXPECT_THAT(of_trace, HasSubstr(R"({"outcome":"corrupt")"));
  const DecodeOptions wind{.protocol = "telegram", .profile = "nmea-0183-weather"};
  EXPECT_THAT(decoded(wind, "< " + ToHex(ToBytes(sentence)) + "\n"), HasSubstr(good));
  EXPECT_THAT(decoded({.protocol = "dcon"}, "< 41\n"), HasSubstr("line 1: a reply before any"));
}

TEST(FrameLines, OnlyBytesThatNobodyAskedForAreNotWaitedWith) {
  FrameLines frames(DecodersOf(kTraceHead, Protocols()));
  frames.Take("04:05:06.000000 ai-1 > 23 30 31 0D | #01.");
  frames.Take("04:05:06.010000 ai-1 < 3E | >");
  EXPECT_FALSE(frames.waits()) << "the end of the exchange comes";
  frames.Take("04:05:06.011000 ai-1 = partial");
  frames.Take("04:05:06.100000 - < 41 | A");
  EXPECT_TRUE(frames.waits());
}

TEST(FrameLines, WhatNeverEndsIsNotCollectedForEver) {
  FrameLines frames({});
  std::string piece = "04:05:06.000000 - <";
  for (int i = 0; i < 1024; ++i) piece += " 41";
  std::size_t lines = 0;
  for (int i = 0; i < 100; ++i) lines += frames.Take(piece).size();
  EXPECT_EQ(lines, 100 * 1024 / FrameLines::kMostBytes);
}

TEST(FrameLines, DecodeReadsThemLikeTheRecords) {
  for (const FrameCase& one : FrameCases()) {
    const auto decoded = [](const std::string& text) {
      std::istringstream in(kTraceHead[0] + "\n" + kTraceHead[1] + "\n" + text);
      std::ostringstream out;
      std::ostringstream err;
      RunDecode({}, Protocols(), in, out, err);
      return out.str() + err.str();
    };
    const std::string of_records = decoded(one.records);
    if (one.records.find("= no_reply\n") == std::string::npos) {
      EXPECT_EQ(decoded(one.frames), of_records) << one.what;
    } else {
      EXPECT_THAT(decoded(one.frames), HasSubstr("no reply after 500 ms"));
    }
  }
}

}  // namespace
}  // namespace baudgate
