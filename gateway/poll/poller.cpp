// The poller's inputs, and who is answered when. How the line and the job under way come together
// is in poller_line.cpp.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/poll/poller.h"

#include <algorithm>
#include <utility>

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
               PointStore& store, RequestPort& port, PollerListener& listener)
    : store_(store),
      port_(port),
      listener_(listener),
      line_(*this),
      echo_(line.echo),
      roster_(line, first_device, find),
      late_(roster_),
      examiner_(roster_),
      whose_reply_(roster_),
      ledger_(roster_, schedule_, store, store.LineIndex(line), listener),
      chooser_(line, roster_, schedule_, writes_, routes_, late_),
      upkeep_(roster_, schedule_, store, late_, whose_reply_, chooser_, ledger_),
      speaker_(roster_),
      run_(store, listener, roster_, schedule_, writes_, routes_, late_, whose_reply_, ledger_,
           chooser_, upkeep_, told_) {
  if (speaker_.device() == nullptr) return;
  line_.Listen(*speaker_.standing());
  ledger_.OnSpeaks(*speaker_.device());
}

// ---------------------------------------------------------------- inputs

void Poller::Advance(Now now) {
  was_idle_ = line_.idle();
  now_ = now;
  run_.OnTime(now, !was_idle_);
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
  winding_up_ = false;
  paused_ = false;
  idle_since_ = now.instant;
  ledger_.OnOpened();
  run_.OnOpened();
  line_.OnOpened(now.instant, keeps_bit_rate);
  chooser_.probes().OnOpened();
  echo_.OnOpened();
  examiner_.OnOpened();
  upkeep_.OnOpened(now.instant);
  if (speaker_.device() != nullptr) ledger_.OnState(*speaker_.device(), "the port is open");
  Pump();
}

void Poller::OnClosed(Now now, Override why) {
  Advance(now);
  paused_ = false;
  ledger_.OnClosed(why);
  const std::string reason = ledger_.WhyClosed();
  LineNews news = line_.OnClosed();
  const bool cut_off = news.end.has_value() && run_.job() != nullptr;
  if (cut_off) ledger_.OnCutOff(*run_.job()->member, examiner_.End(Outcome::line_down));
  Hear(std::move(news));
  echo_.OnClosed();
  run_.OnClosed(reason);
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
  if (in_use) upkeep_.OnEnabled(device, is_open(), now.instant);
  if (device.in_use != in_use) upkeep_.SetInUse(device, in_use, is_open(), now.instant);
  if (is_open()) Settle();
}

void Poller::OnBytes(View bytes, Now now) {
  Advance(now);
  const Job* const job = run_.job();
  const EchoWatch::Heard heard = echo_.OnReceived(bytes, job != nullptr ? &job->request : nullptr);
  if (heard.echo) {
    ledger_.OnEcho();
    run_.OnEcho();
  }
  if (heard.warning != nullptr) listener_.OnWarning(job->member->index, heard.warning);
  if (heard.collision) {
    ledger_.OnCollision();
    ledger_.OnSecondMaster();
    Hear(line_.OnCollision(now.instant));
  }
  if (!heard.bytes.empty()) {
    ledger_.OnReceived(heard.bytes);
    examiner_.Hear(heard.bytes, now.instant);
    if (const auto before = speaker_.Hear(heard.bytes, now.instant)) {
      ledger_.OnMore(*speaker_.device(), *before);
    }
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
  Hear(line_.OnTimer(now.instant));
  if (is_open()) {
    if (auto said = speaker_.OnTimer(now)) TakeUnasked(std::move(*said));
  }
  Settle();
}

bool Poller::Submit(WriteCommand command, Now now) {
  Advance(now);
  AnswerCommands();  // those of clients that have left take no room
  if (writes_.full()) return false;
  if (!is_open()) {
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
  for (const std::uint32_t point : command.reads) {
    writes_.AddReadBacks(device.place, device.conversation->Queries(), point);
  }
  writes_.Confirm(std::move(command), now_.instant);
}

void Poller::Submit(RoutedRequest request, Now now) {
  Advance(now);
  if (!is_open() || roster_.carrier() == nullptr) {
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

void Poller::OnUnsettledWrite(std::uint32_t index) {
  roster_.DeviceAt(index).conversation->OnUnsettledWrite();
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
  if (is_open()) Settle();
}

void Poller::Forget(std::uint64_t client, Now now) {
  Advance(now);
  routes_.queue().Forget(client);
  run_.Forget(client);
  if (is_open()) Settle();
}

std::optional<Instant> Poller::Deadline() const {
  if (!is_open()) return std::nullopt;
  std::optional<Instant> soonest = line_.Deadline();
  const auto sooner = [&](std::optional<Instant> other) {
    if (other && (!soonest || *other < *soonest)) soonest = other;
  };
  sooner(writes_.Deadline());
  sooner(routes_.queue().Deadline());
  sooner(speaker_.DueAt());
  const Job* const job = run_.job();
  if (line_.state() == Line::State::quiet && job != nullptr) sooner(LatestStart(*job));
  if (!line_.idle()) return soonest;
  if (job != nullptr) {  // waits until no late answer can meet its request
    if (job->attempts == 0) sooner(late_.ClearAt(job->asked()));
    sooner(LatestStart(job->goal()));
    return soonest;
  }
  if (!winding_up_ && !paused_) sooner(chooser_.NextAt(idle()));
  return soonest;
}

bool Poller::Pause() {
  paused_ = true;
  return is_open() && line_.idle() && run_.job() == nullptr;
}

void Poller::GoOn(Now now) {
  if (!std::exchange(paused_, false) || !is_open()) return;
  Advance(now);
  idle_since_ = now.instant;
  Settle();
}

Speaking Poller::SpeakingAs(std::uint32_t index) const {
  const Device& device = roster_.DeviceAt(index);
  return {device.protocol, &device.config->options, device.serial, device.times};
}

bool Poller::IsWriting() const {
  const Job* const job = run_.job();
  if (job == nullptr || (job->sending && !job->begun())) return false;
  const auto* const routed = job->As<Job::Routed>();
  return job->As<Job::Write>() != nullptr || (routed != nullptr && !routed->is_read());
}

void Poller::Settle() {
  Conclude();
  if (!was_idle_ && line_.idle()) idle_since_ = now_.instant;
  Probes& probes = chooser_.probes();
  if (const auto began = probes.began(); began && line_.idle()) {
    probes.OnIdle(chooser_.Waited(*began, now_.instant), now_.instant);
  }
  if (line_.state() == Line::State::quiet && run_.Withdraw()) line_.Cancel();
  AnswerCommands();
  AnswerRouted();
  AnswerConfirmed();  // before the next write is to be read back
  Pump();
  AnswerConfirmed();
  if (speaker_.drained()) listener_.OnDrained(speaker_.device()->index, now_.instant);
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
  for (const WriteQueue::Confirmed& one :
       writes_.TakeConfirmed(is_open() && run_.IsReadingBack())) {
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
    const std::size_t keep = run_.job() == nullptr && chooser_.MayProbe(*member, idle()) ? 1 : 0;
    for (RoutedRequest& read :
         routes_.TakeHopeless(*member, keep, *roster_.carrier()->carrier, now_.instant)) {
      read.done({Outcome::no_reply, {}, DoesNotAnswer(slave)});
    }
  }
}

}  // namespace baudgate
