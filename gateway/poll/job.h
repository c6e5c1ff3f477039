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

struct Job {
  struct Poll {
    config::Group group = config::Group::fast;
    bool last_of_round = false;
  };
  struct Events {};      ///< what has happened in the device
  struct Background {};  ///< what can wait
  struct Probe {};
  struct ReadBack {};  ///< of a query whose points were written, or are in doubt
  struct Write {
    WriteCommand command;
    std::size_t first = 0;          ///< index in command.writes of the first that is under way
    std::size_t next = 0;           ///< and of the first that has not been begun
    std::optional<Outcome> told{};  ///< the latest answer to one that is not a mere closing
    bool may_have_acted = false;    ///< as Answer says of the refusal of those

    /// A request that may have written those under way.
    bool sent() const { return command.state == WriteState::sent; }
  };
  struct Routed {
    RouteQueue::Batch batch;          ///< whom the reply goes to; they may leave meanwhile
    bool every_slave_answers = true;  ///< if only with an exception: silence tells of the slave
    Bytes reply;
    bool is_read = false;
    bool odd = false;  ///< the slave has answered, but not in a form that fits its request
    LostReplies::Older older{};  ///< what else its latest reply may answer
    std::size_t replies = 0;     ///< to this request
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
  /// What is done in the end: the postponed job, where this is the probe before it.
  const Job& goal() const { return postponed ? *postponed : *this; }
  /// Something of it has been sent.
  bool begun() const { return steps > 1 || attempts > 0; }
  bool is_probe() const { return task.kind == Task::Kind::probe; }
  /// Its answer tells what would be filed under the device's name.
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
  std::optional<Probes::Kind> looks;  ///< its member is offline: which budget has allowed it
  bool mute = false;                  ///< its end says nothing about the member
  bool renews = false;                ///< see Asked
  bool proved = false;                ///< a probe went before it

  Request request;
  bool sending = false;      ///< the request waits for the line to be idle
  int attempts = 0;          ///< of the present request, beyond the first
  bool unheard = false;      ///< nothing came to what it reads, and never has; others are answered
  bool missed = false;       ///< a request of it had no answer: who answers since may be another
  int steps = 0;             ///< requests of the task, without repetitions
  int broadcasts = 0;        ///< those of them that nobody answers
  int parkings = 0;          ///< how often its device has asked to wait with it
  bool out = false;          ///< a request of it has been sent
  Instant exchange_began{};  ///< the line was given its present request
  Instant sent_at{};         ///< see Asked
  std::optional<ExchangeEnd> end;  ///< of the present request
  Answer answer;                   ///< to it
  WhoseReply::Verdict verdict;     ///< on that
  Now answered{};                  ///< when that came
  Duration round_trip{};           ///< of it
  bool doubted = false;            ///< its reply was not taken: it may answer an earlier request
  std::string said{};              ///< what the device refuses in that reply, and why
  bool took_patience = false;      ///< it came behind the reply time, waited for in patience
  Duration wire{};                 ///< line time of its answered exchanges

  std::unique_ptr<Job> postponed;  ///< goes on when this probe has shown that replies are in order
};

/// False: its device has fewer queries since it began. Example: a poll of query 7 waits behind a
/// probe, and what the probe is answered leaves 5 queries.
bool IsPlanned(const Task& task, const Conversation& conversation);
/// Writes, the reads behind them, and short writes of routes.
bool IsUrgent(const Job& job);
/// What the line's time goes to with it.
LineUse UseOf(const Job& job);
/// When its request may still be sent, if there is a limit to that.
std::optional<Instant> LatestStart(const Job& job);
/// Why its request must not be sent; null: it may.
const char* WhyNotSend(const Job& job, Instant now);

}  // namespace baudgate
