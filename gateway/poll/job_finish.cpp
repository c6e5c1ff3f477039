// The end of a job: what follows from it, and what goes on. What each kind of job leads to is in
// job_end.h; here its effects, and those of replies, are applied.
// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include "gateway/poll/job_end.h"
#include "gateway/poll/job_run.h"
#include "gateway/poll/write_end.h"

namespace baudgate {

void JobRun::Finish(Outcome outcome, const std::string& reason) {
  const std::unique_ptr<Job> done = std::move(job_);
  if (done->postponed) return Resume(*done, outcome, reason);
  const JobEnd end{outcome, reason};
  Apply(*done, EffectsOf(*done, end, now_.instant), end);
}

/// What the probe came to is never the outcome of the task that waited for it. That its device
/// answers probes does not make up for polls that fail.
void JobRun::Resume(Job& probe, Outcome outcome, const std::string& reason) {
  Member& member = *probe.member;
  const bool life = ProvesLife(outcome);
  if (member.device != nullptr) upkeep_.PlanBackground(*member.device);
  if (!life || member.health.state() == DeviceState::never_seen) {
    upkeep_.OnTask(member, outcome, reason, now_.instant);
  }
  job_ = std::move(probe.postponed);
  job_->proved = true;
  job_->wire += probe.wire;
  // A device that wants to be left in peace gets it: a meter counts wrong passwords.
  const bool in_peace = agenda_.schedule.held_until(member.place) > now_.instant;
  const bool is_write = job_->As<Job::Write>() != nullptr;
  const bool allowed = !in_peace || (is_write && outcome == Outcome::ok);
  if (life && member.in_use && owed_.whose.MayBeInStep(job_->asked()) && allowed) {
    if (job_->As<Job::Routed>() != nullptr) return;  // its request is as it was
    if (job_->has_news()) return TakeAnswer();       // only its proof was awaited
    job_->steps = job_->broadcasts = 0;
    return Ask();
  }
  job_->mute = true;
  if (job_->answer.batch) {
    member.device->conversation->OnFailure(job_->task, job_->request, Outcome::unexpected,
                                           now_.instant);
  }
  if (!member.in_use) return Finish(Outcome::no_reply, "the device is disabled");
  Finish(outcome == Outcome::ok ? Outcome::busy : outcome, reason);
}

void JobRun::Apply(const Device& device, const ReplyEffects& effects) {
  if (effects.rechecked) ledger_.devices.OnRecheck(device);
  for (const QueryRef& query : effects.read_soon) agenda_.write_queue.AddReadBack(query);
  for (const config::Group group : effects.repeat) upkeep_.Repeat(device, group, now_.instant);
  if (effects.stored) owed_.readings.OnStored(*effects.stored);
  if (effects.hold_events) {
    agenda_.schedule.HoldEvents(device.place);
    chooser_.background().Hold(device.place);
  }
}

void JobRun::Apply(Job& done, EndEffects effects, const JobEnd& end) {
  Member& member = *done.member;
  Device* const device = member.device;
  if (effects.background) {
    chooser_.background().OnEnd(member.place, effects.background->took, effects.background->proved);
  }
  if (device != nullptr) upkeep_.PlanBackground(*device);
  if (done.looks) chooser_.probes().OnEnd(member, *done.looks, done.began);
  if (effects.fast_poll) ledger_.rounds.OnPoll(member, *effects.fast_poll, now_.instant);
  if (effects.poll) {
    const auto& [query, answered] = *effects.poll;
    ledger_.devices.OnPoll(*device, query, answered, done.missed);
  }
  if (effects.repeat) upkeep_.Repeat(*device, *effects.repeat, now_.instant);
  if (effects.doubt) upkeep_.Doubt(*effects.doubt, now_.instant);
  if (effects.polls_first && device != nullptr) agenda_.schedule.GoFirst(member.place);
  // Silence to a query that was never answered says something about the query, not about the
  // device.
  if (effects.judges_member && !done.unheard)
    upkeep_.OnTask(member, end.outcome, end.reason, now_.instant);
  for (auto& [request, reply] : effects.replies) request.done(std::move(reply));
  if (effects.write) Apply(*done.As<Job::Write>(), *device, *effects.write);
}

void JobRun::Apply(Job::Write& write, Device& device, const EndEffects::Write& effects) {
  using Next = EndEffects::Write::Next;
  upkeep_.Doubt(device, effects.unknown, now_.instant);
  for (const PointWrite& one : effects.confirmed) {
    device.jumps.OnWritten(one.point, WrittenValue(device.config->points[one.point], one));
  }
  if (!effects.confirmed.empty()) write.command.MoveTo(WriteState::reading_back);
  switch (effects.next) {
    case Next::answer:
      ledger_.devices.OnWrite(device, effects.result.end, false);
      return write.command.End(effects.result);
    case Next::confirm:
      return agenda_.write_queue.Confirm(std::move(write.command), now_.instant);
    case Next::go_on:
      write.command.MoveTo(WriteState::queued);
      job_ = std::make_unique<Job>(device, std::move(write), Task{}, now_.instant);
      return NextWrite();
  }
}

}  // namespace baudgate
