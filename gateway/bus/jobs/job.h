// What a line does at present: one task of one device, or one routed request, from its first
// request to its end. Each kind of job is a class (poll.h with events, read_back.h, background.h,
// probe.h, write.h, routed.h); gateway/bus/jobs/chooser.cpp has the list.
// JobRunner (gateway/bus/poller/job_runner.h) calls the functions of a job in this order:
//
//   Begin      the job was chosen                what it asks first
//   Ask        a request is wanted               from the conversation of its device
//   Depart     the line is idle                  sent, held, parked, or behind a probe
//   Start      the line is given the exchange    its times
//   Withdraw   the line is not quiet yet         the request is too late, or forbidden by now
//   Send       the line was quiet                the bytes
//   Judge      a whole frame has come            what it means, and whose reply it is
//   Ended      the exchange is over              the exchange as one value
//   Conclude   all others know of the end        Answer or Fail: the next request, a repetition, or
//                                                the end
//   Take       an answer that waited counts      the same
//   Finish     the job is over                   what follows (End), applied
//
// Each returns what happens next as a value (NextStep, EndEffects), which JobRunner and Apply
// carry out. The table of all states of a job is in job.cpp.
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

/// Why a request is not sent, and how a write ends by that.
struct Withheld {
  WriteEnd end = WriteEnd::not_sent;
  std::string why;
};

/// How a job or one of its requests has ended, also in words.
struct JobEnd {
  Outcome outcome = Outcome::none;
  std::string reason{};
};

// The next step of a job. Carried out by gateway/bus/poller/job_runner.cpp alone.
struct NextStep {
  enum class What : std::uint8_t {
    wait,           ///< its request is ready and waits for the line
    send,           ///< that request goes out now
    hold,           ///< the line waits with it, until no late reply can come
    ask,            ///< the next request of its task, or the same step anew
    probe_first,    ///< a probe of its device goes first
    go_unproved,    ///< the probe cannot be asked; the job behind it goes on. `end.reason`: why not
    take_answer,    ///< its answer counts
    park,           ///< it waits beside the line, until `until`
    back_in_queue,  ///< the requests of its clients wait again
    finish,         ///< it ends, as `end` says
  };

  static NextStep Wait() { return {}; }
  static NextStep Send() { return {.what = What::send}; }
  static NextStep Hold() { return {.what = What::hold}; }
  /// `repeats`: see Job::Step.
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

// EndEffects holds the consequences of the end of a job. The End of each kind decides them;
// Job::Apply carries them out in the order of the fields, and WriteJob::Finish those in `write`.
// After `background` Job::Apply plans the next read in the background and tells the probes.
//
//   kind         its end leads to
//   poll         line time of the fast round; the count of its query; a seldom group that was not
//                read is read again
//   read-back    a seldom group as above; not answered: its points are in doubt; its query gone:
//                they are read by the queries of the new plan
//   events       nothing of its own
//   background   how long its exchange took, or that it was lost or not sent
//   probe        nothing of its own; before a job: what that job does now
//   write        its points are in doubt until they are read; it is confirmed, goes on, or is
//                answered. Not answered: polls go before the next write
//   routed       its clients are answered. An unanswered write: as above
//
// For all kinds the end says whether the member is there, unless the job does not judge it.
struct EndEffects {
  struct Background {
    bool sent = false;
    Duration took{};  ///< line time with its proof; zero: it was not answered
    bool proved = false;
  };
  struct Poll {
    std::size_t query = 0;
    bool answered = false;
  };
  /// The group is to be polled again, because a part of it was not read.
  struct Repeat {
    config::Group group{};
    bool soon = false;  ///< Schedule::RepeatSoon; the rule is in gateway/bus/jobs/poll.h
  };
  /// The consequences for the points of a command that were under way.
  struct Write {
    enum class Next : std::uint8_t {
      answer,   ///< its client, with `result`
      confirm,  ///< the device has confirmed it; its client is answered after the read-back
      go_on,    ///< with the points that remain
    };
    std::vector<std::size_t> unknown;   ///< points whose values are unknown until they are read
    std::vector<PointWrite> confirmed;  ///< a reading that agrees with one of these counts
    Next next = Next::answer;
    WriteResult result{};
  };

