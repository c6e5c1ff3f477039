// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/probe.h"

#include "gateway/bus/jobs/line_context.h"

namespace baudgate::bus {

NextStep ProbeJob::Ask(LineContext& line, int repeats, Instant now) {
  NextStep next = Job::Ask(line, repeats, now);
  const bool asked = next.what == NextStep::What::wait;
  if (!asked && !has_no_request) return next;
  line.agenda.probes.OnAsked(*member, asked, now);
  return asked || !goal_ ? next : NextStep::GoUnproved(next.end.reason);
}

/// A probe that goes before another job is repeated while its reply may answer the probe of an
/// earlier task. This happens behind a server whose replies come some requests late.
bool ProbeJob::MustRepeat(const LineContext& line, Instant now) const {
  const protocols::Answer& answer = attempt.answer;
  const bool wants_peace = answer.outcome == Outcome::busy || answer.wait > Duration::zero();
  return goal_ && !line.owed.whose.IsOfLatest(asked()) && !wants_peace &&
         MayRepeat(line, kMostProbesMore, now);
}

void ProbeJob::OnReplaced(LineContext& line, Now now) {
  Job::OnReplaced(line, now);
  if (goal_) goal_->attempt.answer = {};
}

namespace {

NextStep EndUnproved(Job& job, Outcome outcome, const std::string& reason, Instant now) {
  job.judges_member = false;
  if (job.attempt.answer.batch) {
    job.member->device->conversation->OnFailure(job.task, job.step.request, Outcome::unexpected,
                                                now);
  }
  return NextStep::Finish(outcome, reason);
}

}  // namespace

/// Ends the probe, and decides how the job that waits behind it continues. An answered probe does
/// not make up for failed polls, so it counts for the state of the device only if the device was
/// never seen.
Job::After ProbeJob::Finish(LineContext& line, const JobEnd& end, Instant now) {
  if (!goal_) return Job::Finish(line, end, now);
  const auto& [outcome, reason] = end;
  const bool life = ProvesLife(outcome);
  if (member->device != nullptr) line.tracker.PlanBackground(*member->device);
  if (!life || member->health.state() == DeviceState::never_seen) {
    line.tracker.OnTask(*member, outcome, reason, now);
  }
  std::unique_ptr<Job> job = std::move(goal_);
  job->proved = true;
  job->wire += wire;
  // The device wants no requests for some time, for example after a wrong password, because a meter
  // counts the attempts. Only a write goes on, and only after an outcome `ok`.
  const bool in_peace = line.agenda.schedule.held_until(member->place) > now;
  const bool allowed = !in_peace || (job->writes() && outcome == Outcome::ok);
  NextStep next;
  if (spoilt_ && job->has_news()) {
    next = EndUnproved(*job, Outcome::unexpected,
                       "a second, different reply came, so neither reply is used", now);
  } else if (life && member->in_use && line.owed.whose.MayBeInStep(job->asked()) && allowed) {
    // If an answer of the job has waited for this probe, it is accepted.
    next = job->has_news() ? NextStep::TakeAnswer() : job->GoOn();
  } else if (!member->in_use) {
    next = EndUnproved(*job, Outcome::no_reply,
                       "the device is disabled; 'baudgate enable' takes it into use", now);
  } else if (outcome == Outcome::refused || outcome == Outcome::unsupported) {
    next = EndUnproved(*job, Outcome::no_reply,
                       "the probe, which checks that replies come in order, was refused: " + reason,
                       now);
  } else {
    next = EndUnproved(*job, outcome == Outcome::ok ? Outcome::busy : outcome, reason, now);
  }
  return {std::move(job), std::move(next)};
}

Job::After ProbeJob::GoUnproved(LineContext& line, const std::string& why, Instant now) {
  std::unique_ptr<Job> job = std::move(goal_);
  job->unprovable = true;
  line.owed.whose.OnNoProof(*job->member->device, now);
  NextStep next = job->has_news() ? EndUnproved(*job, Outcome::busy, why, now) : job->GoOn();
  return {std::move(job), std::move(next)};
}

std::unique_ptr<Job> ProbeSource::Take(const Idle& idle) {
  Probes& probes = line_.agenda.probes;
  const Probes::Facts facts = line_.chooser.FactsOf(idle);
  const auto when = probes.NextAt(facts);
  if (!when || *when > idle.now) return nullptr;
  Member& member = *probes.Next(facts);
  const Probes::Kind kind = probes.OnTaken(member, facts);
  std::unique_ptr<Job> job;
  if (member.device != nullptr && member.in_use) {
    job = std::make_unique<ProbeJob>(member, idle.now);
  } else {
    job = line_.routed.TakeProbe(member, idle);
  }
  if (job) job->probe_budget = kind;
  return job;
}

std::optional<Instant> ProbeSource::NextAt(const Idle& idle) const {
  return line_.agenda.probes.NextAt(line_.chooser.FactsOf(idle));
}

}  // namespace baudgate::bus
