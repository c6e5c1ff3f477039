// Tests of `LinkServer`, the end of the link in the DDS process.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/link/link_server.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/base/text.h"
#include "tests/gateway/outputs/dds/remembering_writer.h"
#include "tests/support/times.h"

namespace baudgate::dds {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::RememberingWriter;
using ::testing::SizeIs;

class KeepingWriter : public RememberingWriter {
 public:
  explicit KeepingWriter(std::vector<PointSample>& kept) : kept_(kept) {}
  ~KeepingWriter() override { kept_ = std::move(points); }

 private:
  std::vector<PointSample>& kept_;
};

class LinkServerTest : public ::testing::Test {
 protected:
  Status Take(const Bytes& packet) { return server_.Take(packet); }
  template <typename Sample>
  Status Take(LinkKind kind, const Sample& sample) {
    Bytes packet(kMaxLinkMessage);
    packet.resize(EncodeSample(kind, sample, packet));
    return server_.Take(packet);
  }
  void Open() {
    ASSERT_TRUE(
        Take(EncodeOpen({.gateway = "g", .participant = {}, .room = {.points = 5, .devices = 2}})));
    ASSERT_EQ(*server_.Answer(kStart), EncodeBare(LinkKind::opened));
    writer_->there = {};
  }
  Duration Leave() {
    Instant now = kStart;
    while (const auto next = server_.Leave(now)) now = *next;
    return now - kStart;
  }
  std::optional<Bytes> AnswerToEnd(const Subscribers& there) {
    Open();
    writer_->there = there;
    EXPECT_TRUE(Take(EncodeBare(LinkKind::end)));
    EXPECT_TRUE(server_.ended());
    EXPECT_EQ(Leave(), 150ms);
    return server_.Answer(kStart);
  }
  static PointSample Point(const std::string& name) {
    PointSample sample;
    sample.gateway = "g", sample.device = "d", sample.point = name;
    return sample;
  }

