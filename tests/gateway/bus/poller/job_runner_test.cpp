// Tests of `JobRunner`: the rows of the table in gateway/bus/jobs/job.cpp.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/poller/job_runner.h"

#include <gmock/gmock.h>

#include "gateway/base/text.h"
#include "gateway/bus/jobs/poll.h"
#include "gateway/bus/jobs/probe.h"
#include "gateway/bus/jobs/read_back.h"
#include "gateway/bus/jobs/write.h"
#include "tests/support/times.h"
#include "tests/support/virtual_line.h"

namespace baudgate::bus {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

/// Runs jobs on a line with device A (points `read` and "2") and B ("1"). The constructor has read
/// A's name; `probed` is its reply.
class Rig : private PollerListener, private RequestPort {
 public:
  explicit Rig(const std::string& read, const std::string& probed = "!A0")
      : config_(ConfigOf(read)) {
    Pass({});
    runner_.OnOpened(false);
    context_.tracker.OnOpened(now_.instant);
    while (context_.agenda.schedule.Next(now_.instant)) continue;
    Poll(1);
    for (Turn(); runner_.job() != nullptr; Turn()) Hear(Next() == "PA0" ? probed : "!A2=5");
  }

  void Poll(std::size_t query) {
    Begin(std::make_unique<PollJob>(a(), Schedule::Pick{.query = query}, now_.instant));
  }
  void Probe() { Begin(std::make_unique<ProbeJob>(a(), now_.instant)); }
  void ReadBack() { Begin(std::make_unique<ReadBackJob>(a(), 0, now_.instant)); }
  void Write(std::vector<std::uint32_t> points) {
    WriteCommand command;
    auto& writes = command.kind.emplace<Writes>();
    for (const std::uint32_t point : points) writes.push_back({point, 7.0});
    command.MoveTo(WriteState::queued);
    command.deadline = now_.instant + 1h;
    command.done = [this](const WriteResult& result) { results.push_back(result); };
    command.abandoned = left_;
    command.why_not = [this](Instant) {
      return why_not ? std::optional(Withheld{WriteEnd::denied, *why_not}) : std::nullopt;
    };
    Begin(std::make_unique<WriteJob>(a(), std::move(command), now_.instant));
  }

  /// Applies one input: a reply such as "!A1=5", or "silence", "damage", "sent" (a broadcast has
  /// been sent), "late" (an hour passes), "a while" (the proof of identity becomes too old),
  /// "disabled", "left" (the client disconnects), "forbidden" (by an interlock), "lost" (the port).
  void Hear(const std::string& what) {
    if (what == "late") return Pass(1h);
    if (what == "a while") return Pass(2min);
    if (what == "disabled") {
      a().in_use = false;
    } else if (what == "left") {
      *left_ = true;
    } else if (what == "forbidden") {
      why_not = "an interlock";
    } else if (what == "sent" || what == "silence") {
      if (Go()) EndInSilence();
    } else if (what == "damage") {
      if (Go()) Receive(ToBytes("!A1=5*00\r"));
    } else if (what == "lost") {
      if (Go()) runner_.OnClosed("the port is lost");
    } else if (Go()) {
      Answer(what.substr(1));
    }
  }
  void Answer(const std::string& reply) { Receive(ToyReply(reply)); }
  bool Go() {
    Turn();
    if (runner_.job() == nullptr) return false;
    sent_ = false;
    runner_.Start(now_.instant);
    WaitUntilSent();
    return true;
  }
  void StartOnALineThatIsNotQuiet() {
    Turn();
    runner_.Receive(ToBytes("?"));
    sent_ = false;
    runner_.Start(now_.instant);
  }
  void WaitUntilSent() {
    while (!sent_) PassTimer();
  }
  void Turn() {
    Pass(10ms);
    while (runner_.job() != nullptr && runner_.TakeTurn() == JobRunner::Turn::next) continue;
  }

  std::string Next() {
    if (runner_.job() == nullptr) return context_.agenda.parked.NextAt() ? "parked" : "ended";
    const std::string request(AsText(runner_.job()->step.request.bytes));
    return request.substr(0, request.size() - 1);
  }
  bool IsReadingBack() { return runner_.job() != nullptr && runner_.job()->ReadsBack(a()); }
  std::string Value(std::size_t point) const {
    std::string value;
    store_.Read(0, [&](const DeviceRecord& record) { value = ToText(record.points[point].value); });
    return value;
  }
  DeviceStatus Status() const {
    DeviceStatus status;
    store_.Read(0, [&](const DeviceRecord& record) { status = record.status; });
    return status;
  }
  void Pass(Duration time) {
    now_ = {now_.instant + time, now_.wall + time};
    runner_.OnTime(now_);
  }

