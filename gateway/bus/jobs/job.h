// `Job` is the work of a line at present: one task of one device, or one routed request, from its
// first request to its end. Each kind of job is a class (poll.h with events, read_back.h,
// background.h, probe.h, write.h, routed.h); gateway/bus/jobs/chooser.cpp lists them. `JobRunner`
// (gateway/bus/poller/job_runner.h) calls the functions of a job in this order:
//
//   function   called when                       what it returns or does
//   Begin      the job was chosen                the first step
//   Ask        a request is needed               gets the request from the conversation
//   Depart     the line is idle                  send, hold, park, or a probe first
//   Start      the line gets the exchange        the exchange with its times
//   Withdraw   the line is not quiet yet         the request may be too late, or forbidden now
//   Send       the line was quiet                the request
//   Judge      a whole frame has come            its outcome, and to which request it belongs
//   Ended      the exchange is over              the exchange as one value
//   Conclude   all observers were called         Answer or Fail: next request, repetition, or end
//   Take       an answer that waited counts      next request, or end
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

/// Why a request is not sent, and the result of a write that ends because of that.
struct Withheld {
  WriteEnd end = WriteEnd::not_sent;
  std::string why;
};

/// How a job or one of its requests ended, and the reason in words.
struct JobEnd {
  Outcome outcome = Outcome::none;
  std::string reason{};
};

// The next step of a job. Only gateway/bus/poller/job_runner.cpp carries it out.
struct NextStep {
  enum class What : std::uint8_t {
    wait,           ///< the request is ready and waits for the line
    send,           ///< the request is sent now
    hold,           ///< the line waits until no late reply can come, then sends the request
    ask,            ///< get the next request of the task, or the request of this step again
    probe_first,    ///< a probe of the device goes first
    go_unproved,    ///< the probe cannot be asked; the job behind it goes on; reason in `end`
    take_answer,    ///< the answer counts
    park,           ///< the job waits beside the line, until `until`
    back_in_queue,  ///< the requests of its clients wait in the queue again
    finish,         ///< the job ends as `end` describes
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

// `EndEffects` contains the consequences of the end of a job. End of each kind decides them;
// Job::Apply carries them out in the order of the fields, and WriteJob::Finish those in `write`.
// After `background` Job::Apply plans the next background read and informs the probes.
//
//   kind         consequences of its end
//   poll         line time of the fast round; the query is counted; a seldom group that was not
//                read is read again
//   read-back    a seldom group as above; not answered: its points are in doubt; its query is
//                gone: queries of the new plan read its points
//   events       only those of all kinds
//   background   how long its exchange took, or that it was lost or not sent
//   probe        only those of all kinds; before another job: what that job does now
//   write        its points are in doubt until they are read; the command is confirmed, goes on,
//                or is answered. Not answered: polls go before the next write
//   routed       its clients are answered. A write that was not answered: polls go first
//
// For all kinds the end shows whether the member is there, unless `judges_member` is false.
struct EndEffects {
  struct Background {
    bool sent = false;
    Duration took{};  ///< line time including the probe before it; zero: it was not answered
    bool proved = false;
  };
  struct Poll {
    std::size_t query = 0;
    bool answered = false;
  };
  /// The group is polled again, because a part of it was not read.
  struct Repeat {
    config::Group group{};
    bool soon = false;  ///< Schedule::RepeatSoon; the rule is in gateway/bus/jobs/poll.h
  };
  /// The consequences for the points of a command that are under way.
  struct Write {
    enum class Next : std::uint8_t {
      answer,  ///< the command ends: its client gets `result`
      /// The device has confirmed the command; its client is answered after the read-back.
      confirm,
      go_on,  ///< the command continues with the points that remain
    };
    std::vector<std::size_t> unknown;   ///< points with unknown values, until they are read
    std::vector<PointWrite> confirmed;  ///< readings that agree with these count at once
    Next next = Next::answer;
    WriteResult result{};
  };

