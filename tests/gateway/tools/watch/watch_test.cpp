// Tests of `baudgate watch` with a publisher in this process.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/watch/watch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pthread.h>
#include <signal.h>

#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "gateway/base/text.h"
#include "gateway/outputs/dds/publisher.h"
#include "tests/gateway/outputs/dds/fixture.h"
#include "tests/gateway/outputs/dds/raw_writer.h"

namespace baudgate::tools {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

WatchOptions Options() {
  WatchOptions options;
  options.domain = dds::testing::TestDomain();
  return options;
}

struct Watched {
  int exit_code = 0;
  std::string out;
  std::string err;
};

Watched RunIt(const WatchOptions& options) {
  std::ostringstream out;
  std::ostringstream err;
  const int exit_code = RunWatch(options, out, err);
  return {exit_code, out.str(), err.str()};
}

class StopWhenSeen : public std::stringbuf {
 public:
  explicit StopWhenSeen(std::string wanted) : wanted_(std::move(wanted)) {}
  int sync() override {
    if (!stopped_ && str().find(wanted_) != std::string::npos) {
      stopped_ = true;
      pthread_kill(pthread_self(), SIGTERM);
    }
    return 0;
  }

 private:
  const std::string wanted_;
  bool stopped_ = false;
};

Watched RunUntilSeen(WatchOptions options, const std::string& wanted) {
  options.seconds = 20s;
  StopWhenSeen buffer(wanted);
  std::ostream out(&buffer);
  std::ostringstream err;
  const int exit_code = RunWatch(options, out, err);
  return {exit_code, buffer.str(), err.str()};
}

class WatchTest : public ::testing::Test {
 protected:
  void SetUp() override {
    dds::testing::Set(store_, 0, 0, 2.5);
    dds::testing::Set(store_, 0, 1, std::string("SPCJ\x1b 4D29"));
    publisher_ = dds::testing::Publish(config_, store_);
    ASSERT_NE(publisher_, nullptr);
  }

  static config::Config Config() {
    config::Config config = dds::testing::MakeConfig(2, 3);
    config.dds.heartbeat = 2s;
    return config;
  }

  const config::Config config_ = Config();
  bus::PointStore store_{config_};
  std::unique_ptr<dds::DdsPublisher> publisher_;
};

TEST_F(WatchTest, OncePrintsTheWholeImageAsATable) {
  WatchOptions options = Options();
  options.once = true;
  const Watched watched = RunIt(options);
  EXPECT_EQ(watched.exit_code, 0) << watched.err;
  EXPECT_EQ(std::count(watched.out.begin(), watched.out.end(), '\n'), 1 + 6) << watched.out;
  EXPECT_THAT(watched.out, HasSubstr("2.500  A     good"));
  EXPECT_THAT(watched.out, HasSubstr("waiting for initial data"));
  EXPECT_THAT(watched.out, HasSubstr("SPCJ? 4D29"));
  EXPECT_THAT(watched.out, Not(HasSubstr("\x1b")));
}

TEST_F(WatchTest, JsonLinesAreComplete) {
  WatchOptions options = Options();
  options.once = true;
  options.json = true;
  const Watched watched = RunIt(options);
  ASSERT_EQ(watched.exit_code, 0) << watched.err;
  const auto lines = Split(Trim(watched.out), '\n');
  ASSERT_EQ(lines.size(), 6U);
  const auto number = nlohmann::json::parse(lines[0]);
  EXPECT_EQ(number["gateway"], "substation-7");
  EXPECT_EQ(number["device"], "feeder-0");
  EXPECT_EQ(number["point"], "p0");
  EXPECT_EQ(number["value"], 2.5);
  EXPECT_EQ(number["unit"], "A");
  EXPECT_EQ(number["quality"], 0xC0);
  EXPECT_EQ(number["seq"], 1);
  EXPECT_FALSE(number.contains("text"));
  EXPECT_TRUE(number["writer"].get<std::string>().starts_with("01.0f.")) << number["writer"];
  const auto text = nlohmann::json::parse(lines[1]);
  EXPECT_TRUE(text["value"].is_null());
  EXPECT_EQ(text["text"], "SPCJ\x1b 4D29");
  const auto unread = nlohmann::json::parse(lines[2]);
  EXPECT_TRUE(unread["value"].is_null());
  EXPECT_TRUE(unread["source_time"].is_null());
  EXPECT_EQ(unread["quality"], 0x20);
}

TEST_F(WatchTest, FiltersByDeviceAndPoint) {
  WatchOptions options = Options();
  options.once = true;
  options.json = true;
  options.device = "feeder-1";
  options.point = "p2";
  const Watched watched = RunIt(options);
  ASSERT_EQ(watched.exit_code, 0) << watched.err;
  const auto lines = Split(Trim(watched.out), '\n');
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_EQ(nlohmann::json::parse(lines[0])["point"], "p2");
}

TEST_F(WatchTest, ReportsThatTheFilterMatchesNothing) {
  WatchOptions options = Options();
  options.once = true;
  options.device = "feeder-9";
  const Watched watched = RunIt(options);
  EXPECT_EQ(watched.exit_code, 4);
  EXPECT_THAT(watched.err, HasSubstr("none of the requested gateway, device and point"));
}

TEST_F(WatchTest, ATerminalGetsALiveTable) {
  WatchOptions options = Options();
  options.terminal = TableView{.width = 80, .height = 24, .colour = true};
  const Watched watched = RunUntilSeen(options, "p2");
  EXPECT_EQ(watched.exit_code, 0);
  EXPECT_TRUE(watched.out.starts_with("\x1b[?1049h")) << watched.out;
  EXPECT_THAT(watched.out, HasSubstr("waiting for initial data"));
  EXPECT_THAT(watched.out, Not(HasSubstr("SPCJ\x1b")));
}

TEST_F(WatchTest, OtherOutputsGetPlainLines) {
  const Watched watched = RunUntilSeen(Options(), "feeder-0  p0");
  EXPECT_EQ(watched.exit_code, 0);
  EXPECT_THAT(watched.out, HasSubstr("substation-7  feeder-0  p0  2.500 A  good\n"));
  EXPECT_THAT(watched.out, Not(HasSubstr("\x1b")));
}

class Impostor {
 public:
  void Publish(const std::string& value) {
    dds::PointSample sample;
    sample.gateway = "substation-7", sample.device = "feeder-0", sample.point = "p0";
    sample.text = value, sample.quality = 0xC0, sample.seq = 2;
    ASSERT_TRUE(writer_.ok()) << writer_.error();
    EXPECT_EQ((*writer_)->Write(sample), dds::Sent::yes);
  }

