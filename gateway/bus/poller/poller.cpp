// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/poller/poller.h"

#include <algorithm>
#include <memory>
#include <utility>

namespace baudgate::bus {

Poller::Poller(const config::Line& line, std::uint32_t first_device, const FindProtocol& find,
               PointStore& store, RequestPort& port, PollerListener& listener,
               const MakeObserver& observe)
    : context_(line, first_device, find, store, listener, observe),
      unasked_(context_.roster, *context_.observer, context_.accounts, context_.tracker,
               context_.intake),
      runner_(line.echo, context_, unasked_, port),
      clients_(store, context_) {}

void Poller::Attach(Tap& tap, std::vector<protocols::ForeignRule> foreign) {
  context_.roster.SetForeign(std::move(foreign));
  context_.accounts.Attach(tap);
}

void Poller::Advance(Now now) {
  const bool idle = runner_.idle();
  const Duration passed = time_.OnInput(now, idle);
  runner_.OnTime(now);
  context_.chooser.OnTime(passed, idle ? nullptr : runner_.member());
}

// ---------------------------------------------------------------- the port

void Poller::OnOpened(Now now, bool keeps_bit_rate) {
  if (runner_.is_open()) OnClosed(now);
  Advance(now);
  hold_.OnOpened();
  time_.Restart();
  runner_.OnOpened(keeps_bit_rate);
  context_.tracker.OnOpened(now.instant);
  unasked_.OnOpened();
  TakeTurns();
}

void Poller::OnClosed(Now now, Override why) {
  Advance(now);
  hold_.OnClosed();
  context_.accounts.OnClosed(why);
  const std::string reason = context_.accounts.states.WhyClosed();
  runner_.OnClosed(reason);
  context_.tracker.OnClosed(now.instant);
  clients_.AnswerAll(reason);
}

void Poller::Receive(View bytes, Now now) {
  Advance(now);
  runner_.Receive(bytes);
  Settle();
}

void Poller::OnEnded(Now now) {
  Advance(now);
  runner_.OnEnded();
  Settle();
}

void Poller::OnTimer(Now now) {
  Advance(now);
  runner_.OnTimer();
  // A device that sends unasked may report something at a certain time even without a message.
  if (runner_.is_open()) unasked_.OnTimer(now);
  Settle();
}

std::optional<Instant> Poller::Deadline() const {
  if (!runner_.is_open()) return std::nullopt;
  return Soonest({runner_.Deadline(), clients_.Deadline(), unasked_.Deadline(),
                  runner_.idle() ? NextTurnAt() : std::nullopt});
}

// ---------------------------------------------------------------- clients

bool Poller::Submit(WriteCommand command, Now now) {
  Advance(now);
  if (!clients_.MakeRoom(now.instant)) return false;
  if (!runner_.is_open()) {
    clients_.NotSent(command, context_.accounts.states.WhyClosed());
  } else {
    clients_.Take(std::move(command), now.instant);
    Settle();
  }
  return true;
}

void Poller::Submit(RoutedRequest request, Now now) {
  Advance(now);
  if (runner_.is_open() && clients_.Take(request)) return Settle();
  request.done({Outcome::line_down, {}, context_.accounts.states.WhyClosed()});
}

void Poller::Abandon(std::uint64_t client, Now now) {
  Advance(now);
  clients_.Abandon(client);
  runner_.Abandon(client);
  SettleIfOpen();
}

// ---------------------------------------------------------------- devices

void Poller::Recall(std::uint32_t index, std::string memory, Now now) {
  Advance(now);
  Device& device = context_.roster.DeviceAt(index);
  device.conversation->Recall(memory, now);
  device.memory = std::move(memory);
  context_.tracker.OnRecalled(device);
}

void Poller::SetInUse(std::uint32_t index, bool in_use, Now now, const std::string& by) {
  Advance(now);
  Device& device = context_.roster.DeviceAt(index);
  const bool open = runner_.is_open();
  if (in_use) context_.tracker.OnEnabled(device, open, now.instant);
  if (device.in_use != in_use) {
    context_.tracker.SetInUse(device, in_use, open, now.instant);
    context_.tracker.NoteUse(device, by, now.wall);
  }
  SettleIfOpen();
}

void Poller::OnHostClock(bool right) {
  for (const auto& device : context_.roster.devices()) device->conversation->OnHostClock(right);
}

void Poller::OnUnsettledWrite(std::uint32_t index) {
  Device& device = context_.roster.DeviceAt(index);
  device.conversation->OnUnsettledWrite();
  context_.accounts.states.OnMemory(device);
}

void Poller::OnEventsKept(std::uint32_t index, const std::string& said, Now now) {
  Advance(now);
  Device& device = context_.roster.DeviceAt(index);
  device.conversation->OnEventsKept(said);
  unasked_.OnKept(device);
  context_.agenda.schedule.ReleaseEvents(device.place, device.conversation->HasEvents(),
                                         context_.intake.OnKept(device, said), now.instant);
  context_.agenda.background.Release(device.place);
  context_.tracker.PlanBackground(device);
  SettleIfOpen();
}

// ---------------------------------------------------------------- pause of the line

bool Poller::IsClear(Instant now) const {
  const auto until = hold_.WaitsUntil();
  return until && std::min(context_.owed.late_replies.AllClearAt(), *until) <= now;
}

bool Poller::Pause(Now now) {
  hold_.Pause(now.instant);
  return runner_.job() == nullptr && IsClear(now.instant) && runner_.is_open() && runner_.idle();
}

void Poller::GoOn(Now now) {
  if (!hold_.GoOn() || !runner_.is_open()) return;
  Advance(now);
  time_.Restart();
  Settle();
}

void Poller::CallOffWindUp(Now now) {
  hold_.CallOffWindUp();
  Advance(now);
  SettleIfOpen();
}

bool Poller::MayGoOut(Now now) const {
  const Job* const job = runner_.job();
  return job == nullptr || !job->WhyNotSend(now.instant, true);
}

bool Poller::IsWriting() const {
  const Job* const job = runner_.job();
  const bool begun = job != nullptr && (!job->step.waiting || job->begun());
  return begun && job->is_writing();
}

Speaking Poller::SpeakingAs(std::uint32_t index) const {
  const Device& device = context_.roster.DeviceAt(index);
  return {device.protocol, device.options, device.serial, device.times};
}

void Poller::OnUnansweredTelegram(Now now) {
  Advance(now);
  context_.tracker.OnUnansweredTelegram(now.instant);
}

void Poller::OnWritingTelegram(std::uint32_t index, View telegram, Now now) {
  Advance(now);
  context_.tracker.OnTelegram(*context_.roster.DeviceAt(index).protocol, telegram, now.instant);
}

// ---------------------------------------------------------------- after each input

void Poller::SettleIfOpen() {
  if (runner_.is_open()) Settle();
}

void Poller::Settle() {
  time_.OnHandled(runner_.idle());
  const Idle idle = time_.idle();
  if (runner_.idle()) context_.chooser.ChargeProbe(idle.now);
  runner_.Withdraw();
  clients_.AnswerCommands(idle.now);
  clients_.AnswerRouted(idle, runner_.job() == nullptr);
  // Before the next write begins, clients are answered whose written values were read back.
  clients_.AnswerConfirmed(runner_.job());
  TakeTurns();
  clients_.AnswerConfirmed(runner_.job());
  unasked_.OnSettled(idle.now);
}

void Poller::TakeTurns() {
  while (runner_.idle() && TakeTurn()) runner_.Start(time_.idle().since);
}

/// Called when the line is idle. Returns true if the request of the present job is to be sent now.
/// Chooses the next job if there is none. Returns false if no job can be sent, if the line is
/// paused, or if there were too many turns without any passing time (TurnLimit).
bool Poller::TakeTurn() {
  const Member* last = nullptr;
  while (CountTurn(last)) {
    if (runner_.job() == nullptr) {
      if (hold_.holds()) return false;
      // In case a probe has ended without being sent.
      context_.chooser.ChargeProbe(time_.idle().now);
      std::unique_ptr<Job> job = context_.chooser.Next(time_.idle());
      if (!job) return false;
      last = job->member;
      runner_.Begin(std::move(job));
      continue;
    }
    const JobRunner::Turn turn = runner_.TakeTurn();
    if (turn != JobRunner::Turn::next) return turn == JobRunner::Turn::send;
  }
  return false;
}

/// Counts a turn. Returns false if there were too many turns without any passing time; the line
/// then rests, with a warning. `last`: the device that the warning names if there is no job.
bool Poller::CountTurn(const Member* last) {
  const TurnLimit::Turn turn = limit_.Take(time_.idle().now);
  const Member* const member = runner_.job() != nullptr ? runner_.job()->member : last;
  if (turn == TurnLimit::Turn::rest_and_tell && member != nullptr) {
    context_.accounts.line.Warn(*member, TurnLimit::kWarning);
  }
  return turn == TurnLimit::Turn::take;
}

/// The line is idle. Returns the next time at which TakeTurn can return another result without
/// input.
std::optional<Instant> Poller::NextTurnAt() const {
  const Idle idle = time_.idle();
  if (const auto rest = limit_.RestsUntil(idle.now)) return rest;
  // The job waits until no late reply can be taken for the reply to its request.
  if (const Job* const job = runner_.job()) return job->DepartsAt(context_);
  std::optional<Instant> soonest;
  if (const auto until = hold_.WaitsUntil()) {
    const Instant clear = std::min(context_.owed.late_replies.AllClearAt(), *until);
    if (clear > idle.now) soonest = clear;
  }
  return hold_.holds() ? soonest : Soonest({soonest, context_.chooser.NextAt(idle)});
}

}  // namespace baudgate::bus
