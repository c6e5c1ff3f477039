// SPDX-License-Identifier: Apache-2.0
#include "gateway/poll/poller.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "gateway/base/deadline.h"

namespace baudgate {

Poller::Poller(const config::Line& line, std::uint32_t first_device, const FindProtocol& find,
               PointStore& store, RequestPort& port, PollerListener& listener)
    : listener_(listener),
      roster_(line, first_device, find),
      owed_(roster_),
      agenda_(roster_, owed_.late),
      ledger_(roster_, agenda_.schedule, store, store.LineIndex(line), listener),
      chooser_(roster_, agenda_, owed_.late),
      upkeep_(roster_, store, owed_, agenda_, ledger_),
      clients_(store, roster_, chooser_, agenda_, ledger_.devices),
      intake_(store, listener),
      effects_(owed_, agenda_, ledger_, upkeep_, intake_),
      unasked_(roster_, ledger_, upkeep_, intake_),
      run_(owed_, agenda_, chooser_, ledger_, upkeep_, effects_),
      line_side_(Reception(line.echo, roster_, owed_.whose), unasked_.speaker().standing(), run_,
                 port),
      line_(line_side_, unasked_, upkeep_, ledger_) {
  if (const Device* const device = unasked_.speaker().device()) ledger_.devices.OnSpeaks(*device);
}

// ---------------------------------------------------------------- inputs

void Poller::Advance(Now now) {
  const bool idle = line_.idle();
  const Duration passed = time_.OnInput(now, idle);
  const Job* const job = run_.job();
  const bool asks = job != nullptr && !job->step.waiting;
  const Member* const member = asks ? job->member : owed_.late.last();
  ledger_.OnTime(now, !idle, member, !asks);
  chooser_.OnTime(passed, idle ? nullptr : member);
  run_.SetTime(now);
}

void Poller::Recall(std::uint32_t index, std::string memory, Now now) {
  Advance(now);
  Device& device = roster_.DeviceAt(index);
  device.conversation->Recall(memory, now);
  device.memory = std::move(memory);
  upkeep_.OnRecalled(device);
}

void Poller::OnOpened(Now now, bool keeps_bit_rate) {
  if (line_.is_open()) OnClosed(now);
  Advance(now);
  hold_.OnOpened();
  time_.Restart();
  ledger_.OnOpened();
  unasked_.OnOpened();
  line_.OnOpened(now, keeps_bit_rate);
  agenda_.probes.OnOpened();
  upkeep_.OnOpened(now.instant);
  if (const Device* const device = unasked_.speaker().device()) {
    ledger_.states.OnState(*device, "the port is open");
  }
  Pump();
}

void Poller::OnClosed(Now now, Override why) {
  Advance(now);
  hold_.OnClosed();
  ledger_.line.OnClosed();
  ledger_.states.OnClosed(why);
  const std::string reason = ledger_.states.WhyClosed();
  line_.OnClosed(reason, now);
  for (const auto& device : roster_.devices()) {
    agenda_.parked.Drop(*device);
    agenda_.schedule.Suspend(device->place);
  }
  agenda_.probes.OnClosed();
  clients_.AnswerAll(reason);
  upkeep_.ShowLine(now.instant);
}

void Poller::SetInUse(std::uint32_t index, bool in_use, Now now) {
  Advance(now);
  Device& device = roster_.DeviceAt(index);
  if (in_use) upkeep_.OnEnabled(device, line_.is_open(), now.instant);
  if (device.in_use != in_use) upkeep_.SetInUse(device, in_use, line_.is_open(), now.instant);
  if (line_.is_open()) Settle();
}

void Poller::OnBytes(View bytes, Now now) {
  Advance(now);
  line_.OnBytes(bytes, now);
  Settle();
}

void Poller::OnEnded(Now now) {
  Advance(now);
  line_.OnEnded(now);
  Settle();
}

void Poller::OnTimer(Now now) {
  Advance(now);
  line_.OnTimer(now);
  if (line_.is_open()) unasked_.OnTimer(now);
  Settle();
}

bool Poller::Submit(WriteCommand command, Now now) {
  Advance(now);
  clients_.AnswerCommands(now.instant);  // those of clients that have left take no room
  if (agenda_.write_queue.full()) return false;
  if (!line_.is_open()) {
    clients_.NotSent(command, ledger_.states.WhyClosed());
  } else if (command.writes().empty()) {
    clients_.ReadNow(std::move(command), unasked_.speaker().device(), now.instant);
    Settle();
  } else {
    agenda_.write_queue.Push(std::move(command));
    Settle();
  }
  return true;
}

void Poller::Submit(RoutedRequest request, Now now) {
  Advance(now);
  if (!line_.is_open() || roster_.carrier() == nullptr) {
    request.done({Outcome::line_down, {}, ledger_.states.WhyClosed()});
    return;
  }
  request.sequence = agenda_.write_queue.NextSequence();
  agenda_.routes.queue().Push(std::move(request));
  Settle();
}

void Poller::OnHostClock(bool right) {
  for (const auto& device : roster_.devices()) device->conversation->OnHostClock(right);
}

void Poller::OnUnsettledWrite(std::uint32_t index) {
  Device& device = roster_.DeviceAt(index);
  device.conversation->OnUnsettledWrite();
  ledger_.states.OnMemory(device);
}

void Poller::OnEventsKept(std::uint32_t index, const std::string& said, Now now) {
  Advance(now);
  Device& device = roster_.DeviceAt(index);
  device.conversation->OnEventsKept(said);
  if (&device == unasked_.speaker().device()) unasked_.speaker().OnKept();
  agenda_.schedule.ReleaseEvents(device.place, device.conversation->HasEvents(),
                                 intake_.OnKept(device, said), now.instant);
  agenda_.background.Release(device.place);
  upkeep_.PlanBackground(device);
  if (line_.is_open()) Settle();
}

void Poller::Abandon(std::uint64_t client, Now now) {
  Advance(now);
  agenda_.routes.queue().Abandon(client);
  line_.Abandon(client);
  if (line_.is_open()) Settle();
}

std::optional<Instant> Poller::Deadline() const {
  if (!line_.is_open()) return std::nullopt;
  std::optional<Instant> soonest = line_.Deadline();
  const auto sooner = [&](std::optional<Instant> other) { soonest = Soonest({soonest, other}); };
  sooner(agenda_.write_queue.Deadline());
  sooner(agenda_.routes.queue().Deadline());
  sooner(unasked_.speaker().DueAt());
  if (!line_.idle()) return soonest;
  if (const auto rest = turns_.RestsUntil(time_.now().instant)) {
    sooner(rest);
    return soonest;
  }
  if (run_.job() != nullptr) {  // waits until no late answer can meet its request
    sooner(run_.NextTurnAt());
    return soonest;
  }
  if (const auto until = hold_.WaitsUntil()) {
    const Instant clear = std::min(owed_.late.AllClearAt(), *until);
    if (clear > time_.now().instant) sooner(clear);
  }
  if (!hold_.holds()) sooner(chooser_.NextAt(time_.idle()));
  return soonest;
}

bool Poller::Pause(Now now) {
  hold_.Pause(now.instant);
  const bool idle = line_.is_open() && line_.idle() && run_.job() == nullptr;
  return idle && std::min(owed_.late.AllClearAt(), *hold_.WaitsUntil()) <= now.instant;
}

void Poller::OnUnansweredTelegram(Now now) {
  Advance(now);
  upkeep_.OnUnansweredTelegram(now.instant);
}

bool Poller::MayGoOut(Now now) const {
  const Job* const job = run_.job();
  return job == nullptr || !WhyNotSend(*job, now.instant);
}

void Poller::GoOn(Now now) {
  if (!hold_.GoOn() || !line_.is_open()) return;
  Advance(now);
  time_.Restart();
  Settle();
}

void Poller::CallOffWindUp(Now now) {
  hold_.CallOffWindUp();
  Advance(now);
  if (line_.is_open()) Settle();
}

Speaking Poller::SpeakingAs(std::uint32_t index) const {
  const Device& device = roster_.DeviceAt(index);
  return {device.protocol, device.options, device.serial, device.times};
}

bool Poller::IsWriting() const {
  const Job* const job = run_.job();
  if (job == nullptr || (job->step.waiting && !job->begun())) return false;
  const auto* const routed = job->As<Job::Routed>();
  return job->As<Job::Write>() != nullptr || (routed != nullptr && !routed->is_read);
}

// ---------------------------------------------------------------- after each input

void Poller::Settle() {
  line_.Conclude();
  time_.OnHandled(line_.idle());
  const Instant now = time_.now().instant;
  ChargeProbe();
  line_.Withdraw();
  clients_.AnswerCommands(now);
  clients_.AnswerRouted(time_.idle(), run_.job() == nullptr);
  const auto answer_confirmed = [&] {
    clients_.AnswerConfirmed([this](std::size_t device) {
      const Member& member = *roster_.everyone()[device];
      return line_.is_open() && (agenda_.parked.HasReadBack(member) || run_.IsReadingBack(member));
    });
  };
  answer_confirmed();  // before the next write is to be read back
  Pump();
  answer_confirmed();
  const Speaker& speaker = unasked_.speaker();
  if (speaker.drained()) listener_.OnDrained(speaker.device()->index, now);
}

/// The cost of the probe that ended last is known when the line is idle.
void Poller::ChargeProbe() {
  const Instant now = time_.now().instant;
  Probes& probes = agenda_.probes;
  const auto began = probes.began();
  if (began && line_.idle()) probes.OnIdle(chooser_.Waited(*began, now), now);
}

/// As long as the line is idle: the job takes its turn, or the next one is chosen.
void Poller::Pump() {
  const Member* last = nullptr;
  while (line_.idle() && MayTurn(last)) {
    if (run_.job() == nullptr) {
      if (hold_.holds()) return;
      ChargeProbe();  // of one that was not sent
      std::unique_ptr<Job> job = chooser_.Next(time_.idle());
      if (!job) return;
      last = job->member;
      run_.Begin(std::move(job));
      continue;
    }
    switch (run_.TakeTurn()) {
      case JobRun::Turn::send:
        line_.Start(time_.idle().since, time_.now());
        break;
      case JobRun::Turn::next:
        break;
      case JobRun::Turn::wait:
        return;
    }
  }
}

/// `last`: the member of the latest job.
bool Poller::MayTurn(const Member* last) {
  const TurnLimit::Turn turn = turns_.Take(time_.now().instant);
  const Member* const member = run_.job() != nullptr ? run_.job()->member : last;
  if (turn == TurnLimit::Turn::rest_and_tell && member != nullptr) {
    listener_.OnWarning(member->index, TurnLimit::kWarning);
  }
  return turn == TurnLimit::Turn::take;
}

}  // namespace baudgate
