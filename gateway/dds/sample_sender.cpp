// SPDX-License-Identifier: Apache-2.0
#include "gateway/dds/sample_sender.h"

#include <algorithm>
#include <utility>

#include "gateway/base/version.h"
#include "gateway/dds/fill_samples.h"

namespace baudgate::dds {
namespace {

// Loss-free even on the 208 KiB socket buffers that a kernel grants by default: 20 samples/ms.
constexpr Duration kPaceInterval = 50us;
constexpr std::uint32_t kPaceBurst = 100;
// At a stop there is about a second for all samples.
constexpr Duration kEndInterval = 20us;
constexpr Duration kEndTime = 700ms;
constexpr std::size_t kDueBatch = 64;
constexpr Duration kRetry = 1s;     // of what goes before values
constexpr std::size_t kBatch = 64;  // of what goes before values

// A reader that is connected in the middle of a long image gets its end before its beginning; one
// on Fast DDS 2.9 then searches all that it holds for each sample, for ten seconds and more.
// Subscribers that are already there find a new gateway within this time.
constexpr std::size_t kLongImage = 1000;
constexpr Duration kDiscoveryTime = 500ms;

Instant ImageTime(std::size_t points, Instant now) {
  return points > kLongImage ? now + kDiscoveryTime : now;
}

}  // namespace

SampleSender::SampleSender(const config::Config& config, const PointStore& store,
                           SampleWriter& writer, Log log, Now now, EventSupply* events)
    : config_(config),
      store_(store),
      writer_(writer),
      log_(std::move(log)),
      slots_(store),
      plan_(NewPlan(now.instant)),
      pace_(Pacer(kPaceInterval, kPaceBurst)),
      gateway_due_(now.instant),
      events_(events),
      events_due_(now.instant + kDiscoveryTime),
      alarms_(events),
      alarms_due_(events_due_) {
  gateway_sample_.gateway = config_.name;
  gateway_sample_.start_time_ns = now.wall.time_since_epoch().count();
  AssignBounded(gateway_sample_.version, kVersion, kMaxVersion);
}

/// Plans only the points that have numbers: a reload may be adding devices to the store meanwhile.
PublishPlan SampleSender::NewPlan(Instant now) const {
  return {{.heartbeat = config_.dds.heartbeat},
          DeadbandsBySlot(store_, slots_),
          slots_.devices(),
          ImageTime(slots_.size(), now)};
}

void SampleSender::StartAnew(Instant now) {
  plan_ = NewPlan(now);
  round_ = {};
  gone_.clear();
  pace_.ForgetHold();
  gateway_due_ = now;
  events_.StartAnew();
  alarms_.StartAnew();
  alarms_due_ = events_due_ = now + kDiscoveryTime;
}

// A point that has come back under its name before its end was told has none.
void SampleSender::OnReload(Instant now) {
  AddGone();
  slots_ = PointSlots(store_);
  plan_ = NewPlan(now);
  round_ = {};
  const auto slots = SlotsByName(store_, slots_);
  std::erase_if(gone_, [&](const PointRef& ref) {
    const auto found = slots.find(NameOf(store_, ref));
    if (found != slots.end()) plan_.MarkSent(found->second);
    return found != slots.end();
  });
  gone_due_ = now;
}

/// All that subscribers have been told of.
void SampleSender::AddGone() {
  for (std::uint32_t slot = 0; slot < slots_.size(); ++slot) {
    if (plan_.WasSent(slot)) gone_.push_back(slots_.RefOf(slot));
  }
}

void SampleSender::Add(Changes& changes) {
  const auto gone = [this](std::uint32_t device) {
    return device >= slots_.devices() || store_.gone(device);
  };
  std::erase_if(changes.points, [&](const PointRef& ref) { return gone(ref.device); });
  std::erase_if(changes.devices, gone);
  std::swap(round_.points, changes.points);
  std::swap(round_.devices, changes.devices);
  std::ranges::sort(round_.points, {}, &PointRef::device);
  round_.next_point = round_.next_device = 0;
  due_may_follow_ = true;
}

bool SampleSender::idle() const {
  return round_.next_staged == round_.staged_count && round_.next_point == round_.points.size() &&
         round_.next_device == round_.devices.size();
}

Instant SampleSender::Send(Instant now) {
  if (!SendGateway(now) || !SendGone(now)) return pace_.ReadyAt();
  if (!SendFrom(events_, events_due_, now) || !SendFrom(alarms_, alarms_due_, now))
    return pace_.ReadyAt();
  if (!SendRound(now)) return pace_.ReadyAt();
  // What has changed meanwhile goes before the next few that are due: it does not wait for the
  // whole start-up image.
  if (!std::exchange(due_may_follow_, false)) return now;
  TakeDue(now);
  if (!SendRound(now)) return pace_.ReadyAt();
  return std::min({plan_.NextDue(), gateway_due_, BehindDue()});
}

/// False: the pace or the writer does not allow it now.
bool SampleSender::SendGateway(Instant now) {
  if (now < gateway_due_) return true;
  if (!pace_.MayWrite(now)) return false;
  const Sent sent = writer_.Write(gateway_sample_);
  if (!pace_.Took(sent, now)) return false;
  gateway_due_ = sent == Sent::yes ? Instant::max() : now + kRetry;
  Count(sent, "gateway ", config_.name);
  return true;
}

/// False: the pace or the writer does not allow it now.
bool SampleSender::SendGone(Instant now) {
  if (now < gone_due_) return true;
  for (std::size_t sent = 0; sent < kBatch && !gone_.empty(); ++sent) {
    if (!pace_.MayWrite(now)) return false;
    const PointRef ref = gone_.front();
    const Sent said = EndPoint(ref);
    if (!pace_.Took(said, now)) return false;
    Count(said, "device ", store_.device(ref.device).name);
    if (said == Sent::refused) {
      gone_due_ = now + kRetry;
      return true;
    }
    gone_.pop_front();
  }
  return true;
}

/// False: the pace or the writer does not allow it now. In their order: one that is refused holds
/// up those behind it.
template <typename Sender>
bool SampleSender::SendFrom(Sender& sender, Instant& due, Instant now) {
  if (now < due) return true;
  for (std::size_t sent = 0; sent < kBatch; ++sent) {
    const auto* sample = sender.Next();
    if (sample == nullptr) return true;
    if (!pace_.MayWrite(now)) return false;
    const Sent said = writer_.Write(*sample);
    if (!pace_.Took(said, now)) return false;
    Count(said, "device ", sample->device);
    if (said == Sent::refused) {
      due = now + kRetry;
      return true;
    }
    sender.OnSent();
  }
  return true;
}

/// When what is left of ends, events and alarms may be sent.
Instant SampleSender::BehindDue() {
  const Instant gone = gone_.empty() ? Instant::max() : gone_due_;
  const Instant events = events_.Next() == nullptr ? Instant::max() : events_due_;
  const Instant alarms = alarms_.Next() == nullptr ? Instant::max() : alarms_due_;
  return std::min({gone, events, alarms});
}

void SampleSender::TakeDue(Instant now) {
  round_.points.clear();
  round_.next_point = round_.next_device = 0;
  plan_.TakeDuePoints(now, kDueBatch, due_);
  std::ranges::sort(due_);
  for (const std::uint32_t slot : due_) round_.points.push_back(slots_.RefOf(slot));
  plan_.TakeDueDevices(now, kDueBatch, round_.devices);
}

/// False: the pace or the writer allows no more now.
bool SampleSender::SendRound(Instant now) {
  for (;;) {
    if (round_.next_staged < round_.staged_count) {
      if (!SendStaged(now)) return false;
    } else if (round_.next_point < round_.points.size()) {
      StageNextDevice(now);
    } else if (round_.next_device < round_.devices.size()) {
      if (!SendDevice(round_.devices[round_.next_device], now)) return false;
      ++round_.next_device;
    } else {
      return true;
    }
  }
}

// Under the device's lock values are only copied: a write may block for milliseconds.
void SampleSender::StageNextDevice(Instant now) {
  round_.staged_count = round_.next_staged = 0;
  const auto rest = std::span(round_.points).subspan(round_.next_point);
  const std::uint32_t device = rest.front().device;
  const auto end =
      std::ranges::find_if(rest, [device](const PointRef& ref) { return ref.device != device; });
  const auto refs = rest.first(static_cast<std::size_t>(end - rest.begin()));
  round_.next_point += refs.size();
  const auto stage = [&, this](const DeviceRecord& record) {
    for (const PointRef& ref : refs) {
      const std::uint32_t slot = slots_.SlotOf(ref);
      const Quality quality = QualityAt(record, ref.point, now);
      const PointState state = PointState::Of(record.points[ref.point].value, quality);
      if (!plan_.WantsPoint(slot, state)) continue;
      if (round_.staged_count == round_.staged.size()) round_.staged.emplace_back();
      Staged& staged = round_.staged[round_.staged_count++];
      staged.slot = slot;
      staged.state = state;
      staged.sample.gateway = config_.name;
      FillPoint(record, ref.point, state, staged.sample);
    }
  };
  store_.Read(device, std::cref(stage));
}

bool SampleSender::SendStaged(Instant now) {
  if (!pace_.MayWrite(now)) return false;
  const Staged& staged = round_.staged[round_.next_staged];
  const Sent sent = writer_.Write(staged.sample);
  if (!pace_.Took(sent, now)) {
    Unstage();
    return false;
  }
  ++round_.next_staged;
  if (sent == Sent::yes) {
    plan_.PointSent(staged.slot, staged.state, now);
  } else {
    plan_.PointFailed(staged.slot, now);
  }
  Count(sent, "device ", staged.sample.device);
  return true;
}

/// What is sent later is read from the store again then: the latest value wins.
void SampleSender::Unstage() {
  const std::size_t left = round_.staged_count - round_.next_staged;
  round_.next_point -= left;
  for (std::size_t i = 0; i < left; ++i) {
    round_.points[round_.next_point + i] = slots_.RefOf(round_.staged[round_.next_staged + i].slot);
  }
  round_.staged_count = round_.next_staged = 0;
}

/// False: the pace or the writer does not allow it now.
bool SampleSender::SendDevice(std::uint32_t device, Instant now) {
  DeviceState state{};
  if (store_.gone(device)) {  // it is in the plan for its number alone
    plan_.DeviceSent(device, state, now);
    return true;
  }
  bool wanted = false;
  const auto look = [&, this](const DeviceRecord& record) {
    state = record.status.state;
    wanted = plan_.WantsDevice(device, state, now);
    if (!wanted) return;
    device_sample_.gateway = config_.name;
    FillDevice(record, device_sample_);
  };
  store_.Read(device, std::cref(look));
  if (!wanted) return true;
  if (!pace_.MayWrite(now)) return false;
  const Sent sent = writer_.Write(device_sample_);
  if (!pace_.Took(sent, now)) return false;
  if (sent == Sent::yes) {
    plan_.DeviceSent(device, state, now);
  } else {
    plan_.DeviceFailed(device, now);
  }
  Count(sent, "device ", device_sample_.device);
  return true;
}

std::optional<Instant> SampleSender::End(Instant now) {
  if (!ending_) {
    ending_ = Ending{now + kEndTime, Pacer(kEndInterval, kPaceBurst)};
    AddGone();
  }
  if (const auto next = EndOf(events_, now)) return next;
  if (const auto next = EndOf(alarms_, now)) return next;
  for (; !gone_.empty(); gone_.pop_front()) {
    if (now >= ending_->deadline) return std::nullopt;
    if (!ending_->pacer.Take(now)) return ending_->pacer.ReadyAt();
    if (EndPoint(gone_.front()) == Sent::later) return now + WritePace::kLongestHold;
  }
  return std::nullopt;
}

/// What has happened until now; empty: all is told, or cannot be.
template <typename Sender>
std::optional<Instant> SampleSender::EndOf(Sender& sender, Instant now) {
  while (const auto* sample = sender.Next()) {
    if (now >= ending_->deadline) return std::nullopt;
    if (!ending_->pacer.Take(now)) return ending_->pacer.ReadyAt();
    const Sent said = writer_.Write(*sample);
    if (said == Sent::later) return now + WritePace::kLongestHold;
    if (said == Sent::refused) return std::nullopt;
    sender.OnSent();
  }
  return std::nullopt;
}

/// Its last value, which nobody reads any more.
Sent SampleSender::EndPoint(PointRef ref) {
  PointSample last;
  last.gateway = config_.name;
  const auto look = [&](const DeviceRecord& record) {
    const Value& value = record.points[ref.point].value;
    FillPoint(record, ref.point, PointState::Of(value, Quality::bad_not_connected), last);
  };
  store_.Read(ref.device, std::cref(look));
  return writer_.Write(last);
}

void SampleSender::Count(Sent sent, std::string_view whose, const std::string& name) {
  if (sent == Sent::yes) {
    ++written_;
    if (failing_ > 0 && log_) {
      log_(log::Level::info,
           "samples are taken again; " + std::to_string(failing_) + " were refused and repeated");
    }
    failing_ = 0;
    return;
  }
  ++failed_;
  if (failing_++ == 0 && log_) {
    log_(log::Level::warning,
         "a sample of " + std::string(whose) + name + " was refused; it will be repeated");
  }
}

}  // namespace baudgate::dds
