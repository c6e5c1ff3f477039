// SPDX-License-Identifier: Apache-2.0
#include "gateway/poller.h"

#include <algorithm>
#include <utility>

#include "gateway/conversion.h"

namespace baudgate {
namespace {

/// A task that needs more exchanges than this is a conversation going round in circles.
constexpr int kMostSteps = 8;

/// Writes and the reads that follow them go first, but after so many in a row a poll has its turn.
constexpr int kUrgentInRow = 4;

LineTimes Resolve(const config::Line& line, const config::Device& device, const Protocol& protocol,
                  const config::SerialSettings& serial) {
  const config::Timing timing = Merge(device.timing, Merge(line.timing, protocol.timing(serial)));
  LineTimes times;
  times.quiet = timing.quiet.value_or(5ms);
  times.reply = timing.reply.value_or(500ms);
  times.gap = timing.gap.value_or(50ms);
  times.drain = timing.drain.value_or(100ms);
  times.ceiling = std::max(timing.ceiling.value_or(2s), times.reply + times.gap);
  times.character = serial.CharacterTime();
  return times;
}

}  // namespace

struct Poller::Device {
  std::uint32_t index = 0;  // in the point store
  std::size_t slot = 0;     // in devices_ and in the schedule
  const config::Device* config = nullptr;
  const Protocol* protocol = nullptr;
  config::SerialSettings serial;
  LineTimes times;
  int retries = 0;
  std::unique_ptr<Conversation> conversation;
  DeviceHealth health;
  DeviceState shown = DeviceState::never_seen;
  std::unique_ptr<Work> parked;  // a task that the device asked to wait with
  Instant parked_until{};
  Duration late_drain{};  // how much longer than its drain time this device was seen to need
  std::optional<Instant> unanswered;  // start of the first exchange since its last answer
  Instant late_until{};               // until then an answer to a failed request may still come
  Duration fast_wire{};               // line time of its last whole fast round
  Duration round_wire{};              // of the fast round under way

