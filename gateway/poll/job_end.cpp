// The end of a job: what is repeated after a failure, who is answered, and what goes on. The table
// of all its states is in job_run.cpp.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <span>
#include <utility>

#include "gateway/poll/job_run.h"
#include "gateway/poll/write_end.h"

namespace baudgate {
namespace {

/// Of the points that were to be read.
config::Group GroupOf(const Job& job, const Device* device) {
  if (const auto* poll = job.As<Job::Poll>()) return poll->group;
  if (device == nullptr || job.As<Job::ReadBack>() == nullptr) return config::Group::fast;
  const auto queries = device->conversation->Queries();
  return job.task.query < queries.size() ? queries[job.task.query].group : config::Group::fast;
}

void AnswerRoute(Job& job, Outcome outcome, const std::string& reason) {
  Job::Routed& routed = *job.As<Job::Routed>();
  const bool sent = job.exchange_began != Instant{};
  bool shared = false;
  for (RoutedRequest& request : routed.batch) {
    RoutedReply reply{outcome, {}, reason.empty() ? std::string(Name(outcome)) : reason};
    if (outcome == Outcome::ok || outcome == Outcome::refused) reply.pdu = routed.reply;
    reply.sent = sent;
    reply.shared = std::exchange(shared, true);
    if (sent) reply.waited = job.exchange_began - request.arrived;
    request.done(std::move(reply));
  }
}

}  // namespace

/// A routed read whose reply was damaged waits for its turn again, where that can do no harm.
/// Silence is the client's to judge, who may have better things to ask by now. Whoever asks for
/// what its slave does not know says nothing about the slave by it, and nor does an odd reply.
void JobRun::OnFailed(const ExchangeEnd& end) {
  Job& job = *job_;
  Member& member = *job.member;
  const bool heard_itself = std::exchange(job.answer, {}).outcome == Outcome::unexpected;
  job.missed = true;
  if (auto* routed = job.As<Job::Routed>()) {
    upkeep_.HoldBack(member);
    const bool damaged = end.outcome == Outcome::corrupt || end.outcome == Outcome::partial;
    if (damaged && routed->is_read() && !job.looks &&
        routed->batch.front().tries < member.retries) {
      ledger_.OnRetry(member);
      for (RoutedRequest& request : routed->batch) ++request.tries;
      routes_.queue().Return(std::move(routed->batch));
      job_.reset();
      return;
    }
    job.mute = job.mute || !routed->every_slave_answers || routed->odd;
    return Finish(end.outcome, end.reason);
  }
  // The reply to another request has come, so the awaited one is nearer. A reply in the name of a
  // device that owes none brings nothing nearer.
  const Asked asked = job.asked();
  const bool nearer = end.outcome == Outcome::unexpected &&
                      (heard_itself || !asked.named() || whose_reply_.OthersOwe(asked));
  const int more = nearer ? std::min(whose_reply_.Owed(asked), kMostTriesMore) : 0;
  if (!chooser_.MayRepeat(job, more, now_.instant)) return GiveUp(end);
  const auto instead =
      roster_.AsDevice(member)->conversation->Instead(job.request, end.outcome, now_.instant);
  if (!instead && !job.request.expect.repeatable) return GiveUp(end);
  if (instead) job.request = *instead;
  ++job.attempts;
  job.sending = true;
  ledger_.OnRetry(member);
}

void JobRun::GiveUp(const ExchangeEnd& end) {
  Device& device = *roster_.AsDevice(*job_->member);
  const Then then =
      device.conversation->OnFailure(job_->task, job_->request, end.outcome, now_.instant);
  upkeep_.OnHeard(device, now_.instant);
  if (then == Then::ask_again) return Ask();
  if (then == Then::replan) {
    upkeep_.Plan(device);
    schedule_.GoOn(device.place, now_.instant);
  }
  upkeep_.HoldBack(device);
  Finish(end.outcome, end.reason);
}

// ---------------------------------------------------------------- the end of the task

void JobRun::Finish(Outcome outcome, const std::string& reason) {
  const std::unique_ptr<Job> done = std::move(job_);
  Member& member = *done->member;
  Device* const device = roster_.AsDevice(member);
  const bool life = ProvesLife(outcome);
  if (device != nullptr) {
    if (done->task.kind == Task::Kind::background) {
      chooser_.background().OnEnd(device->place, life ? done->wire : Duration::zero(),
                                  done->proved);
    }
    upkeep_.PlanBackground(*device);
  }
  if (done->behind) {
    // That it answers probes does not make up for polls that fail.
    const bool news = !life || member.health.state() == DeviceState::never_seen;
    if (news) upkeep_.OnTask(member, outcome, reason, now_.instant);
    done->behind->proved = true;
    done->behind->wire += done->wire;
    return Resume(std::move(done->behind), outcome, reason);
  }
  if (done->looks) chooser_.probes().OnEnd(member, *done->looks, done->began);
  const auto* poll = done->As<Job::Poll>();
  if (poll != nullptr && poll->group == config::Group::fast) {
    ledger_.OnFastPoll(member, done->wire, life, poll->last_of_round);
  }
  if (poll != nullptr && !done->mute) ledger_.OnPoll(*device, done->task.query, life);
  // Many devices do not answer at all what they do not know.
  const bool unread = !life || outcome == Outcome::busy;
  const config::Group group = GroupOf(*done, device);
  if (unread && IsSeldom(group)) upkeep_.Repeat(*device, group, now_.instant);
  // What else stands in the register that was written is not known either.
  if (!life && done->As<Job::ReadBack>() != nullptr) {
    upkeep_.Doubt({device->place, done->task.query}, now_.instant);
  }
  const auto* routed = done->As<Job::Routed>();
  const bool writes = routed != nullptr ? !routed->is_read() : done->As<Job::Write>() != nullptr;
  if (writes && !life && device != nullptr) schedule_.GoFirst(device->place);
  if (!done->mute) upkeep_.OnTask(member, outcome, reason, now_.instant);
  if (routed != nullptr) return AnswerRoute(*done, outcome, reason);
  if (auto* write = done->As<Job::Write>()) {
    // A closing that nobody answers takes nothing back.
    const bool closing = done->request.closes && !life;
    FinishWrite(*write, *device, closing ? write->told.value_or(outcome) : outcome, reason);
  }
}

/// What the probe came to is never the outcome of the task that waited for it.
void JobRun::Resume(std::unique_ptr<Job> job, Outcome outcome, const std::string& reason) {
  job_ = std::move(job);
  const Member& member = *job_->member;
  // A device that wants to be left in peace gets it: a meter counts wrong passwords.
  const bool in_peace = schedule_.held_until(member.place) > now_.instant;
  const bool is_write = job_->As<Job::Write>() != nullptr;
  const bool allowed = !in_peace || (is_write && outcome == Outcome::ok);
  if (ProvesLife(outcome) && member.in_use && whose_reply_.MayBeInStep(job_->asked()) && allowed) {
    if (job_->As<Job::Routed>() != nullptr) return;  // its request is as it was
    if (job_->has_news()) return TakeAnswer();       // only its proof was awaited
    job_->steps = job_->broadcasts = 0;
    return Ask();
  }
  job_->mute = true;
  if (job_->answer.batch) {
    const Device& device = *roster_.AsDevice(member);
    device.conversation->OnFailure(job_->task, job_->request, Outcome::unexpected, now_.instant);
  }
  if (!member.in_use) return Finish(Outcome::no_reply, "the device is disabled");
  Finish(outcome == Outcome::ok ? Outcome::busy : outcome, reason);
}

void JobRun::FinishWrite(Job::Write& write, Device& device, Outcome outcome,
                         const std::string& reason) {
  WriteCommand& command = write.command;
  const auto all = std::span(command.writes);
  const auto under_way = all.subspan(write.first, write.next - write.first);
  const WriteEnd end = EndOf(outcome, write.sent, write.may_have_acted);
  for (const PointWrite& one : under_way) {
    // Until it has been read back nobody knows what the point is now.
    const std::size_t point = one.point;
    if (end == WriteEnd::ok || write.sent) store_.Doubt(device.index, {&point, 1}, now_.instant);
    if (end == WriteEnd::ok) {
      device.jumps.OnWritten(one.point, WrittenValue(device.config->points[point], one));
    }
  }
  const auto ended = [&](WriteEnd how, const std::string& why) {
    ledger_.OnWrite(device, how, false);
    const std::size_t written = end == WriteEnd::ok ? write.next : write.first;
    command.done({how, why.empty() && how != WriteEnd::ok ? std::string(Name(outcome)) : why, false,
                  written, write.next});
  };
  if (end != WriteEnd::ok) {
    ended(end, reason);
  } else if (write.next == all.size()) {
    if (open_) {
      writes_.Confirm(std::move(command), now_.instant);
    } else {
      ended(WriteEnd::ok, {});
    }
  } else if (!device.in_use) {
    ended(WriteEnd::not_sent, "the device was disabled before all points were written");
  } else if (command.deadline <= now_.instant) {
    ended(WriteEnd::not_sent, "the deadline passed before all points were written");
  } else {
    job_ = std::make_unique<Job>(device, std::move(write), Task{}, now_.instant);
    NextWrite();
  }
}

}  // namespace baudgate
