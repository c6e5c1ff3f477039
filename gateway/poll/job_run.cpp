// A job from its first request to its end, as the table below: here to each request, in
// job_answer.cpp from an exchange to the next request, in job_finish.cpp its end.
//
// clang-format off
//   the job               what happens                        next
//   chosen, or parked     it asks, or its request is ready    waiting
//   chosen                the conversation will not ask       ended: unsupported
//   waiting, a poll, a    a late reply of its device is due   parked, where replies name their sender:
//   read-back, events or                                      MayPark
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
#include "gateway/poll/job_run.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace baudgate {
namespace {

/// A request that may write the points under way goes out.
void NoteWriting(Job::Write& write, const Device& device, WriteQueue& queue) {
  write.command.MoveTo(WriteState::sent);
  write.told.reset();
  std::vector<std::size_t> points;
  for (std::size_t i = write.first; i < write.next; ++i) {
    points.push_back(write.command.writes()[i].point);
    queue.OnBegun(device.index, write.command.writes()[i].point);
  }
  queue.AddReadBacks(device.place, device.conversation->Queries(), points);
}

/// The next step of a read waits for a late reply of its device. If replies carry an address, the
/// line does not wait.
bool MayPark(const Job& job, const ParkedJobs& parked) {
  const Task::Kind kind = job.task.kind;
  const bool reads =
      kind == Task::Kind::poll || kind == Task::Kind::events || kind == Task::Kind::background;
  return reads && job.asked().named() && !parked.HasLike(job);
}

}  // namespace

void JobRun::OnClosed(const std::string& reason) {
  if (job_) Finish(Outcome::line_down, reason);
}

