// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/poller/job_runner.h"

#include <algorithm>
#include <utility>

#include "gateway/bus/jobs/probe.h"

namespace baudgate::bus {

JobRunner::JobRunner(config::Echo echo, LineContext& context, UnaskedSide& unasked,
                     RequestPort& port)
    : context_(context), unasked_(unasked), port_(port), echo_(echo) {
  if (const auto* const standing = unasked.standing()) line_.Listen(*standing);
}

// ---------------------------------------------------------------- inputs

void JobRunner::OnTime(Now now) {
  arrival_.OnInput(now.instant, IsAwaiting());
  context_.accounts.OnTime(now, !line_.idle(), member(), !asks());
  now_ = now;
}

std::optional<Instant> JobRunner::Deadline() const {
  const bool may_be_withdrawn = waits_for_quiet() && job_;
  return Soonest({line_.Deadline(), may_be_withdrawn ? job_->LatestStart() : std::nullopt,
                  IsAwaiting() ? std::optional(arrival_.NextLook()) : std::nullopt});
}

void JobRunner::OnOpened(bool keeps_bit_rate) {
  echo_.OnOpened();
  context_.observer->OnOpened();
  line_.OnOpened(now_.instant, keeps_bit_rate);
}

void JobRunner::OnClosed(const std::string& reason) {
  LineNews news = line_.OnClosed();
  if (news.end) news.end->reason = reason;
  Apply(std::move(news));
  echo_.OnClosed();
  if (job_) Do(NextStep::Finish(Outcome::line_down, reason));
}

void JobRunner::Receive(View bytes) {
  const EchoWatch::Received heard = echo_.OnReceived(bytes, job_ ? &job_->step.request : nullptr);
  if (!heard.bytes.empty()) {
    context_.owed.late_replies.Hear(heard.bytes, now_.instant);
    context_.observer->Hear(heard.bytes, now_.instant);
  }
  const Member* const asked = job_ ? job_->member : nullptr;
  LineNews collided;
  if (heard.collision) collided = line_.OnCollision(now_.instant);
  LineNews news;
  if (!heard.bytes.empty()) news = line_.Feed(heard.bytes, now_.instant);
  context_.accounts.line.OnHeard(heard, asked);
  Apply(std::move(collided));
  if (heard.bytes.empty()) return;
  unasked_.Overhear(heard.bytes, now_.instant);
  Apply(std::move(news));
}

void JobRunner::OnTimer() {
  Withdraw();  // before the line can send a request that is too late by now
  Apply(line_.OnTimer(now_.instant));
}

/// Replaces the times at which unasked messages and the reply were read by the earliest times at
/// which they can have arrived (ArrivalTime). A reply is never dated before its request.
void JobRunner::Date(LineNews& news) const {
  const Instant now = now_.instant;
  for (UnaskedMessage& message : news.unasked.messages) {
    message.since = now - arrival_.Earliest(now - message.since);
  }
  if (!news.end) return;
  const Instant read = now - news.end->since_reply;
  news.end->since_reply = now - std::max(arrival_.Earliest(read), read - news.end->round_trip);
}

void JobRunner::Apply(LineNews news) {
  Date(news);
  unasked_.OnInput(news.unasked, now_);
  if (news.send) Send();
  if (news.stray_before.count > 0) HandleStray(news.stray_before);
  if (news.end && job_) OnExchangeEnd(std::move(*news.end));
  if (news.stray.count > 0) HandleStray(news.stray);
}

void JobRunner::HandleStray(const StrayBytes& stray) {
  const LateReplies::StrayEffects effects = context_.tracker.ApplyStray(stray, now_.instant);
  if (effects.warned != nullptr) context_.accounts.line.Warn(*effects.warned, effects.warning);
  if (!stray.second_reply) return;
  context_.tracker.OnSecondReply(now_.instant);
  if (job_) job_->OnSecondReply();
}

// ---------------------------------------------------------------- the exchange

void JobRunner::Start(Instant idle_since) {
  Apply(line_.Start(job_->Start(context_, idle_since, now_.instant), now_.instant));
}

void JobRunner::Send() {
  // Late replies of devices that were not asked last are only counted. They do not lengthen the
  // wait for these devices, because all devices would have to wait.
  for (const LateReplies::Late& late : context_.owed.late_replies.TakeOthers()) {
    context_.tracker.CountLate(*late.member, late.lateness, now_.instant);
  }
  const protocols::Request& request = job_->Send(context_, now_);
  context_.observer->OnRequest(*job_->member, request, now_.instant);
  echo_.OnSent(request.bytes);
  port_.Send(request.bytes, job_->member->serial, now_);
}

Outcome JobRunner::Judge(View frame, Instant now) {
  context_.observer->OnReply(frame);
  return job_->Judge(context_, frame, echo_, now);
}

void JobRunner::OnExchangeEnd(ExchangeEnd end) {
  last_ = job_->member;
  const bool no_echo = echo_.OnExchangeEnd(job_->step.request, end);
  if (!ProvesLife(end.outcome)) DropUnsent(end);
  EndedExchange ended = job_->Ended(std::move(end));
  ended.no_echo = no_echo;
  ended.cut = echo_.is_cut();
  context_.tracker.OnExchange(ended, now_.instant);
  for (ExchangeObserver* const observer : context_.observers) observer->OnExchange(ended, now_);
  if (context_.observer->TakeNegotiation()) context_.accounts.line.OnNegotiation();
  context_.tracker.ShowLine(now_.instant);
  Do(job_->Conclude(context_, ended.end, now_));
}

/// Removes the request from the port if it has not left this machine, so that it is not sent later.
void JobRunner::DropUnsent(ExchangeEnd& end) {
  const bool closed = end.outcome == Outcome::line_down;
  if (port_.IsUnsent()) {
    job_->NeverLeft();
    if (!closed) end.reason = kNotConnected;
  }
  if (!closed) port_.DropUnsent();
}

// ---------------------------------------------------------------- the steps of the job

void JobRunner::Begin(std::unique_ptr<Job> job) {
  job_ = std::move(job);
  Do(job_->Begin());
}

JobRunner::Turn JobRunner::TakeTurn() {
  const Job& goal = job_->goal();
  if (&goal != job_.get() && goal.WhyNotSend(now_.instant)) job_ = job_->TakeGoal();
  NextStep step = job_->Depart(context_, now_.instant);
  if (step.what == NextStep::What::send) return Turn::send;
  if (step.what == NextStep::What::hold) return Turn::wait;
  Do(std::move(step));
  return Turn::next;
}

void JobRunner::Withdraw() {
  if (!waits_for_quiet() || !job_) return;
  std::optional<NextStep> step = job_->Withdraw(context_, now_.instant);
  if (!step) return;
  line_.Cancel();
  Do(std::move(*step));
}

void JobRunner::Do(NextStep step) {
  using What = NextStep::What;
  const Instant now = now_.instant;
  while (true) {
    switch (step.what) {
      case What::wait:
      case What::send:
      case What::hold:
        return;
      case What::ask:
        step = job_->Ask(context_, step.repeats, now);
        break;
      case What::probe_first: {
        Member& member = *job_->member;
        job_ = std::make_unique<ProbeJob>(member, now, std::move(job_));
        step = NextStep::Ask();
        break;
      }
      case What::go_unproved:
        step = Continue(job_->GoUnproved(context_, step.end.reason, now));
        break;
      case What::take_answer:
        step = job_->Take(context_, now);
        break;
      case What::park:
        context_.agenda.schedule.Hold(job_->member->place, step.until);
        context_.agenda.parked.Park(std::move(job_), step.until);
        return;
      case What::back_in_queue:
        job_->PutBack(context_);
        job_.reset();
        return;
      case What::finish:
        step = Continue(job_->Finish(context_, step.end, now));
        break;
    }
  }
}

NextStep JobRunner::Continue(Job::After after) {
  job_ = std::move(after.job);
  return std::move(after.next);
}

}  // namespace baudgate::bus
