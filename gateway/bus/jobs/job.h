// What a line does at present: one task of one device, or one routed request, from its first
// request to its end. Made by gateway/bus/jobs/chooser.cpp, carried out by
// gateway/bus/jobs/job_run.cpp, which makes the probe that has to go before a job. NextStep says
// how a job goes on. The functions are in job_run.cpp.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/bus/exchange/line.h"
#include "gateway/bus/points/line_status.h"
#include "gateway/bus/replies/late_replies.h"
#include "gateway/bus/replies/whose_reply.h"
#include "gateway/bus/schedule/probes.h"
#include "gateway/bus/writes/route_queue.h"
#include "gateway/bus/writes/write_command.h"
#include "protocols/conversation.h"

namespace baudgate::bus {

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

struct Job {
  struct Poll {
    config::Group group = config::Group::fast;
    bool last_of_round = false;
  };
  struct Events {};      ///< the events of the device
  struct Background {};  ///< a low-priority read
  struct Probe {};
  struct ReadBack {};  ///< of points that were written, or are in doubt
  struct Write {
    WriteCommand command;
    std::size_t first = 0;  ///< index in command.writes() of the first point under way
    std::size_t next = 0;   ///< index of the first point that was not begun
    /// The latest failure or refusal, or answer to a request that may write. Behind it only closing
    /// requests were sent.
    std::optional<JobEnd> told{};
    bool may_have_acted = false;           ///< see Answer
    bool may_have_written_before = false;  ///< sent(), before the latest try
    std::optional<Withheld> withheld{};    ///< a request was not sent; what is open is closed now

    /// Whether a request was sent that may have written the points under way.
    bool sent() const { return command.state == WriteState::sent; }
  };
  struct Routed {
    RouteQueue::Batch batch;          ///< what the reply answers; clients may leave meanwhile
    bool every_slave_answers = true;  ///< if only with an exception; silence tells of the slave
    Bytes reply;
    bool is_read = false;
    bool odd = false;  ///< the slave has answered, but not in a form that fits its request
    LostReplies::Older older{};  ///< which lost requests its latest reply may answer instead
    std::size_t replies = 0;     ///< to this request

    /// Null: all its clients have left.
    const RoutedRequest* first() const { return batch.empty() ? nullptr : &batch.front(); }
  };

  /// The present request. Lives as long as this is asked and repeated.
  struct Step {
    protocols::Request request{};
    bool waiting = false;  ///< for the line to be idle
    int repeats = 0;       ///< tries beyond the first
  };
  /// The reply was not taken: it may answer an earlier request.
  struct Unproven {
    std::string refusal{};               ///< what it refuses, in words; empty: nothing
    Outcome refused_as = Outcome::none;  ///< the same as an outcome
  };
  /// The latest try of that request, and its reply. Lives from JobRun::Start to the next one.
  struct Attempt {
    Instant began{};
    Instant sent_at{};                   ///< see Asked
    bool job_was_sent = false;           ///< was_sent of the job, before this try
    std::optional<ExchangeEnd> end{};    ///< until JobRun::TakeEnd
    protocols::Answer answer{};          ///< what the reply says
    WhoseReply::Verdict verdict{};       ///< whose it is
    std::optional<Unproven> unproven{};  ///< about that
    Now answered_at{};
    Duration round_trip{};
    bool after_reply_time =
        false;  ///< it came after the reply time, while the line waited in patience
  };

  Job(Member& who, std::variant<Poll, Events, Background, Probe, ReadBack, Write, Routed> kind,
      protocols::Task what, Instant now);

  template <typename Kind>
  Kind* As() {
    return std::get_if<Kind>(&kind);
  }
  template <typename Kind>
  const Kind* As() const {
    return std::get_if<Kind>(&kind);
  }
  /// The job itself, or the postponed job if this is the probe before it.
  const Job& goal() const { return postponed ? *postponed : *this; }
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

  Asked asked() const {
    return {.member = member,
            .request = &step.request,
            .sent = attempt.sent_at,
            .first = requests == 1 + broadcasts && step.repeats == 0 && !is_probe(),
            .retry = step.repeats > 0,
            .probe = is_probe(),
            .lone_probe = is_probe() && !postponed,
            .renews_proof_early = renews_proof_early,
            .proved = proved,
            .unprovable = unprovable,
            .writes = As<Write>() != nullptr};
  }

  // These live as long as the job.
  Member* member;
  std::variant<Poll, Events, Background, Probe, ReadBack, Write, Routed> kind;
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
  bool unasked = false;                      ///< its conversation had no request for it any more
  bool had_failure = false;   ///< an exchange has failed: another device may answer since
  bool judges_member = true;  ///< its end says whether the member answers
  bool blames_query = false;  ///< its query was never answered, although others of the device are
  Duration wire{};            ///< line time of its answered exchanges

  Step step;
  Attempt attempt;

  std::unique_ptr<Job> postponed;  ///< goes on when this probe has shown that replies are in order
};

/// While it waits, or is on the wire, its device may be planned again. Then its query has another
/// number, or is gone: its task names none of the present ones.
void FollowPlan(Job& job);
/// False: its query no longer exists. Example: a poll of query 7 waits for a probe, and after the
/// reply to the probe the device has 5 queries.
bool IsPlanned(const protocols::Task& task, const protocols::Conversation& conversation);
/// The points of a write before the next one are written. As many as one exchange carries come
/// next: its task is to write them.
void BeginNextPoints(Job& job);
/// It is a read-back of the member, or the probe before that, and nothing of it has failed yet.
bool ReadsBack(const Job& job, const Member& member);
/// Writes, their read-backs, and short writes of routes.
bool IsUrgent(const Job& job);
/// The kind of use that the time of the line counts as.
LineUse UseOf(const Job& job);
/// The latest moment at which its request may be sent, if there is one.
std::optional<Instant> LatestStart(const Job& job);
/// Asked right before its request is put on the wire. Empty: it may be. `held`: the poller has sent
/// the request, which has waited for a connection since.
std::optional<Withheld> WhyNotSend(const Job& job, Instant now, bool held = false);

// The next step of a job, as a value. Made by the parts of a job in gateway/bus/jobs/job_phases.h:
// JobAsking, JobDeparture, JobAnswer and JobFinish. Carried out by gateway/bus/jobs/job_run.cpp
// alone.
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

}  // namespace baudgate::bus