  std::optional<Background> background;
  std::optional<FastRounds::Poll> fast_poll;
  std::optional<Poll> poll;
  std::optional<Repeat> repeat;
  std::vector<std::size_t> read_again;  ///< points of a read-back whose query was gone
  std::vector<std::size_t> doubt;       ///< these points are uncertain
  bool polls_first = false;             ///< go before the next write to the device
  bool judges_member = true;            ///< the end says whether the member answers
  bool wrote = false;                   ///< its request may have changed the device
  std::span<const PointWrite> written;  ///< by that, if these were points
  std::vector<std::pair<RoutedRequest, RoutedReply>> replies;
  std::optional<Write> write;
};

class Job {
 public:
  /// The present request. Lives as long as this is asked and repeated.
  struct Step {
    protocols::Request request{};
    bool waiting = false;  ///< for the line to be idle
    int repeats = 0;       ///< tries beyond the first
  };
  /// The latest try of the request in Step, and the reply to the try. Each call of Start replaces
  /// the attempt.
  struct Attempt {
    Instant began{};
    Instant sent_at{};                   ///< see Asked
    bool job_was_sent = false;           ///< was_sent of the job, before this try
    protocols::Answer answer{};          ///< what the reply says
    WhoseReply::Verdict verdict{};       ///< whose it is
    std::optional<Unproven> unproven{};  ///< about that
    Now answered_at{};
    Duration round_trip{};
    /// It came after the reply time, while the line waited in patience.
    bool after_reply_time = false;
  };
  /// The job that is under way behind the end of this one, and its next step. Null: none.
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

  /// It was chosen: its first step.
  virtual NextStep Begin() { return NextStep::Ask(); }
  /// Gets the next request from the conversation. `repeats`: see Step.
  virtual NextStep Ask(LineContext& line, int repeats, Instant now);
  /// The line is idle and its request waits: decides whether the request may go out.
  ///
  ///   the request                                       next
  ///   may not be sent any more (WhyNotSend)             what is open is closed; else the job ends
  ///   could be met by a reply to an earlier one         a probe goes first
  ///   is a retry, or nothing is owed                    it is sent
  ///   of a read, a late reply of its device is due      the job is parked, where replies carry an
  ///                                                     address
  ///   of anything else, a late reply is due             the line waits
  ///
  NextStep Depart(LineContext& line, Instant now);
  /// When Depart may say something else, where it has said hold.
  std::optional<Instant> DepartsAt(const LineContext& line) const;
  /// The line is given the exchange. `idle_since`: since when the line is idle.
  Exchange Start(LineContext& line, Instant idle_since, Instant now);
  /// The line has the request, and is not quiet yet. Empty: the request waits on. A read lets a
  /// short write pass, and a request that has become too late, or is forbidden by now, is not sent.
  std::optional<NextStep> Withdraw(LineContext& line, Instant now);
  /// Returns the request to send now. Called when the line has been quiet long enough.
  const protocols::Request& Send(LineContext& line, Now now);
  /// That request has never left this machine, and never will.
  virtual void NeverLeft() { was_sent = attempt.job_was_sent; }

