// The poller's inputs, and how it keeps the line going: what is chosen when the line is idle is in
// poller_choice.cpp, what then becomes of a task in poller_task.cpp.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/poll/poller.h"

#include <algorithm>
#include <utility>

#include "gateway/poll/poller_parts.h"

namespace baudgate {
namespace {}  // namespace

LineTimes TimesOf(const config::Timing& given, const Protocol& protocol,
                  const config::SerialSettings& serial) {
  const config::Timing timing = config::Resolve(given, protocol.timing(serial));
  return {.quiet = *timing.quiet,
          .reply = *timing.reply,
          .gap = *timing.gap,
          .ceiling = *timing.ceiling,
          .drain = *timing.drain,
          .settle = {},
          .character = serial.CharacterTime()};
}

Poller::Poller(const config::Line& line, std::uint32_t first_device, const FindProtocol& find,
               PointStore& store, PollerListener& listener)
    : config_(line),
      store_(store),
      listener_(listener),
      line_index_(store.LineIndex(line)),
      line_(*this),
      echo_(line.echo) {
  const Protocol& own = find(line.protocol);
  if (own.carrier != nullptr) carrier_ = &own;
  std::vector<std::pair<const Protocol*, Bus*>> made;
  for (std::size_t slot = 0; slot < line.devices.size(); ++slot) {
    auto device = std::make_unique<Device>();
    device->index = first_device + static_cast<std::uint32_t>(slot);
    device->slot = slot;
    device->probe_index = device->index;
    device->config = &line.devices[slot];
    device->protocol = &find(device->config->protocol);
    device->serial = device->config->serial.value_or(line.serial);
    device->times =
        TimesOf(Merge(device->config->timing, line.timing), *device->protocol, device->serial);
    device->retries = device->config->retries.value_or(line.retries);
    device->in_use = device->config->enabled;
    auto known = std::find_if(made.begin(), made.end(),
                              [&](const auto& pair) { return pair.first == device->protocol; });
    if (known == made.end()) {
      buses_.push_back(device->protocol->make_bus(line));
      known = made.insert(made.end(), {device->protocol, buses_.back().get()});
    }
    device->conversation = known->second->MakeConversation(*device->config);
    schedule_.AddDevice(device->config->poll, device->config->slow);
    devices_.push_back(std::move(device));
    everyone_.push_back(devices_.back().get());
    AddSlave(*devices_.back());
    Plan(*devices_.back());
    ShowOverride(*devices_.back());
  }
}

Poller::~Poller() = default;

/// A device that routes may reach beside the polls: one state for both.
void Poller::AddSlave(Device& device) {
  if (carrier_ == nullptr || device.protocol != carrier_) return;
  const auto slave = carrier_->carrier->slave_of(device.config->address);
  if (!slave) return;
  device.slave = *slave;
  slaves_.emplace(*slave, &device);
}

// ---------------------------------------------------------------- inputs

void Poller::Advance(Now now) {
  was_idle_ = line_.idle();
  const Duration passed = now.instant - now_.instant;
  if (open_ && !was_idle_) counters_.busy += passed;
  Device* const device = work_ && !work_->sending ? work_->device : last_;
  if (open_ && !was_idle_ && device != nullptr) device->busy += passed;
  const bool failing = !was_idle_ && device != nullptr && IsDoubted(*device);
  turns_.OnTime(passed, failing);
  now_ = now;
  const Duration minute = now.instant - minute_began_;
  if (minute < 1min) return;
  use_ = UseSince(minute_began_);
  minute_began_ = now.instant;
  busy_before_minute_ = counters_.busy;
}

void Poller::OnOpened(Now now, bool keeps_bit_rate) {
  if (open_) OnClosed(now);
  Advance(now);
  open_ = true;
  winding_up_ = false;
  use_.reset();
  minute_began_ = idle_since_ = now.instant;
  silent_from_.reset();
  busy_before_minute_ = counters_.busy;
  line_.OnOpened(now.instant, keeps_bit_rate);
  probes_ = ProbeBudget();
  write_probes_ = ProbeBudget(kWriteShare);
  echo_.OnOpened();
  for (const auto& device : devices_) {
    if (!device->in_use) continue;
    Reconnect(*device);
    if (!device->health.absent()) schedule_.Restart(device->slot, now.instant);
    ShowOverride(*device);
  }
  Pump();
}

void Poller::OnClosed(Now now) { Close(now, Override::not_connected); }

void Poller::OnReleased(Now now) { Close(now, Override::out_of_service); }

std::string Poller::WhyClosed() const {
  return closed_as_ == Override::out_of_service ? "the port is lent to another program"
                                                : "the port is closed";
}

void Poller::Close(Now now, Override why) {
  Advance(now);
  open_ = false;
  closed_as_ = why;
  const std::string reason = WhyClosed();
  use_ = 0;
  Hear(line_.OnClosed());
  echo_.OnClosed();
  // What a serial server still owes may reach the next connection.
  if (work_ && work_->end) {
    work_->device->order->OnSilence();
    order_.OnSilence();
    SetLate(*work_->device, now.instant + work_->device->times.ceiling);
  }
  if (work_) FinishTask(Outcome::line_down, reason);
  for (const auto& device : devices_) {
    device->parked.reset();
    schedule_.Suspend(device->slot);
    ShowOverride(*device);
    if (!device->in_use) continue;
    // Behind a closed port nothing is online. The log has one line for the port, not one a device;
    // the first answer after it opens is news again.
    if (device->shown != DeviceState::never_seen) device->shown = DeviceState::offline;
    store_.UpdateStatus(device->index, [&](DeviceStatus& status) {
      status.state = device->shown;
      status.last_outcome = Outcome::line_down;
      status.last_reason = reason;
    });
  }
  probe_ = {};
  std::vector<WriteCommand> unsent = writes_.TakeAll();
  AnswerConfirmed();
  for (const WriteCommand& command : unsent) command.done(Outcome::line_down, reason);
  for (RoutedRequest& request : routes_.TakeAll()) {
    request.done({Outcome::line_down, {}, reason});
  }
  ShowLine();
}

void Poller::SetInUse(std::uint32_t index, bool in_use, Now now) {
  Advance(now);
  Device& device = *devices_[index - devices_.front()->index];
  if (device.in_use == in_use) return;
  device.in_use = in_use;
  device.parked.reset();
  schedule_.Suspend(device.slot);
  if (in_use) {
    Reconnect(device);
    if (open_ && !device.health.absent()) schedule_.Restart(device.slot, now.instant);
  }
  MeasureCycle();
  ShowState(device, in_use ? "taken into use" : "taken out of use");
  ShowOverride(device);
  if (open_) Settle();
}

void Poller::OnBytes(View bytes, Now now) {
  Advance(now);
  const EchoWatch::Heard heard = echo_.OnReceived(bytes, work_ ? &work_->request : nullptr);
  if (heard.echo) ++counters_.echoes;
  if (heard.warning != nullptr) listener_.OnWarning(work_->device->index, heard.warning);
  if (heard.collision) {
    ++counters_.collisions;
    Hear(line_.OnCollision(now.instant));
  }
  if (!heard.bytes.empty()) {
    counters_.bytes_in += heard.bytes.size();
    if (tap_ != nullptr) tap_->OnReceived(heard.bytes, now_);
    Hear(line_.OnBytes(heard.bytes, now.instant));
  }
  Settle();
}

/// What an input has led to, in its order; what follows from an exchange's end is for Settle.
void Poller::Hear(LineNews news) {
  if (news.send) Send();
  if (news.stray_before.count > 0) OnStray(news.stray_before);
  if (news.end) OnEnd(std::move(*news.end));
  if (news.stray.count > 0) OnStray(news.stray);
  if (news.second_reply) OnSecondReply();
}

void Poller::OnTimer(Now now) {
  Advance(now);
  Hear(line_.OnTimer(now.instant));
  Settle();
}

std::optional<Instant> Poller::Deadline() const {
  if (!open_) return std::nullopt;
  std::optional<Instant> soonest = line_.Deadline();
  const auto sooner = [&](std::optional<Instant> other) {
    if (other && (!soonest || *other < *soonest)) soonest = other;
  };
  sooner(writes_.Deadline());
  sooner(routes_.Deadline());
  if (line_.state() == Line::State::quiet && work_) sooner(LatestStart(*work_));
  if (!line_.idle()) return soonest;
  if (work_) {  // waits until no late answer can meet its request
    sooner(ClearAt(*work_));
    sooner(LatestStart(postponed_ ? *postponed_ : *work_));
    return soonest;
  }
  if (winding_up_) return soonest;
  sooner(schedule_.NextDue());
  sooner(NextProbe());
  for (const auto& device : devices_) {
    if (device->parked) sooner(device->parked_until);
  }
  const auto when_clear = [&](const Device* device) {
    if (device != nullptr && device->late_until > now_.instant) sooner(device->late_until);
  };
  for (const WriteCommand& command : writes_.waiting()) when_clear(&DeviceOf(command));
  for (const std::uint8_t slave : routes_.Slaves()) {
    const Device* device = FindSlave(slave);
    when_clear(device);
    const bool absent = device != nullptr && device->health.absent();
    if (absent && device->late_until <= now_.instant && routes_.HasUrgent(slave)) {
      sooner(NextWriteProbe(*device));
    }
  }
  return soonest;
}

// ---------------------------------------------------------------- choosing the next exchange

void Poller::Settle() {
  if (work_ && work_->end) ConcludeExchange();
  if (!was_idle_ && line_.idle()) idle_since_ = now_.instant;
  if (line_.idle()) ChargeProbe();
  CancelQuiet();
  ExpireCommands();
  AnswerExpired();
  AnswerForAbsent();
  AnswerConfirmed();  // before the next write is to be read back
  Pump();
  AnswerConfirmed();
}

void Poller::Pump() {
  while (open_ && line_.idle()) {
    if (!work_ && (winding_up_ || !PickTask())) return;
    if (!work_ || !work_->sending) continue;
    if (postponed_ && WhyNot(*postponed_) != nullptr) work_ = std::move(postponed_);
    if (const char* why = WhyNot(*work_)) {
      BreakOff(why);
      continue;
    }
    if (HasOverstayed(*work_)) {
      EndInFailure(ExchangeEnd(work_->failure));
      continue;
    }
    Recognise(*work_->device, work_->request.expect.address);
    if (NeedsSync()) {
      Synchronize();
      continue;
    }
    if (ClearAt(*work_) > now_.instant) return;
    // What has not come for so long is not owed any more.
    if (idle_since_ + work_->device->times.reply <= now_.instant) unproven_.clear();
    work_->sending = false;
    work_->exchange_began = now_.instant;
    Exchange exchange{work_->request, work_->device->protocol->reply_rule, work_->device->times};
    exchange.times.drain += work_->device->late_drain;
    exchange.aftermath = Aftermath(*work_);
    Hear(line_.Start(std::move(exchange), now_.instant));
  }
}

/// What a probe has cost is known when the line is idle again.
void Poller::ChargeProbe() {
  if (probe_.device == nullptr) return;
  const Probe probe = std::exchange(probe_, {});
  Device& device = *probe.device;
  device.probe_wait = Waited(probe.began, now_.instant);
  probe.budget->OnProbe(probe.began, now_.instant, *device.probe_wait);
  if (device.probed_at) device.probe_gap = probe.began - *device.probed_at;
  device.probed_at = probe.began;
}

}  // namespace baudgate
