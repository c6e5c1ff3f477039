// `Job` is the present work of a line: one task of one device, such as a poll or a write, or one
// request of a client of a route, from its first request to its end. Each kind of job is a class
// (poll.h with events, read_back.h, background.h, probe.h, write.h, routed.h). `JobRunner`
// (gateway/bus/poller/job_runner.h) calls the functions of a job in this order:
//
//   function   called when                       what it returns or does
//   Begin      the job was chosen                the first step
//   Ask        a request is needed               gets the request from the conversation
//   Depart     the line is idle                  send, hold, park, or a probe first
//   Start      the line gets the exchange        the exchange with its times
//   Withdraw   the line is not quiet yet         ends the job if the request is too late or
//   forbidden Send       the line was quiet                the request Judge      a whole frame has
//   come            its outcome, and to which request it belongs Ended      the exchange is over
//   the exchange as one value Conclude   all observers were called         Answer or Fail: next
//   request, repetition, or end Take       a probe confirms the answer       next request, or end
//   Finish     the job is over                   applies what follows (End)
//
// The next step is a value (NextStep, EndEffects), which `JobRunner` and Apply carry out. job.cpp
// has the table of all states of a job.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/bus/counters/accounts.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/bus/exchange/line.h"
#include "gateway/bus/points/line_status.h"
#include "gateway/bus/replies/ended_exchange.h"
#include "gateway/bus/replies/late_replies.h"
#include "gateway/bus/replies/whose_reply.h"
#include "gateway/bus/schedule/probes.h"
#include "gateway/bus/schedule/turns.h"
#include "gateway/bus/writes/route_queue.h"
#include "gateway/bus/writes/write_command.h"
#include "protocols/conversation.h"

namespace baudgate::bus {

class Job;
struct LineContext;

/// The outcome of a job, or of one request of it, and the reason in words.
struct JobEnd {
  Outcome outcome = Outcome::none;
  std::string reason{};
};

// `NextStep` is what a job has to do next. JobRunner carries it out.
struct NextStep {
  enum class What : std::uint8_t {
    wait,
    send,
    hold,  ///< the line stays idle until no late reply can come; then the request is sent
    ask,   ///< the job needs its next request, or the present one again, from the conversation
    probe_first,  ///< a probe of the device is sent before this job continues
    /// No probe is possible, so the job that waits behind the probe continues without it. `end`
    /// contains the reason.
    go_unproved,
    take_answer,    ///< the answer that waited for a probe is accepted
    park,           ///< the job is interrupted until `until`, and the line does other work
    back_in_queue,  ///< the job ends; its requests of clients wait in the queue again
    finish,
  };

  static NextStep Wait() { return {}; }
  static NextStep Send() { return {.what = What::send}; }
  static NextStep Hold() { return {.what = What::hold}; }
  static NextStep Ask(int repeats = 0) { return {.what = What::ask, .repeats = repeats}; }
  static NextStep ProbeFirst() { return {.what = What::probe_first}; }
  static NextStep GoUnproved(std::string why) {
    return {.what = What::go_unproved, .end = {Outcome::none, std::move(why)}};
  }
  static NextStep TakeAnswer() { return {.what = What::take_answer}; }
  static NextStep Park(Instant until) { return {.what = What::park, .until = until}; }
  static NextStep BackInQueue() { return {.what = What::back_in_queue}; }
  static NextStep Finish(Outcome outcome, std::string reason) {
    return {.what = What::finish, .end = {outcome, std::move(reason)}};
  }

  What what = What::wait;
  int repeats = 0;
  Instant until{};
  JobEnd end{};
};

// `EndEffects` contains the consequences of the end of a job. The function End of each kind of job
// fills it in. Job::Apply carries out the fields in their order, except `write`, which
// WriteJob::Finish carries out. After `background` it also plans the next background read, and
// tells Probes that a probe has ended.
//
//   kind         consequences of its end
//   poll         line time of the fast round; the query is counted; a seldom group (once, daily)
//                that was not read is read again
//   read-back    a seldom group as above; without an answer its points become uncertain; if its
//                query is gone, queries of the new plan read its points
//   events       none of its own
//   background   how long its exchange took, or that it was lost or not sent
//   probe        none of its own; if a job waits behind it, the next step of that job
//   write        its points are uncertain until they are read; the command is confirmed, goes on,
//                or is answered. Without an answer, polls go before the next write
//   routed       its clients are answered. After a write without an answer, polls go first
//
// Each end also shows whether the device answers, unless `judges_member` is false.
struct EndEffects {
  struct Background {
    bool sent = false;
    /// Line time of the job and of the probe before it. Zero: the job was not answered.
    Duration took{};
    bool proved = false;
  };
  struct Poll {
    std::size_t query = 0;
    bool answered = false;
  };
  /// The group is to be polled again, because a part of it was not read.
  struct Repeat {
    config::Group group{};
    bool soon = false;  ///< after some seconds: see DeviceTracker::Repeat
  };
  /// Consequences for the points of a write command when one of its requests has ended.
  struct Write {
    enum class Next : std::uint8_t {
      answer,  ///< the command ends, and its client gets `result`
      /// The device has confirmed the command; its client is answered after the read-back.
      confirm,
      go_on,
    };
    std::vector<std::size_t> unknown;  ///< points whose values are unknown until they are read
    /// Writes that succeeded; JumpCheck then accepts their values.
    std::vector<PointWrite> confirmed;
    Next next = Next::answer;
    WriteResult result{};
  };

