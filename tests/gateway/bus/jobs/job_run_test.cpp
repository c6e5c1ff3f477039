// One job from its first request to its end, without a line: the rows of the table in
// gateway/bus/jobs/job_run.cpp.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/job_run.h"

#include <gmock/gmock.h>

#include "gateway/base/text.h"
#include "gateway/bus/poller/poller.h"
#include "tests/support/times.h"
#include "tests/support/virtual_line.h"

namespace baudgate::bus {
namespace {

using ::testing::StartsWith;

/// Device A reads one point as the test says and then "2"; B reads "1". All was answered a moment
/// ago: A has proven who it is, and nothing is owed.
class Rig : private PollerListener {
 public:
  explicit Rig(const std::string& read) : config_(ConfigOf(read)) {
    SetTime();
    context_.tracker.OnOpened(now_.instant);
    while (context_.agenda.schedule.Next(now_.instant)) continue;  // nothing is due for a second
    Poll(1);
    // Another master may have asked it before: one probe is not enough.
    for (Turn(); run_.job() != nullptr; Turn()) Hear(Next() == "PA0" ? "!A0" : "!A2=5");
  }

  void Poll(std::size_t query) {
    Begin(Job::Poll{}, {.kind = protocols::Task::Kind::poll, .query = query});
  }
  void ReadBack() { Begin(Job::ReadBack{}, {.kind = protocols::Task::Kind::poll, .query = 0}); }
  void Write(std::vector<std::uint32_t> points) {
    Job::Write write;
    auto& writes = std::get<Writes>(write.command.kind);
    for (const std::uint32_t point : points) writes.push_back({point, 7.0});
    write.command.MoveTo(WriteState::queued);
    write.command.deadline = now_.instant + 1h;
    write.command.done = [this](const WriteResult& result) { results.push_back(result); };
    write.command.abandoned = left_;
    write.command.why_not = [this](Instant) { return why_not; };
    Begin(std::move(write), {});
  }

  /// "silence", "damage", "sent" (of a broadcast), "late" (an hour passes), "a while" (its proof
  /// has become old), "disabled", "left" (its client), "forbidden" (by an interlock), "lost" (the
  /// port), or a reply:
  /// "!A1=5".
  void Hear(const std::string& what) {
    if (what == "late") return Pass(1h);
    if (what == "a while") return Pass(2min);
    if (what == "disabled") {
      a().in_use = false;
    } else if (what == "left") {
      *left_ = true;
    } else if (what == "forbidden") {
      why_not = "an interlock";
    } else if (what == "sent") {
      End(Go() ? Outcome::ok : Outcome::none);
    } else if (what == "silence") {
      End(Go() ? Outcome::no_reply : Outcome::none);
    } else if (what == "damage") {
      End(Go() ? Outcome::corrupt : Outcome::none);
    } else if (what == "lost") {
      if (!Go()) return;
      End(Outcome::line_down);
    } else if (Go()) {
      Answer(what.substr(1));
    }
  }
  void Answer(const std::string& reply) { End(Judge(reply)); }
  Outcome Judge(const std::string& reply, bool may_be_echo = false) {
    return judge_.Judge(*run_.job(), ToyReply(reply), may_be_echo, now_.instant);
  }
  /// Until its request may go. False: it may not, and "next" has happened to it.
  bool Go() {
    Pass(10ms);
    while (run_.job() != nullptr) {
      if (run_.TakeTurn() == JobRun::Turn::next) continue;
      run_.Start(now_.instant);
      run_.Send();
      Pass(10ms);
      return true;
    }
    return false;
  }
  void Turn() {
    while (run_.job() != nullptr && run_.TakeTurn() == JobRun::Turn::next) continue;
  }

  /// The request that waits, or what has become of the job.
  std::string Next() {
    if (run_.job() == nullptr) return context_.agenda.parked.NextAt() ? "parked" : "ended";
    const std::string request(AsText(run_.job()->step.request.bytes));
    return request.substr(0, request.size() - 1);
  }
  bool IsReadingBack() { return run_.job() != nullptr && ReadsBack(*run_.job(), a()); }
  std::string Value(std::size_t point) const {
    std::string value;
    store_.Read(0, [&](const DeviceRecord& record) { value = ToText(record.points[point].value); });
    return value;
  }

