// SPDX-License-Identifier: Apache-2.0
#include "gateway/dds/publisher.h"

#include <algorithm>
#include <utility>

#include "gateway/base/time.h"

namespace baudgate::dds {
namespace {

// A wake-up costs more than a sample: when they come faster than this, what changes goes in
// batches.
constexpr Duration kWakeInterval = 2ms;
constexpr std::uint32_t kWakeBurst = 64;
constexpr Duration kAcknowledgeTime = 250ms;

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

}  // namespace

Result<std::unique_ptr<DdsPublisher>> DdsPublisher::Create(const config::Config& config,
                                                           PointStore& store,
                                                           std::unique_ptr<SampleWriter> writer,
                                                           Log log) {
  if (const Status status = CheckKeys(config); !status) return Error{status.error()};
  std::unique_ptr<DdsPublisher> publisher(
      new DdsPublisher(config, store, std::move(log), std::move(writer)));
  publisher->thread_ = std::thread([raw = publisher.get()] { raw->Run(); });
  return publisher;
}

DdsPublisher::DdsPublisher(const config::Config& config, PointStore& store, Log log,
                           std::unique_ptr<SampleWriter> writer)
    : writer_(std::move(writer)),
      feed_(store.Subscribe()),
      sender_(config, store, *writer_, std::move(log), ReadClocks().instant) {}

DdsPublisher::~DdsPublisher() { Stop(); }

void DdsPublisher::Stop() {
  {
    const MutexLock lock(stop_mutex_);
    stop_ = true;
  }
  stop_changed_.notify_all();
  feed_->Wake();
  if (thread_.joinable()) thread_.join();
}

void DdsPublisher::Run() {
  Pacer wakes(kWakeInterval, kWakeBurst);
  Changes changes;
  Instant next_sending{};
  while (!stopping()) {
    const bool takes_changes = sender_.idle();
    if (takes_changes) {
      feed_->Drain(next_sending, changes);
      sender_.Add(changes);
    } else {
      WaitUntil(next_sending);
    }
    const Instant now = ReadClocks().instant;
    next_sending = sender_.Send(now);
    if (takes_changes && !wakes.Take(now)) WaitUntil(now + kWakeInterval);
  }
  while (const auto next = sender_.End(ReadClocks().instant)) std::this_thread::sleep_until(*next);
  writer_->WaitAcknowledged(kAcknowledgeTime);
}

void DdsPublisher::WaitUntil(Instant when) {
  MutexLock lock(stop_mutex_);
  while (!stop_ && lock.WaitUntil(stop_changed_, when)) {
  }
}

bool DdsPublisher::stopping() const {
  const MutexLock lock(stop_mutex_);
  return stop_;
}

}  // namespace baudgate::dds
