// What a line does at present: one task of one device, or one routed request, from its first
// request to its end. Made by gateway/poll/chooser.cpp, carried out by gateway/poll/job_run.cpp.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <variant>

#include "gateway/base/time.h"
#include "gateway/line/line.h"
#include "gateway/poll/late_answers.h"
#include "gateway/poll/probes.h"
#include "gateway/poll/roster.h"
#include "gateway/poll/whose_reply.h"
#include "gateway/requests/route_queue.h"
#include "gateway/requests/write_command.h"
#include "gateway/store/line_use.h"
#include "protocols/conversation.h"

namespace baudgate {

/// Why a request is not sent, and how a write ends by that.
struct Withheld {
  WriteEnd end = WriteEnd::not_sent;
  std::string why;
};

struct Job {
  struct Poll {
    config::Group group = config::Group::fast;
    bool last_of_round = false;
  };
  struct Events {};      ///< the events of the device
  struct Background {};  ///< a low-priority read
  struct Probe {};
  struct ReadBack {};  ///< of a query whose points were written, or are in doubt
  struct Write {
    WriteCommand command;
    std::size_t first = 0;          ///< index in command.writes() of the first point under way
    std::size_t next = 0;           ///< index of the first point that was not begun
    std::optional<Outcome> told{};  ///< the latest answer to a request that does not only close
    bool may_have_acted = false;    ///< see Answer
    bool was_sent = false;          ///< sent(), before the present request
    std::optional<Withheld> withheld{};  ///< a request was not sent; what is open is closed now

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

  Job(Member& who, std::variant<Poll, Events, Background, Probe, ReadBack, Write, Routed> kind,
      Task what, Instant now)
      : member(&who), kind(std::move(kind)), task(std::move(what)), began(now) {}

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
  /// Something of it has been sent.
  bool begun() const { return steps > 1 || attempts > 0; }
  bool is_probe() const { return task.kind == Task::Kind::probe; }
  /// Its answer has values or events that would be stored for the device.
  bool has_news() const {
    return answer.batch || (task.kind == Task::Kind::poll && !answer.readings.empty());
  }

  Asked asked() const {
    return {.member = member,
            .request = &request,
            .sent = sent_at,
            .first = steps == 1 + broadcasts && attempts == 0 && !is_probe(),
            .retry = attempts > 0,
            .probe = is_probe(),
            .lone_probe = is_probe() && !postponed,
            .renews = renews};
  }

  Member* member;
  std::variant<Poll, Events, Background, Probe, ReadBack, Write, Routed> kind;
  Task task;  ///< for the conversation
  Instant began;
  std::optional<Probes::Kind> looks;  ///< the probe budget that pays for it; empty: its member is
                                      ///< not offline
  bool mute = false;                  ///< its end says nothing about the member
  bool renews = false;                ///< see Asked
  bool proved = false;                ///< a probe went before it

  Request request;
  bool sending = false;      ///< the request waits for the line to be idle
  int attempts = 0;          ///< of the present request, beyond the first
  bool unheard = false;      ///< its query was never answered, although others of the device are
  bool missed = false;       ///< a request of it had no answer: another device may answer since
  int steps = 0;             ///< requests of the task, without repetitions
  int broadcasts = 0;        ///< of these, broadcasts
  int parkings = 0;          ///< how often its device has said busy
  bool out = false;          ///< a request of it has been sent
  bool was_out = false;      ///< a request before the present one has been sent
  Instant exchange_began{};  ///< when the line was given its present request
  Instant sent_at{};         ///< see Asked
  std::optional<ExchangeEnd> end;  ///< of the present request
  Answer answer;                   ///< what the reply to the present request says
  WhoseReply::Verdict verdict;     ///< whose that reply is
  Now answered{};                  ///< when that reply came
  Duration round_trip{};           ///< of that reply
  bool doubted = false;            ///< its reply was not taken: it may answer an earlier request
  std::string said{};              ///< the refusal in that reply, in words
  Outcome says = Outcome::none;    ///< the refusal in that reply, as an outcome
  bool took_patience =
      false;        ///< the reply came after the reply time, while the line waited in patience
  Duration wire{};  ///< line time of its answered exchanges

  std::unique_ptr<Job> postponed;  ///< goes on when this probe has shown that replies are in order
};

/// False: its query no longer exists. Example: a poll of query 7 waits for a probe, and after the
/// reply to the probe the device has 5 queries.
bool IsPlanned(const Task& task, const Conversation& conversation);
/// Writes, their read-backs, and short writes of routes.
bool IsUrgent(const Job& job);
/// The kind of use that the time of the line counts as.
LineUse UseOf(const Job& job);
/// The latest moment at which its request may be sent, if there is one.
std::optional<Instant> LatestStart(const Job& job);
/// Asked right before its request is put on the wire. Empty: it may be.
std::optional<Withheld> WhyNotSend(const Job& job, Instant now);

}  // namespace baudgate