bool JobRun::IsReadingBack(const Member& member) const {
  if (agenda_.parked.HasReadBack(member)) return true;
  return job_ && job_->member == &member && job_->goal().As<Job::ReadBack>() != nullptr &&
         !job_->goal().had_failure && !job_->had_failure;
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

// ---------------------------------------------------------------- to the request

void JobRun::Begin(std::unique_ptr<Job> job) {
  job_ = std::move(job);
  if (job_->As<Job::Write>() != nullptr) BeginNextPoints(*job_);
  if (job_->As<Job::Routed>() == nullptr) Ask();
}

void JobRun::Ask(int retries) {
  if (++job_->requests > kMostSteps) {
    return Finish(Outcome::unexpected,
                  "the task needed more than " + std::to_string(kMostSteps) + " requests");
  }
  Conversation& conversation = *job_->member->device->conversation;
  FollowPlan(*job_);
  if (!IsPlanned(job_->task, conversation)) {
    job_->judges_member = false;
    job_->unplanned = true;
    return Finish(Outcome::busy,
                  "the query no longer exists: the points of the device were planned again");
  }
  auto request = conversation.Ask(job_->task, now_.instant);
  if (job_->is_probe()) {
    agenda_.probes.OnAsked(*job_->member, bool(request), now_.instant);
    if (!request && job_->postponed) return GoOnUnproved(request.error());
  }
  if (!request) {
    job_->judges_member = false;
    job_->unasked = true;
    if (!job_->is_probe()) ledger_.devices.OnUnsupported(*job_->member, request.error());
    return Finish(Outcome::unsupported, request.error());
  }
  job_->step = {.request = std::move(*request), .waiting = true, .retries = retries};
}

void JobRun::PutProbeFirst() {
  auto probe = std::make_unique<Job>(*job_->member, Job::Probe{}, Task{.kind = Task::Kind::probe},
                                     now_.instant);
  probe->postponed = std::move(job_);
  job_ = std::move(probe);
  Ask();
}

JobRun::Turn JobRun::TakeTurn() {
  if (job_->postponed && WhyNotSend(*job_->postponed, now_.instant)) {
    std::unique_ptr<Job> postponed = std::move(job_->postponed);
    job_ = std::move(postponed);
  }
  if (const auto withheld = WhyNotSend(*job_, now_.instant)) {
    BreakOff(*withheld);
    return Turn::next;
  }
  owed_.whose.orders().Recognise(*job_->member, job_->step.request.expect.address);
  if (owed_.whose.NeedsProbeFirst(job_->asked(), now_.instant)) {
    PutProbeFirst();
    return Turn::next;
  }
  // A retry does not wait: a late reply to its first try is as good as its own.
  const Instant clear = owed_.late.ClearAt(job_->asked());
  if (job_->step.retries > 0 || clear <= now_.instant) return Turn::send;
  if (!MayPark(*job_, agenda_.parked)) return Turn::wait;
  Park(clear);
  return Turn::next;
}

void JobRun::Park(Instant until) {
  agenda_.schedule.Hold(job_->member->place, until);
  agenda_.parked.Park(std::move(job_), until);
}

Exchange JobRun::Start(Instant idle_since) {
  const Member& member = *job_->member;
  if (idle_since + owed_.late.LongestReply() <= now_.instant) owed_.readings.OnRested();
  const Device* const device = member.device;
  const bool trusted = device != nullptr && device->config->trust_order;
  if (trusted && job_->step.retries == 0) owed_.whose.OnTrusted(member);
  job_->step.waiting = false;
  job_->attempt = {.began = now_.instant, .sent_at = now_.instant, .job_was_sent = job_->was_sent};
  Exchange exchange{job_->step.request, member.protocol->reply_rule, member.times, {}, {}};
  exchange.lags = owed_.whose.Lags(member);
  exchange.times.reply += owed_.late.MoreReply(job_->asked());
  const Duration more = job_->step.request.reply - exchange.times.reply;
  if (more > Duration::zero()) {
    exchange.times.reply += more;
    exchange.times.ceiling += more;
  }
  exchange.times.quiet = std::max(exchange.times.quiet, job_->step.request.quiet);
  exchange.times.drain += owed_.late.ExtraDrain(member);
  exchange.aftermath = owed_.late.Aftermath(job_->asked(), now_.instant);
  // This device answers each request only after the next one. Waiting does not help.
  if (exchange.lags) exchange.aftermath = std::min(exchange.aftermath, member.times.drain);
  return exchange;
}

const Request& JobRun::Send() {
  Request& request = job_->step.request;
  if (request.stamped) {
    const auto characters = static_cast<std::int64_t>(request.bytes.size());
    const Duration character = job_->member->times.character;
    const Duration takes = characters * character;
    job_->member->device->conversation->Stamp(request, {now_.instant + takes, now_.wall + takes},
                                              character);
  }
  if (auto* const write = job_->As<Job::Write>()) {
    write->may_have_written_before = write->sent();
    if (!request.prepares && !request.closes) {
      NoteWriting(*write, *job_->member->device, agenda_.write_queue);
    }
  }
  agenda_.turns.OnSent(IsUrgent(job_->goal()));
  owed_.whose.OnSent(job_->asked(), now_.instant);
  if (job_->probe_budget && !job_->was_sent) ledger_.line.OnProbe();
  ledger_.line.OnSent(*job_->member, request);
  job_->attempt.sent_at = now_.instant;
  job_->was_sent = true;
  return request;
}

void JobRun::NeverLeft() {
  job_->was_sent = job_->attempt.job_was_sent;
  auto* const write = job_->As<Job::Write>();
  if (write != nullptr && write->sent() && !write->may_have_written_before) {
    write->command.MoveTo(WriteState::queued);
  }
}

/// A read whose line is not quiet yet lets a short write pass, and a request that has become too
/// late, or is forbidden by now, is not sent.
bool JobRun::Withdraw() {
  if (!job_ || job_->attempt.end) return false;
  if (const auto withheld = WhyNotSend(*job_, now_.instant)) {
    BreakOff(*withheld);
    return true;
  }
  auto* routed = job_->As<Job::Routed>();
  if (routed == nullptr || !routed->is_read) return false;
  const RoutedJobs& others = chooser_.routed();
  if (!agenda_.turns.UrgentAllowed(others.ShortWriteWaits())) return false;
  if (!others.ShortWriteMayGo(now_.instant)) return false;
  agenda_.routes.queue().Return(std::move(routed->batch));
  job_.reset();
  return true;
}

/// The waiting request is not sent. What the job has begun is closed properly.
void JobRun::BreakOff(const Withheld& withheld) {
  Job& job = *job_;
  job.judges_member = false;
  if (auto* const write = job.As<Job::Write>()) write->withheld = withheld;
  const bool asks = job.As<Job::Routed>() == nullptr;
  if (asks && job.begun()) {
    Conversation& conversation = *job.member->device->conversation;
    const Then then =
        conversation.OnFailure(job.task, job.step.request, Outcome::busy, now_.instant);
    if (then == Then::ask_again) return Ask();
  }
  Finish(Outcome::no_reply, withheld.why);
}

}  // namespace baudgate
