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

}  // namespace

// Keys cannot be cut: two of them might become one.
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
                                                           PointStore& store,
                                                           std::shared_ptr<SampleWriter> writer,
                                                           Log log,
                                                           std::shared_ptr<EventSupply> events) {
  if (const Status status = CheckNames(config); !status) return Error{status.error()};
  std::unique_ptr<DdsPublisher> publisher(
      new DdsPublisher(config, store, std::move(log), std::move(writer), std::move(events)));
  publisher->writer_->OnSession([raw = publisher.get()] {
    {
      const MutexLock lock(raw->stop_mutex_);
      raw->session_changed_ = true;
    }
    raw->stop_changed_.notify_all();
    raw->feed_->Wake();
  });
  if (publisher->events_) {
    publisher->events_->OnNew([raw = publisher.get()] { raw->feed_->Wake(); });
  }
  publisher->thread_ = std::thread([raw = publisher.get()] { raw->Run(); });
  return publisher;
}

DdsPublisher::DdsPublisher(const config::Config& config, PointStore& store, Log log,
                           std::shared_ptr<SampleWriter> writer,
                           std::shared_ptr<EventSupply> events)
    : writer_(std::move(writer)),
      events_(std::move(events)),
      feed_(store.Subscribe()),
      sender_(config, store, *writer_, std::move(log), ReadClocks(), events_.get()) {}

DdsPublisher::~DdsPublisher() {
  Stop();
  if (events_) events_->OnNew({});
  writer_->OnSession({});  // they may outlive this
}

void DdsPublisher::Renumber() {
  renumbered_ = true;
  feed_->Wake();
}

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
  std::uint64_t session = 0;  // whom the sender sends to
  while (!stopping()) {
    const std::uint64_t current = AwaitSession();
    if (current == 0) break;
    if (std::exchange(session, current) != current) {
      sender_.StartAnew(ReadClocks().instant);
      next_sending = {};
    }
    if (renumbered_.exchange(false)) {
      sender_.Renumber(ReadClocks().instant);
      next_sending = {};
    }
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
  if (writer_->session() != session) return;  // nobody is there who has anything
  while (const auto next = sender_.End(ReadClocks().instant)) std::this_thread::sleep_until(*next);
  const bool heard = writer_->subscribers() > 0;
  if (writer_->WaitAcknowledged(kAcknowledgeTime) && heard) sender_.Confirm();
}

/// Waits until somebody takes samples; 0: Stop was called.
std::uint64_t DdsPublisher::AwaitSession() {
  MutexLock lock(stop_mutex_);
  for (;;) {
    session_changed_ = false;
    const std::uint64_t session = writer_->session();
    if (stop_) return 0;
    if (session != 0) return session;
    while (!stop_ && !session_changed_) lock.Wait(stop_changed_);
  }
}

void DdsPublisher::WaitUntil(Instant when) {
  MutexLock lock(stop_mutex_);
  while (!stop_ && !session_changed_ && lock.WaitUntil(stop_changed_, when)) {
  }
}

bool DdsPublisher::stopping() const {
  const MutexLock lock(stop_mutex_);
  return stop_;
}

}  // namespace baudgate::dds
