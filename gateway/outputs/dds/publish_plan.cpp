// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/publish_plan.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <utility>

namespace baudgate::dds {

DueQueue::DueQueue(std::size_t count, Instant first)
    : due_(count, first), key_(count, first), heap_(count), position_(count) {
  std::iota(heap_.begin(), heap_.end(), 0U);
  std::iota(position_.begin(), position_.end(), 0U);
}

void DueQueue::Set(std::uint32_t slot, Instant due) {
  due_[slot] = due;
  if (due >= key_[slot]) return;
  key_[slot] = due;
  SiftUp(position_[slot]);
}

std::optional<std::uint32_t> DueQueue::Due(Instant now) {
  while (!heap_.empty()) {
    const std::uint32_t top = heap_.front();
    if (key_[top] > now) return std::nullopt;
    if (due_[top] <= now) return top;
    key_[top] = due_[top];
    SiftDown(0);
  }
  return std::nullopt;
}

Instant DueQueue::Next() const { return heap_.empty() ? Instant::max() : key_[heap_.front()]; }

void DueQueue::SiftUp(std::size_t at) {
  while (at > 0 && Before(at, (at - 1) / 2)) {
    Swap(at, (at - 1) / 2);
    at = (at - 1) / 2;
  }
}

void DueQueue::SiftDown(std::size_t at) {
  for (;;) {
    std::size_t least = at;
    for (const std::size_t child : {2 * at + 1, 2 * at + 2}) {
      if (child < heap_.size() && Before(child, least)) least = child;
    }
    if (least == at) return;
    Swap(at, least);
    at = least;
  }
}

void DueQueue::Swap(std::size_t a, std::size_t b) {
  std::swap(heap_[a], heap_[b]);
  position_[heap_[a]] = static_cast<std::uint32_t>(a);
  position_[heap_[b]] = static_cast<std::uint32_t>(b);
}

std::string TextOf(const Value& value) {
  constexpr std::int64_t kExact = std::int64_t{1} << 53U;
  const auto* number = std::get_if<std::int64_t>(&value);
  const auto* natural = std::get_if<std::uint64_t>(&value);
  const bool is_long = (number != nullptr && (*number > kExact || *number < -kExact)) ||
                       (natural != nullptr && std::cmp_greater(*natural, kExact));
  return is_long || std::holds_alternative<std::string>(value) ? ToText(value) : std::string();
}

PointState PointState::Of(const Value& value, Quality quality) {
  PointState state;
  state.number = ToDouble(value);
  if (const std::string text = TextOf(value); !text.empty()) {
    state.text_hash = std::hash<std::string>()(text);
  }
  state.quality = quality;
  return state;
}

PublishPlan::PublishPlan(const PlanOptions& options, std::vector<double> deadbands,
                         std::size_t devices, Instant start)
    : options_(options),
      points_(deadbands.size()),
      devices_(devices),
      due_points_(deadbands.size(), start),
      due_devices_(devices, start) {
  for (std::size_t slot = 0; slot < deadbands.size(); ++slot) {
    points_[slot].deadband = deadbands[slot];
  }
}

bool PublishPlan::WantsPoint(std::uint32_t slot, const PointState& state) const {
  const Point& point = points_[slot];
  if (point.forced || state.quality != point.sent.quality) return true;
  const bool other_text = state.text_hash != point.sent.text_hash;
  const bool nan = std::isnan(state.number);
  if (nan || std::isnan(point.sent.number)) {
    return other_text || nan != std::isnan(point.sent.number);
  }
  if (state.number == point.sent.number) return other_text;
  // The difference of two equal infinities is NaN, for which `!(… <= deadband)` is true and `>` is
  // not.
  return !(std::abs(state.number - point.sent.number) <= point.deadband);
}

void PublishPlan::PointSent(std::uint32_t slot, const PointState& state, Instant now) {
  points_[slot].sent = state;
  points_[slot].forced = false;
  points_[slot].was_sent = true;
  due_points_.Set(slot, now + Period(slot));
}

void PublishPlan::PointFailed(std::uint32_t slot, Instant now) {
  due_points_.Set(slot, now + options_.retry);
}

bool PublishPlan::WantsDevice(std::uint32_t device, bus::DeviceState state, Instant now) {
  const Device& held = devices_[device];
  if (held.forced || state != held.sent) return true;
  const Instant allowed = held.sent_at + options_.device_interval;
  if (now >= allowed) return true;
  if (allowed < due_devices_.due(device)) due_devices_.Set(device, allowed);
  return false;
}

void PublishPlan::DeviceSent(std::uint32_t device, bus::DeviceState state, Instant now) {
  devices_[device] = {now, state, false, true};
  due_devices_.Set(device, now + Period(device));
}

void PublishPlan::KeepMarks(const PublishPlan& before) {
  for (std::size_t i = 0; i < points_.size(); ++i) points_[i].was_sent = before.points_[i].was_sent;
  for (std::size_t i = 0; i < devices_.size(); ++i) {
    devices_[i].was_sent = before.devices_[i].was_sent;
  }
}

void PublishPlan::DeviceFailed(std::uint32_t device, Instant now) {
  due_devices_.Set(device, now + options_.retry);
}

void PublishPlan::TakeDuePoints(Instant now, std::size_t most, std::vector<std::uint32_t>& slots) {
  slots.clear();
  while (slots.size() < most) {
    const auto slot = due_points_.Due(now);
    if (!slot) return;
    points_[*slot].forced = true;
    due_points_.Set(*slot, now + options_.retry);
    slots.push_back(*slot);
  }
}

void PublishPlan::TakeDueDevices(Instant now, std::size_t most,
                                 std::vector<std::uint32_t>& devices) {
  devices.clear();
  while (devices.size() < most) {
    const auto device = due_devices_.Due(now);
    if (!device) return;
    devices_[*device].forced = true;
    due_devices_.Set(*device, now + options_.retry);
    devices.push_back(*device);
  }
}

Instant PublishPlan::NextDue() const { return std::min(due_points_.Next(), due_devices_.Next()); }

// Returns the time from a sample to its repetition (heartbeat): between three quarters of
// options_.heartbeat and all of it, different for each slot. So the samples of one burst (the
// start, a line that failed) spread over time and do not return as a burst.
Duration PublishPlan::Period(std::uint32_t slot) const {
  const std::uint32_t scattered = slot * 2654435769U >> 22;  // a hash of the slot: 0…1023
  return options_.heartbeat - options_.heartbeat / 4 * scattered / 1024;
}

}  // namespace baudgate::dds
