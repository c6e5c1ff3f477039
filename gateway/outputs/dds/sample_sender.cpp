// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/sample_sender.h"

#include <algorithm>
#include <functional>
#include <span>
#include <utility>

#include "gateway/outputs/dds/fill_samples.h"

namespace baudgate::dds {
namespace {

constexpr std::size_t kDueBatch = 64;

// A reader that is connected in the middle of a long image gets its end before its beginning; one
// on Fast DDS 2.9 then searches all that it holds for each sample, for ten seconds and more.
constexpr std::size_t kLongImage = 1000;

Instant ImageTime(std::size_t points, Instant now) {
  return points > kLongImage ? now + NoticeSender::kDiscoveryTime : now;
}

}  // namespace

SampleSender::SampleSender(const config::Config& config, const PointStore& store,
                           SampleWriter& writer, PacedWriter::Log log, Now now, EventSupply* events)
    : config_(config),
      store_(store),
      writer_(writer),
      room_(RoomFor(store)),
      slots_(store),
      plan_(NewPlan(now.instant)),
      paced_(writer, std::move(log)),
      notices_(config, store, paced_, events, now) {}

/// Plans only the points that have numbers: a reload may be adding devices to the store meanwhile.
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

/// False: the writer cannot do it now.
bool SampleSender::Reopen() {
  const Room room = RoomFor(store_);
  if (writer_.Reopen(room) != Sent::yes) return false;
  room_ = room;
  reopen_ = false;
  reopened_ = true;
  return true;
}

/// All that subscribers have been told of.
void SampleSender::AddEnds(const PointSlots& before) {
  for (std::uint32_t slot = 0; slot < before.size(); ++slot) {
    if (plan_.WasSent(slot)) notices_.ends().Add(before.RefOf(slot));
  }
  for (std::uint32_t device = 0; device < before.devices(); ++device) {
    const bool gone = before.Has(device) && !slots_.Has(device);
    if (gone && plan_.DeviceWasSent(device)) notices_.device_ends().Add(device);
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
  if (!notices_.Send(now)) return paced_.ReadyAt();
  if (reopen_ && notices_.EndsAreTold() && !Reopen()) return now + PacedWriter::kLongestHold;
  // There may be no room yet for what the reload has added.
  if (reopen_ && notices_.Due() <= now) return now;
  if (!SendRound(now)) return paced_.ReadyAt();
  // What has changed meanwhile goes before the next few that are due: it does not wait for the
  // whole start-up image.
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
  if (store_.gone(device)) {
    plan_.DeviceGone(device);
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

}  // namespace baudgate::dds
