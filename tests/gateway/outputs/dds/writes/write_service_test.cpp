// Tests of `WriteService`: the command, the reply and the record of a request from DDS.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/writes/write_service.h"

#include <gmock/gmock.h>

#include <condition_variable>
#include <limits>
#include <mutex>

#include "tests/gateway/outputs/dds/writes/service_fixture.h"

namespace baudgate::dds {
namespace {

using testing::Ask;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::ServiceConfig;
using ::testing::SizeIs;

constexpr char kClient[] = "dds:01.0f.02.03.04.05.06.07.08.09.0a.0b|0.0.1.2";

class WriteServiceTest : public ::testing::Test {
 protected:
  ReplySample Take(WriteArrival arrival) {
    if (arrival.received == Instant()) arrival.received = now_.instant;
    service_.Take(arrival, now_);
    return Reply();
  }
  ReplySample Reply() {
    if (replies_.empty()) return {};
    const ReplySample reply = replies_.front();
    replies_.erase(replies_.begin());
    return reply;
  }
  void Finish(const WriteResult& result) {
    sink_.commands.front().done(result);
    sink_.commands.erase(sink_.commands.begin());
    ASSERT_THAT(ended_, SizeIs(1));
    service_.End(ended_[0].first, ended_[0].second, now_.instant);
    ended_.clear();
  }

