// Tests of `trace` and `decode`: the records of a trace as whole frames, decoded.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <sstream>

#include "gateway/base/text.h"
#include "gateway/diagnosis/decode/exchange_decoder.h"
#include "gateway/records/trace/trace_text.h"
#include "gateway/tools/cli/client/control_client.h"
#include "gateway/tools/cli/offline/decode.h"
#include "gateway/tools/cli/trace.h"
#include "protocols/all_protocols.h"
#include "tests/gateway/outputs/control/fixture.h"
#include "tests/support/file_cases.h"

namespace baudgate::tools {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

const config::Catalog& Protocols() {
  static const config::Catalog catalog = [] {
    config::Catalog all;
    for (const protocols::Protocol* protocol : protocols::AllProtocols())
      all.protocols.emplace(protocol->name, protocol);
    return all;
  }();
  return catalog;
}

const std::vector<std::string> kTraceHead = {"# line io, port /dev/ttyUSB0 9600 8N1, protocol dcon",
                                             "# device ai-1, protocol dcon"};

std::string Frames(const std::string& records) {
  diagnosis::FrameLines frames(DecodersOf(kTraceHead, Protocols()));
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

TEST(FrameLines, UnaskedMessagesAreDecoded) {
  config::Catalog catalog = Protocols();
  catalog.profile_dirs = {"config/profiles"};
  const std::string head = "# device wind, protocol telegram, profile nmea-0183-weather";
  const std::string sentence = "$WIMWV,045,R,011.63,N,A*09\r\n";
  const std::string records = RecordOf("12:00:00.000000", sentence.substr(0, 9)) +
                              RecordOf("12:00:00.020000", sentence.substr(9)) +
                              RecordOf("12:00:01.000000", "$WIMWV,046,R,011.63,N,A*09\r\n") +
                              RecordOf("12:00:02.000000", sentence + sentence);
  diagnosis::FrameLines frames(DecodersOf({head}, catalog));
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
  EXPECT_THAT(decoded({.protocol = "dcon"}, "< 41\n"),
              HasSubstr("line 1: the reply has no request"));
}

TEST(FrameLines, OnlyUnaskedBytesAreShownAfterAWait) {
  diagnosis::FrameLines frames(DecodersOf(kTraceHead, Protocols()));
  frames.Take("04:05:06.000000 ai-1 > 23 30 31 0D | #01.");
  frames.Take("04:05:06.010000 ai-1 < 3E | >");
  EXPECT_FALSE(frames.waits()) << "the end of the exchange comes";
  frames.Take("04:05:06.011000 ai-1 = partial");
  frames.Take("04:05:06.100000 - < 41 | A");
  EXPECT_TRUE(frames.waits());
}

TEST(FrameLines, AnEndlessMessageIsCollectedWithinABound) {
  diagnosis::FrameLines frames({});
  std::string piece = "04:05:06.000000 - <";
  for (int i = 0; i < 1024; ++i) piece += " 41";
  std::size_t lines = 0;
  for (int i = 0; i < 100; ++i) lines += frames.Take(piece).size();
  EXPECT_EQ(lines, 100 * 1024 / diagnosis::FrameLines::kMostBytes);
}

TEST(FrameLines, DecodeAcceptsFramesLikeRecords) {
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
}  // namespace baudgate::tools

namespace baudgate::tools {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

class TraceTest : public control::ControlTest {
 protected:
  int Trace(const TraceOptions& options) { return RunTrace(options, {}, out_, err_); }
  std::string Head() const {
    std::string head;
    for (const std::string& line : records::TraceHead(config_.lines[0])) head += line + "\n";
    return head;
  }

  std::ostringstream out_;
  std::ostringstream err_;
};

TEST_F(TraceTest, UnknownNamesAndNoGatewayHaveTheirExitCodes) {
  EXPECT_EQ(Trace({.line = "io", .socket = path()}), 4);
  StartServer();
  EXPECT_EQ(Trace({.line = "iO", .socket = path()}), 2);
  EXPECT_THAT(out_.str(), IsEmpty());
}

TEST_F(TraceTest, TraceShowsStoredRecords) {
  records::TraceRecord record;
  record.kind = records::TraceRecord::Kind::sent;
  record.device = "feeder-1";
  record.hex = "3E 31";
  lines_.recorded = {record, record};
  StartServer();
  EXPECT_EQ(Trace({.line = "bay-1", .last = true, .socket = path()}), 0);
  EXPECT_EQ(out_.str(), Head() + ToText(record) + "\n" + ToText(record) + "\n");
  out_.str({});
  EXPECT_EQ(Trace({.line = "bay-1", .device = "feeder-2", .last = true, .socket = path()}), 0);
  EXPECT_THAT(out_.str(), Not(HasSubstr(" feeder-1")));
  EXPECT_THAT(err_.str(), HasSubstr("no frames are recorded yet"));
}

TEST_F(TraceTest, PiecesAreJoinedIntoAFrameUnlessBytesAreRequested) {
  records::TraceRecord first;
  first.kind = records::TraceRecord::Kind::received;
  first.device = "feeder-1";
  first.hex = "3C";
  first.text = "<";
  records::TraceRecord second = first;
  second.hex = "31";
  second.text = "1";
  lines_.recorded = {first, second};
  StartServer();
  EXPECT_EQ(Trace({.line = "bay-1", .last = true, .socket = path()}), 0);
  EXPECT_THAT(out_.str(), EndsWith(" feeder-1 < 3C 31 | <1\n"));
  out_.str({});
  EXPECT_EQ(Trace({.line = "bay-1", .last = true, .bytes = true, .socket = path()}), 0);
  EXPECT_EQ(out_.str(), Head() + ToText(first) + "\n" + ToText(second) + "\n");
}

TEST_F(TraceTest, TraceEndsAfterItsTimeOrASignal) {
  StartServer();
  EXPECT_EQ(Trace({.line = "bay-1", .seconds = 1ms, .socket = path()}), 0);
  EXPECT_THAT(err_.str(), IsEmpty());
  ASSERT_TRUE(lines_.WaitForTraces(0, 0)) << "or the signal would come for the first one";

  const pthread_t here = ::pthread_self();
  std::thread stopper([&] {
    if (lines_.WaitForTraces(0, 1)) ::pthread_kill(here, SIGINT);
  });
  EXPECT_EQ(Trace({.line = "bay-1", .socket = path()}), 0);
  stopper.join();
  EXPECT_THAT(err_.str(), IsEmpty());
  EXPECT_TRUE(lines_.WaitForTraces(0, 0));
}

TEST_F(TraceTest, TraceReportsThatTheGatewayStops) {
  StartServer();
  records::TraceRecord record;
  record.text = "went offline";
  std::thread stopper([&] {
    lines_.WaitForTraces(0, 1);
    lines_.Push(0, record);
    StopServer();
  });
  EXPECT_EQ(Trace({.line = "bay-1", .socket = path()}), kNoDaemon);
  stopper.join();
  EXPECT_THAT(out_.str(), ::testing::AnyOf(Head(), EndsWith("went offline\n")));
  EXPECT_THAT(err_.str(), HasSubstr("the trace has ended: the gateway "));
}

}  // namespace
}  // namespace baudgate::tools