  RememberingWriter* writer_ = nullptr;
  std::vector<PointSample> written_;
  std::string refusal_;
  LinkOpen asked_;
  int woken_ = 0;
  LinkServer server_{[this](const LinkOpen& open) -> Result<std::unique_ptr<SampleWriter>> {
                       asked_ = open;
                       if (!refusal_.empty()) return Error{refusal_};
                       auto writer = std::make_unique<KeepingWriter>(written_);
                       writer_ = writer.get();
                       return std::unique_ptr<SampleWriter>(std::move(writer));
                     },
                     [this] { ++woken_; }};
};

TEST_F(LinkServerTest, OpensOnceAndPublishes) {
  EXPECT_EQ(server_.Answer(kStart), std::nullopt);
  Open();
  EXPECT_EQ(asked_.room.points, 5U);
  ASSERT_TRUE(Take(LinkKind::point, Point("p")));
  DeviceSample device;
  device.device = "d";
  ASSERT_TRUE(Take(LinkKind::device, device));
  EXPECT_THAT(writer_->points, ElementsAre(Point("p")));
  EXPECT_THAT(writer_->devices, SizeIs(1));
  const GatewaySample gateway{"g", 7, "1.2.3"};
  ASSERT_TRUE(Take(LinkKind::gateway, gateway));
  EXPECT_THAT(writer_->gateways, ElementsAre(gateway));
}

TEST_F(LinkServerTest, ASecondOpenReplacesTheWriters) {
  Open();
  LinkOpen open;
  open.room = {.points = 7, .devices = 3, .events = 1};
  ASSERT_TRUE(Take(EncodeOpen(open)));
  EXPECT_EQ(*server_.Answer(kStart), EncodeBare(LinkKind::opened));
  ASSERT_THAT(writer_->reopened, SizeIs(1));
  EXPECT_EQ(writer_->reopened[0].points, 7U);
  writer_->answer = Sent::refused;
  EXPECT_THAT(Take(EncodeOpen(open)).error(), HasSubstr("no writers"));
}

EventSample Event(std::uint64_t seq) {
  EventSample event;
  event.gateway = "g", event.device = "d", event.seq = seq;
  return event;
}

TEST_F(LinkServerTest, ARefusedEventIsRetriedBeforeLaterEvents) {
  Open();
  ASSERT_TRUE(Take(LinkKind::event, Event(1)));
  EXPECT_THAT(writer_->events, ElementsAre(Event(1)));
  writer_->answer = Sent::refused;
  ASSERT_TRUE(Take(LinkKind::event, Event(2)));
  server_.Answer(kStart + 1s);
  writer_->answer = Sent::yes;
  ASSERT_TRUE(Take(LinkKind::event, Event(3)));
  EXPECT_THAT(writer_->events, SizeIs(1)) << "in their order";
  server_.Answer(kStart + 1500ms);
  EXPECT_THAT(writer_->events, SizeIs(1)) << "not before a second";
  server_.Answer(kStart + 2s);
  EXPECT_THAT(writer_->events, ElementsAre(Event(1), Event(2), Event(3)));
  EXPECT_THAT(Take(*ParseHex("07 07 04 00 00 01 00 00")).error(), HasSubstr("damaged sample"));
}

TEST_F(LinkServerTest, RefusedEventsAreLimitedAndDropsAreCounted) {
  Open();
  writer_->answer = Sent::refused;
  for (std::uint64_t seq = 1; seq <= 1005; ++seq) {
    ASSERT_TRUE(Take(LinkKind::event, Event(seq)));
  }
  const auto counts = DecodeCounts(ParseLink(*server_.Answer(kStart + 1s))->body);
  EXPECT_EQ(counts->events_dropped, 5U);
  writer_->answer = Sent::yes;
  server_.Answer(kStart + 3s);
  ASSERT_THAT(writer_->events, SizeIs(1000));
  EXPECT_EQ(writer_->events.front().seq, 6U);
}

WriteArrival Arrival(std::uint64_t seq, Instant received) {
  WriteArrival arrival;
  arrival.request.gateway = "g", arrival.request.client = "c", arrival.request.seq = seq;
  arrival.received = received;
  return arrival;
}

TEST_F(LinkServerTest, HandsRequestsOnAndPublishesReplies) {
  ASSERT_TRUE(Take(EncodeOpen(
      {.gateway = "g", .participant = {}, .room = {.points = 5, .devices = 2}, .requests = true})));
  EXPECT_EQ(server_.NextRequest(), std::nullopt);
  ASSERT_TRUE(writer_->on_request);
  writer_->on_request(Arrival(7, kStart));
  EXPECT_EQ(woken_, 1);
  const auto packet = server_.NextRequest();
  ASSERT_TRUE(packet);
  EXPECT_EQ(*packet, EncodeRequest(Arrival(7, kStart)));
  EXPECT_EQ(server_.NextRequest(), std::nullopt);

  const ReplySample reply{"g", "c", 7, "ok", "", 1};
  ASSERT_TRUE(Take(LinkKind::reply, reply));
  EXPECT_THAT(writer_->replies, ElementsAre(reply));
  EXPECT_THAT(Take(*ParseHex("06 07 01 00 00")).error(), HasSubstr("damaged reply"));
}

TEST_F(LinkServerTest, ListensForNoRequestsWhereWritingIsDenied) {
  Open();
  EXPECT_FALSE(writer_->on_request);
}

TEST_F(LinkServerTest, ExcessRequestsAreDroppedAndCounted) {
  ASSERT_TRUE(Take(EncodeOpen(
      {.gateway = "g", .participant = {}, .room = {.points = 5, .devices = 2}, .requests = true})));
  for (std::uint64_t seq = 0; seq < 10'000; ++seq) writer_->on_request(Arrival(seq, kStart));
  std::uint64_t handed = 0;
  while (server_.NextRequest()) ++handed;
  EXPECT_EQ(handed, RequestIntake::kMost);
  ASSERT_EQ(*server_.Answer(kStart), EncodeBare(LinkKind::opened));
  const auto counts = server_.Answer(kStart + 2s);
  ASSERT_TRUE(counts);
  EXPECT_EQ(DecodeCounts(ParseLink(*counts)->body)->dropped, 10'000 - handed);
}

TEST_F(LinkServerTest, AFailedOpenIsExplainedAndMayBeRepeated) {
  refusal_ = "dds: this machine has no IPv4 address of interfaces [192.0.2.1]";
  ASSERT_TRUE(Take(EncodeOpen({})));
  const auto answer = server_.Answer(kStart);
  ASSERT_TRUE(answer);
  EXPECT_EQ(*answer, EncodeFailed(refusal_));
  EXPECT_EQ(server_.Answer(kStart + 5s), std::nullopt);
  refusal_.clear();
  Open();
}

TEST_F(LinkServerTest, CountsAreSentOnceASecondAsASignOfLife) {
  Open();
  EXPECT_EQ(server_.Answer(kStart + 999ms), std::nullopt);
  ASSERT_TRUE(Take(LinkKind::point, Point("p")));
  writer_->counted.passed = 12345;
  writer_->counted.refused[static_cast<std::size_t>(Refusal::fragment)] = 38;
  EXPECT_EQ(server_.NextAnswer(), kStart + 1s) << "datagrams come all the time";
  const auto answer = server_.Answer(kStart + 1s);
  ASSERT_TRUE(answer);
  EXPECT_EQ(
      *answer,
      EncodeCounts({.subscribers = {}, .written = 1, .refused = 0, .datagrams = writer_->counted}));
  EXPECT_EQ(server_.Answer(kStart + 1s), std::nullopt);
  EXPECT_TRUE(server_.Answer(kStart + 2s));
}

TEST_F(LinkServerTest, ARefusedSampleIsReportedWithin100ms) {
  Open();
  writer_->answer = Sent::refused;
  ASSERT_TRUE(Take(LinkKind::point, Point("p")));
  EXPECT_EQ(server_.NextAnswer(), kStart + 100ms);
  EXPECT_EQ(*server_.Answer(kStart + 100ms),
            EncodeCounts({.subscribers = {}, .written = 0, .refused = 1}));
}

TEST_F(LinkServerTest, LeftIsSentIfEventsHaveAReader) {
  EXPECT_EQ(AnswerToEnd({.points = 1, .events = 1}), EncodeBare(LinkKind::left));
}

TEST_F(LinkServerTest, LeftIsNotSentIfOnlyPointsHaveReaders) {
  EXPECT_EQ(AnswerToEnd({.points = 3}), std::nullopt);
}

TEST_F(LinkServerTest, ALostDaemonConfirmsNoEvents) {
  Open();
  writer_->there = {.points = 1, .events = 1};
  Leave();
  EXPECT_EQ(server_.Answer(kStart), std::nullopt) << "its last events may not have been read";
}

TEST_F(LinkServerTest, TheFinalSampleKeepsItsValueWithQualityNotConnected) {
  Open();
  PointSample sample = Point("p");
  sample.value = 2.5, sample.quality = 0xC0, sample.seq = 7;
  ASSERT_TRUE(Take(LinkKind::point, Point("p")));
  ASSERT_TRUE(Take(LinkKind::point, sample));
  PointSample told = Point("ended");
  ASSERT_TRUE(Take(LinkKind::point, told));
  told.quality = 0x08;
  ASSERT_TRUE(Take(LinkKind::point, told));
  writer_->points.clear();
  Leave();
  sample.quality = 0x08;
  EXPECT_THAT(written_, ElementsAre(sample)) << "each once";
  Leave();
  EXPECT_THAT(written_, SizeIs(1));
}

TEST_F(LinkServerTest, FinalSamplesArePacedAndLimitedInTime) {
  Open();
  for (int i = 0; i < 100'000; ++i) {
    ASSERT_TRUE(Take(LinkKind::point, Point("p" + std::to_string(i))));
  }
  writer_->points.clear();
  const Duration took = Leave();
  EXPECT_GE(took, 850ms);
  EXPECT_LE(took, 853ms);
  EXPECT_GE(written_.size(), 14'000U) << "20 a millisecond";
}

TEST_F(LinkServerTest, AMalformedMessageClosesTheLink) {
  EXPECT_THAT(Take(LinkKind::point, Point("p")).error(), HasSubstr("before its request to open"));
  EXPECT_THAT(Take(*ParseHex("01 01 00 00")).error(), HasSubstr("version 1"));
  EXPECT_THAT(Take(*ParseHex("01 07 01 00 00")).error(), HasSubstr("damaged request"));
  Open();
  EXPECT_THAT(Take(EncodeBare(LinkKind::opened)).error(), HasSubstr("unexpected kind"));
  EXPECT_THAT(Take(*ParseHex("02 07 04 00 00 01 00 00")).error(), HasSubstr("damaged sample"));
  Bytes long_version(kMaxLinkMessage);
  long_version.resize(
      EncodeSample(LinkKind::gateway, GatewaySample{"g", 7, std::string(32, 'v')}, long_version));
  ASSERT_TRUE(Take(long_version));
  long_version[long_version.size() - 33 - 4] = 34;
  long_version[2] = static_cast<std::uint8_t>(long_version[2] + 1);
  long_version.insert(long_version.end() - 1, 'v');
  EXPECT_THAT(Take(long_version).error(), HasSubstr("damaged sample"));
}

}  // namespace
}  // namespace baudgate::dds