  std::optional<Background> background;
  std::optional<FastRounds::Poll> fast_poll;
  std::optional<Poll> poll;
  std::optional<Repeat> repeat;
  std::vector<std::size_t> read_again;  ///< points of a read-back whose query no longer exists
  std::vector<std::size_t> doubt;
  bool polls_first = false;   ///< polls of the device go before the next write to it
  bool judges_member = true;  ///< the end counts for the state of the member (online, offline)
  bool wrote = false;         ///< the request may have changed the device
  /// The points that the request wrote. Empty: the points are unknown, or the request wrote none.
  std::span<const PointWrite> written;
  std::vector<std::pair<RoutedRequest, RoutedReply>> replies;
  std::optional<Write> write;
};

class Job {
 public:
  struct Step {
    protocols::Request request{};
    bool waiting = false;  ///< the request waits for the line to be idle
    int repeats = 0;       ///< number of retries so far
  };
  /// The latest try of the request, and its reply. Job::Start begins a new attempt.
  struct Attempt {
    Instant began{};
    Instant sent_at{};  ///< when the first byte was sent; before that, when Start was called
    bool job_was_sent = false;  ///< the value of Job::was_sent before this try
    protocols::Answer answer{};
    WhoseReply::Verdict verdict{};
    std::optional<Unproven> unproven{};
    Now answered_at{};
    Duration round_trip{};
    /// True if the reply came after the reply time, and was received because the line waits longer
    /// for a slow device (Patience).
    bool after_reply_time = false;
  };
  /// The job that continues after the end of this job, with its next step. Null: no job continues.
  struct After {
    std::unique_ptr<Job> job;
    NextStep next;
  };

  Job(Member& who, protocols::Task what, Instant now)
      : member(&who), task(std::move(what)), began(now) {}
  virtual ~Job() = default;
  Job(const Job&) = delete;
  Job& operator=(const Job&) = delete;

  // ---------------- the life of a job, in order

  virtual NextStep Begin() { return NextStep::Ask(); }
  /// Gets the next request from the conversation. `repeats`: number of earlier tries of this
  /// request.
  virtual NextStep Ask(LineContext& line, int repeats, Instant now);
  /// Called when the line is idle and the request waits. Decides whether the request is sent now.
  ///
  ///   the request                                     what follows
  ///   must not be sent any more (WhyNotSend)          the job closes what it opened, or ends
  ///   could get the reply to an earlier request       a probe goes first
  ///   is a retry, or no late reply can come           it is sent
  ///   is a read, and a late reply may come            it is parked, if replies carry addresses
  ///   is not a read, and a late reply may come        the line waits
  ///
  NextStep Depart(LineContext& line, Instant now);
  /// Returns when Depart is to be called again after it has returned `hold`.
  std::optional<Instant> DepartsAt(const LineContext& line) const;
  /// Returns the exchange for the line. `idle_since`: the line has been idle since then.
  Exchange Start(LineContext& line, Instant idle_since, Instant now);
  /// Called while the line waits for silence before it sends the request. Returns the next step if
  /// the request must not be sent after all: it is too late or forbidden, or it is a read of a
  /// client and a short write (RouteQueue::IsShortWrite, such as a start or stop) waits. Empty: the
  /// request goes on waiting.
  std::optional<NextStep> Withdraw(LineContext& line, Instant now);
  /// Called when the silence before the request is over. Returns the request, which is sent now.
  const protocols::Request& Send(LineContext& line, Now now);
  /// The request was given to the port, but never left this machine, and will not be sent.
  virtual void NeverLeft() { was_sent = attempt.job_was_sent; }