  const config::Config config_ = ServiceConfig();
  bus::PointStore store_{config_};
  KeepingSink sink_;
  std::vector<ReplySample> replies_;
  std::vector<std::pair<WriteService::Ticket, WriteResult>> ended_;
  Now now_{Instant(1h), testing::kAsked};
  std::optional<bus::PastRequests> past_ = bus::PastRequests();
  WriteService service_{config_,
                        store_,
                        sink_,
                        [this] { return past_; },
                        [this](ReplySample reply) { replies_.push_back(std::move(reply)); },
                        [this](WriteService::Ticket ticket, const WriteResult& result) {
                          ended_.emplace_back(std::move(ticket), result);
                        }};
};

TEST_F(WriteServiceTest, ARequestGoesToItsLineAndItsOutcomeIsTheReply) {
  EXPECT_EQ(Take(Ask(7, "setting", 2.5)), ReplySample()) << "not before the device has confirmed";
  ASSERT_THAT(sink_.commands, SizeIs(1));
  const bus::WriteCommand& command = sink_.commands[0];
  EXPECT_EQ(command.client, kClient);
  EXPECT_EQ(command.deadline, now_.instant + 5s);
  ASSERT_THAT(command.writes(), SizeIs(1));
  EXPECT_EQ(command.writes()[0].point, 0U);
  EXPECT_EQ(command.writes()[0].raw, Value(2.5));
  now_.instant += 42ms;
  Finish({WriteEnd::ok});
  EXPECT_EQ(Reply(), (ReplySample{"substation-7", "plc-1", 7, "ok", "", 42'000}));
  EXPECT_EQ(service_.taken(), 1U);
  EXPECT_THAT(sink_.denied, IsEmpty());
}

TEST_F(WriteServiceTest, EveryOutcomeHasItsName) {
  const WriteEnd ends[] = {WriteEnd::ok,      WriteEnd::differs,  WriteEnd::refused, WriteEnd::busy,
                           WriteEnd::unknown, WriteEnd::not_sent, WriteEnd::denied};
  std::uint64_t seq = 0;
  for (const WriteEnd end : ends) {
    Take(Ask(++seq, "setting", 1));
    Finish({end, "a sentence"});
    const ReplySample reply = Reply();
    EXPECT_EQ(reply.outcome, Name(end));
    EXPECT_LE(reply.outcome.size(), kMaxOutcome);
    EXPECT_EQ(reply.reason, "a sentence");
  }
}

TEST_F(WriteServiceTest, ADuplicateIsSentOnce) {
  Take(Ask(7, "setting", 1));
  EXPECT_EQ(Take(Ask(7, "setting", 1)), ReplySample());
  Finish({WriteEnd::differs, "shows 0"});
  const ReplySample first = Reply();
  now_.instant += 3s;
  EXPECT_EQ(Take(Ask(7, "setting", 1)), first);
  EXPECT_THAT(sink_.commands, IsEmpty());
  const ReplySample other = Take(Ask(7, "setting", 2));
  EXPECT_EQ(other.outcome, "denied");
  EXPECT_THAT(sink_.commands, IsEmpty());
  ASSERT_THAT(sink_.denied, SizeIs(1)) << "recorded, too";
  EXPECT_EQ(sink_.denied[0].value, Value(2.0));
}

TEST_F(WriteServiceTest, ARequestOfAnEarlierRunIsAnsweredAndNotSent) {
  past_->all.push_back({IdOf(Ask(7, "setting", 2.5).request), WriteEnd::ok, "", 42ms});
  past_->all.push_back({IdOf(Ask(6, "setting", 2.5).request), WriteEnd::unknown, "it was stopped"});
  EXPECT_EQ(Take(Ask(7, "setting", 2.5)),
            (ReplySample{"substation-7", "plc-1", 7, "ok", "", 42'000}));
  EXPECT_EQ(Take(Ask(6, "setting", 2.5)).outcome, "unknown");
  EXPECT_EQ(Take(Ask(7, "setting", 3)).outcome, "denied") << "this number was for another one";
  EXPECT_THAT(sink_.commands, IsEmpty());
  Take(Ask(8, "setting", 2.5));
  ASSERT_THAT(sink_.commands, SizeIs(1));
  EXPECT_EQ(sink_.commands[0].request, IdOf(Ask(8, "setting", 2.5).request));
}

TEST_F(WriteServiceTest, NothingIsSentBeforeEarlierRequestsAreLoaded) {
  past_.reset();
  EXPECT_EQ(Take(Ask(7, "setting", 2.5)).outcome, "busy");
  past_ = bus::PastRequests{{{IdOf(Ask(7, "setting", 2.5).request), WriteEnd::ok, ""}}, true};
  EXPECT_EQ(Take(Ask(7, "setting", 2.5)).outcome, "ok");
  EXPECT_THAT(sink_.commands, IsEmpty());
}

/// The DDS library of a client can send a stored request to the next run of the gateway.
TEST_F(WriteServiceTest, AnExpiredRequestIsDeniedAndRecorded) {
  WriteArrival early = Ask(1, "setting", 1);
  early.early = true;
  EXPECT_THAT(Take(early).reason, HasSubstr("too old: by its time stamp it was published"));
  WriteArrival slow = Ask(2, "setting", 1);
  slow.published -= 5001ms;
  EXPECT_THAT(Take(slow).reason, HasSubstr("its deadline has passed"));
  WriteArrival patient = Ask(3, "setting", 1);
  patient.request.deadline_ms = 1000;
  patient.published -= 1001ms;
  EXPECT_EQ(Take(patient).outcome, "denied");
  WriteArrival ahead = Ask(6, "setting", 1);
  ahead.published += 5001ms;
  EXPECT_THAT(Take(ahead).reason, HasSubstr("ahead of this machine's clock"));
  WriteArrival timeless = Ask(4, "setting", 1);
  timeless.published = {};
  EXPECT_THAT(Take(timeless).reason, HasSubstr("no time stamp"));
  EXPECT_THAT(sink_.commands, IsEmpty());
  EXPECT_THAT(sink_.denied, SizeIs(5));
  EXPECT_EQ(Take(early).outcome, "denied") << "repeated, it stays so";
  WriteArrival in_time = Ask(5, "setting", 1);
  in_time.published -= 4999ms;
  Take(in_time);
  EXPECT_THAT(sink_.commands, SizeIs(1));
}

TEST_F(WriteServiceTest, AForbiddenWriteIsDeniedAndRecorded) {
  EXPECT_THAT(
      Take(Ask(1, "off", 1)).reason,
      HasSubstr("may not be written: add it to 'write' of the device in the configuration"));
  EXPECT_THAT(Take(Ask(2, "setting", 41)).reason, HasSubstr("41 is above"));
  const ReplySample trip = Take(Ask(3, "trip", 1));
  EXPECT_EQ(trip.outcome, "denied");
  EXPECT_THAT(trip.reason, HasSubstr("selected before it is written; over DDS set 'confirm'"));
  EXPECT_THAT(Take(Ask(4, "setting", std::numeric_limits<double>::quiet_NaN())).reason,
              HasSubstr("not a number"));
  EXPECT_THAT(sink_.commands, IsEmpty());
  ASSERT_THAT(sink_.denied, SizeIs(4));
  for (const bus::DeniedWrite& denied : sink_.denied) {
    EXPECT_EQ(denied.client, kClient);
    EXPECT_FALSE(denied.reason.empty());
  }
  EXPECT_EQ(sink_.denied[3].value, Value(std::string("nan")));
}

TEST_F(WriteServiceTest, ANonVolatileRequestIsDeniedAndMayBeRepeated) {
  WriteArrival old = Ask(7, "setting", 1);
  old.lasting = true;
  EXPECT_THAT(Take(old).reason, HasSubstr("is not volatile"));
  EXPECT_THAT(sink_.commands, IsEmpty());
  EXPECT_THAT(sink_.denied, SizeIs(1));
  EXPECT_EQ(Take(Ask(7, "setting", 1)), ReplySample());
  EXPECT_THAT(sink_.commands, SizeIs(1));
  EXPECT_EQ(Take(old).outcome, "denied") << "not told of what another has asked";
}

TEST_F(WriteServiceTest, ConfirmReplacesTheSelection) {
  WriteArrival trip = Ask(1, "trip", 1);
  trip.request.confirm = true;
  EXPECT_EQ(Take(trip), ReplySample());
  EXPECT_THAT(sink_.commands, SizeIs(1));
}

TEST_F(WriteServiceTest, AnUnknownTargetIsNamedAndNotRecorded) {
  WriteArrival arrival = Ask(1, "seting", 1);
  EXPECT_THAT(Take(arrival).reason, HasSubstr("'seting' is no point of feeder-1"));
  arrival = Ask(2, "setting", 1);
  arrival.request.device = "feeder\n2";
  EXPECT_THAT(Take(arrival).reason, HasSubstr("'feeder?2' is no device of this gateway"));
  arrival = Ask(3, "setting", 1);
  arrival.request.client.clear();
  EXPECT_THAT(Take(arrival).reason, HasSubstr("'client' is empty"));
  EXPECT_THAT(sink_.denied, IsEmpty());
  arrival = Ask(4, "setting", 1);
  arrival.request.gateway = "substation-8";
  EXPECT_EQ(Take(arrival), ReplySample()) << "it is another gateway's";
  EXPECT_EQ(service_.taken(), 3U);
  EXPECT_THAT(sink_.commands, IsEmpty());
}

TEST_F(WriteServiceTest, AFullLineAnswersBusyAndDoesNotWriteLater) {
  sink_.full = true;
  const ReplySample busy = Take(Ask(1, "setting", 1));
  EXPECT_EQ(busy.outcome, "busy");
  sink_.full = false;
  EXPECT_EQ(Take(Ask(1, "setting", 1)), busy);
  EXPECT_THAT(sink_.commands, IsEmpty());
  EXPECT_EQ(Take(Ask(2, "setting", 1)), ReplySample());
  EXPECT_THAT(sink_.commands, SizeIs(1));
}

struct Deadline {
  std::uint32_t deadline_ms;
  Duration waited;
  std::optional<Duration> not_after;
  Duration left;
};

TEST_F(WriteServiceTest, TheEarliestDeadlineOfARequestApplies) {
  const Deadline cases[] = {
      {0, 0s, {}, 5s},      {2500, 0s, {}, 2500ms},        {2500, 2s, {}, 500ms},
      {1, 3s, {}, -2999ms}, {4'294'967'295U, 0s, {}, 60s}, {0, 0s, 1s, 1s},
      {0, 0s, 1h, 5s},      {0, 0s, Duration::max(), 5s},  {0, 0s, -1ns, 0s},
      {100, 0s, 1s, 100ms}, {0, 59min, {}, 5s - 59min},
  };
  std::uint64_t seq = 0;
  for (const Deadline& one : cases) {
    WriteArrival arrival = Ask(++seq, "setting", 1);
    arrival.request.deadline_ms = one.deadline_ms;
    arrival.received = now_.instant - one.waited;
    if (one.not_after) {
      arrival.request.not_after_ns = *one.not_after == Duration::max()
                                         ? std::numeric_limits<std::int64_t>::max()
                                         : (now_.wall + *one.not_after).time_since_epoch().count();
    }
    Take(arrival);
    ASSERT_THAT(sink_.commands, SizeIs(1)) << seq;
    EXPECT_EQ(sink_.commands[0].deadline - now_.instant, one.left) << seq;
    Finish({WriteEnd::not_sent, "late"});
    EXPECT_EQ(Reply().outcome, "not_sent");
  }
  WriteArrival arrival = Ask(++seq, "setting", 1);
  for (const std::int64_t odd :
       {std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max()}) {
    arrival.request.not_after_ns = odd;
    arrival.request.seq = ++seq;
    Take(arrival);
    EXPECT_LE(sink_.commands.back().deadline, now_.instant + 5s);
  }
}

class PlayedWriter : public SampleWriter {
 public:
  Sent Write(const PointSample&) override { return Sent::yes; }
  Sent Write(const DeviceSample&) override { return Sent::yes; }
  Sent Write(const GatewaySample&) override { return Sent::yes; }
  Sent Write(const ReplySample& reply) override {
    const std::lock_guard lock(mutex_);
    if (later_-- > 0) return Sent::later;
    replies_.push_back(reply);
    changed_.notify_all();
    return Sent::yes;
  }
  bool WaitAcknowledged(Duration) override { return true; }
  Subscribers subscribers() const override { return {}; }
  void OnRequest(TakeRequest take) override {
    const std::lock_guard lock(mutex_);
    take_ = std::move(take);
  }

  bool Request(WriteArrival arrival) {
    const std::lock_guard lock(mutex_);
    if (!take_) return false;
    arrival.received = ReadClocks().instant;
    take_(std::move(arrival));
    return true;
  }
  void FindNoRoom(int times) {
    const std::lock_guard lock(mutex_);
    later_ = times;
  }
  std::vector<ReplySample> WaitFor(std::size_t count) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return replies_.size() >= count; });
    return replies_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  TakeRequest take_;
  int later_ = 0;
  std::vector<ReplySample> replies_;
};

class ConfirmingSink final : public bus::CommandSink {
 public:
  bool Submit(bus::WriteCommand command) override {
    ++done;
    command.done({WriteEnd::ok});
    return true;
  }
  std::atomic<int> done = 0;
};

WriteArrival AskNow(std::uint64_t seq, const std::string& point, double value) {
  WriteArrival arrival = testing::Ask(seq, point, value);
  arrival.published = ReadClocks().wall;
  return arrival;
}

class DdsWritesTest : public ::testing::Test {
 protected:
  const config::Config config_ = ServiceConfig();
  bus::PointStore store_{config_};
  ConfirmingSink sink_;
  std::shared_ptr<PlayedWriter> writer_ = std::make_shared<PlayedWriter>();
  DdsWrites writes_{config_, store_, sink_, {}, writer_};
};

TEST_F(DdsWritesTest, RepliesKeepTheirOrderWhenTheWriterWasFull) {
  writer_->FindNoRoom(3);
  for (std::uint64_t seq = 1; seq <= 5; ++seq) {
    ASSERT_TRUE(writer_->Request(AskNow(seq, "setting", 1)));
  }
  const auto replies = writer_->WaitFor(5);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(replies[i].seq, i + 1);
    EXPECT_EQ(replies[i].outcome, "ok");
  }
  EXPECT_EQ(sink_.done, 5);
  EXPECT_EQ(writes_.taken(), 5U);
  EXPECT_EQ(writes_.dropped(), 0U);
}

TEST_F(DdsWritesTest, NoRequestIsAcceptedAfterStopTaking) {
  ASSERT_TRUE(writer_->Request(AskNow(1, "setting", 1)));
  writer_->WaitFor(1);
  writes_.StopTaking();
  EXPECT_FALSE(writer_->Request(AskNow(2, "setting", 1)));
  writes_.Stop();
  EXPECT_EQ(sink_.done, 1);
}

TEST_F(DdsWritesTest, ExcessRequestsAreOnlyCounted) {
  for (std::uint64_t seq = 1; seq <= 10'000; ++seq) writer_->Request(AskNow(seq, "setting", 1));
  writer_->WaitFor(1);
  writes_.StopTaking();
  writes_.Stop();
  EXPECT_GT(writes_.dropped(), 0U);
  EXPECT_LE(writes_.taken() + writes_.dropped(), 10'000U);
  EXPECT_LE(static_cast<std::uint64_t>(sink_.done), writes_.taken());
}

using config::Type;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinite = std::numeric_limits<double>::infinity();

struct Case {
  Type type;
  double value;
  std::string text;
  std::optional<Value> meant;
};

TEST(RequestValue, TextIsUsedUnlessItIsEmpty) {
  const std::string hostile("1\0", 2);
  const Case cases[] = {
      {Type::uint16, 1, "", Value(std::int64_t{1})},
      {Type::uint16, -0.0, "", Value(std::int64_t{0})},
      {Type::uint16, 1, "2", Value(std::int64_t{2})},
      {Type::uint16, kNaN, "2", Value(std::int64_t{2})},
      {Type::uint16, kNaN, "", {}},
      {Type::uint16, kInfinite, "", {}},
      {Type::uint16, 1, "two", {}},
      {Type::uint16, 1, " 2", {}},
      {Type::int32, -7, "", Value(std::int64_t{-7})},
      {Type::uint64, 9007199254740992.0, "", Value(std::int64_t{9007199254740992})},
      {Type::uint64, 1e15, "", Value(std::int64_t{1000000000000000})},
      {Type::uint64, 9007199254740994.0, "", {}},
      {Type::uint64, 1e300, "", {}},
      {Type::uint64, kNaN, "18446744073709551615", Value(std::uint64_t{18446744073709551615ULL})},
      {Type::boolean, 1, "", Value(true)},
      {Type::boolean, 0, "", Value(false)},
      {Type::boolean, 2, "", {}},
      {Type::boolean, 0.5, "", {}},
      {Type::boolean, 0, "on", Value(true)},
      {Type::boolean, kNaN, "off", Value(false)},
      {Type::float32, 0.1, "", Value(0.1)},
      {Type::float32, 1e20, "", Value(1e20)},
      {Type::float64, 1e-9, "", Value(1e-9)},
      {Type::float64, kNaN, "", {}},
      {Type::float64, -kInfinite, "", {}},
      {Type::float64, 1, "nan", {}},
      {Type::float64, 1, "inf", {}},
      {Type::float64, 1, hostile, {}},
      {Type::string, 1, "on", Value(std::string("on"))},
      {Type::string, 1, "", Value(std::string())},
      {Type::string, 1, "longer than it is", {}},
  };
  for (const Case& one : cases) {
    config::Point point;
    point.name = "p";
    point.type = one.type;
    point.text_length = 8;
    RequestSample request;
    request.value = one.value;
    request.text = one.text;
    const auto value = ValueOf(point, request);
    const std::string which =
        std::string(Name(one.type)) + " " + std::to_string(one.value) + " '" + one.text + "'";
    ASSERT_EQ(value.ok(), one.meant.has_value()) << which;
    if (value.ok()) {
      EXPECT_EQ(*value, *one.meant) << which;
    } else {
      EXPECT_FALSE(value.error().empty());
    }
  }
}

}  // namespace
}  // namespace baudgate::dds