  std::optional<Background> background;
  std::optional<FastRounds::Poll> fast_poll;
  std::optional<Poll> poll;
  std::optional<Repeat> repeat;
  std::vector<std::size_t> read_again;  ///< points of a read-back whose query is gone
  std::vector<std::size_t> doubt;       ///< points that become uncertain
  bool polls_first = false;             ///< polls go before the next write to the device
  bool judges_member = true;            ///< the end shows whether the member answers
  bool wrote = false;                   ///< the request may have changed the device
  /// The points that this request wrote; empty if none are known.
  std::span<const PointWrite> written;
  std::vector<std::pair<RoutedRequest, RoutedReply>> replies;
  std::optional<Write> write;
};

class Job {
 public:
  /// The present request, with its repetitions.
  struct Step {
    protocols::Request request{};
    bool waiting = false;  ///< the request waits for the line to be idle
    int repeats = 0;       ///< number of tries beyond the first
  };
  /// The latest try of the request in `Step`, and the reply to it. Each call of Start replaces the
  /// attempt.
  struct Attempt {
    Instant began{};
    Instant sent_at{};          ///< see Asked::sent
    bool job_was_sent = false;  ///< was_sent of the job before this try
    protocols::Answer answer{};
    WhoseReply::Verdict verdict{};
    std::optional<Unproven> unproven{};
    Now answered_at{};
    Duration round_trip{};
    /// The reply came after the reply time, because the line waited longer (Patience).
    bool after_reply_time = false;
  };
  /// The job that continues after the end of this job, and its next step. Null: none.
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
  /// Gets the next request from the conversation. `repeats`: see Step.
  virtual NextStep Ask(LineContext& line, int repeats, Instant now);
  /// Called when the line is idle and the request waits. Decides whether the request may be sent.
  ///
  ///   the request                                     what follows
  ///   may not be sent any more (WhyNotSend)           the job closes what it opened, or ends
  ///   could get the reply to an earlier request       a probe goes first
  ///   is a retry, or no late reply can come           it is sent
  ///   is a read, and a late reply may come            it is parked, if replies carry addresses
  ///   is no read, and a late reply may come           the line waits
  ///
  NextStep Depart(LineContext& line, Instant now);
  /// Returns when Depart may decide otherwise, after it returned `hold`.
  std::optional<Instant> DepartsAt(const LineContext& line) const;
  /// Returns the exchange that is given to the line. `idle_since`: since when the line is idle.
  Exchange Start(LineContext& line, Instant idle_since, Instant now);
  /// Called while the line has the request, but is not quiet yet. Returns a step if the request
  /// must not be sent: it is too late, or forbidden now, or it is a routed read and a short write
  /// waits. Empty: the request goes on waiting.
  std::optional<NextStep> Withdraw(LineContext& line, Instant now);
  /// Returns the request to send now. Called when the line has been quiet long enough.
  const protocols::Request& Send(LineContext& line, Now now);
  /// The request has never left this machine, and will not be sent.
  virtual void NeverLeft() { was_sent = attempt.job_was_sent; }

  /// A frame came while the request is on the wire. Stores its meaning in `attempt` and returns its
  /// outcome.
  ///
  ///   the frame                            outcome
  ///   may be the echo of the request       unexpected
  ///   is damaged, or has another form      as the conversation or the carrier decides
  ///   may answer an earlier request        unexpected: the request is repeated
  ///   answers this request                 as the conversation decides; it gets only such frames
  ///
  /// `echo`: whether this bus is known to echo.
  Outcome Judge(LineContext& line, View frame, const EchoWatch& echo, Instant now);
  /// `end`: the end of the exchange as the line reported it.
  EndedExchange Ended(ExchangeEnd end) const;
  NextStep Conclude(LineContext& line, const ExchangeEnd& end, Now now);
  NextStep Take(LineContext& line, Instant now);
  virtual After Finish(LineContext& line, const JobEnd& end, Instant now);
  /// For a probe that cannot be asked, which is no fault of the device: the job behind it goes on
  /// without a proof. A reply that waits for the proof is not taken.
  virtual After GoUnproved(LineContext& /*line*/, const std::string& /*why*/, Instant /*now*/) {
    return {};
  }
  /// Returns the consequences of the end of the job. Moves the requests of routes out of the job,
  /// and changes nothing else.
  EndEffects EffectsOf(const JobEnd& end, Instant now);