  /// A frame came while its request is out. Decides what the frame means, and puts that into the
  /// attempt.
  ///
  ///   a frame comes                        outcome
  ///   it may be the echo of the request    unexpected
  ///   damaged, or of another form          as the conversation or the carrier says
  ///   it may answer an earlier request     unexpected: asked again until that is certain
  ///   its own                              as the conversation says, which sees only such replies
  ///
  /// `echo`: whether this bus is known to echo.
  Outcome Judge(LineContext& line, View frame, const EchoWatch& echo, Instant now);
  /// The value of its exchange, which has ended as `end` says.
  EndedExchange Ended(ExchangeEnd end) const;
  /// The exchange is over, and was counted: Answer or Fail decides.
  NextStep Conclude(LineContext& line, const ExchangeEnd& end, Now now);
  /// Its answer counts.
  NextStep Take(LineContext& line, Instant now);
  /// The job is over. Applies what End says.
  virtual After Finish(LineContext& line, const JobEnd& end, Instant now);
  /// This probe cannot be asked, which says nothing of the device: the job behind it goes on
  /// without a proof. A reply whose owner is not proven yet is not taken.
  virtual After GoUnproved(LineContext& /*line*/, const std::string& /*why*/, Instant /*now*/) {
    return {};
  }
  /// Returns the consequences of the end of the job. Moves the requests of routes out of the job,
  /// and changes nothing else in the job.
  EndEffects EffectsOf(const JobEnd& end, Instant now);

  // ---------------- what differs by kind

  virtual LineUse use() const { return LineUse::polls; }
  /// Writes, their read-backs, and short writes of routes.
  virtual bool is_urgent() const { return false; }
  /// It writes points.
  virtual bool writes() const { return false; }
  /// Its request is a client's: the conversation does not read the reply.
  virtual bool is_routed() const { return false; }
  virtual bool is_read_back() const { return false; }
  /// The group that it polls.
  virtual std::optional<config::Group> group() const { return std::nullopt; }
  /// It may be writing now: what it has begun has to end in peace.
  virtual bool is_writing() const { return false; }
  /// It reads back points of the member, and nothing of that has failed yet.
  virtual bool ReadsBack(const Member& /*of*/) const { return false; }
  /// The job itself, or the job that waits behind this probe.
  virtual const Job& goal() const { return *this; }
  /// Taken out of this probe; null: none waits.
  virtual std::unique_ptr<Job> TakeGoal() { return nullptr; }
  /// The latest moment at which its request may be sent, if there is one.
  virtual std::optional<Instant> LatestStart() const { return std::nullopt; }
  /// Asked right before its request is put on the wire. Empty: it may be. `held`: the poller has
  /// sent the request, which has waited for a connection since.
  virtual std::optional<Withheld> WhyNotSend(Instant now, bool held = false) const;
  /// Until when its requests are repeated, in place of the rule of gateway/bus/jobs/chooser.h.
  virtual std::optional<Instant> RepeatsUntil() const { return std::nullopt; }
  /// A routed read lets short writes pass.
  virtual bool LetsPass(const LineContext& /*line*/, Instant /*now*/) const { return false; }
  /// A second, different reply has come: one of the two belongs to another request. So the answer
  /// that waits behind this probe does not count.
  virtual void OnSecondReply() {}
  /// The requests of its clients wait again.
  virtual void PutBack(LineContext& /*line*/) {}
  /// The client has left. `unsent`: the request under way has not left this machine.
  virtual void Abandon(std::uint64_t /*client*/, bool /*unsent*/) {}
  /// While it waits, or is on the wire, its device may be planned again. Then its query has another
  /// number, or is gone: its task names none of the present ones.
  virtual void FollowPlan() {}

  // ---------------- facts

  /// Its present request is not its first one, or is repeated: the conversation may have something
  /// to close.
  bool begun() const { return requests > 1 || step.repeats > 0; }
  /// No reply is due to its request.
  bool is_broadcast() const {
    return step.request.expect.reply == protocols::Expectation::Reply::none;
  }
  bool is_probe() const { return task.kind == protocols::Task::Kind::probe; }
  /// Its answer has values or events that would be stored for the device.
  bool has_news() const {
    const protocols::Answer& answer = attempt.answer;
    return answer.batch || (task.kind == protocols::Task::Kind::poll && !answer.readings.empty());
  }
  Asked asked() const;

