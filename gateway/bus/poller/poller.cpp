// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/poller/poller.h"

#include <utility>

#include "gateway/base/time.h"

namespace baudgate {

Poller::Poller(const config::Line& line, std::uint32_t first_device, const FindProtocol& find,
               PointStore& store, RequestPort& port, PollerListener& listener,
               const MakeObserver& observe)
    : context_(line, first_device, find, store, listener),
      observer_(observe ? observe(context_.roster) : std::make_unique<LineObserver>()),
      intake_parts_(context_, *observer_, store, listener),
      chooser_(context_.roster, context_.agenda, context_.owed.late_replies),
      phases_(context_, chooser_, intake_parts_.replies),
      run_(phases_),
      reception_(line.echo, *observer_, context_.owed.whose),
      line_side_(reception_, intake_parts_.unasked.standing(), run_, port),
      devices_(context_.roster, context_.accounts, context_.tracker, intake_parts_.unasked,
               intake_parts_.replies),
      clients_(store, context_.roster, chooser_, context_.owed.whose, context_.agenda,
               context_.accounts.devices),
      turn_taker_(chooser_, run_, context_.accounts.line),
      line_(line_side_, intake_parts_.unasked, context_.tracker, context_.accounts) {}

// ---------------------------------------------------------------- inputs

void Poller::Advance(Now now) {
  const bool idle = line_.idle();
  const Duration passed = time_.OnInput(now, idle);
  line_.OnTime(now);
  turn_taker_.OnTime(now, passed, idle);
}

void Poller::Recall(std::uint32_t index, std::string memory, Now now) {
  Advance(now);
  devices_.Recall(index, std::move(memory), now);
}

void Poller::OnOpened(Now now, bool keeps_bit_rate) {
  if (line_.is_open()) OnClosed(now);
  Advance(now);
  turn_taker_.OnOpened();
  time_.Restart();
  line_.OnOpened(now, keeps_bit_rate);
  devices_.OnOpened(now.instant);
  TakeTurns();
}

void Poller::OnClosed(Now now, Override why) {
  Advance(now);
  turn_taker_.OnClosed();
  const std::string reason = devices_.OnClosing(why);
  line_.OnClosed(reason, now);
  devices_.OnClosed(now.instant);
  clients_.AnswerAll(reason);
}

void Poller::SetInUse(std::uint32_t index, bool in_use, Now now) {
  Advance(now);
  devices_.SetInUse(index, in_use, line_.is_open(), now.instant);
  SettleIfOpen();
}

void Poller::Receive(View bytes, Now now) {
  Advance(now);
  line_.HandleBytes(bytes, now);
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
  if (line_.is_open()) devices_.OnTimer(now);
  Settle();
}

bool Poller::Submit(WriteCommand command, Now now) {
  Advance(now);
  if (!clients_.MakeRoom(now.instant)) return false;
  if (!line_.is_open()) {
    clients_.NotSent(command, devices_.WhyClosed());
  } else {
    clients_.Take(std::move(command), now.instant);
    Settle();
  }
  return true;
}

void Poller::Submit(RoutedRequest request, Now now) {
  Advance(now);
  if (line_.is_open() && clients_.Take(request)) return Settle();
  request.done({Outcome::line_down, {}, devices_.WhyClosed()});
}

void Poller::OnHostClock(bool right) { devices_.OnHostClock(right); }

void Poller::OnUnsettledWrite(std::uint32_t index) { devices_.OnUnsettledWrite(index); }

void Poller::OnEventsKept(std::uint32_t index, const std::string& said, Now now) {
  Advance(now);
  devices_.OnEventsKept(index, said, now.instant);
  SettleIfOpen();
}

void Poller::Abandon(std::uint64_t client, Now now) {
  Advance(now);
  clients_.Abandon(client);
  line_.Abandon(client);
  SettleIfOpen();
}

std::optional<Instant> Poller::Deadline() const {
  if (!line_.is_open()) return std::nullopt;
  return Soonest({line_.Deadline(), clients_.Deadline(), devices_.Deadline(),
                  line_.idle() ? turn_taker_.NextAt(time_.idle()) : std::nullopt});
}

bool Poller::Pause(Now now) {
  const bool rests = turn_taker_.Pause(now.instant);
  return rests && line_.is_open() && line_.idle();
}

void Poller::OnUnansweredTelegram(Now now) {
  Advance(now);
  devices_.OnUnansweredTelegram(now.instant);
}

void Poller::OnWritingTelegram(std::uint32_t device, View telegram, Now now) {
  Advance(now);
  devices_.OnWritingTelegram(device, telegram, now.instant);
}

bool Poller::MayGoOut(Now now) const {
  const Job* const job = turn_taker_.job();
  return job == nullptr || !WhyNotSend(*job, now.instant, true);
}

void Poller::GoOn(Now now) {
  if (!turn_taker_.GoOn() || !line_.is_open()) return;
  Advance(now);
  time_.Restart();
  Settle();
}

void Poller::CallOffWindUp(Now now) {
  turn_taker_.CallOffWindUp();
  Advance(now);
  SettleIfOpen();
}

Speaking Poller::SpeakingAs(std::uint32_t index) const { return devices_.SpeakingAs(index); }

bool Poller::IsWriting() const {
  const Job* const job = turn_taker_.job();
  if (job == nullptr || (job->step.waiting && !job->begun())) return false;
  const auto* const routed = job->As<Job::Routed>();
  return job->As<Job::Write>() != nullptr || (routed != nullptr && !routed->is_read);
}

// ---------------------------------------------------------------- after each input

void Poller::SettleIfOpen() {
  if (line_.is_open()) Settle();
}

void Poller::Settle() {
  line_.HandleEnd();
  time_.OnHandled(line_.idle());
  const Idle idle = time_.idle();
  if (line_.idle()) turn_taker_.ChargeProbe(idle.now);
  line_.Withdraw();
  clients_.AnswerCommands(idle.now);
  clients_.AnswerRouted(idle, turn_taker_.job() == nullptr);
  clients_.AnswerConfirmed(turn_taker_.job());  // before the next write is to be read back
  TakeTurns();
  clients_.AnswerConfirmed(turn_taker_.job());
  devices_.OnSettled(idle.now);
}

void Poller::TakeTurns() {
  while (line_.idle() && turn_taker_.Take(time_.idle()))
    line_.Start(time_.idle().since, time_.now());
}

}  // namespace baudgate
