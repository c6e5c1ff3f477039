// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/publisher.h"

#include <algorithm>
#include <thread>
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
  DdsPublisher* const raw = publisher.get();
  raw->writer_->OnSession([raw] {
    raw->worker_.Wake();
    raw->feed_->Wake();
  });
  if (raw->events_) raw->events_->OnNew([raw] { raw->feed_->Wake(); });
  raw->worker_.Start();
  return publisher;
}

DdsPublisher::DdsPublisher(const config::Config& config, PointStore& store, Log log,
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
  writer_->OnSession({});  // they may outlive this
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
    feed_->Drain(next_sending_, changes_);  // waits for them
    sender_.Add(changes_);
  }
  const Instant now = ReadClocks().instant;
  next_sending_ = sender_.Send(now);
  if (takes_changes && !wakes_.Take(now)) rests_until_ = now + kWakeInterval;
  if (!sender_.idle()) rests_until_ = std::max(rests_until_, next_sending_);
  return rests_until_;
}

/// Another session, or a reload: the sender starts again, and at once.
void DdsPublisher::Renew(std::uint64_t session) {
  const Instant now = ReadClocks().instant;
  const bool other_session = std::exchange(session_, session) != session;
  const bool reloaded = reloaded_.exchange(false);
  if (other_session) sender_.StartAnew(now);
  if (reloaded) sender_.OnReload(now);
  if (other_session || reloaded) next_sending_ = rests_until_ = {};
}

Instant DdsPublisher::End() {
  const bool known = writer_->session() == session_;  // else the receiver has no event yet
  while (known) {
    const auto next = sender_.End(ReadClocks().instant);
    if (!next) break;
    std::this_thread::sleep_until(*next);
  }
  if (writer_->WaitAcknowledged(kAcknowledgeTime) && known) sender_.Confirm();
  return kWhenWoken;
}

}  // namespace baudgate::dds