  // These live as long as the job.
  Member* member;
  protocols::Task task;             ///< for the conversation
  std::vector<std::size_t> points;  ///< polls and read-backs: those of its query
  Instant began;
  std::optional<Probes::Kind> probe_budget;  ///< pays for it; empty: its member is not offline
  bool renews_proof_early = false;           ///< see Asked
  bool proved = false;                       ///< a probe went before it
  bool unprovable = false;                   ///< see Asked
  int requests = 0;                          ///< of the task, without repetitions
  int broadcasts = 0;                        ///< of these, broadcasts
  int parkings = 0;                          ///< how often its device has said busy
  bool was_sent = false;                     ///< a request of it
  bool unplanned = false;                    ///< its query was gone before its points were read
  bool has_no_request = false;               ///< its conversation had none for it any more
  bool had_failure = false;   ///< an exchange has failed: another device may answer since
  bool judges_member = true;  ///< its end says whether the member answers
  bool blames_query = false;  ///< its query was never answered, although others of the device are
  Duration wire{};            ///< line time of its answered exchanges

  Step step;
  Attempt attempt;

 protected:
  /// The exchange was answered: what follows.
  virtual NextStep Answer(LineContext& line, const ExchangeEnd& end, Now now);
  /// The exchange was not answered: what follows.
  virtual NextStep Fail(LineContext& line, const ExchangeEnd& end, Instant now);
  /// Adds to `effects` what the end of this kind of job leads to.
  virtual void End(const JobEnd& /*end*/, Instant /*now*/, EndEffects& /*effects*/) {}

  /// The probe goes on with the job behind it.
  friend class ProbeJob;

  /// The outcome that a frame has for the conversation or the carrier, and its answer.
  virtual Outcome JudgeForm(LineContext& line, View frame, const EchoWatch& echo);
  /// A reply whose owner is known.
  virtual Outcome Read(View frame, Instant now);
  virtual Outcome Refuse(View frame, Outcome outcome);
  /// A good reply does not count yet, and its request is repeated.
  virtual bool MustRepeat(const LineContext& line, Instant now) const;
  /// Another device answers in place of its member.
  virtual void OnReplaced(LineContext& line, Now now);
  /// Its request goes out.
  virtual void OnSend(LineContext& /*line*/) {}
  /// The latest word about what it writes.
  virtual void NoteTold(const JobEnd& /*told*/, bool /*may_have_acted*/) {}
  virtual void OnGaveUp(const ExchangeEnd& /*end*/) {}
  /// A request is not sent, and what is open is closed now.
  virtual void OnWithheld(const Withheld& /*why*/) {}
  /// No tries are left.
  virtual NextStep GiveUp(LineContext& line, const ExchangeEnd& end, Instant now);
  /// Continues the job after the probe that went first, or where no probe can be asked: asks the
  /// conversation for a request again.
  virtual NextStep GoOn();

  /// Applies the effects of its end, field by field; decides nothing.
  void Apply(LineContext& line, EndEffects& effects, const JobEnd& end, Instant now);
  /// The same request once more.
  NextStep Repeat();
  /// Whether its failed request may be sent again now. `more`: repetitions beyond the usual number,
  /// because other replies may come before its own.
  bool MayRepeat(const LineContext& line, int more, Instant now) const;

 private:
  NextStep BreakOff(const Withheld& withheld, Instant now);
  bool WaitsBesideLine(const LineContext& line) const;
  Outcome LeaveUnproven(View frame, Outcome outcome);
  bool GoesOnBehindBroadcast(Instant now);
  bool ParksBusy(const LineContext& line, Outcome outcome) const;
  void TakeOver(LineContext& line, Device& device, protocols::Answer answer, Instant now);
};

// Where the jobs of one kind come from. Each kind implements this beside its job; the list of all
// is in gateway/bus/jobs/chooser.cpp.
class JobSource {
 public:
  virtual ~JobSource() = default;
  /// The line is idle. Null: nothing of this kind may be sent now.
  virtual std::unique_ptr<Job> Take(const Idle& idle) = 0;
  /// When Take may have something even if nothing else happens. May lie in the past.
  virtual std::optional<Instant> NextAt(const Idle& idle) const = 0;
};

}  // namespace baudgate::bus