 private:
  Result<std::unique_ptr<dds::SampleWriter>> writer_ = dds::CreateFastWriter(
      dds::testing::TestSubscriber().participant, {.points = 1, .devices = 1});
};

TEST_F(WatchTest, TwoLiveWritersOfOnePointAreAnAlarm) {
  Impostor impostor;
  impostor.Publish("false");
  WatchOptions options = Options();
  options.terminal = TableView{.width = 0, .height = 24, .colour = true};
  const Watched table = RunUntilSeen(options, "ALARM");
  EXPECT_THAT(table.out, HasSubstr("feeder-0 p0 comes from two senders at once, 01.0f."));
}

TEST_F(WatchTest, PlainLinesNameThePublisherOnce) {
  const Watched watched = RunUntilSeen(Options(), "feeder-0  p0");
  EXPECT_THAT(watched.err, HasSubstr("watch: gateway substation-7 is published by 01.0f."));
}

TEST_F(WatchTest, UndecodableSamplesAreReportedWithTheirNumber) {
  dds::testing::RawWriter writer(dds::kPointTopic, "baudgate::v1::PointSample");
  ASSERT_TRUE(writer.Write(Bytes{0, 3, 0, 0}));
  WatchOptions options = Options();
  options.terminal = TableView{.width = 80, .height = 24, .colour = false};
  const Watched watched = RunUntilSeen(options, "samples were left out");
  EXPECT_THAT(watched.err, HasSubstr("watch: 1 samples were left out: they are longer"));
}

TEST_F(WatchTest, EndsCleanlyAtASignal) {
  std::ostringstream out;
  std::ostringstream err;
  int exit_code = -1;
  sigset_t stop;
  sigemptyset(&stop);
  sigaddset(&stop, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &stop, nullptr);
  std::thread watching([&] { exit_code = RunWatch(Options(), out, err); });
  pthread_kill(watching.native_handle(), SIGTERM);
  watching.join();
  pthread_sigmask(SIG_UNBLOCK, &stop, nullptr);
  EXPECT_TRUE(exit_code == 0 || err.str().find("no samples came on domain") != std::string::npos);
}

TEST(Watch, AnEndWithoutSamplesIsReported) {
  WatchOptions options = Options();
  options.seconds = 100ms;
  const Watched watched = RunIt(options);
  EXPECT_EQ(watched.exit_code, 4);
  EXPECT_THAT(watched.err,
              HasSubstr("watch: no samples came on domain " + std::to_string(options.domain)));
}

TEST(Watch, SilenceIsReportedWithAdvice) {
  WatchOptions options = Options();
  options.once = true;
  options.first_sample_timeout = 100ms;
  const Watched watched = RunIt(options);
  EXPECT_EQ(watched.exit_code, 4);
  EXPECT_THAT(watched.err, HasSubstr("domain " + std::to_string(options.domain)));
  EXPECT_THAT(watched.err, HasSubstr("127.0.0.1"));
  EXPECT_THAT(watched.err, HasSubstr("gateway runs"));
}

TEST(Watch, AnInterfaceAddressOfAnotherMachineIsAnError) {
  WatchOptions options = Options();
  options.interfaces = {"192.0.2.1"};
  const Watched watched = RunIt(options);
  EXPECT_EQ(watched.exit_code, 4);
  EXPECT_THAT(watched.err, HasSubstr("192.0.2.1"));
}

}  // namespace
}  // namespace baudgate::tools