  Duration WorstCase() const {
    return times.quiet + 32 * times.character + times.reply + times.drain + late_drain;
  }
};

struct Poller::Work {
  Device* device = nullptr;
  Task task;
  std::optional<WriteCommand> command;
  std::size_t write = 0;  // index in command->writes
  bool fast = false;
  bool last_of_round = false;
  Request request;
  bool sending = false;  // request waits for the line to be idle
  int attempts = 0;      // of the present request, beyond the first
  int steps = 0;
  int parkings = 0;   // how often the device has asked to wait with it
  bool mute = false;  // its end says nothing about the device
  Instant began{};
  Instant exchange_began{};
  Answer answer;
  std::optional<ExchangeEnd> end;
};

Poller::Poller(const config::Line& line, std::uint32_t first_device, const FindProtocol& find,
               PointStore& store, PollerListener& listener)
    : config_(line), store_(store), listener_(listener), line_(*this) {
  std::vector<std::pair<const Protocol*, Bus*>> made;
  for (std::size_t slot = 0; slot < line.devices.size(); ++slot) {
    auto device = std::make_unique<Device>();
    device->index = first_device + static_cast<std::uint32_t>(slot);
    device->slot = slot;
    device->config = &line.devices[slot];
    device->protocol = &find(device->config->protocol);
    device->serial = device->config->serial.value_or(line.serial);
    device->times = Resolve(line, *device->config, *device->protocol, device->serial);
    device->retries = device->config->retries.value_or(line.retries);
    auto known = std::find_if(made.begin(), made.end(),
                              [&](const auto& pair) { return pair.first == device->protocol; });
    if (known == made.end()) {
      buses_.push_back(device->protocol->make_bus(line));
      known = made.insert(made.end(), {device->protocol, buses_.back().get()});
    }
    device->conversation = known->second->MakeConversation(*device->config);
    schedule_.AddDevice(device->config->poll, device->config->slow);
    devices_.push_back(std::move(device));
    Plan(*devices_.back());
    store_.SetOverride(devices_.back()->index, OverrideOf(*devices_.back()));
  }
}

Poller::~Poller() = default;

// ---------------------------------------------------------------- inputs

void Poller::OnOpened(Now now) {
  if (open_) OnClosed(now);
  now_ = now;
  open_ = true;
  last_life_ = now.instant;
  line_.OnOpened(now.instant);
  for (const auto& device : devices_) {
    if (!device->config->enabled) continue;
    device->conversation->OnReconnect();
    Plan(*device);
    if (!device->health.absent()) schedule_.Restart(device->slot, now.instant);
    store_.SetOverride(device->index, OverrideOf(*device));
  }
  Pump();
}

void Poller::OnClosed(Now now) {
  now_ = now;
  open_ = false;
  line_.OnClosed(now.instant);
  if (work_) FinishTask(Outcome::line_down, "the port is closed");
  for (const auto& device : devices_) {
    device->parked.reset();
    schedule_.Suspend(device->slot);
    store_.SetOverride(device->index, OverrideOf(*device));
    if (!device->config->enabled) continue;
    store_.UpdateStatus(device->index, [](DeviceStatus& status) {
      status.last_outcome = Outcome::line_down;
      status.last_reason = "the port is closed";
    });
  }
  refresh_.clear();
  while (!commands_.empty()) {
    WriteCommand command = std::move(commands_.front());
    commands_.pop_front();
    command.done(Outcome::line_down, "the port is closed");
  }
}

void Poller::OnBytes(View bytes, Now now) {
  now_ = now;
  counters_.bytes_in += bytes.size();
  line_.OnBytes(bytes, now.instant);
  Settle();
}

void Poller::OnTimer(Now now) {
  now_ = now;
  line_.OnTimer(now.instant);
  Settle();
}

bool Poller::Submit(WriteCommand command, Now now) {
  now_ = now;
  if (commands_.size() >= kQueueLimit) return false;
  commands_.push_back(std::move(command));
  if (open_) {
    Settle();
  } else {
    WriteCommand refused = std::move(commands_.back());
    commands_.pop_back();
    refused.done(Outcome::line_down, "the port is closed");
  }
  return true;
}

std::optional<Instant> Poller::Deadline() const {
  if (!open_) return std::nullopt;
  std::optional<Instant> soonest = line_.Deadline();
  const auto sooner = [&](std::optional<Instant> other) {
    if (other && (!soonest || *other < *soonest)) soonest = other;
  };
  for (const WriteCommand& command : commands_) sooner(command.deadline);
  if (!line_.idle()) return soonest;
  if (work_) {  // waits until no late answer can meet its request
    sooner(ClearAt(*work_));
    if (work_->command && work_->steps == 1) sooner(work_->command->deadline);
    return soonest;
  }
  sooner(schedule_.NextDue());
  sooner(NextProbe());
  for (const auto& device : devices_) {
    if (device->parked) sooner(device->parked_until);
  }
  return soonest;
}

// ---------------------------------------------------------------- choosing the next exchange

void Poller::Settle() {
  if (work_ && work_->end) ConcludeExchange();
  ExpireCommands();
  Pump();
}

void Poller::ExpireCommands() {
  const auto expired = std::stable_partition(
      commands_.begin(), commands_.end(),
      [this](const WriteCommand& command) { return command.deadline > now_.instant; });
  std::vector<WriteCommand> late(std::make_move_iterator(expired),
                                 std::make_move_iterator(commands_.end()));
  commands_.erase(expired, commands_.end());
  for (const WriteCommand& command : late) {
    command.done(Outcome::no_reply, "the command waited for the line beyond its deadline");
  }
}

void Poller::Pump() {
  while (open_ && line_.idle()) {
    if (!work_ && !PickTask()) return;
    if (!work_ || !work_->sending) continue;
    if (IsTooLate(*work_)) {
      work_->mute = true;
      FinishTask(Outcome::no_reply, "the command waited for the line beyond its deadline");
      continue;
    }
    if (ClearAt(*work_) > now_.instant) return;
    work_->sending = false;
    work_->exchange_began = now_.instant;
    Exchange exchange{work_->request, work_->device->protocol->reply_rule, work_->device->times};
    exchange.times.drain += work_->device->late_drain;
    exchange.aftermath = Aftermath(*work_->device);
    last_ = work_->device;
    line_.Start(std::move(exchange), now_.instant);
  }
}

/// A reply to the first of several unanswered requests may be taken for one to the last. Those to
/// the requests between come after it, the last as much later as its request was sent later.
Duration Poller::Aftermath(const Device& device) const {
  if (!device.unanswered) return Duration::zero();
  const Duration since = now_.instant - *device.unanswered + device.times.gap;
  return std::min(since, device.times.ceiling);
}

/// When the request of `work` may be sent: no earlier than the last moment at which an answer to
/// another request could come that would pass for its own. A retry may be met by the answer to its
/// first try; a reply that carries its sender's address is not taken for another device's.
Instant Poller::ClearAt(const Work& work) const {
  if (work.attempts > 0) return {};
  Instant clear{};
  for (const auto& device : devices_) {
    const bool alike = device.get() == work.device || work.request.expect.address.empty();
    if (alike) clear = std::max(clear, device->late_until);
  }
  return clear;
}

/// Nothing of the command has been sent yet, and nothing may be any more.
bool Poller::IsTooLate(const Work& work) const {
  return work.command && work.steps == 1 && work.attempts == 0 &&
         work.command->deadline <= now_.instant;
}

bool Poller::PickTask() {
  if (urgent_in_row_ < kUrgentInRow && (PickCommand() || PickRefresh())) {
    ++urgent_in_row_;
    return true;
  }
  urgent_in_row_ = 0;
  // The probe knows its share: it does not take a poll's place on a line that is never idle.
  return PickParked() || PickProbe() || PickPoll() || PickCommand() || PickRefresh();
}

bool Poller::PickCommand() {
  if (commands_.empty()) return false;
  WriteCommand command = std::move(commands_.front());
  commands_.pop_front();
  Device& device = *devices_[command.device - devices_.front()->index];
  if (!device.config->enabled) {
    command.done(Outcome::no_reply, "the device is disabled");
  } else if (device.health.absent()) {
    command.done(Outcome::no_reply, "the device is offline");
  } else if (command.writes.empty()) {
    command.done(Outcome::ok, {});
  } else {
    Begin(device, {});
    work_->command = std::move(command);
    NextWrite();
  }
  return true;
}

bool Poller::PickParked() {
  for (const auto& device : devices_) {
    if (!device->parked || device->parked_until > now_.instant) continue;
    work_ = std::move(device->parked);
    Ask();
    return true;
  }
  return false;
}

bool Poller::PickRefresh() {
  if (refresh_.empty()) return false;
  const auto [device, query] = refresh_.front();
  refresh_.pop_front();
  if (device->health.absent() || query >= device->conversation->Queries().size()) return true;
  Begin(*device, {Task::Kind::poll, query, kNoPoint, {}});
  Ask();
  return true;
}

bool Poller::PickPoll() {
  const auto pick = schedule_.Next(now_.instant);
  if (!pick) return false;
  Device& device = *devices_[pick->device];
  Begin(device, {Task::Kind::poll, pick->query, kNoPoint, {}});
  work_->fast = pick->group == config::Group::fast;
  work_->last_of_round = pick->last_of_round;
  Ask();
  return true;
}

Poller::Device* Poller::Absent(std::size_t turn) const {
  for (std::size_t i = 0; i < devices_.size(); ++i) {
    Device* device = devices_[(turn + i) % devices_.size()].get();
    if (device->config->enabled && device->health.absent()) return device;
  }
  return nullptr;
}

std::optional<Instant> Poller::NextProbe() const {
  const Device* device = Absent(probe_turn_);
  if (device == nullptr) return std::nullopt;
  return probes_.NextProbe(now_.instant, schedule_.NextDue(), device->WorstCase());
}

bool Poller::PickProbe() {
  const auto when = NextProbe();
  if (!when || *when > now_.instant) return false;
  Device* device = Absent(probe_turn_);
  probe_turn_ = device->slot + 1;
  Begin(*device, {Task::Kind::probe, 0, kNoPoint, {}});
  Ask();
  return true;
}

bool Poller::Waiting(Instant now) const {
  const auto due = schedule_.NextDue();
  return !commands_.empty() || (due && *due <= now);
}

// ---------------------------------------------------------------- one task

void Poller::Begin(Device& device, Task task) {
  work_ = std::make_unique<Work>();
  work_->device = &device;
  work_->task = std::move(task);
  work_->began = now_.instant;
}

void Poller::Ask() {
  if (++work_->steps > kMostSteps) {
    FinishTask(Outcome::unexpected, "the conversation did not come to an end");
    return;
  }
  auto request = work_->device->conversation->Ask(work_->task, now_.instant);
  if (!request) {
    work_->mute = true;
    store_.UpdateStatus(work_->device->index, [&](DeviceStatus& status) {
      status.last_outcome = Outcome::unsupported;
      status.last_reason = request.error();
    });
    FinishTask(Outcome::unsupported, request.error());
    return;
  }
  work_->request = std::move(*request);
  work_->attempts = 0;
  work_->sending = true;
}

void Poller::Send(View bytes) {
  counters_.bytes_out += bytes.size();
  listener_.Send(bytes, work_->device->serial);
}

Outcome Poller::OnFrame(View frame, Instant now) {
  work_->answer = work_->device->conversation->OnFrame(work_->task, work_->request, frame, now);
  return work_->answer.outcome;
}

void Poller::OnExchangeEnd(const ExchangeEnd& end, Instant) {
  if (work_) work_->end = end;
}

void Poller::OnStrayBytes(std::size_t count, Duration since_end, Instant) {
  counters_.stray_bytes += count;
  if (last_ == nullptr) return;
  // A late answer, or the rest of one: this device gets a longer quarantine from now on.
  Device& device = *last_;
  if (since_end > device.times.ceiling) return;  // too late for any answer: noise
  const Duration needed = std::min(since_end + device.times.gap, device.times.ceiling);
  if (needed <= device.times.drain + device.late_drain) return;
  if (device.late_drain == Duration::zero()) {
    listener_.OnWarning(
        device.index, "bytes came " +
                          FormatDuration(std::chrono::round<std::chrono::milliseconds>(since_end)) +
                          " after its exchange had ended; if this goes on, raise timing.reply");
  }
  device.late_drain = needed - device.times.drain;
}

void Poller::ConcludeExchange() {
  Work& work = *work_;
  Device& device = *work.device;
  const ExchangeEnd& end = *work.end;
  const std::string reason = work.answer.reason.empty() ? end.reason : work.answer.reason;
  counters_.busy += now_.instant - work.exchange_began;
  work.mute = work.request.expect.reply == Expectation::Reply::none;
  if (!work.mute) device.health.OnExchange(end.outcome);
  if (end.outcome == Outcome::no_reply) {
    if (!device.unanswered) device.unanswered = work.exchange_began;
    // Probes of an absent device would cost the living this time again and again.
    const bool probe = work.task.kind == Task::Kind::probe;
    if (!probe) device.late_until = now_.instant + device.times.ceiling - device.times.reply;
  } else if (ProvesLife(end.outcome) && !work.mute) {
    device.unanswered.reset();
    device.late_until = {};  // the aftermath of the answer took care
  }
  Count(device, reason);
  listener_.OnExchangeEnd(device.index, end.outcome);
  if (end.outcome == Outcome::line_down) {
    FinishTask(end.outcome, reason);
  } else if (ProvesLife(end.outcome)) {
    if (!work.mute) last_life_ = now_.instant;
    Store(device);
    OnAnswered();
  } else {
    OnFailed();
  }
}

void Poller::OnAnswered() {
  Work& work = *work_;
  Device& device = *work.device;
  const ExchangeEnd end = *std::exchange(work.end, std::nullopt);
  const Answer answer = std::exchange(work.answer, {});
  if (answer.wait > Duration::zero()) schedule_.Hold(device.slot, now_.instant + answer.wait);
  if (answer.then == Then::replan) {
    Plan(device);
    schedule_.Restart(device.slot, now_.instant);
    FinishTask(end.outcome, answer.reason);
  } else if (answer.then == Then::ask_again) {
    Ask();
  } else if (end.outcome == Outcome::busy && work.task.kind == Task::Kind::poll &&
             work.parkings < device.retries && !device.parked) {
    ++work.parkings;
    --work.steps;
    device.parked_until = now_.instant + std::max<Duration>(answer.wait, device.times.quiet);
    schedule_.Hold(device.slot, device.parked_until);
    device.parked = std::move(work_);
  } else {
    FinishTask(end.outcome, answer.reason);
  }
}

void Poller::OnFailed() {
  Work& work = *work_;
  Device& device = *work.device;
  const ExchangeEnd end = *std::exchange(work.end, std::nullopt);
  const Answer answer = std::exchange(work.answer, {});
  const bool in_time = !work.command || now_.instant < work.command->deadline;
  const bool may_retry = work.attempts < device.retries && work.task.kind != Task::Kind::probe &&
                         device.health.state() != DeviceState::never_seen && in_time;
  if (may_retry) {
    const auto instead = device.conversation->Instead(work.request, end.outcome, now_.instant);
    if (instead || work.request.expect.repeatable) {
      if (instead) work.request = *instead;
      ++work.attempts;
      work.sending = true;
      store_.UpdateStatus(device.index, [](DeviceStatus& status) { ++status.retries; });
      return;
    }
  }
  const Then then =
      device.conversation->OnFailure(work.task, work.request, end.outcome, now_.instant);
  if (then == Then::ask_again) {
    Ask();
    return;
  }
  if (then == Then::replan) Plan(device);
  schedule_.Hold(device.slot, device.late_until);
  FinishTask(end.outcome, answer.reason.empty() ? end.reason : answer.reason);
}

void Poller::Store(Device& device) {
  std::vector<Sample> samples;
  samples.reserve(work_->answer.readings.size());
  for (const Reading& reading : work_->answer.readings) {
    if (reading.point >= device.config->points.size()) continue;
    samples.push_back(ToSample(device.config->points[reading.point], reading));
  }
  if (!samples.empty()) store_.Update(device.index, samples, now_, work_->end->round_trip);
}

void Poller::FinishTask(Outcome outcome, const std::string& reason) {
  const std::unique_ptr<Work> done = std::move(work_);
  Device& device = *done->device;
  if (done->task.kind == Task::Kind::probe) {
    const Duration drain = NeedsDrain(outcome) ? device.times.drain + device.late_drain : 0s;
    probes_.OnProbe(done->began, now_.instant + drain, Waiting(now_.instant + drain));
  }
  if (done->fast) {
    device.round_wire += now_.instant - done->began;
    if (done->last_of_round) {
      device.fast_wire = std::exchange(device.round_wire, {});
      MeasureCycle();
    }
  }
  if (!done->mute) UpdateHealth(device, outcome, reason);
  if (!done->command) return;
  if (outcome == Outcome::ok && done->write < done->command->writes.size()) {
    if (done->command->deadline <= now_.instant) {
      done->command->done(Outcome::no_reply, "the deadline passed before all points were written");
      return;
    }
    Begin(device, {});
    work_->command = std::move(done->command);
    work_->write = done->write;
    NextWrite();
  } else {
    done->command->done(outcome, reason);
  }
}

/// The writes of the command before work_->write are confirmed: goes on with the next.
void Poller::NextWrite() {
  Work& work = *work_;
  Device& device = *work.device;
  const PointWrite& write = work.command->writes[work.write++];
  auto raw = ToRaw(device.config->points[write.point], write.value);
  work.task.kind = Task::Kind::write;
  work.task.point = write.point;
  if (!raw) {
    FinishTask(Outcome::refused, raw.error());
    return;
  }
  work.task.value = std::move(*raw);
  const auto queries = device.conversation->Queries();
  for (std::size_t query = 0; query < queries.size(); ++query) {
    const auto& points = queries[query].points;
    if (std::find(points.begin(), points.end(), write.point) == points.end()) continue;
    const std::pair wanted(&device, query);
    const bool known = std::find(refresh_.begin(), refresh_.end(), wanted) != refresh_.end();
    if (!known && refresh_.size() < kQueueLimit) refresh_.push_back(wanted);
  }
  Ask();
}

// ---------------------------------------------------------------- device state

Override Poller::OverrideOf(const Device& device) const {
  if (!device.config->enabled) return Override::out_of_service;
  if (!open_) return Override::not_connected;
  return device.health.offline() ? Override::offline : Override::none;
}

void Poller::UpdateHealth(Device& device, Outcome outcome, const std::string& reason) {
  const bool was_absent = device.health.absent();
  device.health.OnTask(outcome, now_.instant);
  if (device.health.absent() && !was_absent) {
    schedule_.Suspend(device.slot);
    device.parked.reset();
    device.fast_wire = device.round_wire = {};
    device.conversation->OnReconnect();
    Plan(device);
  } else if (!device.health.absent() && was_absent) {
    schedule_.Restart(device.slot, now_.instant);
  }
  ShowState(device, reason.empty() ? std::string(Name(outcome)) : reason);
  store_.SetOverride(device.index, OverrideOf(device));
}

void Poller::ShowState(Device& device, const std::string& reason) {
  const DeviceState state = device.health.state();
  if (state == device.shown) return;
  const DeviceState from = std::exchange(device.shown, state);
  store_.UpdateStatus(device.index, [&](DeviceStatus& status) { status.state = state; });
  listener_.OnDeviceState(device.index, from, state, reason);
}

void Poller::Count(Device& device, const std::string& reason) {
  ++counters_.exchanges;
  const ExchangeEnd& end = *work_->end;
  const std::uint32_t missed = schedule_.missed(device.slot);
  store_.UpdateStatus(device.index, [&](DeviceStatus& status) {
    ++status.exchanges;
    ++status.outcomes[static_cast<std::size_t>(end.outcome)];
    status.last_outcome = end.outcome;
    status.missed = missed;
    if (end.outcome != Outcome::ok) status.last_reason = reason;
    if (ProvesLife(end.outcome) && !work_->mute) {
      status.last_ok = now_.instant;
      status.last_ok_wall = now_.wall;
      status.round_trips.Add(end.round_trip);
    }
  });
}

void Poller::MeasureCycle() {
  Duration cycle{};
  for (const auto& device : devices_) cycle += device->fast_wire;
  for (const auto& device : devices_) store_.SetLineCycle(device->index, cycle);
}

void Poller::Plan(Device& device) {
  std::vector<config::Group> groups;
  for (const Query& query : device.conversation->Queries()) groups.push_back(query.group);
  schedule_.SetQueries(device.slot, std::move(groups));
  device.parked.reset();  // its query may be another one now
}

}  // namespace baudgate
