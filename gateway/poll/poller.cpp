// The poller's inputs. How the line and the job under way come together is in poller_line.cpp.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/poll/poller.h"

#include <utility>

namespace baudgate {

Poller::Poller(const config::Line& line, std::uint32_t first_device, const FindProtocol& find,
               PointStore& store, RequestPort& port, PollerListener& listener)
    : port_(port),
      listener_(listener),
      line_(*this),
      roster_(line, first_device, find),
      owed_(roster_),
      reception_(line.echo, roster_, owed_.whose),
      ledger_(roster_, agenda_.schedule, store, store.LineIndex(line), listener),
      chooser_(line, roster_, agenda_, owed_.late),
      upkeep_(roster_, store, owed_, chooser_, ledger_),
      clients_(store, roster_, chooser_, ledger_.devices),
      intake_(store, listener),
      unasked_(roster_, ledger_, upkeep_, intake_),
      run_(owed_, chooser_, ledger_, upkeep_, intake_) {
  const Speaker& speaker = unasked_.speaker();
  if (speaker.device() == nullptr) return;
  line_.Listen(*speaker.standing());
  ledger_.devices.OnSpeaks(*speaker.device());
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
  if (is_open()) OnClosed(now);
  Advance(now);
  hold_.OnOpened();
  time_.Restart();
  ledger_.OnOpened();
  reception_.OnOpened();
  line_.OnOpened(now.instant, keeps_bit_rate);
  chooser_.probes().OnOpened();
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
  LineNews news = line_.OnClosed();
  if (news.end) news.end->reason = reason;
  Hear(std::move(news));
  Conclude();
  reception_.OnClosed();
  run_.OnClosed(reason);
  for (const auto& device : roster_.devices()) {
    chooser_.parked().Drop(*device);
    agenda_.schedule.Suspend(device->place);
  }
  chooser_.probes().OnClosed();
  clients_.AnswerAll(reason);
  upkeep_.ShowLine(now.instant);
}

void Poller::SetInUse(std::uint32_t index, bool in_use, Now now) {
  Advance(now);
  Device& device = roster_.DeviceAt(index);
  if (in_use) upkeep_.OnEnabled(device, is_open(), now.instant);
  if (device.in_use != in_use) upkeep_.SetInUse(device, in_use, is_open(), now.instant);
  if (is_open()) Settle();
}

void Poller::OnBytes(View bytes, Now now) {
  Advance(now);
  const Job* const job = run_.job();
  const EchoWatch::Received heard = reception_.OnBytes(bytes, job, now.instant);
  if (heard.echo) ledger_.line.OnEcho();
  if (heard.warning != nullptr) listener_.OnWarning(job->member->index, heard.warning);
  if (heard.collision) {
    ledger_.line.OnCollision();
    ledger_.line.OnSecondMaster();
    Hear(line_.OnCollision(now.instant));
  }
  if (!heard.bytes.empty()) {
    ledger_.line.OnReceived(heard.bytes);
    unasked_.OnBytes(heard.bytes, now.instant);
    Hear(line_.OnBytes(heard.bytes, now.instant));
  }
  Settle();
}

void Poller::OnEnded(Now now) {
  Advance(now);
  Hear(line_.OnEnded(now.instant));
  Settle();
}

void Poller::OnTimer(Now now) {
  Advance(now);
  Withdraw();  // the program may have been stopped since the line began to wait for its quiet
  Hear(line_.OnTimer(now.instant));
  if (is_open()) unasked_.OnTimer(now);
  Settle();
}

bool Poller::Submit(WriteCommand command, Now now) {
  Advance(now);
  clients_.AnswerCommands(now.instant);  // those of clients that have left take no room
  if (agenda_.write_queue.full()) return false;
  if (!is_open()) {
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
  if (!is_open() || roster_.carrier() == nullptr) {
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
  chooser_.background().Release(device.place);
  upkeep_.PlanBackground(device);
  if (is_open()) Settle();
}

void Poller::Abandon(std::uint64_t client, Now now) {
  Advance(now);
  agenda_.routes.queue().Abandon(client);
  run_.Abandon(client, port_.IsUnsent());
  if (is_open()) Settle();
}

std::optional<Instant> Poller::Deadline() const {
  if (!is_open()) return std::nullopt;
  std::optional<Instant> soonest = line_.Deadline();
  const auto sooner = [&](std::optional<Instant> other) {
    if (other && (!soonest || *other < *soonest)) soonest = other;
  };
  sooner(agenda_.write_queue.Deadline());
  sooner(agenda_.routes.queue().Deadline());
  sooner(unasked_.speaker().DueAt());
  const Job* const job = run_.job();
  if (line_.state() == Line::State::quiet && job != nullptr) sooner(LatestStart(*job));
  if (!line_.idle()) return soonest;
  if (job != nullptr) {  // waits until no late answer can meet its request
    if (job->step.retries == 0) sooner(owed_.late.ClearAt(job->asked()));
    sooner(LatestStart(job->goal()));
    return soonest;
  }
  if (!hold_.holds()) sooner(chooser_.NextAt(time_.idle()));
  return soonest;
}

bool Poller::Pause() {
  hold_.Pause();
  return is_open() && line_.idle() && run_.job() == nullptr;
}

bool Poller::MayGoOut(Now now) const {
  const Job* const job = run_.job();
  return job == nullptr || !WhyNotSend(*job, now.instant);
}

void Poller::GoOn(Now now) {
  if (!hold_.GoOn() || !is_open()) return;
  Advance(now);
  time_.Restart();
  Settle();
}

void Poller::CallOffWindUp(Now now) {
  hold_.CallOffWindUp();
  Advance(now);
  if (is_open()) Settle();
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

/// The request that waits for a quiet line may have become too late. The line begins again with
/// the next request, also if that is one of the same job that closes what it has opened.
void Poller::Withdraw() {
  if (line_.state() == Line::State::quiet && run_.Withdraw()) line_.Cancel();
}

void Poller::Settle() {
  Conclude();
  time_.OnHandled(line_.idle());
  const Instant now = time_.now().instant;
  Probes& probes = chooser_.probes();
  if (const auto began = probes.began(); began && line_.idle()) {
    probes.OnIdle(chooser_.Waited(*began, now), now);
  }
  Withdraw();
  clients_.AnswerCommands(now);
  clients_.AnswerRouted(time_.idle(), run_.job() == nullptr);
  const auto answer_confirmed = [&] {
    clients_.AnswerConfirmed(is_open() && run_.IsReadingBack());
  };
  answer_confirmed();  // before the next write is to be read back
  Pump();
  answer_confirmed();
  const Speaker& speaker = unasked_.speaker();
  if (speaker.drained()) listener_.OnDrained(speaker.device()->index, now);
}

}  // namespace baudgate