  Device& a() { return context_.roster.device(0); }
  DeviceTracker& tracker() { return context_.tracker; }
  Schedule& schedule() { return context_.agenda.schedule; }
  JobRun& run() { return run_; }
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

  template <typename Kind>
  void Begin(Kind kind, protocols::Task task) {
    Pass(10ms);
    run_.Begin(std::make_unique<Job>(a(), std::move(kind), std::move(task), now_.instant));
  }
  void End(Outcome outcome) {
    if (run_.job() == nullptr) return;
    run_.KeepEnd({outcome, {}, 10ms, 0});
    auto end = run_.TakeEnd();
    ASSERT_TRUE(end);
    run_.FollowUp(std::move(*end), {});
  }
  void Pass(Duration time) {
    now_ = {now_.instant + time, now_.wall + time};
    SetTime();
  }
  void SetTime() {
    context_.accounts.OnTime(now_, false, nullptr);
    run_.SetTime(now_);
  }

  config::Config config_;
  std::shared_ptr<std::atomic<bool>> left_ = std::make_shared<std::atomic<bool>>(false);
  Now now_{kStart, kWall};
  PointStore store_{config_};
  LineContext context_{
      config_.lines[0], 0,
      [](const std::string&) -> const protocols::Protocol& { return ToyProtocol(); }, store_,
      *this};
  Chooser chooser_{context_.roster, context_.agenda, context_.owed.late_replies};
  Intake intake_{store_, *this};
  ReplyJudge judge_{context_.owed.whose};
  EffectApplier effects_{context_.owed, context_.agenda, context_.accounts, context_.tracker,
                         intake_};
  JobPhases phases_{context_, chooser_, effects_};
  JobRun run_{phases_};
};

struct Row {
  const char* what;
  const char* read;
  std::vector<std::string> heard;
  const char* next;
};

TEST(JobRunTest, WhatAPollComesTo) {
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

TEST(JobRunTest, WhatAWriteComesTo) {
  struct WriteRow : Row {
    std::optional<WriteEnd> end{};
  };
  const WriteRow kRows[] = {
      {{"it is asked for", "1", {}, "WA1=7"}},
      {{"refused", "1", {"!A1~refused"}, "ended"}, WriteEnd::refused},
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

TEST(JobRunTest, ASilentClosingDoesNotHideWhyAWriteWasRefused) {
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
  }
}

TEST(JobRunTest, WhatIsForbiddenMeanwhileIsWithdrawnFromALineThatIsNotQuietYet) {
  Rig rig("1");
  rig.Write({0});
  rig.Turn();
  rig.run().Start(rig.now());
  EXPECT_FALSE(rig.run().Withdraw());
  rig.why_not = "an interlock";
  EXPECT_TRUE(rig.run().Withdraw());
  ASSERT_EQ(rig.results.size(), 1U);
  EXPECT_EQ(rig.results[0].end, WriteEnd::denied);
  EXPECT_TRUE(rig.writes().read_backs().empty()) << "nothing was written";
}

/// It may have been carried out, so it was not denied.
TEST(JobRunTest, WhatIsForbiddenMeanwhileIsNotRepeated) {
  Rig rig("1");
  rig.Write({0});
  rig.run().job()->step.request.expect.repeatable = true;
  rig.Hear("silence");
  ASSERT_EQ(rig.Next(), "WA1=7");
  rig.why_not = "an interlock";
  rig.Turn();
  EXPECT_EQ(rig.Next(), "ended");
  ASSERT_EQ(rig.results.size(), 1U);
  EXPECT_EQ(rig.results[0].end, WriteEnd::unknown);
  EXPECT_EQ(rig.results[0].reason, "an interlock");
}

TEST(JobRunTest, AReplyThatCountsIsStored) {
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

TEST(JobRunTest, WhatMayBeItsEchoIsNoReply) {
  Rig rig("1");
  rig.Poll(0);
  ASSERT_TRUE(rig.Go());
  EXPECT_EQ(rig.Judge("A1=8", true), Outcome::unexpected);
  EXPECT_EQ(rig.Judge("A1=8"), Outcome::ok);
}

TEST(JobRunTest, AfterAWhileAProbeGoesFirstAndItsSilenceEndsTheJob) {
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

TEST(JobRunTest, ARefusedProbeRefusesNotTheWriteThatWaitsForIt) {
  Rig rig("1");
  rig.schedule().Hold(0, rig.now() + 1h);  // the device wants to be left in peace
  rig.Write({0});
  for (const char* what : {"a while", "!A0~refused"}) rig.Hear(what);
  EXPECT_EQ(rig.Next(), "ended");
  ASSERT_EQ(rig.results.size(), 1U);
  EXPECT_EQ(rig.results[0].end, WriteEnd::not_sent);
}

/// "L1" was dropped, so "2" is the only query. While it is asked, "L1" comes back, and "2" is the
/// second one.
TEST(JobRunTest, AReplyGoesToThePointThatWasAskedThoughTheQueriesHaveOtherNumbers) {
  Rig rig("L1");
  rig.Poll(0);
  while (rig.run().job() != nullptr) rig.Hear("silence");
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

TEST(JobRunTest, APollWaitsBesideTheLineForALateReplyOfItsDevice) {
  Rig rig("1");
  rig.late().OnClosed(rig.a(), rig.now());
  rig.Poll(0);
  EXPECT_EQ(rig.run().TakeTurn(), JobRun::Turn::next);
  EXPECT_EQ(rig.Next(), "parked");
}

TEST(JobRunTest, AReadThatNamesNobodyWaitsWithTheLine) {
  Rig rig("U1");
  rig.late().OnClosed(rig.a(), rig.now());
  rig.Poll(0);
  EXPECT_EQ(rig.run().TakeTurn(), JobRun::Turn::wait);
  EXPECT_EQ(rig.Next(), "UA1");
}

TEST(JobRunTest, WhatIsTooLateIsWithdrawnFromALineThatIsNotQuietYet) {
  Rig rig("1");
  rig.Write({0});
  ASSERT_TRUE(rig.Go());
  EXPECT_FALSE(rig.run().Withdraw());
  rig.Hear("late");
  EXPECT_TRUE(rig.run().Withdraw());
  EXPECT_EQ(rig.Next(), "ended");
}

TEST(JobRunTest, ACommandOfTwoPointsIsConfirmedBehindTheSecond) {
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

TEST(JobRunTest, WhatRemainsOfACommandIsNotKeptForThePortToOpen) {
  Rig rig("S1");
  rig.Write({0, 1});
  for (const char* what : {"!A9", "!A1", "lost"}) rig.Hear(what);
  EXPECT_EQ(rig.Next(), "ended");
  ASSERT_EQ(rig.results.size(), 1U);
  EXPECT_EQ(rig.results[0].end, WriteEnd::not_sent);
}

TEST(JobRunTest, WhatIsNotPermittedAnyMoreIsNotBegun) {
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

TEST(JobRunTest, AReadBackThatFailsOnceHoldsNobodyUp) {
  Rig rig("1");
  EXPECT_FALSE(rig.IsReadingBack());
  rig.ReadBack();
  EXPECT_TRUE(rig.IsReadingBack());
  rig.Hear("silence");
  EXPECT_EQ(rig.Next(), "?A1");
  EXPECT_FALSE(rig.IsReadingBack());
}

TEST(JobRunTest, AReadBackIsAwaitedBehindTheProbeBeforeIt) {
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

TEST(JobRunTest, AProbeThatFailsBeforeAReadBackHoldsNobodyUp) {
  Rig rig("1");
  rig.ReadBack();
  for (const char* what : {"late", "silence"}) rig.Hear(what);
  EXPECT_EQ(rig.Next(), "PA0");
  EXPECT_FALSE(rig.IsReadingBack());
}

TEST(JobRunTest, TheTimeOfAReplyCountsFromItsRequestAndNotFromTheQuietBeforeIt) {
  Rig rig("1");
  rig.Poll(0);
  rig.Turn();
  rig.run().Start(rig.now());
  rig.Hear("late");
  rig.run().Send();
  EXPECT_EQ(rig.run().job()->asked().sent, rig.now());
}

}  // namespace
}  // namespace baudgate::bus