  // ---------------- functions that differ by kind

  virtual LineUse use() const { return LineUse::polls; }
  /// True for writes, their read-backs, and short writes of routes.
  virtual bool is_urgent() const { return false; }
  virtual bool writes() const { return false; }
  /// True if the request comes from a client of a route: the conversation does not read the reply.
  virtual bool is_routed() const { return false; }
  virtual bool is_read_back() const { return false; }
  virtual std::optional<config::Group> group() const { return std::nullopt; }
  /// True if the job may be writing now, so that it has to be finished properly.
  virtual bool is_writing() const { return false; }
  /// True if the job reads back points of the member, and no exchange of it has failed yet.
  virtual bool ReadsBack(const Member& /*of*/) const { return false; }
  /// Returns the job itself; for a probe, the job that waits behind it.
  virtual const Job& goal() const { return *this; }
  /// Takes the job that waits behind this probe; null: none.
  virtual std::unique_ptr<Job> TakeGoal() { return nullptr; }
  /// Returns the latest moment at which the request may be sent; empty: no limit.
  virtual std::optional<Instant> LatestStart() const { return std::nullopt; }
  /// Called directly before the request is put on the wire. Empty: it may be sent. `held`: the
  /// request was sent, but has waited for a connection since.
  virtual std::optional<Withheld> WhyNotSend(Instant now, bool held = false) const;
  /// Returns until when requests are repeated, in place of the rule in gateway/bus/jobs/chooser.h.
  virtual std::optional<Instant> RepeatsUntil() const { return std::nullopt; }
  /// True for a routed read if a short write should be sent before it.
  virtual bool LetsPass(const LineContext& /*line*/, Instant /*now*/) const { return false; }
  /// A second, different reply has come, so one of the two belongs to another request. An answer
  /// that waits behind this probe must not count.
  virtual void OnSecondReply() {}
  virtual void PutBack(LineContext& /*line*/) {}
  /// The client has left. `unsent`: the request under way has not left this machine.
  virtual void Abandon(std::uint64_t /*client*/, bool /*unsent*/) {}
  /// Updates the number of the query in `task` after the queries of the device have changed. If the
  /// query is gone, the number is that of no query.
  virtual void FollowPlan() {}

  // ---------------- facts

  /// True if the present request is not the first one, or is repeated: the conversation may have
  /// something to close.
  bool begun() const { return requests > 1 || step.repeats > 0; }
  /// True if no reply to the request is expected.
  bool is_broadcast() const {
    return step.request.expect.reply == protocols::Expectation::Reply::none;
  }
  bool is_probe() const { return task.kind == protocols::Task::Kind::probe; }
  /// True if the answer contains values or events that would be stored for the device.
  bool has_news() const {
    const protocols::Answer& answer = attempt.answer;
    return answer.batch || (task.kind == protocols::Task::Kind::poll && !answer.readings.empty());
  }
  Asked asked() const;