  /// Called when a frame came for the request under way. Stores its meaning in `attempt` and
  /// returns the outcome of the exchange.
  ///
  ///   the frame                            outcome
  ///   may be the echo of the request       unexpected
  ///   is damaged, or has another form      as JudgeForm decides
  ///   may answer an earlier request        unexpected: the request is repeated
  ///   answers this request                 as the conversation decides (Read)
  ///
  /// `echo` contains whether this bus is known to echo.
  Outcome Judge(LineContext& line, View frame, const EchoWatch& echo, Instant now);
  /// Returns the exchange that has ended, for the observers. `end`: the end as the line reported
  /// it.
  EndedExchange Ended(ExchangeEnd end) const;
  NextStep Conclude(LineContext& line, const ExchangeEnd& end, Now now);
  NextStep Take(LineContext& line, Instant now);
  virtual After Finish(LineContext& line, const JobEnd& end, Instant now);
  /// Ends a probe that the conversation cannot make. The device is not at fault, so the job behind
  /// the probe continues without a probe. If that job has an answer that waits for the probe, the
  /// job ends as busy.
  virtual After GoUnproved(LineContext& /*line*/, const std::string& /*why*/, Instant /*now*/) {
    return {};
  }
  /// Returns the consequences of the end of the job. Moves the requests of clients out of the job;
  /// changes nothing else.
  EndEffects EffectsOf(const JobEnd& end, Instant now);

  // ---------------- functions that differ by kind

  virtual LineUse use() const { return LineUse::polls; }
  /// True for writes to points, their read-backs, and short writes (a start or stop) of clients.
  virtual bool is_urgent() const { return false; }
  virtual bool writes() const { return false; }
  /// True if the request comes from a client of a route. The client gets the reply; no conversation
  /// reads it.
  virtual bool is_routed() const { return false; }
  virtual bool is_read_back() const { return false; }
  virtual std::optional<config::Group> group() const { return std::nullopt; }
  /// True if a request of the job may have begun a write, so the job must not be dropped.
  virtual bool is_writing() const { return false; }
  /// True if the job reads back points of this member, and none of its exchanges has failed so far.
  virtual bool ReadsBack(const Member& /*of*/) const { return false; }
  /// Returns this job; a probe returns the job that waits behind it, if there is one.
  virtual const Job& goal() const { return *this; }
  /// Returns the job that waits behind this probe and removes it from the probe; null: there is
  /// none.
  virtual std::unique_ptr<Job> TakeGoal() { return nullptr; }
  /// Returns the latest time at which the request can be sent; empty: there is no limit.
  virtual std::optional<Instant> LatestStart() const { return std::nullopt; }
  /// Called directly before the request is put on the wire. Returns why it must not be sent; empty:
  /// it is sent. `held`: the request was given to the port, and has waited for a connection since.
  virtual std::optional<Withheld> WhyNotSend(Instant now, bool held = false) const;
  /// Returns until when failed requests are retried. Empty: Chooser::MayRepeat decides about each
  /// retry.
  virtual std::optional<Instant> RepeatsUntil() const { return std::nullopt; }
  /// True for a read of a client if a waiting short write (a start or stop) is to be sent first.
  virtual bool LetsPass(const LineContext& /*line*/, Instant /*now*/) const { return false; }
  /// Called when two different replies have come, so one of them belongs to another request. If an
  /// answer waits behind this probe, it is not accepted.
  virtual void OnSecondReply() {}
  virtual void PutBack(LineContext& /*line*/) {}
  /// The client has left, so its requests leave the job. `unsent`: the request under way has not
  /// left this machine yet.
  virtual void Abandon(std::uint64_t /*client*/, bool /*unsent*/) {}
  /// Finds the query of `task` again after the queries of the device have changed, and updates its
  /// number. If the query no longer exists, the number becomes that of no query.
  virtual void FollowPlan() {}

  // ---------------- facts

  /// True if the task has sent a request before, so the conversation may have to close a session.
  bool begun() const { return requests > 1 || step.repeats > 0; }
  bool is_broadcast() const {
    return step.request.expect.reply == protocols::Expectation::Reply::none;
  }
  bool is_probe() const { return task.kind == protocols::Task::Kind::probe; }
  /// True if the reply contains events, or readings of a poll, that are to be stored.
  bool has_news() const {
    const protocols::Answer& answer = attempt.answer;
    return answer.batch || (task.kind == protocols::Task::Kind::poll && !answer.readings.empty());
  }
  Asked asked() const;

