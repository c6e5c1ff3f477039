// The poller's inputs, and who is answered when. What becomes of the job under way is in
// job_run.cpp.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/poll/poller.h"

#include <algorithm>
#include <utility>

#include "gateway/poll/samples.h"
#include "gateway/poll/write_end.h"

namespace baudgate {
namespace {

/// One of the points at least.
bool IsAsked(const Conversation& conversation, const std::vector<std::uint32_t>& points) {
  return std::ranges::any_of(conversation.Queries(), [&](const Query& query) {
    return std::ranges::find_first_of(query.points, points) != query.points.end();
  });
}

std::string DoesNotAnswer(std::uint8_t slave) {
  return "slave " + std::to_string(slave) + " does not answer; it is asked now and then";
}

}  // namespace

Poller::Poller(const config::Line& line, std::uint32_t first_device, const FindProtocol& find,
               PointStore& store, PollerListener& listener)
    : store_(store),
      listener_(listener),
      line_(*this),
      echo_(line.echo),
      roster_(line, first_device, find),
      late_(roster_),
      whose_reply_(roster_),
      ledger_(roster_, schedule_, store, store.LineIndex(line), listener),
      chooser_(line, roster_, schedule_, writes_, routes_, late_),
      upkeep_(roster_, schedule_, store, late_, whose_reply_, chooser_, ledger_),
      speaker_(roster_) {
  if (speaker_.device() == nullptr) return;
  line_.Listen(*speaker_.standing());
  ledger_.OnSpeaks(*speaker_.device());
}

// ---------------------------------------------------------------- inputs

void Poller::Advance(Now now) {
  was_idle_ = line_.idle();
  const Duration passed = now.instant - now_.instant;
  now_ = now;
  const Member* member = job_ && !job_->sending ? job_->member : late_.last();
  ledger_.OnTime(now, !was_idle_, member);
  const bool failing = !was_idle_ && member != nullptr && roster_.IsDevice(*member) &&
                       schedule_.doubted(member->place);
  chooser_.turns().OnTime(passed, failing);
}

void Poller::Recall(std::uint32_t index, std::string memory, Now now) {
  Device& device = roster_.DeviceAt(index);
  device.conversation->Recall(memory, now);
  device.memory = std::move(memory);
  upkeep_.OnRecalled(device);
}

void Poller::OnOpened(Now now, bool keeps_bit_rate) {
  if (open_) OnClosed(now);
  Advance(now);
  open_ = true;
  winding_up_ = false;
  idle_since_ = now.instant;
  ledger_.OnOpened();
  line_.OnOpened(now.instant, keeps_bit_rate);
  chooser_.probes().OnOpened();
  echo_.OnOpened();
  upkeep_.OnOpened(now.instant);
  if (speaker_.device() != nullptr) ledger_.OnState(*speaker_.device(), "the port is open");
  Pump();
}

void Poller::OnClosed(Now now, Override why) {
  Advance(now);
  open_ = false;
  ledger_.OnClosed(why);
  const std::string reason = ledger_.WhyClosed();
  Hear(line_.OnClosed());
  echo_.OnClosed();
  if (job_ && job_->end) late_.OnClosed(*job_->member, now.instant);
  if (job_) Finish(Outcome::line_down, reason);
  for (const auto& device : roster_.devices()) {
    chooser_.DropParked(*device);
    schedule_.Suspend(device->place);
  }
  chooser_.probes().OnClosed();
  const std::vector<WriteCommand> unsent = writes_.TakeAll();
  AnswerConfirmed();
  for (const WriteCommand& command : unsent) NotSent(command, reason);
  for (RoutedRequest& request : routes_.queue().TakeAll()) {
    request.done({Outcome::line_down, {}, reason});
  }
  upkeep_.ShowLine(now.instant);
}

void Poller::SetInUse(std::uint32_t index, bool in_use, Now now) {
  Advance(now);
  Device& device = roster_.DeviceAt(index);
  if (in_use) upkeep_.OnEnabled(device, open_, now.instant);
  if (device.in_use != in_use) upkeep_.SetInUse(device, in_use, open_, now.instant);
  if (open_) Settle();
}

void Poller::OnBytes(View bytes, Now now) {
  Advance(now);
  const EchoWatch::Heard heard = echo_.OnReceived(bytes, job_ ? &job_->request : nullptr);
  if (heard.echo) ledger_.OnEcho();
  if (heard.warning != nullptr) listener_.OnWarning(job_->member->index, heard.warning);
  if (heard.collision) {
    ledger_.OnCollision();
    ledger_.OnSecondMaster();
    Hear(line_.OnCollision(now.instant));
  }
  if (!heard.bytes.empty()) {
    ledger_.OnReceived(heard.bytes);
    Hear(line_.OnBytes(heard.bytes, now.instant));
  }
  Settle();
}

void Poller::OnTimer(Now now) {
  Advance(now);
  Hear(line_.OnTimer(now.instant));
  if (open_) {
    if (auto said = speaker_.OnTimer(now)) TakeUnasked(std::move(*said));
  }
  Settle();
}

bool Poller::Submit(WriteCommand command, Now now) {
  Advance(now);
  AnswerCommands();  // those of clients that have left take no room
  if (writes_.full()) return false;
  if (!open_) {
    NotSent(command, ledger_.WhyClosed());
  } else if (command.writes.empty()) {
    ReadNow(std::move(command));
    Settle();
  } else {
    writes_.Push(std::move(command));
    Settle();
  }
  return true;
}

/// As if its points had been written just now.
void Poller::ReadNow(WriteCommand command) {
  const Device& device = roster_.DeviceAt(command.device);
  if (const char* why = WhyNotAsked(command)) return NotSent(command, why);
  if (&device == speaker_.device() && !IsAsked(*device.conversation, command.reads)) {
    return NotSent(command, "it is not asked: it speaks by itself, and what it said last is shown");
  }
  for (const std::uint32_t point : command.reads) ReadBack(device, point);
  writes_.Confirm(std::move(command), now_.instant);
}

void Poller::ReadBack(const Device& device, std::size_t point) {
  const auto queries = device.conversation->Queries();
  for (std::size_t query = 0; query < queries.size(); ++query) {
    const auto& points = queries[query].points;
    if (std::ranges::find(points, point) == points.end()) continue;
    writes_.AddReadBack({device.place, query});
  }
}

void Poller::Submit(RoutedRequest request, Now now) {
  Advance(now);
  if (!open_ || roster_.carrier() == nullptr) {
    request.done({Outcome::line_down, {}, ledger_.WhyClosed()});
    return;
  }
  request.sequence = writes_.NextSequence();
  routes_.queue().Push(std::move(request));
  Settle();
}

void Poller::OnHostClock(bool right) {
  for (const auto& device : roster_.devices()) device->conversation->OnHostClock(right);
}

void Poller::OnEventsKept(std::uint32_t index, const std::string& said, Now now) {
  Advance(now);
  Device& device = roster_.DeviceAt(index);
  device.conversation->OnEventsKept(said);
  if (&device == speaker_.device()) speaker_.OnKept();
  schedule_.ReleaseEvents(device.place, device.conversation->HasEvents(),
                          told_.OnKept(device, said), now.instant);
  chooser_.background().Release(device.place);
  upkeep_.PlanBackground(device);
  if (open_) Settle();
}

std::size_t Poller::Forget(std::uint64_t client, Now now) {
  Advance(now);
  std::size_t forgotten = routes_.queue().Forget(client);
  for (Job* job = job_.get(); job != nullptr; job = job->behind.get()) {
    auto* routed = job->As<Job::Routed>();
    if (routed == nullptr) continue;
    forgotten += std::erase_if(
        routed->batch, [client](const RoutedRequest& request) { return request.client == client; });
  }
  if (open_) Settle();
  return forgotten;
}

std::optional<Instant> Poller::Deadline() const {
  if (!open_) return std::nullopt;
  std::optional<Instant> soonest = line_.Deadline();
  const auto sooner = [&](std::optional<Instant> other) {
    if (other && (!soonest || *other < *soonest)) soonest = other;
  };
  sooner(writes_.Deadline());
  sooner(routes_.queue().Deadline());
  sooner(speaker_.DueAt());
  if (line_.state() == Line::State::quiet && job_) sooner(LatestStart(*job_));
  if (!line_.idle()) return soonest;
  if (job_) {  // waits until no late answer can meet its request
    if (job_->attempts == 0) sooner(late_.ClearAt(job_->asked()));
    sooner(LatestStart(job_->goal()));
    return soonest;
  }
  if (!winding_up_) sooner(chooser_.NextAt(idle()));
  return soonest;
}

bool Poller::IsWriting() const {
  return job_ && job_->As<Job::Write>() != nullptr && (job_->begun() || !job_->sending);
}

// ---------------------------------------------------------------- what the line has to say

/// What an input has led to, in its order; what follows from an exchange's end is for Settle.
void Poller::Hear(LineNews news) {
  OnUnasked(news.unasked);
  if (news.send) Send();
  if (news.stray_before.count > 0) OnStray(news.stray_before);
  if (news.end && job_) {
    late_.OnEnd(job_->asked(), news.end->outcome, now_.instant);
    job_->end = std::move(news.end);
  }
  if (news.stray.count > 0) OnStray(news.stray);
  if (!news.second_reply || late_.last() == nullptr) return;
  ledger_.OnSecondReply(*late_.last());
  whose_reply_.OnSecondReply(*late_.last());
  upkeep_.DoubtLatest(now_.instant);
}

void Poller::OnUnasked(const Heard& heard) {
  if (!speaker_.in_use()) return;
  Device& device = *speaker_.device();
  for (std::size_t i = 0; i < heard.damaged; ++i) {
    upkeep_.OnUnasked(device, Outcome::corrupt, std::string(heard.why), now_.instant);
  }
  for (const UnaskedMessage& message : heard.messages) {
    Speaker::Said said = speaker_.OnMessage(message, now_);
    upkeep_.OnUnasked(device, said.outcome, said.reason, now_.instant);
    TakeUnasked(std::move(said));
  }
}

void Poller::TakeUnasked(Speaker::Said said) {
  Device& device = *speaker_.device();
  upkeep_.OnHeard(device, now_.instant);
  if (!said.samples.empty()) {
    store_.Update(device.index, said.samples, said.received, {});
    listener_.OnRead(device.index, PointsOf(said.samples), said.received);
  }
  if (said.lost > 0) ledger_.OnLostEvents(device, said.lost);
  if (!said.warning.empty()) listener_.OnWarning(device.index, said.warning);
  if (said.events) listener_.OnEvents(std::move(*said.events));
}

void Poller::OnStray(const StrayBytes& stray) {
  const LateAnswers::Stray told = late_.OnStray(stray, now_.instant);
  if (told.counts) ledger_.OnStray(stray.count);
  if (told.late != nullptr) {
    ledger_.OnLate(*told.late, told.lateness);
    upkeep_.ShowLine(now_.instant);
  }
  if (told.warned != nullptr) listener_.OnWarning(told.warned->index, told.warning);
}

void Poller::Settle() {
  if (job_ && job_->end) Conclude();
  if (!was_idle_ && line_.idle()) idle_since_ = now_.instant;
  Probes& probes = chooser_.probes();
  if (const auto began = probes.began(); began && line_.idle()) {
    probes.OnIdle(chooser_.Waited(*began, now_.instant), now_.instant);
  }
  CancelQuiet();
  AnswerCommands();
  AnswerRouted();
  AnswerConfirmed();  // before the next write is to be read back
  Pump();
  AnswerConfirmed();
  if (speaker_.drained()) listener_.OnDrained(speaker_.device()->index, now_.instant);
}

void Poller::Pump() {
  while (open_ && line_.idle()) {
    if (!job_) {
      if (winding_up_) return;
      job_ = chooser_.Next(idle());
      if (!job_) return;
      if (job_->looks) ledger_.OnProbe();
      if (job_->As<Job::Write>() != nullptr) {
        NextWrite();
      } else if (job_->As<Job::Routed>() == nullptr) {
        Ask();
      }
      continue;
    }
    if (job_->behind && WhyNotSend(*job_->behind, now_.instant) != nullptr) {
      std::unique_ptr<Job> behind = std::move(job_->behind);
      job_ = std::move(behind);
    }
    if (const char* why = WhyNotSend(*job_, now_.instant)) {
      BreakOff(why);
      continue;
    }
    whose_reply_.Recognise(*job_->member, job_->request.expect.address);
    if (whose_reply_.NeedsProbeFirst(job_->asked(), now_.instant)) {
      PutProbeFirst();
      continue;
    }
    // A retry may be met by the answer to its first try, which is as good.
    const Instant clear = late_.ClearAt(job_->asked());
    if (job_->attempts > 0 || clear <= now_.instant) {
      Start();
    } else if (!SetAside(clear)) {
      return;
    }
  }
}

/// The next step of a poll waits for a late reply of its device: where replies say who they are
/// from, the line does not.
bool Poller::SetAside(Instant until) {
  const Member& member = *job_->member;
  const Task::Kind kind = job_->task.kind;
  const bool reads =
      kind == Task::Kind::poll || kind == Task::Kind::events || kind == Task::Kind::background;
  if (!reads || !job_->asked().named() || chooser_.IsParked(member)) return false;
  schedule_.Hold(member.place, until);
  chooser_.Park(std::move(job_), until);
  return true;
}

// ---------------------------------------------------------------- answers to those who wait

void Poller::AnswerCommands() {
  const WriteQueue::Expired expired = writes_.TakeExpired(now_.instant);
  for (const WriteQueue::Confirmed& one : expired.confirmed) AnswerConfirmed(one);
  for (const WriteCommand& command : expired.unsent) {
    const bool answers = Answers(roster_.DeviceAt(command.device).health.state());
    NotSent(command, !answers || schedule_.doubted(roster_.DeviceAt(command.device).place)
                         ? "the device does not answer, and the command waited for it in vain"
                         : "the command waited for the line beyond its deadline");
  }
  while (const auto refused = writes_.Take(
             [&](const WriteCommand& command) { return WhyNotAsked(command) != nullptr; })) {
    NotSent(*refused, WhyNotAsked(*refused));
  }
}

const char* Poller::WhyNotAsked(const WriteCommand& command) const {
  const Device& device = roster_.DeviceAt(command.device);
  if (command.dropped && *command.dropped) return "its client has left";
  if (!device.in_use) return "the device is disabled";
  return device.health.offline() ? "the device is offline" : nullptr;
}

void Poller::NotSent(const WriteCommand& command, const std::string& reason) {
  if (!command.writes.empty()) {
    ledger_.OnWrite(roster_.DeviceAt(command.device), WriteEnd::not_sent, false);
  }
  command.done({.end = WriteEnd::not_sent, .reason = reason});
}

void Poller::AnswerConfirmed() {
  const bool reading_back = job_ && job_->As<Job::ReadBack>() != nullptr && job_->attempts == 0;
  for (const WriteQueue::Confirmed& one : writes_.TakeConfirmed(open_ && reading_back)) {
    AnswerConfirmed(one);
  }
}

void Poller::AnswerConfirmed(const WriteQueue::Confirmed& one) {
  Verdict verdict;
  store_.Read(one.command.device,
              [&](const DeviceRecord& record) { verdict = VerdictOn(one, record); });
  if (one.written > 0) {
    ledger_.OnWrite(roster_.DeviceAt(one.command.device), verdict.result.end, !verdict.lost);
  }
  one.command.done(verdict.result);
}

/// A slave that is offline is asked as often as its probes allow. Until it answers, writes wait for
/// their deadlines, and reads are told at once, but for one that may be the probe right now.
void Poller::AnswerRouted() {
  if (routes_.queue().empty()) return;
  for (RoutedRequest& request : routes_.queue().TakeExpired(now_.instant)) {
    const Member* member = roster_.FindSlave(request.slave);
    const bool offline = member != nullptr && member->health.offline();
    request.done({Outcome::no_reply,
                  {},
                  offline ? DoesNotAnswer(request.slave)
                          : "the request waited for the line beyond its deadline"});
  }
  for (const std::uint8_t slave : routes_.queue().Slaves()) {
    const Member* member = roster_.FindSlave(slave);
    if (member == nullptr || !member->health.offline()) continue;
    const std::size_t keep = !job_ && chooser_.MayProbe(*member, idle()) ? 1 : 0;
    for (RoutedRequest& read :
         routes_.TakeHopeless(*member, keep, *roster_.carrier()->carrier, now_.instant)) {
      read.done({Outcome::no_reply, {}, DoesNotAnswer(slave)});
    }
  }
}

}  // namespace baudgate
