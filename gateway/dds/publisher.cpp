// SPDX-License-Identifier: Apache-2.0
#include "gateway/dds/publisher.h"

#include <algorithm>
#include <utility>

namespace baudgate::dds {
namespace {

// Loss-free even on the 208 KiB socket buffers that a kernel grants by default: 20 samples/ms.
constexpr Duration kPaceInterval = 50us;
constexpr std::uint32_t kPaceBurst = 100;
// At a stop samples are keys only, and there is about a second for all of them.
constexpr Duration kDisposeInterval = 20us;
constexpr Duration kDisposeTime = 700ms;
constexpr Duration kAcknowledgeTime = 250ms;
// A wake-up costs more than a sample: when they come faster than this, what changes goes in
// batches.
constexpr Duration kWakeInterval = 2ms;
constexpr std::uint32_t kWakeBurst = 64;
constexpr Duration kAgeInterval = 200ms;
constexpr std::size_t kDueBatch = 64;

Instant Clock() { return std::chrono::steady_clock::now(); }

// A reader that is connected in the middle of a long image gets its end before its beginning; one
// on Fast DDS 2.9 then searches all that it holds for each sample, for ten seconds and more.
// Subscribers that are already there find a new gateway within this time.
constexpr std::size_t kLongImage = 1000;
constexpr Duration kDiscoveryTime = 500ms;

Instant ImageTime(std::size_t points) {
  return points > kLongImage ? Clock() + kDiscoveryTime : Clock();
}

std::vector<std::uint32_t> FirstSlots(const PointStore& store) {
  std::vector<std::uint32_t> first{0};
  for (std::uint32_t device = 0; device < store.device_count(); ++device) {
    first.push_back(first.back() + static_cast<std::uint32_t>(store.device(device).points.size()));
  }
  return first;
}

std::vector<double> Deadbands(const PointStore& store) {
  std::vector<double> deadbands;
  for (std::uint32_t device = 0; device < store.device_count(); ++device) {
    for (const config::Point& point : store.device(device).points) {
      deadbands.push_back(point.deadband);
    }
  }
  return deadbands;
}

Status CheckKey(const std::string& what, const std::string& name) {
  if (name.size() <= kMaxKey && name.find('\0') == std::string::npos) return {};
  return Error{"dds: the name of " + what + " \"" + name + "\" is longer than 64 bytes"};
}

// Keys can not be cut: two of them might become one.
Status CheckKeys(const config::Config& config) {
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

std::uint32_t Microseconds(Duration duration) {
  return static_cast<std::uint32_t>(std::clamp<std::int64_t>(duration / 1us, 0, UINT32_MAX));
}

}  // namespace

Result<std::unique_ptr<DdsPublisher>> DdsPublisher::Create(const config::Config& config,
                                                           PointStore& store, Log log) {
  if (const Status status = CheckKeys(config); !status) return Error{status.error()};
  const ParticipantOptions options{config.dds.domain, config.dds.interfaces,
                                   config.dds.shared_memory};
  auto writer = CreateFastWriter(options, FirstSlots(store).back(), store.device_count());
  if (!writer) return Error{writer.error()};
  return Create(config, store, std::move(log), std::move(*writer));
}

Result<std::unique_ptr<DdsPublisher>> DdsPublisher::Create(const config::Config& config,
                                                           PointStore& store, Log log,
                                                           std::unique_ptr<SampleWriter> writer) {
  if (const Status status = CheckKeys(config); !status) return Error{status.error()};
  std::unique_ptr<DdsPublisher> publisher(
      new DdsPublisher(config, store, std::move(log), std::move(writer)));
  publisher->thread_ = std::thread([raw = publisher.get()] { raw->Run(); });
  return publisher;
}

DdsPublisher::DdsPublisher(const config::Config& config, PointStore& store, Log log,
                           std::unique_ptr<SampleWriter> writer)
    : config_(config),
      store_(store),
      log_(std::move(log)),
      writer_(std::move(writer)),
      feed_(store.Subscribe()),
      first_slot_(FirstSlots(store)),
      plan_({.heartbeat = config.dds.heartbeat}, Deadbands(store), store.device_count(),
            ImageTime(first_slot_.back())),
      pacer_(kPaceInterval, kPaceBurst) {}

DdsPublisher::~DdsPublisher() { Stop(); }

void DdsPublisher::Stop() {
  {
    const std::lock_guard lock(stop_mutex_);
    stop_ = true;
  }
  stop_changed_.notify_all();
  feed_->Wake();
  if (thread_.joinable()) thread_.join();
}

DdsCounters DdsPublisher::counters() const { return {written_, failed_, writer_->subscribers()}; }

void DdsPublisher::Run() {
  Instant next_ageing = Clock();
  Pacer wakes(kWakeInterval, kWakeBurst);
  while (!stopping()) {
    const Instant now = Clock();
    if (now >= next_ageing) {
      store_.Age(now);
      next_ageing = now + kAgeInterval;
    }
    const Instant until = std::min(plan_.NextDue(), next_ageing);
    feed_->Drain(std::max(Duration(0), until - now), changes_);
    const Instant woken = Clock();
    SendChanges();
    SendDue();
    if (!wakes.Take(woken)) WaitUntil(woken + kWakeInterval);
  }
  DisposeAll();
}

void DdsPublisher::SendChanges() {
  std::ranges::sort(changes_.points, {}, &PointRef::device);
  SendPoints(changes_.points);
  for (const std::uint32_t device : changes_.devices) SendDevice(device);
}

// A few at a time, so that what changes now does not wait for the whole start-up image.
void DdsPublisher::SendDue() {
  const Instant now = Clock();
  plan_.TakeDuePoints(now, kDueBatch, due_);
  std::ranges::sort(due_);
  due_refs_.clear();
  for (const std::uint32_t slot : due_) due_refs_.push_back(RefOf(slot));
  SendPoints(due_refs_);
  plan_.TakeDueDevices(now, kDueBatch, due_);
  for (const std::uint32_t device : due_) SendDevice(device);
}

void DdsPublisher::SendPoints(std::span<const PointRef> refs) {
  while (!refs.empty()) {
    const std::uint32_t device = refs.front().device;
    const auto end =
        std::ranges::find_if(refs, [device](const PointRef& ref) { return ref.device != device; });
    const auto count = static_cast<std::size_t>(end - refs.begin());
    StagePoints(device, refs.first(count));
    for (std::size_t i = 0; i < staged_count_; ++i) {
      if (!Pace()) return;
      const Staged& staged = staged_[i];
      const bool written = writer_->Write(staged.sample);
      if (written) {
        plan_.PointSent(staged.slot, staged.state, Clock());
      } else {
        plan_.PointFailed(staged.slot, Clock());
      }
      Count(written, staged.sample.device);
    }
    refs = refs.subspan(count);
  }
}

// Under the device's lock values are only copied: a write may block for milliseconds.
void DdsPublisher::StagePoints(std::uint32_t device, std::span<const PointRef> refs) {
  staged_count_ = 0;
  const Instant now = Clock();
  const auto stage = [&, this](const DeviceRecord& record) {
    for (const PointRef& ref : refs) {
      const std::uint32_t slot = first_slot_[device] + ref.point;
      const Quality quality = QualityAt(record, ref.point, now);
      const PointState state = PointState::Of(record.points[ref.point].value, quality);
      if (!plan_.WantsPoint(slot, state)) continue;
      if (staged_count_ == staged_.size()) staged_.emplace_back();
      Staged& staged = staged_[staged_count_++];
      staged.slot = slot;
      staged.state = state;
      FillPoint(record, ref.point, staged);
    }
  };
  store_.Read(device, std::cref(stage));
}

void DdsPublisher::FillPoint(const DeviceRecord& record, std::uint32_t point,
                             Staged& staged) const {
  const PointRecord& held = record.points[point];
  const config::Point& described = record.device->points[point];
  PointSample& sample = staged.sample;
  sample.gateway = config_.name;
  sample.device = record.device->name;
  sample.point = described.name;
  sample.value = staged.state.number;
  const auto* text = std::get_if<std::string>(&held.value);
  AssignBounded(sample.text, text != nullptr ? std::string_view(*text) : "", kMaxText);
  AssignBounded(sample.unit, described.unit, kMaxUnit);
  sample.quality = static_cast<std::uint16_t>(staged.state.quality);
  sample.source_time_ns = held.read_at ? held.source_time.time_since_epoch().count() : 0;
  sample.seq = held.seq;
  sample.rtt_us = held.rtt_us;
}

void DdsPublisher::SendDevice(std::uint32_t device) {
  DeviceState state{};
  bool wanted = false;
  const auto look = [&, this](const DeviceRecord& record) {
    state = record.status.state;
    wanted = plan_.WantsDevice(device, state, Clock());
    if (wanted) FillDevice(record);
  };
  store_.Read(device, std::cref(look));
  if (!wanted || !Pace()) return;
  const bool written = writer_->Write(device_sample_);
  if (written) {
    plan_.DeviceSent(device, state, Clock());
  } else {
    plan_.DeviceFailed(device, Clock());
  }
  Count(written, device_sample_.device);
}

void DdsPublisher::FillDevice(const DeviceRecord& record) {
  const DeviceStatus& status = record.status;
  DeviceSample& sample = device_sample_;
  sample.gateway = config_.name;
  sample.device = record.device->name;
  sample.line = record.line->name;
  sample.state = static_cast<std::uint16_t>(status.state);
  sample.last_outcome = static_cast<std::uint16_t>(status.last_outcome);
  sample.last_ok_time_ns = status.last_ok ? status.last_ok_wall.time_since_epoch().count() : 0;
  sample.exchanges = status.exchanges;
  sample.ok = status.Count(Outcome::ok);
  sample.no_reply = status.Count(Outcome::no_reply);
  sample.corrupt = status.Count(Outcome::corrupt);
  sample.retries = status.retries;
  const bool measured = status.round_trips.count() > 0;
  sample.rtt_mean_us = measured ? Microseconds(status.round_trips.mean()) : 0;
  sample.rtt_p99_us = measured ? Microseconds(status.round_trips.Percentile(0.99)) : 0;
}

// When the time does not suffice, the end of the writer itself tells the rest.
void DdsPublisher::DisposeAll() {
  const Instant deadline = Clock() + kDisposeTime;
  Pacer pacer(kDisposeInterval, kPaceBurst);
  const auto pace = [&] {
    while (!pacer.Take(Clock())) std::this_thread::sleep_until(pacer.ReadyAt());
    return Clock() < deadline;
  };
  PointSample sample;
  sample.gateway = config_.name;
  for (std::uint32_t slot = 0; slot < first_slot_.back(); ++slot) {
    if (!plan_.WasSent(slot)) continue;
    const PointRef ref = RefOf(slot);
    sample.device = store_.device(ref.device).name;
    sample.point = store_.device(ref.device).points[ref.point].name;
    if (!pace()) return;
    writer_->Dispose(sample);
  }
  DeviceSample status;
  status.gateway = config_.name;
  for (std::uint32_t device = 0; device < store_.device_count(); ++device) {
    if (!plan_.DeviceWasSent(device)) continue;
    status.device = store_.device(device).name;
    if (!pace()) return;
    writer_->Dispose(status);
  }
  writer_->WaitAcknowledged(kAcknowledgeTime);
}

void DdsPublisher::Count(bool written, const std::string& device) {
  if (written) {
    ++written_;
    if (failing_ > 0 && log_) {
      log_("dds: samples are taken again; " + std::to_string(failing_) +
           " were refused and repeated");
    }
    failing_ = 0;
    return;
  }
  ++failed_;
  if (failing_++ == 0 && log_) {
    log_("dds: a sample of device " + device + " was refused; it will be repeated");
  }
}

bool DdsPublisher::Pace() {
  while (!pacer_.Take(Clock())) {
    if (!WaitUntil(pacer_.ReadyAt())) return false;
  }
  return true;
}

bool DdsPublisher::WaitUntil(Instant when) {
  std::unique_lock lock(stop_mutex_);
  return !stop_changed_.wait_until(lock, when, [this] { return stop_; });
}

bool DdsPublisher::stopping() const {
  const std::lock_guard lock(stop_mutex_);
  return stop_;
}

PointRef DdsPublisher::RefOf(std::uint32_t slot) const {
  const auto after = std::ranges::upper_bound(first_slot_, slot);
  const auto device = static_cast<std::uint32_t>(after - first_slot_.begin()) - 1;
  return {device, slot - first_slot_[device]};
}

}  // namespace baudgate::dds
