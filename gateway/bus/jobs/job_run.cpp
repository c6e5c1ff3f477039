// A job from its first request to its end, as the table below. The decisions of each row are in the
// parts that job_run.h lists; this file carries out the next step that they return.
//
// clang-format off
//   the job               what happens                        next
//   chosen, or parked     it asks, or its request is ready    waiting
//   chosen                the conversation will not ask       ended: unsupported
//   waiting, a poll, a    a late reply of its device is due   parked, where replies name their sender:
//   read-back, events or                                      WaitsBesideLine
//   background
//   waiting, another kind the same, or replies name nobody    the line waits: Turn::wait
//   waiting               line idle, a reply to an earlier    postponed behind a probe of its device
//                         request could pass for its own
//   waiting               line idle, nothing owed any more    under way (quiet, sending, receiving)
//   waiting, quiet        its deadline came, its client left, broken off: what it has begun is closed,
//                         its device was disabled, or an      then ended: not_sent or denied; unknown
//                         interlock holds no more             if it may have written
//   quiet, a routed read  a short write came                  back in its queue
//   under way             a good reply, a step remains        waiting, for the next request
//   under way             a good reply, nothing remains       ended: its outcome
//   under way             a good reply with events or         postponed behind a probe of its device,
//                         readings, to a repetition or        if that has a name: OnAnswered
//                         after a miss
//   under way             a broadcast out, a step remains     waiting, for the next request
//   under way, a poll or  busy                                parked, as often as there are retries,
//   a read-back                                               unless one like it is: ParkedJobs
//   under way, a read     a good reply that may answer a      waiting, to be repeated, also a routed
//                         much older request                  one
//   under way, a probe    a good reply that may answer the    waiting, to be repeated, before it goes
//                         probe of an earlier task            on with what is postponed
//   under way, no route   silence, damage, another's reply    waiting, to be repeated: Chooser::MayRepeat
//   under way, a routed   damage                              back in its queue, as often as there are
//   read                                                      retries
//   under way, routed     silence, damage, another's reply    ended: its client judges
//   under way, no route   the same, no retry left             a step that closes what is open, or ended
//   under way             the port is lost                    ended: line_down
//   postponed             its probe cannot be asked           waiting, without a proof; ended as busy if
//                                                             its reply is here and waits for that
//   postponed             its probe was answered in order     waiting
//   postponed             it was not                          ended: as the probe, or not sent if that
//                                                             was refused
//   a write, ended ok     points of its command remain        chosen, with the next point
//   a write, ended ok     none remains                        confirmed: answered after the read-back
// clang-format on
//
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/job_run.h"

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "gateway/base/time.h"

