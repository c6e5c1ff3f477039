// Tests of `LinkKeeper` (under virtual time), `BoundedLines` and `LinkWriter`.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "gateway/outputs/dds/link/child_process.h"
#include "gateway/outputs/dds/link/packet_socket.h"
#include "gateway/outputs/dds/link/process_link.h"
#include "gateway/outputs/dds/published_types.h"
#include "tests/support/times.h"

namespace baudgate::dds {
namespace {

using ::testing::ElementsAre;
using Phase = LinkState::Phase;
using Wish = LinkKeeper::Wish;

Duration UntilStart(LinkKeeper& keeper, Instant& now) {
  const Instant from = now;
  while (keeper.Look(now) != Wish::start) now = std::max(now, keeper.NextLook());
  return now - from;
}

LinkCounts Counts(std::uint32_t subscribers, std::uint64_t written, std::uint64_t refused,
                  std::uint32_t passed, std::uint64_t fragments) {
  LinkCounts counts{.subscribers = {.points = subscribers}, .written = written, .refused = refused};
  counts.datagrams.passed = counts.datagrams.participants = passed;
  counts.datagrams.refused[static_cast<std::size_t>(Refusal::fragment)] = fragments;
  return counts;
}

TEST(LinkKeeper, StartsAtOnceAndIsUpWhenOpened) {
  LinkKeeper keeper(true);
  EXPECT_EQ(keeper.Look(kStart), Wish::start);
  keeper.Started(kStart);
  EXPECT_EQ(keeper.state().phase, Phase::starting);
  EXPECT_EQ(keeper.Look(kStart), Wish::nothing);
  keeper.Opened(kStart + 20ms);
  EXPECT_EQ(keeper.state().phase, Phase::up);
}

TEST(LinkKeeper, WaitsLongerAfterEachEndAndResetsAfterAMinuteOfLife) {
  LinkKeeper keeper(true);
  Instant now = kStart;
  UntilStart(keeper, now);
  std::vector<Duration> waits;
  for (int i = 0; i < 8; ++i) {
    keeper.Started(now);
    keeper.Opened(now);
    keeper.Ended("was ended by signal 6", now);
    waits.push_back(UntilStart(keeper, now));
  }
  EXPECT_THAT(waits, ElementsAre(100ms, 500ms, 1s, 2s, 5s, 10s, 10s, 10s));
  EXPECT_EQ(keeper.state().times_lost, 8U);

  keeper.Started(now);
  keeper.Opened(now);
  now += 1min;
  keeper.Counted({}, now);
  keeper.Ended("was ended by signal 6", now);
  EXPECT_EQ(UntilStart(keeper, now), 100ms);
}

TEST(LinkKeeper, AProcessThatCannotStartIsNotCountedAsLost) {
  LinkKeeper keeper(true);
  Instant now = kStart;
  for (int i = 0; i < 3; ++i) {
    UntilStart(keeper, now);
    keeper.Ended("cannot be started: there is no such file", now);
  }
  EXPECT_EQ(keeper.state().phase, Phase::waiting);
  EXPECT_EQ(keeper.state().reason, "cannot be started: there is no such file");
  EXPECT_EQ(keeper.state().next_start, now + 1s);
  EXPECT_EQ(keeper.state().times_lost, 0U);
}

TEST(LinkKeeper, ASilentProcessIsShownAfter2sAndEndedAfter10s) {
  LinkKeeper keeper(true);
  keeper.Look(kStart);
  keeper.Started(kStart);
  keeper.Opened(kStart);
  keeper.Counted(Counts(3, 10, 0, 0, 0), kStart + 1s);
  EXPECT_EQ(keeper.NextLook(), kStart + 3s);
  EXPECT_EQ(keeper.Look(kStart + 3s - 1ns), Wish::nothing);
  EXPECT_EQ(keeper.state().phase, Phase::up);
  EXPECT_EQ(keeper.Look(kStart + 3s), Wish::nothing);
  EXPECT_EQ(keeper.state().phase, Phase::silent);
  EXPECT_EQ(keeper.state().subscribers.points, 3U);
  EXPECT_EQ(keeper.NextLook(), kStart + 11s);
  EXPECT_EQ(keeper.Look(kStart + 11s - 1ns), Wish::nothing);
  EXPECT_EQ(keeper.Look(kStart + 11s), Wish::give_up);
}

TEST(LinkKeeper, ASilentProcessThatReadsAgainIsUpAgain) {
  LinkKeeper keeper(true);
  keeper.Look(kStart);
  keeper.Started(kStart);
  keeper.Opened(kStart);
  keeper.Look(kStart + 5s);
  ASSERT_EQ(keeper.state().phase, Phase::silent);
  keeper.Counted({}, kStart + 6s);
  EXPECT_EQ(keeper.state().phase, Phase::up);
  EXPECT_EQ(keeper.Look(kStart + 7s), Wish::nothing);
}

TEST(LinkKeeper, AProcessThatNeverOpensIsGivenUpAfterAMinute) {
  LinkKeeper keeper(true);
  keeper.Look(kStart);
  keeper.Started(kStart);
  EXPECT_EQ(keeper.Look(kStart + 59s), Wish::nothing);
  EXPECT_EQ(keeper.state().phase, Phase::silent);
  EXPECT_EQ(keeper.NextLook(), kStart + 1min);
  EXPECT_EQ(keeper.Look(kStart + 1min), Wish::give_up);
  EXPECT_EQ(keeper.patience(), 1min);
}

TEST(LinkKeeper, CountsContinueOverProcesses) {
  LinkKeeper keeper(true);
  keeper.Look(kStart);
  keeper.Started(kStart);
  keeper.Opened(kStart);
  keeper.Counted(Counts(2, 90, 0, 40, 3), kStart);
  keeper.Counted(Counts(2, 100, 1, 50, 4), kStart);
  keeper.Ended("was ended by signal 9", kStart);
  EXPECT_EQ(keeper.state().subscribers.points, 0U);
  EXPECT_EQ(keeper.state().datagrams.passed, 50U);
  EXPECT_EQ(keeper.state().datagrams.participants, 0U);
  keeper.Started(kStart + 1s);
  keeper.Opened(kStart + 1s);
  keeper.Counted(Counts(1, 20, 2, 7, 5), kStart + 1s);
  EXPECT_EQ(keeper.state().subscribers.points, 1U);
  EXPECT_EQ(keeper.state().written, 120U);
  EXPECT_EQ(keeper.state().refused, 3U);
  EXPECT_EQ(keeper.state().datagrams.passed, 57U);
  EXPECT_EQ(keeper.state().datagrams.Refused(Refusal::fragment), 9U);
  EXPECT_EQ(keeper.state().datagrams.participants, 7U);
}

TEST(LinkKeeper, AnExternallyStartedProcessIsAwaited) {
  LinkKeeper keeper(false);
  EXPECT_EQ(keeper.Look(kStart), Wish::nothing);
  EXPECT_EQ(keeper.NextLook(), Instant::max());
  keeper.Started(kStart);
  keeper.Opened(kStart);
  keeper.Ended("closed the link", kStart + 1s);
  EXPECT_EQ(keeper.Look(kStart + 1h), Wish::nothing);
  EXPECT_EQ(keeper.state().next_start, std::nullopt);
  EXPECT_EQ(keeper.state().times_lost, 1U);
}

TEST(LinkKeeper, KeepsSubscriberAddressesUntilTheNextProcessReachesThem) {
  LinkKeeper keeper(true);
  const config::HostPort first{"10.0.0.1", 7410};
  const config::HostPort second{"10.0.0.2", 7410};
  const config::HostPort third{"10.0.0.3", 7410};
  const auto counted = [&](std::vector<config::HostPort> reached, Instant now) {
    LinkCounts counts;
    counts.neighbours = {.reached = std::move(reached), .remarks = {"10.0.0.9 was heard"}};
    keeper.Counted(counts, now);
  };
  keeper.Started(kStart);
  keeper.Opened(kStart);
  counted({first, second}, kStart + 1s);
  EXPECT_THAT(keeper.state().remarks, ElementsAre("10.0.0.9 was heard"));
  keeper.Ended("was ended by signal 6", kStart + 2s);
  EXPECT_THAT(keeper.reached(), ElementsAre(first, second));
  EXPECT_TRUE(keeper.state().remarks.empty());

  keeper.Started(kStart + 3s);
  keeper.Opened(kStart + 3s);
  counted({third, second}, kStart + 4s);
  EXPECT_THAT(keeper.reached(), ElementsAre(third, second, first));
  counted({third, second}, kStart + 3s + LinkKeeper::kYoung);
  EXPECT_THAT(keeper.reached(), ElementsAre(third, second)) << "the first one is gone";
}

using ::testing::IsEmpty;
using ::testing::SizeIs;

TEST(BoundedLines, OnlyWholePrintableLinesPass) {
  BoundedLines lines;
  EXPECT_THAT(lines.Add("ab", kStart), IsEmpty());
  EXPECT_THAT(lines.Add("c\n\nd\x1b[2J\nrest", kStart), ElementsAre("abc", "d?[2J"));
}

TEST(BoundedLines, ALongLineIsCut) {
  BoundedLines lines;
  EXPECT_THAT(lines.Add(std::string(100'000, 'x') + "\n", kStart),
              ElementsAre(std::string(BoundedLines::kLongest, 'x')));
}

TEST(BoundedLines, ExcessLinesAreDroppedAndCounted) {
  BoundedLines lines;
  std::string flood;
  for (int i = 0; i < 1000; ++i) flood += "line\n";
  EXPECT_THAT(lines.Add(flood, kStart), SizeIs(BoundedLines::kMost));
  EXPECT_THAT(lines.Add("next\n", kStart + BoundedLines::kPeriod),
              ElementsAre("980 lines were left out", "next"));
}

PointSample Point(double value) {
  PointSample sample;
  sample.gateway = "g", sample.device = "d", sample.point = "p", sample.value = value;
  return sample;
}

class LinkWriterTest : public ::testing::Test {
 protected:
  double Next() {
    const ReceivedPacket received = ReceivePacket(ends_.second.get(), buffer_);
    PointSample sample;
    if (received.got != PacketGot::packet) return std::nan("");
    const auto message = ParseLink(received.packet);
    return message.ok() && Decode(message->body, sample) ? sample.value : std::nan("");
  }

  std::pair<Descriptor, Descriptor> ends_ = std::move(*MakePacketPair());
  PacketBuffer buffer_{};
  LinkWriter writer_;
};

TEST_F(LinkWriterTest, ThereIsNoSessionUntilASocketIsAttached) {
  int told = 0;
  writer_.OnSession([&] { ++told; });
  EXPECT_EQ(writer_.session(), 0U);
  EXPECT_EQ(writer_.Write(Point(1)), Sent::later);
  writer_.Attach(ends_.first.get());
  EXPECT_EQ(writer_.session(), 1U);
  EXPECT_EQ(writer_.Write(Point(2)), Sent::yes);
  EXPECT_EQ(Next(), 2.0);
  writer_.Detach();
  EXPECT_EQ(writer_.session(), 0U);
  EXPECT_EQ(writer_.Write(Point(3)), Sent::later);
  writer_.Attach(ends_.first.get());
  EXPECT_EQ(writer_.session(), 2U);
  EXPECT_EQ(told, 3);
}

TEST_F(LinkWriterTest, AFullSocketPostponesSamplesAndLosesNone) {
  writer_.Attach(ends_.first.get());
  int sent = 0;
  while (sent < 100'000 && writer_.Write(Point(sent)) == Sent::yes) ++sent;
  ASSERT_GT(sent, 50);
  ASSERT_LT(sent, 5000);
  EXPECT_EQ(writer_.Write(Point(0)), Sent::later);
  for (int i = 0; i < sent; ++i) EXPECT_EQ(Next(), i);
  EXPECT_EQ(writer_.Write(Point(7)), Sent::yes);
  EXPECT_EQ(Next(), 7.0);
}

TEST_F(LinkWriterTest, ASampleBeyondItsBoundsIsRefused) {
  writer_.Attach(ends_.first.get());
  PointSample sample = Point(1);
  sample.text = std::string(kMaxText + 1, 't');
  EXPECT_EQ(writer_.Write(sample), Sent::refused);
}

TEST_F(LinkWriterTest, AGatewaySampleIsAMessageOfItsOwnKind) {
  writer_.Attach(ends_.first.get());
  const GatewaySample sample{"g", 7, "1.2.3"};
  ASSERT_EQ(writer_.Write(sample), Sent::yes);
  const ReceivedPacket received = ReceivePacket(ends_.second.get(), buffer_);
  ASSERT_EQ(received.got, PacketGot::packet);
  const auto message = ParseLink(received.packet);
  ASSERT_TRUE(message.ok()) << message.error();
  EXPECT_EQ(message->kind, LinkKind::gateway);
  GatewaySample back;
  ASSERT_TRUE(Decode(message->body, back));
  EXPECT_EQ(back, sample);
}

TEST_F(LinkWriterTest, AClosedSocketPostponesASample) {
  writer_.Attach(ends_.first.get());
  ends_.second.Close();
  EXPECT_EQ(writer_.Write(Point(1)), Sent::later);
}

TEST_F(LinkWriterTest, TheEndIsAnnouncedToTheProcess) {
  writer_.Attach(ends_.first.get());
  EXPECT_FALSE(writer_.WaitAcknowledged(Duration::zero()));
  EXPECT_TRUE(writer_.ending());
  const ReceivedPacket received = ReceivePacket(ends_.second.get(), buffer_);
  ASSERT_EQ(received.got, PacketGot::packet);
  EXPECT_EQ(ParseLink(received.packet)->kind, LinkKind::end);
}

TEST_F(LinkWriterTest, NothingIsSentUntilTheProcessHasReplacedItsWriters) {
  EXPECT_EQ(writer_.Reopen({.points = 7}), Sent::later);
  EXPECT_EQ(writer_.open().room.points, 7U) << "the next process is asked for it";
  writer_.Attach(ends_.first.get());
  EXPECT_EQ(writer_.Reopen({.points = 8}), Sent::yes);
  const ReceivedPacket received = ReceivePacket(ends_.second.get(), buffer_);
  ASSERT_EQ(received.got, PacketGot::packet);
  EXPECT_EQ(DecodeOpen(ParseLink(received.packet)->body)->room.points, 8U);
  EXPECT_EQ(writer_.Write(Point(1)), Sent::later);
  EXPECT_EQ(writer_.Reopen({.points = 9}), Sent::later);
  writer_.Attach(ends_.first.get());
  EXPECT_EQ(writer_.session(), 2U);
  EXPECT_EQ(writer_.Write(Point(2)), Sent::yes);
}

TEST(PacketSocket, ATooLongPacketIsRefused) {
  auto ends = std::move(*MakePacketPair());
  const Bytes large(kMaxLinkMessage * 2, 1);
  ASSERT_EQ(SendPacket(ends.first.get(), large), PacketSent::yes);
  PacketBuffer buffer;
  const ReceivedPacket received = ReceivePacket(ends.second.get(), buffer);
  ASSERT_EQ(received.got, PacketGot::packet);
  EXPECT_FALSE(ParseLink(received.packet).ok());
}

}  // namespace
}  // namespace baudgate::dds
