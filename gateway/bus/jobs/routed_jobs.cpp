// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/routed_jobs.h"

#include <utility>

namespace baudgate {

Turns::Waiting RoutedJobs::Waiting() const {
  const RouteQueue& queue = agenda_.route_queue;
  if (queue.empty()) return {};
  return {.short_write = ShortWriteWaits(),
          .routed = true,
          .high_clients = queue.Clients(config::Priority::high)};
}

bool RoutedJobs::AnyMayGo(Instant now) const {
  return agenda_.route_queue.HasAny(
      [&](const RoutedRequest& request) { return MayGo(request, now); });
}

bool RoutedJobs::ShortWriteMayGo(Instant now) const {
  return agenda_.route_queue.HasAny([&](const RoutedRequest& request) {
    return RouteQueue::IsShortWrite(request) && MayGo(request, now);
  });
}

bool RoutedJobs::ShortWriteWaits() const {
  return agenda_.route_queue.HasAny([this](const RoutedRequest& request) {
    if (!RouteQueue::IsShortWrite(request)) return false;
    const Member* member = roster_.FindSlave(request.slave);
    return member == nullptr || !member->health.absent();
  });
}

bool RoutedJobs::IsLookedFor(const Member& slave, const Idle& idle) const {
  if (slave.slave == 0) return false;
  return agenda_.route_queue.HasFor(slave.slave) ||
         agenda_.routes.MayRepeatRead(slave, idle.since == idle.now, idle.now);
}

/// Not while a late reply could pass for its own; and no write before an earlier one to a point of
/// the same device.
bool RoutedJobs::MayGo(const RoutedRequest& request, Instant now) const {
  const Member* member = roster_.FindSlave(request.slave);
  if (member != nullptr && (!late_.IsClear(*member, now) || member->health.absent())) return false;
  if (!IsWrite(request)) return true;
  const Device* device = member == nullptr ? nullptr : member->device;
  if (device != nullptr && agenda_.schedule.GoesFirst(device->place, now)) return false;
  return !agenda_.write_queue.HasAny([&](const WriteCommand& command) {
    const std::uint8_t slave = roster_.DeviceAt(command.device).slave;
    const bool same = slave != 0 && (slave == request.slave || request.slave == 0);
    return same && command.sequence < request.sequence;
  });
}

std::unique_ptr<Job> RoutedJobs::Take(config::Priority priority, Instant now) {
  const auto may_go = [&](const RoutedRequest& request) { return MayGo(request, now); };
  return JobOf(agenda_.route_queue.Take(priority, may_go), now);
}

std::unique_ptr<Job> RoutedJobs::TakeUrgent(Instant now) {
  const auto may_go = [&](const RoutedRequest& request) { return MayGo(request, now); };
  return JobOf(agenda_.route_queue.TakeUrgent(may_go), now);
}

std::unique_ptr<Job> RoutedJobs::TakeShortWrite(std::uint8_t slave, Instant now) {
  const auto to_it = [slave](const RoutedRequest& request) { return request.slave == slave; };
  return JobOf(agenda_.route_queue.TakeUrgent(to_it), now);
}

std::unique_ptr<Job> RoutedJobs::TakeProbe(const Member& slave, const Idle& idle) {
  auto job = JobOf(agenda_.route_queue.TakeFor(slave.slave), idle.now);
  if (!job && agenda_.routes.MayRepeatRead(slave, idle.since == idle.now, idle.now)) {
    job = JobOf(agenda_.routes.RepeatRead(slave), idle.now);
  }
  return job;
}

std::unique_ptr<Job> RoutedJobs::JobOf(RouteQueue::Batch batch, Instant now) {
  if (batch.empty()) return nullptr;
  const Protocol& protocol = *roster_.carrier();
  const RoutedRequest& first = batch.front();
  Request request;
  request.bytes = protocol.carrier->wrap(first.slave, first.pdu);
  Member& slave = roster_.SlaveAt(first.slave);
  request.expect = protocol.expect(request.bytes, slave.options);
  const bool common = protocol.carrier->is_common(first.pdu);
  const bool read = !IsWrite(first);
  auto job = std::make_unique<Job>(
      slave,
      Job::Routed{
          .batch = std::move(batch), .every_slave_answers = common, .reply = {}, .is_read = read},
      Task{}, now);
  job->step = {.request = std::move(request), .waiting = true};
  job->requests = 1;
  return job;
}

}  // namespace baudgate