  Member* member;
  protocols::Task task;
  std::vector<std::size_t> points;
  Instant began;
  /// Set if the job probes an offline member: the kind of the probe, which decides whose budget of
  /// line time it uses.
  std::optional<Probes::Kind> probe_budget;
  bool renews_proof_early = false;  ///< see Asked::renews_proof_early
  bool proved = false;              ///< a probe before this job was answered
  bool unprovable = false;          ///< a probe before this job is necessary, but not possible
  int requests = 0;                 ///< number of requests of the task, without retries
  int broadcasts = 0;               ///< number of broadcasts among `requests`
  int parkings = 0;                 ///< how often the job was parked because the device was busy
  bool was_sent = false;
  bool unplanned = false;       ///< the query no longer existed when its reply came
  bool has_no_request = false;  ///< the conversation could not make a request for the job
  /// An exchange of the job has failed, so another device may answer now.
  bool had_failure = false;
  bool judges_member = true;
  /// True if the request got no answer because the device does not have its points: it answers
  /// other queries, but has never answered this one.
  bool blames_query = false;
  Duration wire{};  ///< line time of the answered exchanges of the job and of its probe

  Step step;
  Attempt attempt;

 protected:
  /// Conclude calls Answer after an answered exchange, else Fail. Both return the next step.
  virtual NextStep Answer(LineContext& line, const ExchangeEnd& end, Now now);
  virtual NextStep Fail(LineContext& line, const ExchangeEnd& end, Instant now);
  virtual void End(const JobEnd& /*end*/, Instant /*now*/, EndEffects& /*effects*/) {}

  friend class ProbeJob;

  /// Returns the outcome of the frame by its form. The conversation decides; for a request of a
  /// route, the carrier (protocols::PduCarrier).
  virtual Outcome JudgeForm(LineContext& line, View frame, const EchoWatch& echo);
  /// Reads a reply that is known to answer this request, and stores its content in `attempt`.
  virtual Outcome Read(View frame, Instant now);
  virtual Outcome Refuse(View frame, Outcome outcome);
  /// True if the request has to be sent again although its reply is good, because the reply may
  /// belong to an older request.
  virtual bool MustRepeat(const LineContext& line, Instant now) const;
  virtual void OnReplaced(LineContext& line, Now now);
  virtual void OnSend(LineContext& /*line*/, Instant /*now*/) {}
  /// In a write: stores the latest answer of the device. `may_have_acted`: the device has refused
  /// the write, but may have changed something.
  virtual void NoteTold(const JobEnd& /*told*/, bool /*may_have_acted*/) {}
  virtual void OnGaveUp(const ExchangeEnd& /*end*/) {}
  /// Called when the waiting request is not sent after all, for example after its deadline. The job
  /// then closes a session that it has opened.
  virtual void OnWithheld(const Withheld& /*why*/) {}
  /// Called when the failed request is not retried.
  virtual NextStep GiveUp(LineContext& line, const ExchangeEnd& end, Instant now);
  /// Continues the job after the probe that went before it, or without it if no probe is possible.
  /// Asks the conversation for the request again.
  virtual NextStep GoOn();

  /// Carries out the effects of the end, field by field, and decides nothing.
  void Apply(LineContext& line, EndEffects& effects, const JobEnd& end, Instant now);
  NextStep Repeat();
  /// True if the failed request is to be sent again now. `more`: number of extra retries, given
  /// because other replies may come before the reply to this request.
  bool MayRepeat(const LineContext& line, int more, Instant now) const;

 private:
  NextStep BreakOff(const Withheld& withheld, Instant now);
  bool WaitsBesideLine(const LineContext& line) const;
  Outcome LeaveUnproven(View frame, Outcome outcome);
  bool GoesOnBehindBroadcast(Instant now);
  bool ParksBusy(const LineContext& line, Outcome outcome) const;
  void TakeOver(LineContext& line, Device& device, protocols::Answer answer, Instant now);
};

// `JobSource` offers the jobs of one kind, such as all polls. gateway/bus/jobs/chooser.cpp has the
// list of all sources.
class JobSource {
 public:
  virtual ~JobSource() = default;
  /// Called when the line is idle. Returns a job, or null if no job of this kind can be sent now.
  virtual std::unique_ptr<Job> Take(const Idle& idle) = 0;
  /// Returns when Take can return a job if nothing happens until then. The time can be in the past.
  virtual std::optional<Instant> NextAt(const Idle& idle) const = 0;
};

}  // namespace baudgate::bus
