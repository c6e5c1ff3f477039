// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/points/point_store.h"

#include <algorithm>
#include <numeric>

namespace baudgate::bus {

ChangeFeed::ChangeFeed(std::span<const std::size_t> points_per_device)
    : device_pending_(points_per_device.size(), false) {
  point_pending_.reserve(points_per_device.size());
  for (const std::size_t count : points_per_device) point_pending_.emplace_back(count, false);
}

void ChangeFeed::AddDevice(std::size_t points) {
  const MutexLock lock(mutex_);
  point_pending_.emplace_back(points, false);
  device_pending_.push_back(false);
}

void ChangeFeed::MarkPoints(std::uint32_t device, std::span<const std::uint32_t> points) {
  {
    const MutexLock lock(mutex_);
    std::vector<bool>& pending = point_pending_[device];
    for (const std::uint32_t point : points) {
      if (pending[point]) continue;
      pending[point] = true;
      pending_.points.push_back({device, point});
    }
  }
  changed_.notify_one();
}

void ChangeFeed::MarkDevice(std::uint32_t device) {
  {
    const MutexLock lock(mutex_);
    if (device_pending_[device]) return;
    device_pending_[device] = true;
    pending_.devices.push_back(device);
  }
  changed_.notify_one();
}

void ChangeFeed::Drain(Instant until, Changes& out) {
  out.points.clear();
  out.devices.clear();
  MutexLock lock(mutex_);
  while (!woken_ && pending_.empty() && lock.WaitUntil(changed_, until)) {
  }
  woken_ = false;
  std::swap(out, pending_);
  for (const PointRef& ref : out.points) point_pending_[ref.device][ref.point] = false;
  for (const std::uint32_t device : out.devices) device_pending_[device] = false;
}

void ChangeFeed::Wake() {
  {
    const MutexLock lock(mutex_);
    woken_ = true;
  }
  changed_.notify_one();
}

namespace {

AgeLimits LimitsOfGroup(const config::Device& device, config::Group group, Duration line_cycle) {
  const std::optional<Duration> max_age = MaxAgeOf(device, group);
  if (!max_age) return {};
  AgeLimits limits;
  limits.uncertain_after = std::max(*max_age, 2 * line_cycle);
  limits.bad_after = 3 * limits.uncertain_after;
  if (device.dead_age && group != config::Group::daily) {
    limits.bad_after = std::max(*device.dead_age, limits.uncertain_after);
  }
  return limits;
}

const AgeLimits& LimitsAt(const DeviceRecord& record, std::size_t point) {
  return record.age_limits[static_cast<std::size_t>(record.device->points[point].group)];
}

}  // namespace

std::array<AgeLimits, config::kGroups> LimitsOf(const config::Device& device, Duration line_cycle) {
  std::array<AgeLimits, config::kGroups> limits;
  for (std::size_t group = 0; group < config::kGroups; ++group) {
    limits[group] = LimitsOfGroup(device, static_cast<config::Group>(group), line_cycle);
  }
  return limits;
}

Quality AgedQuality(const DeviceRecord& record, std::size_t point, Instant now) {
  const PointRecord& held = record.points[point];
  if (!held.read_at) return Quality::bad_waiting;
  // A worse quality has a smaller number, so the minimum is the worse of the two.
  const Quality known = std::min(held.reported, held.at_best);
  if (IsBad(known)) return known;
  const AgeLimits& limits = LimitsAt(record, point);
  const Duration age = now - *held.read_at;
  if (age > limits.bad_after) return Quality::bad_communication;
  if (age > limits.uncertain_after) return Quality::uncertain_last_usable;
  return known;
}

Quality QualityAt(const DeviceRecord& record, std::size_t point, Instant now) {
  return record.override_quality ? *record.override_quality : AgedQuality(record, point, now);
}

Value KnownValue(const DeviceRecord& record, std::size_t point, Instant now) {
  return IsBad(QualityAt(record, point, now)) ? Value() : record.points[point].value;
}

std::optional<Duration> AgeAt(const DeviceRecord& record, std::size_t point, Instant now) {
  const auto& read_at = record.points[point].read_at;
  if (!read_at) return std::nullopt;
  return now - *read_at;
}

std::optional<Instant> NextAgeing(const DeviceRecord& record, std::size_t point, Instant now) {
  if (record.override_quality) return std::nullopt;
  const PointRecord& held = record.points[point];
  if (!held.read_at || IsBad(std::min(held.reported, held.at_best))) return std::nullopt;
  const AgeLimits& limits = LimitsAt(record, point);
  if (!limits.ages()) return std::nullopt;
  for (const Duration limit : {limits.uncertain_after, limits.bad_after}) {
    const Instant due = *held.read_at + limit + 1ns;
    if (due > now) return due;
  }
  return std::nullopt;
}

PointStore::Entry::Entry(const std::shared_ptr<const config::Line>& line,
                         const config::Device& device)
    : point_count(device.points.size()),
      line(line),
      device(std::shared_ptr<const config::Device>(line, &device)),
      // Not make_shared, because the memory must be freed although `record`, a weak pointer,
      // remains.
      own(std::make_unique<DeviceRecord>()),
      record(own) {
  own->line = line;
  own->device = this->device.load().lock();
  own->points.resize(point_count);
  own->age_limits = LimitsOf(device, Duration::zero());
  announced.assign(point_count, Quality::bad_waiting);
  if (device.enabled) return;
  own->override_quality = Quality::bad_out_of_service;
  own->status.state = DeviceState::disabled;
}

PointStore::PointStore(const config::Config& config) {
  for (const config::Line& line : config.lines) Append(std::make_shared<const config::Line>(line));
}

void PointStore::Append(const std::shared_ptr<const config::Line>& line) {
  lines_.Append(line, device_count());
  for (const config::Device& device : line->devices) {
    // feeds_mutex_ covers all feeds and the new device, so a feed that Subscribe makes at the same
    // time counts the device once.
    const MutexLock lock(feeds_mutex_);
    for (const auto& feed : feeds_) feed->AddDevice(device.points.size());
    devices_.Append(line, device);
  }
}

void PointStore::Reconfigure(std::uint32_t line, const std::shared_ptr<const config::Line>& as) {
  const std::uint32_t first = lines_[line].first_device;
  for (std::size_t i = 0; i < as->devices.size(); ++i) {
    const auto device = first + static_cast<std::uint32_t>(i);
    Entry& entry = devices_[device];
    {
      const MutexLock lock(entry.mutex);
      DeviceRecord& record = *entry.own;
      record.line = as;
      record.device = {as, &as->devices[i]};
      entry.line = record.line;
      entry.device = record.device;
      record.age_limits = LimitsOf(as->devices[i], record.line_cycle);
      entry.next_ageing = Instant::min();  // the next Age checks all points
      ++record.version;
    }
    std::vector<std::uint32_t> all(entry.point_count);
    std::iota(all.begin(), all.end(), 0U);
    Announce(device, all);
  }
}

std::size_t PointStore::EndOfDevices(std::uint32_t line) const {
  return line + 1 < lines_.size() ? lines_[line + 1].first_device : devices_.size();
}

void PointStore::Retire(std::uint32_t line) {
  LineEntry& its = lines_[line];
  {
    const MutexLock lock(its.mutex);
    its.line.reset();
  }
  for (std::size_t device = its.first_device; device < EndOfDevices(line); ++device) {
    devices_[device].gone = true;
  }
}

void PointStore::Forget(std::uint32_t line) {
  LineEntry& its = lines_[line];
  {
    const MutexLock lock(its.mutex);
    its.status.reset();
  }
  for (std::size_t device = its.first_device; device < EndOfDevices(line); ++device) {
    const MutexLock lock(devices_[device].mutex);
    devices_[device].own.reset();
    devices_[device].announced = {};
  }
}

std::uint32_t PointStore::present_count() const {
  std::uint32_t present = 0;
  for (std::size_t device = 0; device < devices_.size(); ++device) {
    present += devices_[device].gone ? 0 : 1;
  }
  return present;
}

std::shared_ptr<const config::Line> PointStore::line(std::uint32_t device) const {
  return devices_[device].line.load().lock();
}

std::shared_ptr<const config::Device> PointStore::device(std::uint32_t device) const {
  return devices_[device].device.load().lock();
}

bool PointStore::Read(std::uint32_t device,
                      const std::function<void(const DeviceRecord&)>& look) const {
  const Entry& entry = devices_[device];
  const MutexLock lock(entry.mutex);
  const auto record = entry.record.lock();
  if (record) look(*record);
  return record != nullptr;
}

std::shared_ptr<const void> PointStore::Hold(std::uint32_t device) const {
  const Entry& entry = devices_[device];
  const MutexLock lock(entry.mutex);
  return entry.record.lock();
}

void PointStore::Update(std::uint32_t device, std::span<const Sample> samples, Now at,
                        Duration round_trip) {
  Entry& entry = devices_[device];
  std::vector<std::uint32_t> changed;
  changed.reserve(samples.size());
  {
    const MutexLock lock(entry.mutex);
    if (!entry.own) return;
    DeviceRecord& record = *entry.own;
    ++record.version;
    for (const Sample& sample : samples) {
      PointRecord& held = record.points[sample.point];
      // The value of a reading with a bad quality is not used, so the last good value stays.
      if (HasValue(sample.value) && !IsBad(sample.quality)) held.value = sample.value;
      held.reported = sample.quality;
      held.at_best = Quality::good;
      held.read_at = at.instant;
      held.source_time = at.wall;
      held.rtt_us = static_cast<std::uint32_t>(round_trip / 1us);
      ++held.seq;
      changed.push_back(sample.point);
      // The quality at the time `at` is reported here. If the value of a late reply is already too
      // old, the next call of Age reports the new quality.
      entry.announced[sample.point] = QualityAt(record, sample.point, at.instant);
      ScheduleAgeing(entry, record, sample.point, at.instant);
    }
  }
  Announce(device, changed);
}

void PointStore::Doubt(std::uint32_t device, std::span<const std::size_t> points, Instant now) {
  Entry& entry = devices_[device];
  std::vector<std::uint32_t> changed;
  {
    const MutexLock lock(entry.mutex);
    if (!entry.own) return;
    DeviceRecord& record = *entry.own;
    ++record.version;
    for (const std::size_t point : points) {
      PointRecord& held = record.points[point];
      if (!IsGood(held.reported)) continue;
      held.at_best = std::min(held.at_best, Quality(Quality::uncertain));
      changed.push_back(static_cast<std::uint32_t>(point));
      entry.announced[point] = QualityAt(record, point, now);
      ScheduleAgeing(entry, record, point, now);
    }
  }
  Announce(device, changed);
}

void PointStore::OnWritten(std::uint32_t device, std::span<const std::size_t> points, Instant now) {
  {
    Entry& entry = devices_[device];
    const MutexLock lock(entry.mutex);
    if (!entry.own) return;
    for (const std::size_t point : points) entry.own->points[point].written_at = now;
  }
  Doubt(device, points, now);
}

void PointStore::SetOverride(std::uint32_t device, Override why) {
  Entry& entry = devices_[device];
  {
    const MutexLock lock(entry.mutex);
    if (!entry.own || entry.own->override_quality == why) return;
    DeviceRecord& record = *entry.own;
    record.override_quality = why;
    ++record.version;
    // While there is an override, the quality does not depend on age, so any time can be passed.
    // When the override ends, the next call of Age reports the qualities by age.
    if (why) {
      for (std::uint32_t point = 0; point < entry.announced.size(); ++point) {
        entry.announced[point] = QualityAt(record, point, Instant());
      }
    }
    entry.next_ageing = Instant::min();
  }
  std::vector<std::uint32_t> all(entry.point_count);
  std::iota(all.begin(), all.end(), 0U);
  Announce(device, all);
}

void PointStore::SetLineCycle(std::uint32_t device, Duration cycle, Instant now) {
  Entry& entry = devices_[device];
  const MutexLock lock(entry.mutex);
  if (!entry.own) return;
  DeviceRecord& record = *entry.own;
  record.line_cycle = cycle;
  const auto after = LimitsOf(*record.device, cycle);
  if (after == record.age_limits) return;
  // A value that is too old by the old limits must not become good by longer limits. It stays too
  // old until it is read again.
  for (std::size_t point = 0; point < record.points.size(); ++point) {
    PointRecord& held = record.points[point];
    if (!held.read_at) continue;
    const Quality aged = AgedQuality(record, point, now);
    if (aged < std::min(held.reported, held.at_best)) held.at_best = aged;
  }
  record.age_limits = after;
  ++record.version;
  entry.next_ageing = Instant::min();  // the next Age checks all points
}

void PointStore::UpdateStatus(std::uint32_t device,
                              const std::function<void(DeviceStatus&)>& change) {
  Entry& entry = devices_[device];
  {
    const MutexLock lock(entry.mutex);
    if (!entry.own) return;
    change(entry.own->status);
  }
  const MutexLock lock(feeds_mutex_);
  for (const auto& feed : feeds_) feed->MarkDevice(device);
}

std::uint32_t PointStore::LineIndex(const config::Line& line) const {
  for (std::size_t i = 0; i < lines_.size(); ++i) {
    const MutexLock lock(lines_[i].mutex);
    if (lines_[i].line && lines_[i].line->name == line.name) return static_cast<std::uint32_t>(i);
  }
  return static_cast<std::uint32_t>(lines_.size());
}

std::shared_ptr<const config::Line> PointStore::LineAt(std::uint32_t line) const {
  const MutexLock lock(lines_[line].mutex);
  return lines_[line].line;
}

LineStatus PointStore::ReadLine(std::uint32_t line) const {
  const LineEntry& entry = lines_[line];
  const MutexLock lock(entry.mutex);
  return entry.status ? *entry.status : LineStatus();
}

void PointStore::UpdateLine(std::uint32_t line, const std::function<void(LineStatus&)>& change) {
  LineEntry& entry = lines_[line];
  const MutexLock lock(entry.mutex);
  if (entry.status) change(*entry.status);
}

std::shared_ptr<ChangeFeed> PointStore::Subscribe() {
  const MutexLock lock(feeds_mutex_);
  std::vector<std::size_t> counts;
  for (std::size_t i = 0; i < devices_.size(); ++i) {
    counts.push_back(devices_[i].point_count);
  }
  auto feed = std::make_shared<ChangeFeed>(counts);
  feeds_.push_back(feed);
  return feed;
}

void PointStore::Unsubscribe(const std::shared_ptr<ChangeFeed>& feed) {
  const MutexLock lock(feeds_mutex_);
  std::erase(feeds_, feed);
}

void PointStore::Age(Instant now) {
  for (std::uint32_t device = 0; device < devices_.size(); ++device) {
    Entry& entry = devices_[device];
    if (entry.gone) continue;
    std::vector<std::uint32_t> aged;
    {
      const MutexLock lock(entry.mutex);
      if (now < entry.next_ageing || !entry.own) continue;
      const DeviceRecord& record = *entry.own;
      entry.next_ageing = Instant::max();
      for (std::uint32_t point = 0; point < entry.announced.size(); ++point) {
        const Quality quality = QualityAt(record, point, now);
        if (quality != entry.announced[point]) aged.push_back(point);
        entry.announced[point] = quality;
        ScheduleAgeing(entry, record, point, now);
      }
    }
    Announce(device, aged);
  }
}

void PointStore::Announce(std::uint32_t device, std::span<const std::uint32_t> points) {
  if (points.empty()) return;
  const MutexLock lock(feeds_mutex_);
  for (const auto& feed : feeds_) feed->MarkPoints(device, points);
}

void PointStore::ScheduleAgeing(Entry& entry, const DeviceRecord& record, std::size_t point,
                                Instant now) {
  const auto due = NextAgeing(record, point, now);
  if (due) entry.next_ageing = std::min(entry.next_ageing, *due);
}

}  // namespace baudgate::bus