  // Fields for the lifetime of the job.
  Member* member;
  protocols::Task task;             ///< for the conversation
  std::vector<std::size_t> points;  ///< the points of the query of a poll or read-back
  Instant began;
  /// The budget that pays for the job; empty: its member is not offline.
  std::optional<Probes::Kind> probe_budget;
  bool renews_proof_early = false;  ///< see Asked
  bool proved = false;              ///< a probe was answered before this job
  bool unprovable = false;          ///< see Asked
  int requests = 0;                 ///< number of requests of the task, without repetitions
  int broadcasts = 0;               ///< number of broadcasts among these
  int parkings = 0;                 ///< how often the device has answered busy
  bool was_sent = false;
  bool unplanned = false;       ///< the query was gone before its points were read
  bool has_no_request = false;  ///< the conversation had no further request for the job
  bool had_failure = false;     ///< an exchange has failed, so another device may answer since
  bool judges_member = true;    ///< the end shows whether the member answers
  /// The query was never answered, although other queries of the device are.
  bool blames_query = false;
  Duration wire{};  ///< line time of the answered exchanges

  Step step;
  Attempt attempt;

 protected:
  /// Answer and Fail are called by Conclude and return the next step. Fail: there was no answer.
  virtual NextStep Answer(LineContext& line, const ExchangeEnd& end, Now now);
  virtual NextStep Fail(LineContext& line, const ExchangeEnd& end, Instant now);
  /// Adds the consequences of the end of this kind of job to `effects`.
  virtual void End(const JobEnd& /*end*/, Instant /*now*/, EndEffects& /*effects*/) {}

  /// The probe continues the job behind it.
  friend class ProbeJob;

  /// Returns the outcome of the frame for the conversation or the carrier; stores the answer.
  virtual Outcome JudgeForm(LineContext& line, View frame, const EchoWatch& echo);
  /// Reads a reply that certainly answers this request.
  virtual Outcome Read(View frame, Instant now);
  virtual Outcome Refuse(View frame, Outcome outcome);
  /// True if a good reply does not count yet, and the request has to be repeated.
  virtual bool MustRepeat(const LineContext& line, Instant now) const;
  virtual void OnReplaced(LineContext& line, Now now);
  virtual void OnSend(LineContext& /*line*/) {}
  /// Stores the latest answer about the points that the job writes.
  virtual void NoteTold(const JobEnd& /*told*/, bool /*may_have_acted*/) {}
  virtual void OnGaveUp(const ExchangeEnd& /*end*/) {}
  /// Called if the request is not sent, and what is open is closed now.
  virtual void OnWithheld(const Withheld& /*why*/) {}
  /// Called when no tries are left. Returns the next step.
  virtual NextStep GiveUp(LineContext& line, const ExchangeEnd& end, Instant now);
  /// Continues the job after the probe before it, or without it if no probe can be asked: asks the
  /// conversation for a request again.
  virtual NextStep GoOn();

  /// Applies the effects of the end, field by field. Decides nothing.
  void Apply(LineContext& line, EndEffects& effects, const JobEnd& end, Instant now);
  NextStep Repeat();
  /// Returns whether the failed request may be sent again now. `more`: repetitions beyond the usual
  /// number, because other replies may come before the reply to this request.
  bool MayRepeat(const LineContext& line, int more, Instant now) const;

 private:
  NextStep BreakOff(const Withheld& withheld, Instant now);
  bool WaitsBesideLine(const LineContext& line) const;
  Outcome LeaveUnproven(View frame, Outcome outcome);
  bool GoesOnBehindBroadcast(Instant now);
  bool ParksBusy(const LineContext& line, Outcome outcome) const;
  void TakeOver(LineContext& line, Device& device, protocols::Answer answer, Instant now);
};

// Source of the jobs of one kind. Each kind implements it beside its job;
// gateway/bus/jobs/chooser.cpp lists all sources.
class JobSource {
 public:
  virtual ~JobSource() = default;
  /// Called when the line is idle. Null: no job of this kind may be sent now.
  virtual std::unique_ptr<Job> Take(const Idle& idle) = 0;
  /// Returns when Take may have a job even if nothing else happens. The time may be in the past.
  virtual std::optional<Instant> NextAt(const Idle& idle) const = 0;
};

}  // namespace baudgate::bus
