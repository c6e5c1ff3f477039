// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/mqtt/live_points.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

namespace baudgate::mqtt {
namespace {

/// Returns the numbers of the points of each device that the history stores.
std::set<std::pair<std::uint32_t, std::uint32_t>> KeptPoints(const config::Config& config) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> kept;
  for (const config::HistoryPoint& one : config.history.points) kept.emplace(one.device, one.point);
  return kept;
}

std::size_t HashOf(const Value& value) {
  if (const auto* text = std::get_if<std::string>(&value)) return std::hash<std::string>()(*text);
  if (const auto* whole = std::get_if<std::int64_t>(&value))
    return std::hash<std::int64_t>()(*whole);
  if (const auto* counter = std::get_if<std::uint64_t>(&value)) return *counter;
  return std::hash<double>()(ToDouble(value));
}

}  // namespace

void LivePoints::Configure(const std::shared_ptr<const config::Config>& config,
                           const Removed& removed) {
  const auto kept = KeptPoints(*config);
  const bool all = config->mqtt.values == config::Mqtt::Values::all;
  // Devices are numbered in the order of the configuration at the start only, so the names decide
  // which points are stored.
  std::set<std::pair<std::string, std::string>> wanted;
  std::set<std::pair<std::string, std::string>> present;
  std::uint32_t number = 0;
  for (const config::Line& line : config->lines) {
    for (const config::Device& device : line.devices) {
      for (std::uint32_t point = 0; point < device.points.size(); ++point) {
        const std::pair<std::string, std::string> name(device.name, device.points[point].name);
        if (device.points[point].access == config::Access::write) continue;
        if (all || kept.contains({number, point})) wanted.insert(name);
      }
      ++number;
    }
  }
  devices_.resize(store_.device_count());
  std::vector<std::pair<Device, std::vector<std::size_t>>> lost;
  for (std::uint32_t index = 0; index < devices_.size(); ++index) {
    Device& its = devices_[index];
    const Device before = its;
    const bool gone = store_.gone(index);
    its.line = gone ? nullptr : store_.line(index);
    its.device = gone ? nullptr : store_.device(index);
    if (its.device == nullptr) its.points.clear();
    std::vector<std::size_t> missing;
    if (its.device) its.points.resize(its.device->points.size());
    for (std::size_t point = 0; point < its.points.size(); ++point) {
      const std::pair<std::string, std::string> name(its.device->name,
                                                     its.device->points[point].name);
      its.points[point].wanted = wanted.contains(name);
      if (its.points[point].wanted) present.insert(name);
      if (its.points[point].wanted && !its.points[point].known) all_sent_ = false;
    }
    if (!before.device) continue;
    for (std::size_t point = 0; point < before.points.size(); ++point) {
      const bool still = point < its.points.size() && its.points[point].wanted;
      if (before.points[point].wanted && !still) missing.push_back(point);
    }
    if (!missing.empty()) lost.emplace_back(before, std::move(missing));
  }
  for (const auto& [device, points] : lost) {
    for (const std::size_t point : points) {
      const config::Point& its = device.device->points[point];
      if (!present.contains({device.device->name, its.name})) {
        removed(device.line->name, device.device->name, its);
      }
    }
  }
  // A point may be new, or have another unit.
  for (std::uint32_t index = 0; index < devices_.size(); ++index) {
    for (Sent& sent : devices_[index].points) sent.known = false;
    std::vector<std::uint32_t> points(devices_[index].points.size());
    std::iota(points.begin(), points.end(), 0U);
    if (!points.empty()) feed_->MarkPoints(index, points);
  }
}

void LivePoints::StartAnew() {
  all_sent_ = false;
  next_ = 0;
  changes_.points.clear();
  for (std::uint32_t index = 0; index < devices_.size(); ++index) {
    devices_[index].touched = false;
    std::vector<std::uint32_t> points(devices_[index].points.size());
    std::iota(points.begin(), points.end(), 0U);
    for (Sent& sent : devices_[index].points) sent.known = false;
    if (!points.empty()) feed_->MarkPoints(index, points);
  }
}

void LivePoints::Send(Now now, const Publish& publish) {
  if (next_ == changes_.points.size()) {
    feed_->Drain(now.instant, changes_);
    next_ = 0;
  }
  while (next_ < changes_.points.size()) {
    if (!SendOne(changes_.points[next_], now, publish)) return;
    ++next_;
  }
  all_sent_ = true;
}

bool LivePoints::SendOne(const bus::PointRef& at, Now now, const Publish& publish) {
  if (!Has(at.device, at.point)) return true;
  Device& its = devices_[at.device];
  Reading reading;
  if (!store_.Read(at.device, [&](const bus::DeviceRecord& record) {
        reading = ReadingOf(record, at.point, now.instant);
      })) {
    return true;
  }
  Sent& sent = its.points[at.point];
  const config::Point& point = its.device->points[at.point];
  const std::uint16_t quality = reading.quality.word();
  const double number = ToDouble(reading.value);
  const std::size_t hash = IsBad(reading.quality) ? 0 : HashOf(reading.value);
  if (sent.known && sent.quality == quality) {
    if (sent.hash == hash) return true;
    const double deadband = point.deadband.ToDouble();
    if (deadband > 0 && std::abs(number - sent.number) <= deadband) return true;
  }
  const Point visited{*its.line, *its.device, point, at.device, at.point, !its.touched};
  if (!publish(visited, reading)) return false;
  its.touched = true;
  sent.number = number;
  sent.hash = hash;
  sent.quality = quality;
  sent.known = true;
  return true;
}

bool LivePoints::Has(std::uint32_t device, std::uint32_t point) const {
  return device < devices_.size() && devices_[device].device != nullptr &&
         point < devices_[device].points.size() && devices_[device].points[point].wanted;
}

void LivePoints::SendAll(std::uint32_t device, Now now, const Publish& publish) {
  for (std::uint32_t point = 0; point < devices_[device].points.size(); ++point) {
    devices_[device].points[point].known = false;
    SendOne({device, point}, now, publish);
  }
}

void LivePoints::Each(const std::function<void(const Point&)>& visit) const {
  for (std::uint32_t index = 0; index < size(); ++index) EachOf(index, visit);
}

void LivePoints::EachOf(std::uint32_t device,
                        const std::function<void(const Point&)>& visit) const {
  const Device& its = devices_[device];
  for (std::uint32_t point = 0; point < its.points.size(); ++point) {
    if (!Has(device, point)) continue;
    visit({*its.line, *its.device, its.device->points[point], device, point});
  }
}

}  // namespace baudgate::mqtt