  /// Continues the parked job, if there is one.
  void Resume() {
    Pass(1s);
    if (auto job = context_.agenda.parked.Take(now_.instant)) runner_.Begin(std::move(job));
  }
  /// Polls a point of A when no late reply can come. A answers probes, but all other requests get
  /// `reply` (see Hear).
  void PollInVain(std::size_t query, const std::string& reply) {
    Pass(1s);
    Poll(query);
    for (Turn(); runner_.job() != nullptr; Turn()) Hear(Next() == "PA0" ? "!A0" : reply);
  }

  Device& a() { return context_.roster.device(0); }
  ParkedJobs& parked() { return context_.agenda.parked; }
  LineContext& context() { return context_; }
  DeviceTracker& tracker() { return context_.tracker; }
  Schedule& schedule() { return context_.agenda.schedule; }
  JobRunner& runner() { return runner_; }
  LateReplies& late() { return context_.owed.late_replies; }
  WriteQueue& writes() { return context_.agenda.write_queue; }
  Instant now() const { return now_.instant; }

  std::vector<WriteResult> results;
  std::optional<std::string> why_not;

 private:
  static config::Config ConfigOf(const std::string& read) {
    config::Config config;
    config.lines.push_back(ToyLine({ToyDevice("a", "A", {read, "2"}), ToyDevice("b", "B", {"1"})}));
    return config;
  }
  void OnDeviceState(std::uint32_t, DeviceState, DeviceState, const std::string&, Now) override {}
  void OnWarning(std::uint32_t, const std::string&) override {}
  void Send(View, const config::SerialSettings&, Now) override { sent_ = true; }

  void Begin(std::unique_ptr<Job> job) {
    Pass(10ms);
    runner_.Begin(std::move(job));
  }
  void Receive(const Bytes& bytes) {
    Pass(10ms);
    runner_.Receive(bytes);
    EndInSilence();
  }
  void EndInSilence() {
    while (!runner_.idle()) {
      PassTimer();
    }
  }
  void PassTimer() {
    Pass(*runner_.Deadline() - now_.instant);
    runner_.OnTimer();
  }

