// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/publisher.h"

#include <algorithm>
#include <functional>
#include <span>
#include <thread>
#include <utility>

#include "gateway/base/time.h"

namespace baudgate::dds {
namespace {

constexpr std::size_t kDueBatch = 64;

// If there are more points than this, the publisher waits kDiscoveryTime before it sends them all.
// Otherwise, a reader that is matched while they are sent receives the last points before the
// first; with Fast DDS 2.9 it then searches all its samples for each new one, for ten seconds and
// more.
constexpr std::size_t kLongImage = 1000;

Instant ImageTime(std::size_t points, Instant now) {
  return points > kLongImage ? now + NoticeSender::kDiscoveryTime : now;
}

}  // namespace

SampleSender::SampleSender(const config::Config& config, const bus::PointStore& store,
                           SampleWriter& writer, PacedWriter::Log log, Now now, EventSupply* events)
    : config_(config),
      store_(store),
      writer_(writer),
      room_(RoomFor(store)),
      slots_(store),
      plan_(NewPlan(now.instant)),
      paced_(writer, std::move(log)),
      notices_(config, store, paced_, events, now) {}

/// Only points that have slots are planned, because a reload may be adding devices to the store.
PublishPlan SampleSender::NewPlan(Instant now) const {
  return {{.heartbeat = config_.dds.heartbeat},
          DeadbandsBySlot(store_, slots_),
          slots_.devices(),
          ImageTime(slots_.size(), now)};
}

void SampleSender::StartAnew(Instant now) {
  const bool same = std::exchange(reopened_, false);
  PublishPlan plan = NewPlan(now);
  if (same) plan.KeepMarks(plan_);
  plan_ = std::move(plan);
  round_ = {};
  paced_.ForgetHold();
  notices_.StartAnew(now, same);
}

void SampleSender::OnReload(Instant now) {
  const PointSlots before = std::exchange(slots_, PointSlots(store_));
  AddEnds(before);
  plan_ = NewPlan(now);
  round_ = {};
  for (const std::uint32_t slot : notices_.ends().TakeBack(slots_)) plan_.MarkSent(slot);
  notices_.device_ends().TakeBack();
  notices_.SendEndsAt(now);
  reopen_ = reopen_ || !notices_.EndsAreTold() || !room_.Holds(CountOf(store_));
}

bool SampleSender::Reopen() {
  const Room room = RoomFor(store_);
  if (writer_.Reopen(room) != Sent::yes) return false;
  room_ = room;
  reopen_ = false;
  reopened_ = true;
  return true;
}

void SampleSender::AddEnds(const PointSlots& before) {
  for (std::uint32_t slot = 0; slot < before.size(); ++slot) {
    if (plan_.WasSent(slot)) {
      const bus::PointRef ref = before.RefOf(slot);
      notices_.ends().Add(ref, before.HoldOf(ref.device));
    }
  }
  for (std::uint32_t device = 0; device < before.devices(); ++device) {
    const bool gone = before.Has(device) && !slots_.Has(device);
    if (gone && plan_.DeviceWasSent(device)) {
      notices_.device_ends().Add(device, before.HoldOf(device));
    }
  }
}

void SampleSender::Add(bus::Changes& changes) {
  const auto gone = [this](std::uint32_t device) {
    return device >= slots_.devices() || store_.gone(device);
  };
  std::erase_if(changes.points, [&](const bus::PointRef& ref) { return gone(ref.device); });
  std::erase_if(changes.devices, gone);
  std::swap(round_.points, changes.points);
  std::swap(round_.devices, changes.devices);
  std::ranges::sort(round_.points, {}, &bus::PointRef::device);
  round_.next_point = round_.next_device = 0;
  due_may_follow_ = true;
}

bool SampleSender::idle() const {
  return round_.next_staged == round_.staged_count && round_.next_point == round_.points.size() &&
         round_.next_device == round_.devices.size();
}

Instant SampleSender::Send(Instant now) {
  if (!notices_.Send(now)) return paced_.ReadyAt();
  if (reopen_ && notices_.EndsAreTold() && !Reopen()) return now + PacedWriter::kLongestHold;
  // Values wait until the writers are replaced, because the present writers may have no space for
  // points that the reload has added.
  if (reopen_ && notices_.Due() <= now) return now;
  if (!SendRound(now)) return paced_.ReadyAt();
  // The caller calls Add first, so that new changes are sent before the next batch of due points: a
  // change does not wait until all points were sent once.
  if (!std::exchange(due_may_follow_, false)) return now;
  TakeDue(now);
  if (!SendRound(now)) return paced_.ReadyAt();
  return std::min(plan_.NextDue(), notices_.Due());
}

void SampleSender::TakeDue(Instant now) {
  round_.points.clear();
  round_.next_point = round_.next_device = 0;
  plan_.TakeDuePoints(now, kDueBatch, due_);
  std::ranges::sort(due_);
  for (const std::uint32_t slot : due_) round_.points.push_back(slots_.RefOf(slot));
  plan_.TakeDueDevices(now, kDueBatch, round_.devices);
}

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

// The function only copies values under the device's lock, because a write can block for
// milliseconds.
void SampleSender::StageNextDevice(Instant now) {
  round_.staged_count = round_.next_staged = 0;
  const auto rest = std::span(round_.points).subspan(round_.next_point);
  const std::uint32_t device = rest.front().device;
  const auto end = std::ranges::find_if(
      rest, [device](const bus::PointRef& ref) { return ref.device != device; });
  const auto refs = rest.first(static_cast<std::size_t>(end - rest.begin()));
  round_.next_point += refs.size();
  const auto stage = [&, this](const bus::DeviceRecord& record) {
    for (const bus::PointRef& ref : refs) {
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
  if (!paced_.MayWrite(now)) return false;
  const Staged& staged = round_.staged[round_.next_staged];
  const Sent sent = paced_.Write(staged.sample, now);
  if (sent == Sent::later) {
    Unstage();
    return false;
  }
  ++round_.next_staged;
  if (sent == Sent::yes) {
    plan_.PointSent(staged.slot, staged.state, now);
  } else {
    plan_.PointFailed(staged.slot, now);
  }
  return true;
}

/// Puts staged samples that were not sent back into the list of points, so that the next attempt
/// reads the latest values from the store.
void SampleSender::Unstage() {
  const std::size_t left = round_.staged_count - round_.next_staged;
  round_.next_point -= left;
  for (std::size_t i = 0; i < left; ++i) {
    round_.points[round_.next_point + i] = slots_.RefOf(round_.staged[round_.next_staged + i].slot);
  }
  round_.staged_count = round_.next_staged = 0;
}

bool SampleSender::SendDevice(std::uint32_t device, Instant now) {
  bus::DeviceState state{};
  if (store_.gone(device)) {
    plan_.DeviceGone(device);
    return true;
  }
  bool wanted = false;
  const auto look = [&, this](const bus::DeviceRecord& record) {
    state = record.status.state;
    wanted = plan_.WantsDevice(device, state, now);
    if (!wanted) return;
    device_sample_.gateway = config_.name;
    FillDevice(record, device_sample_);
  };
  store_.Read(device, std::cref(look));
  if (!wanted) return true;
  if (!paced_.MayWrite(now)) return false;
  const Sent sent = paced_.Write(device_sample_, now);
  if (sent == Sent::later) return false;
  if (sent == Sent::yes) {
    plan_.DeviceSent(device, state, now);
  } else {
    plan_.DeviceFailed(device, now);
  }
  return true;
}

namespace {

// A wake-up costs more than a sample: if changes come faster than this interval, they are sent in
// batches.
constexpr Duration kWakeInterval = 2ms;
constexpr std::uint32_t kWakeBurst = 64;
constexpr Duration kAcknowledgeTime = 250ms;

Status CheckKey(const std::string& what, const std::string& name) {
  if (name.size() <= kMaxKey && name.find('\0') == std::string::npos) return {};
  return Error{"dds: the name of " + what + " \"" + name + "\" is longer than 64 bytes"};
}

}  // namespace

// Checks that all names fit into their keys. Keys cannot be cut, because two long names could
// become the same key.
Status DdsPublisher::CheckNames(const config::Config& config) {
  if (const Status status = CheckKey("gateway", config.name); !status) return status;
  for (const config::Line& line : config.lines) {
    if (const Status status = CheckKey("line", line.name); !status) return status;
    for (const config::Device& device : line.devices) {
      if (const Status status = CheckKey("device", device.name); !status) return status;
      for (const config::Point& point : device.points) {
        const Status status = CheckKey("point " + device.name, point.name);
        if (!status) return status;
      }
    }
  }
  return {};
}

Result<std::unique_ptr<DdsPublisher>> DdsPublisher::Create(const config::Config& config,
                                                           bus::PointStore& store,
                                                           std::shared_ptr<SampleWriter> writer,
                                                           Log log,
                                                           std::shared_ptr<EventSupply> events) {
  if (const Status status = CheckNames(config); !status) return Error{status.error()};
  std::unique_ptr<DdsPublisher> publisher(
      new DdsPublisher(config, store, std::move(log), std::move(writer), std::move(events)));
  DdsPublisher* const raw = publisher.get();
  raw->writer_->OnSession([raw] {
    raw->worker_.Wake();
    raw->feed_->Wake();
  });
  if (raw->events_) raw->events_->OnNew([raw] { raw->feed_->Wake(); });
  raw->worker_.Start();
  return publisher;
}

DdsPublisher::DdsPublisher(const config::Config& config, bus::PointStore& store, Log log,
                           std::shared_ptr<SampleWriter> writer,
                           std::shared_ptr<EventSupply> events)
    : writer_(std::move(writer)),
      events_(std::move(events)),
      feed_(store.Subscribe()),
      sender_(config, store, *writer_, std::move(log), ReadClocks(), events_.get()),
      wakes_(kWakeInterval, kWakeBurst),
      worker_("dds publish", [this](bool last) { return last ? End() : Publish(); }) {}

DdsPublisher::~DdsPublisher() {
  Stop();
  if (events_) events_->OnNew({});
  writer_->OnSession({});
}

void DdsPublisher::OnReload() {
  reloaded_ = true;
  feed_->Wake();
}

void DdsPublisher::Stop() {
  worker_.RequestStop();
  feed_->Wake();
  worker_.Stop();
}

Instant DdsPublisher::Publish() {
  const std::uint64_t session = writer_->session();
  if (session == 0) return kWhenWoken;
  Renew(session);
  if (ReadClocks().instant < rests_until_) return rests_until_;
  const bool takes_changes = sender_.idle();
  if (takes_changes) {
    feed_->Drain(next_sending_, changes_);  // waits for changes until next_sending_
    sender_.Add(changes_);
  }
  const Instant now = ReadClocks().instant;
  next_sending_ = sender_.Send(now);
  if (takes_changes && !wakes_.Take(now)) rests_until_ = now + kWakeInterval;
  if (!sender_.idle()) rests_until_ = std::max(rests_until_, next_sending_);
  return rests_until_;
}

void DdsPublisher::Renew(std::uint64_t session) {
  const Instant now = ReadClocks().instant;
  const bool other_session = std::exchange(session_, session) != session;
  const bool reloaded = reloaded_.exchange(false);
  if (other_session) sender_.StartAnew(now);
  if (reloaded) sender_.OnReload(now);
  if (other_session || reloaded) next_sending_ = rests_until_ = {};
}

Instant DdsPublisher::End() {
  // If a new session has begun after the last StartAnew, the remaining events are not sent, because
  // its writers lack the events before them.
  const bool known = writer_->session() == session_;
  while (known) {
    const auto next = sender_.End(ReadClocks().instant);
    if (!next) break;
    std::this_thread::sleep_until(*next);
  }
  if (writer_->WaitAcknowledged(kAcknowledgeTime) && known) sender_.Confirm();
  return kWhenWoken;
}

}  // namespace baudgate::dds