namespace baudgate::bus {

// ---------------------------------------------------------------- the job (job.h)

Job::Job(Member& who, std::variant<Poll, Events, Background, Probe, ReadBack, Write, Routed> kind,
         protocols::Task what, Instant now)
    : member(&who), kind(std::move(kind)), task(std::move(what)), began(now) {
  if (As<Poll>() == nullptr && As<ReadBack>() == nullptr) return;
  const auto queries = member->device->conversation->Queries();
  if (task.query < queries.size()) points = queries[task.query].points;
}

void FollowPlan(Job& job) {
  if (job.As<Job::Poll>() == nullptr && job.As<Job::ReadBack>() == nullptr) return;
  const auto queries = job.member->device->conversation->Queries();
  const auto is_its = [&job](const protocols::Query& query) { return query.points == job.points; };
  if (job.task.query < queries.size() && is_its(queries[job.task.query])) return;
  const auto found = std::ranges::find_if(queries, is_its);
  const bool is_one = std::ranges::count_if(queries, is_its) == 1;
  job.task.query = is_one ? static_cast<std::size_t>(found - queries.begin()) : queries.size();
}

bool IsPlanned(const protocols::Task& task, const protocols::Conversation& conversation) {
  if (task.kind == protocols::Task::Kind::events) return conversation.HasEvents();
  if (task.kind == protocols::Task::Kind::background)
    return conversation.BackgroundDue().has_value();
  return task.kind != protocols::Task::Kind::poll || task.query < conversation.Queries().size();
}

void BeginNextPoints(Job& job) {
  Job::Write& write = *job.As<Job::Write>();
  std::vector<protocols::PointValue> rest;
  for (std::size_t i = write.next; i < write.command.writes().size(); ++i) {
    rest.push_back({write.command.writes()[i].point, write.command.writes()[i].raw});
  }
  protocols::Conversation& conversation = *job.member->device->conversation;
  rest.resize(std::clamp<std::size_t>(conversation.WritesTogether(rest), 1, rest.size()));
  write.first = std::exchange(write.next, write.next + rest.size());
  write.told.reset();
  write.may_have_acted = false;
  job.task.kind = protocols::Task::Kind::write;
  job.task.point = rest.front().point;
  job.task.value = rest.front().value;
  job.task.also.assign(rest.begin() + 1, rest.end());
}

bool ReadsBack(const Job& job, const Member& member) {
  const Job& goal = job.goal();
  return job.member == &member && goal.As<Job::ReadBack>() != nullptr && !goal.had_failure &&
         !job.had_failure;
}

LineUse UseOf(const Job& job) {
  if (job.As<Job::Routed>() != nullptr) return LineUse::routes;
  if (job.is_probe()) return LineUse::probes;
  const bool writes = job.As<Job::Write>() != nullptr || job.As<Job::ReadBack>() != nullptr;
  return writes ? LineUse::writes : LineUse::polls;
}

bool IsUrgent(const Job& job) {
  if (job.As<Job::Write>() != nullptr || job.As<Job::ReadBack>() != nullptr) return true;
  const auto* routed = job.As<Job::Routed>();
  const RoutedRequest* const first = routed != nullptr ? routed->first() : nullptr;
  return first != nullptr && RouteQueue::IsShortWrite(*first);
}

std::optional<Instant> LatestStart(const Job& job) {
  if (job.step.request.closes) return std::nullopt;
  if (const auto* write = job.As<Job::Write>()) return write->command.deadline;
  const auto* routed = job.As<Job::Routed>();
  if (routed == nullptr) return std::nullopt;
  if (routed->batch.empty()) return Instant{};  // nobody waits any more
  return std::ranges::max(routed->batch, {}, &RoutedRequest::deadline).deadline;
}

std::optional<Withheld> WhyNotSend(const Job& job, Instant now, bool held) {
  constexpr auto kNotSent = WriteEnd::not_sent;
  if (job.step.request.closes) return std::nullopt;
  if (job.As<Job::Routed>() == nullptr && !job.member->in_use) {
    return Withheld{kNotSent, "the device is disabled"};
  }
  const auto* write = job.As<Job::Write>();
  const bool untouched = write != nullptr && write->first == 0 &&
                         !(held ? write->may_have_written_before : write->sent());
  if (untouched && write->command.client_left()) return Withheld{kNotSent, kClientLeft};
  const auto latest = LatestStart(job);
  if (latest && *latest <= now) return Withheld{kNotSent, kTooLate};
  if (write == nullptr || !write->command.why_not) return std::nullopt;
  auto forbidden = write->command.why_not(now);
  if (!forbidden) return std::nullopt;
  return Withheld{WriteEnd::denied, std::move(*forbidden)};
}

// ---------------------------------------------------------------- JobRun

void JobRun::OnClosed(const std::string& reason) {
  if (job_) Do(NextStep::Finish(Outcome::line_down, reason));
}

void JobRun::Abandon(std::uint64_t client, bool unsent) {
  for (Job* job = job_.get(); job != nullptr; job = job->postponed.get()) {
    auto* routed = job->As<Job::Routed>();
    if (routed == nullptr) continue;
    const bool out = unsent && job == job_.get() ? job->attempt.job_was_sent : job->was_sent;
    std::erase_if(routed->batch, [client, out](const RoutedRequest& request) {
      if (request.client == client) request.done(Abandoned(out));
      return request.client == client;
    });
  }
}

// ---------------------------------------------------------------- the steps

/// One step after the other, until the job waits or is over.
void JobRun::Do(NextStep step) {
  using What = NextStep::What;
  while (true) {
    switch (step.what) {
      case What::wait:
      case What::send:
      case What::hold:
        return;
      case What::ask:
        step = phases_.asking.Ask(*job_, step.repeats, now_.instant);
        break;
      case What::probe_first:
        step = AskProbe();
        break;
      case What::go_unproved:
        step = Continue(phases_.finish.GoUnproved(std::move(job_), step.end.reason, now_.instant));
        break;
      case What::take_answer:
        step = phases_.answer.Take(*job_, now_.instant);
        break;
      case What::park:
        return phases_.departure.Park(std::move(job_), step.until);
      case What::back_in_queue:
        phases_.departure.PutBack(*job_);
        job_.reset();
        return;
      case What::finish:
        step = Continue(phases_.finish.Finish(std::move(job_), step.end, now_.instant));
        break;
    }
  }
}

NextStep JobRun::AskProbe() {
  auto probe =
      std::make_unique<Job>(*job_->member, Job::Probe{},
                            protocols::Task{.kind = protocols::Task::Kind::probe}, now_.instant);
  probe->postponed = std::move(job_);
  job_ = std::move(probe);
  return NextStep::Ask();
}

NextStep JobRun::Continue(JobFinish::After after) {
  job_ = std::move(after.job);
  return std::move(after.next);
}

void JobRun::Begin(std::unique_ptr<Job> job) {
  job_ = std::move(job);
  if (job_->As<Job::Write>() != nullptr) BeginNextPoints(*job_);
  if (job_->As<Job::Routed>() == nullptr) Do(NextStep::Ask());
}

JobRun::Turn JobRun::TakeTurn() {
  if (job_->postponed && WhyNotSend(*job_->postponed, now_.instant)) {
    std::unique_ptr<Job> postponed = std::move(job_->postponed);
    job_ = std::move(postponed);
  }
  NextStep step = phases_.departure.Decide(*job_, now_.instant);
  if (step.what == NextStep::What::send) return Turn::send;
  if (step.what == NextStep::What::hold) return Turn::wait;
  Do(std::move(step));
  return Turn::next;
}

bool JobRun::Withdraw() {
  if (!job_ || job_->attempt.end) return false;
  std::optional<NextStep> step = phases_.departure.Withdraw(*job_, now_.instant);
  if (step) Do(std::move(*step));
  return step.has_value();
}

// ---------------------------------------------------------------- its exchange

void JobRun::KeepEnd(ExchangeEnd end) {
  last_ = job_->member;
  phases_.sending.NoteEnd(*job_, end.outcome, now_.instant);
  job_->attempt.end = std::move(end);
}

std::optional<ExchangeEnd> JobRun::TakeEnd() {
  return job_ ? std::exchange(job_->attempt.end, std::nullopt) : std::nullopt;
}

void JobRun::FollowUp(ExchangeEnd end, const Finding& finding) {
  Do(phases_.answer.Conclude(*job_, std::move(end), finding, now_));
}

void TurnTaker::OnTime(Now now, Duration passed, bool idle) {
  chooser_.OnTime(passed, idle ? nullptr : run_.member());
  run_.SetTime(now);
}

bool TurnTaker::Take(const Idle& idle) {
  const Member* last = nullptr;
  while (CountTurn(last, idle.now)) {
    if (run_.job() == nullptr) {
      if (hold_.holds()) return false;
      ChargeProbe(idle.now);  // of one that was not sent
      std::unique_ptr<Job> job = chooser_.Next(idle);
      if (!job) return false;
      last = job->member;
      run_.Begin(std::move(job));
      continue;
    }
    switch (run_.TakeTurn()) {
      case JobRun::Turn::send:
        return true;
      case JobRun::Turn::next:
        break;
      case JobRun::Turn::wait:
        return false;
    }
  }
  return false;
}

/// Counts one more turn. False: there were too many at this moment. `last`: the member of the
/// latest job.
bool TurnTaker::CountTurn(const Member* last, Instant now) {
  const TurnLimit::Turn turn = limit_.Take(now);
  const Member* const member = run_.job() != nullptr ? run_.job()->member : last;
  if (turn == TurnLimit::Turn::rest_and_tell && member != nullptr) {
    account_.Warn(*member, TurnLimit::kWarning);
  }
  return turn == TurnLimit::Turn::take;
}

std::optional<Instant> TurnTaker::NextAt(const Idle& idle) const {
  if (const auto rest = limit_.RestsUntil(idle.now)) return rest;
  if (run_.job() != nullptr) return run_.NextTurnAt();  // until no late answer can meet its request
  std::optional<Instant> soonest;
  if (const auto until = hold_.WaitsUntil()) {
    const Instant clear = std::min(chooser_.AllClearAt(), *until);
    if (clear > idle.now) soonest = clear;
  }
  return hold_.holds() ? soonest : Soonest({soonest, chooser_.NextAt(idle)});
}

bool TurnTaker::Pause(Instant now) {
  hold_.Pause(now);
  return run_.job() == nullptr && std::min(chooser_.AllClearAt(), *hold_.WaitsUntil()) <= now;
}

}  // namespace baudgate::bus