  config::Config config_;
  std::shared_ptr<std::atomic<bool>> left_ = std::make_shared<std::atomic<bool>>(false);
  Now now_{kStart, kWall};
  bool sent_ = false;
  PointStore store_{config_};
  LineContext context_{
      config_.lines[0], 0,
      [](const std::string&) -> const protocols::Protocol& { return ToyProtocol(); }, store_,
      *this};
  UnaskedSide unasked_{context_.roster, *context_.observer, context_.accounts, context_.tracker,
                       context_.intake};
  JobRunner runner_{config::Echo::off, context_, unasked_, *this};
};

struct Row {
  const char* what;
  const char* read;
  std::vector<std::string> heard;
  const char* next;
};

TEST(JobRunnerTest, EachEventDeterminesTheNextStepOfAPoll) {
  const Row kRows[] = {
      {"it asks", "1", {}, "?A1"},
      {"the conversation will not ask", "E1", {}, "ended"},
      {"a good reply, nothing remains", "1", {"!A1=5"}, "ended"},
      {"a good reply, a step remains", "S1", {}, "OA9"},
      {"and the next request", "S1", {"!A9"}, "?A1"},
      {"behind a broadcast", "N1", {"sent"}, "?A1"},
      {"busy", "1", {"!A1~busy"}, "parked"},
      {"silence", "1", {"silence"}, "?A1"},
      {"damage", "1", {"damage"}, "?A1"},
      {"another's reply", "1", {"!A2=5"}, "?A1"},
      {"no retry left", "1", {"silence", "silence", "silence"}, "ended"},
      {"what is read once has another request", "L1", {"silence"}, "BA1"},
      {"what is read once and has none", "D1", {"silence"}, "ended"},
      {"what the device does not know", "1", {"!A1~unsupported"}, "ended"},
      {"its device was disabled", "1", {"disabled", "silence"}, "ended"},
      {"the port is lost", "1", {"lost"}, "ended"},
  };
  for (const Row& row : kRows) {
    SCOPED_TRACE(row.what);
    Rig rig(row.read);
    rig.Poll(0);
    for (const std::string& what : row.heard) rig.Hear(what);
    EXPECT_EQ(rig.Next(), row.next);
  }
}

TEST(JobRunnerTest, EachEventDeterminesTheNextStepOfAWrite) {
  struct WriteRow : Row {
    std::optional<WriteEnd> end{};
  };
  const WriteRow kRows[] = {
      {{"it is asked for", "1", {}, "WA1=7"}},
      {{"refused", "1", {"!A1~refused"}, "ended"}, WriteEnd::refused},
      {{"busy: a write is never parked", "1", {"!A1~busy"}, "ended"}, WriteEnd::busy},
      {{"silence: it may have written", "1", {"silence"}, "ended"}, WriteEnd::unknown},
      {{"it was not sent in time", "1", {"late", "silence"}, "ended"}, WriteEnd::not_sent},
      {{"its device was disabled", "1", {"disabled", "silence"}, "ended"}, WriteEnd::not_sent},
      {{"the port is lost", "1", {"lost"}, "ended"}, WriteEnd::unknown},
      {{"a session first", "S1", {}, "OA9"}},
      {{"which is silent", "S1", {"silence", "silence", "silence"}, "CA0"}},
      {{"then the write", "S1", {"!A9"}, "WA1=7"}},
      {{"then it is closed", "S1", {"!A9", "!A1"}, "CA0"}},
      {{"also behind a failure", "S1", {"!A9", "silence"}, "CA0"}},
      {{"too late for the write, not for closing", "S1", {"!A9", "late", "!A0"}, "ended"},
       WriteEnd::not_sent},
      {{"forbidden before anything was asked", "1", {"forbidden", "silence"}, "ended"},
       WriteEnd::denied},
      {{"while a probe went first", "1", {"a while", "!A0", "forbidden", "silence"}, "ended"},
       WriteEnd::denied},
      {{"forbidden before its session is opened", "S1", {"forbidden", "silence"}, "ended"},
       WriteEnd::denied},
      {{"forbidden before, after a probe",
        "S1",
        {"a while", "!A0", "forbidden", "silence"},
        "ended"},
       WriteEnd::denied},
      {{"behind a session, which is closed", "S1", {"!A9", "forbidden", "!A0"}, "ended"},
       WriteEnd::denied},
      {{"its client has left meanwhile", "S1", {"!A9", "left", "!A0"}, "ended"},
       WriteEnd::not_sent},
      {{"that does not close",
        "S1",
        {"!A9", "forbidden", "silence", "silence", "silence"},
        "ended"},
       WriteEnd::denied},
      {{"forbidden too late", "S1", {"!A9", "!A1", "forbidden"}, "CA0"}},
      {{"a closing that is silent takes nothing back",
        "S1",
        {"!A9", "!A1", "silence", "silence", "silence"},
        "ended"}},
      {{"nor does a port that is lost meanwhile", "S1", {"!A9", "!A1", "lost"}, "ended"},
       WriteEnd::ok},
  };
  for (const WriteRow& row : kRows) {
    SCOPED_TRACE(row.what);
    Rig rig(row.read);
    rig.Write({0});
    for (const std::string& what : row.heard) rig.Hear(what);
    EXPECT_EQ(rig.Next(), row.next);
    EXPECT_EQ(row.end, rig.results.empty() ? std::nullopt : std::optional(rig.results[0].end));
    if (row.end == WriteEnd::denied) {
      EXPECT_THAT(rig.results[0].reason, StartsWith("an interlock"));
    }
  }
}

TEST(JobRunnerTest, ASilentClosingDoesNotHideWhyAWriteWasRefused) {
  const std::vector<std::string> kRefusals[] = {{"!A9", "!A1~refused"}, {"!A9~refused"}};
  for (const std::vector<std::string>& heard : kRefusals) {
    Rig rig("S1");
    rig.Write({0});
    for (const std::string& what : heard) rig.Hear(what);
    EXPECT_EQ(rig.Next(), "CA0");
    for (int tries = 0; tries < 3; ++tries) rig.Hear("silence");
    ASSERT_EQ(rig.results.size(), 1U);
    EXPECT_EQ(rig.results[0].end, WriteEnd::refused);
    EXPECT_THAT(rig.results[0].reason, StartsWith("the device says refused"));
    EXPECT_THAT(rig.results[0].reason, HasSubstr("access to the device may still be open"));
  }
}

TEST(JobRunnerTest, AForbiddenWriteIsWithdrawnWhileTheLineIsNotQuiet) {
  Rig rig("1");
  rig.Write({0});
  rig.StartOnALineThatIsNotQuiet();
  rig.runner().Withdraw();
  EXPECT_EQ(rig.Next(), "WA1=7");
  rig.why_not = "an interlock";
  rig.runner().Withdraw();
  EXPECT_EQ(rig.Next(), "ended");
  EXPECT_TRUE(rig.runner().idle());
  ASSERT_EQ(rig.results.size(), 1U);
  EXPECT_EQ(rig.results[0].end, WriteEnd::denied);
  EXPECT_TRUE(rig.writes().read_backs().empty()) << "nothing was written";
}

/// The first try of the write may have been carried out, so the end is unknown, not denied.
TEST(JobRunnerTest, AForbiddenWriteIsNotRetried) {
  Rig rig("1");
  rig.Write({0});
  rig.runner().job()->step.request.expect.repeatable = true;
  rig.Hear("silence");
  ASSERT_EQ(rig.Next(), "WA1=7");
  rig.why_not = "an interlock";
  rig.Turn();
  EXPECT_EQ(rig.Next(), "ended");
  ASSERT_EQ(rig.results.size(), 1U);
  EXPECT_EQ(rig.results[0].end, WriteEnd::unknown);
  EXPECT_EQ(rig.results[0].reason, "an interlock");
}

TEST(JobRunnerTest, AReplyIsStoredOnceItIsProvenToMatchItsRequest) {
  Rig rig("1");
  EXPECT_EQ(rig.Value(1), "5");
  rig.Poll(0);
  rig.Hear("!A2=9");
  EXPECT_EQ(rig.Value(0), "") << "of another request";
  rig.Hear("!A1=8");
  EXPECT_EQ(rig.Value(0), "") << "another device may have answered the repetition";
  EXPECT_EQ(rig.Next(), "PA0");
  rig.Hear("!A0");
  EXPECT_EQ(rig.Value(0), "8");
  EXPECT_EQ(rig.Value(1), "5");
}

/// One of the two replies belongs to an earlier request, but which one is unknown. So neither reply
/// counts.
TEST(JobRunnerTest, AReplyThatWaitsForAProbeIsDroppedAfterASecondReply) {
  for (const bool second : {false, true}) {
    Rig rig("1");
    rig.Poll(0);
    rig.Hear("silence");
    rig.Hear("!A1=8");
    ASSERT_EQ(rig.Next(), "PA0");
    if (second) rig.Answer("A1=9");
    rig.Hear("!A0");
    EXPECT_EQ(rig.Next(), "ended") << "else a device that doubles its replies would have the line";
    EXPECT_EQ(rig.Value(0), second ? "" : "8");
  }
}

TEST(JobRunnerTest, AfterAWhileAProbeGoesFirstAndItsSilenceEndsTheJob) {
  struct ProbeRow {
    const char* what;
    std::vector<std::string> heard;
    const char* next;
  };
  const ProbeRow kRows[] = {
      {"the probe", {"late"}, "PA0"},
      {"it was answered", {"late", "!A0"}, "?A1"},
      {"it was not", {"late", "silence", "silence", "silence"}, "ended"},
  };
  for (const ProbeRow& row : kRows) {
    SCOPED_TRACE(row.what);
    Rig rig("1");
    rig.Poll(0);
    for (const std::string& what : row.heard) rig.Hear(what);
    rig.Turn();
    EXPECT_EQ(rig.Next(), row.next);
  }
}

TEST(JobRunnerTest, ARefusedProbeLeavesItsWaitingWriteNotSent) {
  Rig rig("1");
  rig.schedule().Hold(0, rig.now() + 1h);
  rig.Write({0});
  for (const char* what : {"a while", "!A0~refused"}) rig.Hear(what);
  EXPECT_EQ(rig.Next(), "ended");
  ASSERT_EQ(rig.results.size(), 1U);
  EXPECT_EQ(rig.results[0].end, WriteEnd::not_sent);
}

/// The conversation drops the query of point "L1", so point "2" is query 0. While "2" is read, the
/// query of "L1" comes back, and "2" becomes query 1.
TEST(JobRunnerTest, AReplyGoesToTheRequestedPointAfterQueriesAreRenumbered) {
  Rig rig("L1");
  rig.Poll(0);
  while (rig.runner().job() != nullptr) rig.Hear("silence");
  rig.Hear("a while");
  ASSERT_EQ(rig.a().conversation->Queries().size(), 1U);
  rig.Poll(0);
  rig.Turn();
  while (rig.Next() == "PA0") rig.Hear("!A0");
  ASSERT_EQ(rig.Next(), "?A2");
  ASSERT_TRUE(rig.Go());
  rig.tracker().OnSecondReply(rig.now());
  ASSERT_EQ(rig.a().conversation->Queries().size(), 2U);
  rig.Answer("A2=9");
  EXPECT_EQ(rig.Value(0), "");
  EXPECT_EQ(rig.Value(1), "9");
}

TEST(JobRunnerTest, APollIsParkedWhileALateReplyOfItsDeviceMayCome) {
  Rig rig("1");
  rig.late().OnClosed(rig.a(), rig.now());
  rig.Poll(0);
  EXPECT_EQ(rig.runner().TakeTurn(), JobRunner::Turn::next);
  EXPECT_EQ(rig.Next(), "parked");
}

TEST(JobRunnerTest, AReadWithAnUnnamedReplyWaitsOnTheLineForALateReply) {
  Rig rig("U1");
  rig.late().OnClosed(rig.a(), rig.now());
  rig.Poll(0);
  EXPECT_EQ(rig.runner().TakeTurn(), JobRunner::Turn::wait);
  EXPECT_EQ(rig.Next(), "UA1");
}

TEST(JobRunnerTest, AnOverdueWriteIsWithdrawnWhileTheLineIsNotQuiet) {
  Rig rig("1");
  rig.Write({0});
  rig.StartOnALineThatIsNotQuiet();
  rig.runner().Withdraw();
  EXPECT_EQ(rig.Next(), "WA1=7");
  rig.Hear("late");
  rig.runner().Withdraw();
  EXPECT_EQ(rig.Next(), "ended");
}

TEST(JobRunnerTest, ACommandOfTwoPointsIsConfirmedAfterTheSecondWrite) {
  Rig rig("1");
  rig.Write({0, 1});
  EXPECT_EQ(rig.Next(), "WA1=7");
  rig.Hear("!A1");
  EXPECT_EQ(rig.Next(), "WA2=7");
  EXPECT_TRUE(rig.writes().TakeConfirmed([](std::size_t) { return false; }).empty()) << "it is not";
  rig.Hear("!A2");
  EXPECT_EQ(rig.Next(), "ended");
  EXPECT_TRUE(rig.results.empty()) << "answered when it was read back";
  EXPECT_EQ(rig.writes().read_backs().size(), 2U);
}

TEST(JobRunnerTest, TheRestOfACommandIsDroppedWhenThePortIsLost) {
  Rig rig("S1");
  rig.Write({0, 1});
  for (const char* what : {"!A9", "!A1", "lost"}) rig.Hear(what);
  EXPECT_EQ(rig.Next(), "ended");
  ASSERT_EQ(rig.results.size(), 1U);
  EXPECT_EQ(rig.results[0].end, WriteEnd::not_sent);
}

TEST(JobRunnerTest, AnInterlockStopsTheRemainingPointsOfACommand) {
  Rig rig("1");
  rig.Write({0, 1});
  ASSERT_TRUE(rig.Go());
  rig.why_not = "an interlock";
  rig.Answer("A1");
  rig.Turn();
  EXPECT_EQ(rig.Next(), "ended");
  ASSERT_EQ(rig.results.size(), 1U);
  EXPECT_EQ(rig.results[0].end, WriteEnd::denied);
  EXPECT_EQ(rig.results[0].reason, "an interlock");
  EXPECT_EQ(rig.results[0].written, 1U);
  EXPECT_EQ(ResultOf(rig.results[0], 1).end, WriteEnd::denied);
}

TEST(JobRunnerTest, ReadingBackEndsAtTheFirstFailure) {
  Rig rig("1");
  EXPECT_FALSE(rig.IsReadingBack());
  rig.ReadBack();
  EXPECT_TRUE(rig.IsReadingBack());
  rig.Hear("silence");
  EXPECT_EQ(rig.Next(), "?A1");
  EXPECT_FALSE(rig.IsReadingBack());
}

TEST(JobRunnerTest, ReadingBackIncludesTheProbeBeforeTheRead) {
  Rig rig("1");
  rig.ReadBack();
  rig.Hear("late");
  rig.Turn();
  EXPECT_EQ(rig.Next(), "PA0");
  EXPECT_TRUE(rig.IsReadingBack());
  rig.Hear("!A0");
  EXPECT_EQ(rig.Next(), "?A1");
  EXPECT_TRUE(rig.IsReadingBack());
  rig.Hear("!A1=8");
  EXPECT_FALSE(rig.IsReadingBack());
}

TEST(JobRunnerTest, ReadingBackEndsWhenItsProbeFails) {
  Rig rig("1");
  rig.ReadBack();
  for (const char* what : {"late", "silence"}) rig.Hear(what);
  EXPECT_EQ(rig.Next(), "PA0");
  EXPECT_FALSE(rig.IsReadingBack());
}

TEST(JobRunnerTest, TheReplyTimeCountsFromTheRequestNotFromTheQuietBefore) {
  Rig rig("1");
  rig.Poll(0);
  rig.StartOnALineThatIsNotQuiet();
  const Instant started = rig.now();
  rig.WaitUntilSent();
  EXPECT_GT(rig.now(), started);
  EXPECT_EQ(rig.runner().job()->asked().sent, rig.now());
}

TEST(JobRunnerTest, APollOfABusyDeviceIsParkedAsOftenAsThereAreRetries) {
  Rig rig("1");
  rig.Poll(0);
  for (const char* next : {"parked", "parked", "ended"}) {
    rig.Hear("!A1~busy");
    EXPECT_EQ(rig.Next(), next);
    rig.Resume();
  }
}

TEST(JobRunnerTest, APollIsNotParkedIfItsDeviceWasDisabled) {
  Rig rig("1");
  rig.Poll(0);
  ASSERT_TRUE(rig.Go());
  rig.a().in_use = false;
  rig.Answer("A1~busy");
  EXPECT_EQ(rig.Next(), "ended");
}

TEST(JobRunnerTest, ADeviceHasOneParkedPoll) {
  Rig rig("1");
  rig.Poll(0);
  rig.Hear("!A1~busy");
  rig.Poll(1);
  rig.Hear("!A2~busy");
  EXPECT_EQ(rig.parked().TakeAll(rig.a()).size(), 1U);
}

TEST(JobRunnerTest, AParkedPollEndsWhenThePortClosesOrItsDeviceIsDisabled) {
  for (const bool closed : {false, true}) {
    Rig rig("1");
    rig.Poll(0);
    rig.Hear("!A1~busy");
    ASSERT_EQ(rig.Next(), "parked");
    if (closed) {
      rig.tracker().OnClosed(rig.now());
    } else {
      rig.tracker().SetInUse(rig.a(), false, true, rig.now());
    }
    EXPECT_EQ(rig.Next(), "ended");
  }
}

TEST(JobRunnerTest, AnsweredProbesDoNotMakeUpForFailedPolls) {
  Rig rig("1");
  for (int task = 0; task < 3; ++task) {
    rig.Hear("a while");
    rig.PollInVain(1, "silence");
  }
  EXPECT_TRUE(rig.a().health.absent());
}

/// The constructor of Rig has read point "2", but not point "1".
TEST(JobRunnerTest, SilenceToAPointThatNeverHadAValueDoesNotTakeItsDeviceOffline) {
  struct SilenceRow {
    const char* what;
    std::size_t query;
    const char* reply;
    bool offline;
  };
  const SilenceRow kRows[] = {
      {"the device does not have the point", 0, "silence", false},
      {"it had the point before", 1, "silence", true},
      {"damage comes from the device", 0, "damage", true},
  };
  for (const SilenceRow& row : kRows) {
    SCOPED_TRACE(row.what);
    Rig rig("1");
    for (int task = 0; task < 3; ++task) rig.PollInVain(row.query, row.reply);
    EXPECT_EQ(rig.a().health.absent(), row.offline);
  }
}

TEST(JobRunnerTest, ABroadcastDoesNotMakeUpForFailedPolls) {
  Rig rig("Q1");
  for (int task = 0; task < 3; ++task) {
    rig.Write({0});
    for (rig.Turn(); rig.runner().job() != nullptr; rig.Turn()) {
      rig.Hear(rig.Next() == "PA0" ? "!A0" : "sent");
    }
    rig.PollInVain(1, "silence");
  }
  EXPECT_FALSE(rig.writes().read_backs().empty()) << "the broadcasts were sent";
  EXPECT_TRUE(rig.a().health.absent());
}

TEST(JobRunnerTest, ASecondReplyDoesNotEndAJobWhoseProbeIsUnderWay) {
  Rig rig("1");
  rig.Poll(0);
  rig.Hear("a while");
  rig.Turn();
  ASSERT_EQ(rig.Next(), "PA0");
  rig.Answer("A2=9");
  rig.Hear("!A0");
  EXPECT_EQ(rig.Next(), "?A1") << "no answer waits for the probe";
}

TEST(JobRunnerTest, AfterAnUnansweredTelegramAProbeGoesFirst) {
  Rig rig("1");
  rig.tracker().OnUnansweredTelegram(rig.now());
  rig.Poll(0);
  rig.Turn();
  EXPECT_EQ(rig.Next(), "PA0");
}

/// Nobody knows whether the device would have answered, so the lost port is no failed exchange.
TEST(JobRunnerTest, ALostPortIsNoReasonForARetry) {
  Rig rig("1");
  rig.Poll(0);
  rig.Hear("lost");
  EXPECT_EQ(rig.Status().retries, 0U);
  rig.Poll(0);
  rig.Hear("silence");
  EXPECT_EQ(rig.Status().retries, 1U);
}

TEST(JobRunnerTest, AProbeIsNotAnsweredByAReplyToAnotherRequest) {
  Rig rig("1");
  rig.Probe();
  rig.Hear("!A0=2");
  EXPECT_EQ(rig.Next(), "PA0") << "it is repeated";
  rig.Hear("!A0");
  EXPECT_EQ(rig.Next(), "ended");
}

TEST(JobRunnerTest, AReplyOfUnexpectedFormIsUsedIfNoOtherReplyCanCome) {
  for (const bool owed : {false, true}) {
    Rig rig("1");
    rig.Poll(0);
    if (owed) rig.Hear("silence");
    rig.Hear("!A1~odd");
    EXPECT_EQ(rig.Next(), owed ? "?A1" : "ended");
  }
}

TEST(JobRunnerTest, AReplyOfUnexpectedFormGetsNoMoreRetriesThanSilence) {
  Rig rig("1");
  rig.Hear("a while");
  rig.Poll(0);
  rig.Hear("!A0");
  for (const char* next : {"?A1", "?A1", "ended"}) {
    rig.Hear("!A9=5");
    EXPECT_EQ(rig.Next(), next);
  }
}

/// The query of point "2" is dropped while point "2" is read, so the reply has no point any more.
TEST(JobRunnerTest, AReplyToADroppedQueryIsNotStored) {
  Rig rig("1");
  rig.Poll(1);
  ASSERT_TRUE(rig.Go());
  const protocols::Request request = rig.runner().job()->step.request;
  rig.a().conversation->OnFrame({.query = 1}, request, ToyReply("A2~replan"), rig.now());
  rig.Answer("A2=9");
  EXPECT_EQ(rig.Value(0), "");
  EXPECT_EQ(rig.Value(1), "5");
}

/// The reply may answer the request that BA1 replaces.
TEST(JobRunnerTest, OnlyTheReasonOfARefusalIsKeptFromAReplyThatIsNotUsed) {
  for (const bool refused : {false, true}) {
    Rig rig("L1");
    rig.Poll(0);
    rig.Hear("silence");
    ASSERT_EQ(rig.Next(), "BA1");
    rig.Hear(refused ? "!A1~refused" : "!A1=8");
    ASSERT_EQ(rig.Next(), "BA1");
    const std::optional<Unproven>& unproven = rig.runner().job()->attempt.unproven;
    ASSERT_TRUE(unproven);
    EXPECT_EQ(unproven->refused_as, refused ? Outcome::refused : Outcome::none);
    EXPECT_EQ(unproven->refusal, refused ? "the device says refused" : "");
  }
}

struct AnyJob : Job {
  using Job::Job;
  using Job::MustRepeat;
  NextStep Begin() override { return NextStep::Ask(); }
};

TEST(JobRunnerTest, OnlyARepeatablePollIsRepeatedBecauseItsReplyMayBeMuchOlder) {
  Rig rig("1");
  rig.Hear("a while");
  rig.Poll(0);
  rig.Hear("silence");
  rig.Hear("!A0");
  ASSERT_TRUE(rig.context().owed.whose.Lags(rig.a())) << "the reply to the second probe may come";
  using Kind = protocols::Task::Kind;
  for (const Kind kind : {Kind::poll, Kind::write, Kind::background}) {
    for (const bool repeatable : {true, false}) {
      AnyJob job(rig.a(), {.kind = kind}, rig.now());
      job.attempt.answer.readings.push_back({0, 1.0, Quality::good, {}});
      job.attempt.verdict.older = 2s;
      job.step.request.expect.repeatable = repeatable;
      EXPECT_EQ(job.MustRepeat(rig.context(), rig.now()), kind == Kind::poll && repeatable);
    }
  }
}

TEST(JobRunnerTest, ADeviceWithoutANameNeedsNoProbeAfterARetry) {
  Rig rig("1", "!A0~refused");
  rig.Poll(0);
  rig.Hear("silence");
  rig.Hear("!A1=8");
  EXPECT_EQ(rig.Next(), "ended") << "it would not tell who it is";
  EXPECT_EQ(rig.Value(0), "8");
}

TEST(JobRunnerTest, ARequestWithAContextIsNotRetried) {
  Rig rig("1");
  rig.Poll(0);
  rig.runner().job()->step.request.context = ToBytes("channel 3");
  rig.Hear("silence");
  EXPECT_EQ(rig.Next(), "ended");
}

/// After a failure of BA1 the conversation drops the query. Here BA1 was not sent.
TEST(JobRunnerTest, ARequestThatIsWithdrawnIsNoFailureOfTheDevice) {
  Rig rig("L1");
  rig.Poll(0);
  rig.Hear("silence");
  ASSERT_EQ(rig.Next(), "BA1");
  rig.Hear("disabled");
  rig.Turn();
  EXPECT_EQ(rig.Next(), "ended");
  EXPECT_EQ(rig.a().conversation->Queries().size(), 2U);
}

TEST(JobRunnerTest, TheConversationLearnsThatItsWaitingEventsAreNotAccepted) {
  Rig rig("L1");
  rig.Poll(0);
  rig.Hear("silence");
  for (int reply = 0; reply < 2; ++reply) rig.Hear("!A1~events");
  ASSERT_EQ(rig.Next(), "PA0") << "the second can only answer BA1";
  while (rig.Next() == "PA0") rig.Hear("silence");
  EXPECT_EQ(rig.a().conversation->Queries().size(), 1U) << "the failure of BA1 was reported";
}

/// The reply to a probe may answer the second probe of the task before.
TEST(JobRunnerTest, AProbeIsRepeatedWhileItsReplyMayBeOlderUnlessTheDeviceIsBusy) {
  for (const bool busy : {false, true}) {
    Rig rig("1");
    rig.Hear("a while");
    rig.Poll(0);
    for (const char* what : {"silence", "!A0", "silence", "silence", "silence"}) rig.Hear(what);
    ASSERT_EQ(rig.Next(), "ended");
    rig.Hear("a while");
    rig.Poll(0);
    rig.Hear(busy ? "!A0~busy" : "!A0");
    EXPECT_EQ(rig.Next() == "PA0", !busy) << rig.Next();
  }
}

/// A request that waits at the port for a connection has not reached the device.
TEST(JobRunnerTest, AWriteThatNeverLeftIsUnknownOnlyIfAnEarlierTryMayHaveWritten) {
  for (const bool retried : {false, true}) {
    Rig rig("1");
    rig.Write({0});
    rig.runner().job()->step.request.expect.repeatable = retried;
    if (retried) rig.Hear("silence");
    ASSERT_TRUE(rig.Go());
    rig.Hear("left");
    Job& job = *rig.runner().job();
    EXPECT_FALSE(job.WhyNotSend(rig.now())) << "it is under way";
    EXPECT_EQ(job.WhyNotSend(rig.now(), true).has_value(), !retried);
    job.NeverLeft();
    rig.runner().OnClosed("the port is lost");
    ASSERT_EQ(rig.results.size(), 1U);
    EXPECT_EQ(rig.results[0].end, retried ? WriteEnd::unknown : WriteEnd::not_sent);
  }
}

}  // namespace
}  // namespace baudgate::bus
