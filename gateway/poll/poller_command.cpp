// Writes to points on a line: queued, begun in time or not at all, read back, answered once. What
// must not be sent any more, of routed requests too.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include "gateway/poll/poller.h"
#include "gateway/poll/poller_parts.h"
#include "gateway/store/conversion.h"

namespace baudgate {

bool Poller::Submit(WriteCommand command, Now now) {
  Advance(now);
  if (writes_.full()) return false;
  if (open_) {
    writes_.Push(std::move(command));
    Settle();
  } else {
    command.done(Outcome::line_down, WhyClosed());
  }
  return true;
}

void Poller::AnswerConfirmed() {
  const bool reading_back = work_ && work_->refresh && work_->attempts == 0;
  for (const WriteCommand& command : writes_.TakeConfirmed(open_ && reading_back)) {
    command.done(Outcome::ok, {});
  }
}

void Poller::ExpireCommands() {
  const WriteQueue::Expired expired = writes_.TakeExpired(now_.instant);
  for (const WriteCommand& command : expired.confirmed) command.done(Outcome::ok, {});
  for (const WriteCommand& command : expired.unsent) {
    command.done(Outcome::no_reply, "the command waited for the line beyond its deadline");
  }
}

Poller::Device& Poller::DeviceOf(const WriteCommand& command) const {
  return *devices_[command.device - devices_.front()->index];
}

/// Writes to one slave keep their order, whichever way they came.
bool Poller::MayCommand(const WriteCommand& command) const {
  const std::uint8_t slave = DeviceOf(command).slave;
  if (slave == 0) return true;
  const auto routed = routes_.FirstWrite(slave);
  return !routed || *routed > command.sequence;
}

/// The first command whose device may be asked now; commands to one device keep their order.
bool Poller::PickCommand() {
  std::optional<WriteCommand> next = writes_.Take([this](const WriteCommand& waiting) {
    const Device& device = DeviceOf(waiting);
    if (!MayCommand(waiting)) return false;
    return device.late_until <= now_.instant || !device.in_use || device.health.absent();
  });
  if (!next) return false;
  WriteCommand& command = *next;
  Device& device = DeviceOf(command);
  if (command.dropped && *command.dropped) {
    command.done(Outcome::no_reply, "its client has left");
  } else if (!device.in_use) {
    command.done(Outcome::no_reply, "the device is disabled");
  } else if (device.health.absent()) {
    command.done(Outcome::no_reply, "the device is offline");
  } else if (command.writes.empty()) {
    command.done(Outcome::ok, {});
  } else {
    BeginTask(device, {});
    work_->command = std::move(command);
    NextWrite();
  }
  return true;
}

bool Poller::PickRefresh() {
  const auto next = writes_.TakeReadBack(
      [this](std::size_t device) { return devices_[device]->late_until <= now_.instant; });
  if (!next) return false;
  Device* const device = devices_[next->device].get();
  const std::size_t query = next->query;
  if (!device->in_use || device->health.absent() || query >= device->conversation->Queries().size())
    return true;
  BeginTask(*device, {Task::Kind::poll, query, kNoPoint, {}});
  work_->refresh = true;
  Ask();
  return true;
}

/// The writes of the command before work_->write are confirmed: goes on with the next.
void Poller::NextWrite() {
  Work& work = *work_;
  Device& device = *work.device;
  const PointWrite& write = work.command->writes[work.write++];
  auto raw = ToRaw(device.config->points[write.point], write.value);
  work.task.kind = Task::Kind::write;
  work.task.point = write.point;
  if (!raw) {
    work.mute = true;
    FinishTask(Outcome::refused, raw.error());
    return;
  }
  work.task.value = std::move(*raw);
  const auto queries = device.conversation->Queries();
  for (std::size_t query = 0; query < queries.size(); ++query) {
    const auto& points = queries[query].points;
    if (std::find(points.begin(), points.end(), write.point) == points.end()) continue;
    writes_.AddReadBack({device.slot, query});
  }
  Ask();
}

bool Poller::IsTooLate(const Work& work) const {
  const auto latest = LatestStart(work);
  return latest && *latest <= now_.instant;
}

/// When the request of the task may still be sent, if it has a deadline.
std::optional<Instant> Poller::LatestStart(const Work& work) const {
  if (work.command && !work.request.closes) return work.command->deadline;
  if (!work.routed) return std::nullopt;
  if (work.routed->empty()) return Instant{};  // nobody waits any more
  return std::ranges::max(*work.routed, {}, &RoutedRequest::deadline).deadline;
}

/// Why the request of the task must not be sent; null: it may.
const char* Poller::WhyNot(const Work& work) const {
  if (work.request.closes) return nullptr;
  if (!work.routed && !work.device->in_use) return "the device is disabled";
  const bool first = !work.begun() && work.write <= 1;
  if (first && work.command && work.command->dropped && *work.command->dropped) {
    return "its client has left";
  }
  return IsTooLate(work) ? "the command waited for the line beyond its deadline" : nullptr;
}

bool Poller::IsWriting() const {
  return work_ && work_->command && (work_->begun() || !work_->sending);
}

/// What waits for the line is not sent. What it has begun is ended in order.
void Poller::BreakOff(const std::string& why) {
  Work& work = *work_;
  work.mute = true;
  const bool closes = !work.routed && work.begun() &&
                      work.device->conversation->OnFailure(work.task, work.request, Outcome::busy,
                                                           now_.instant) == Then::ask_again;
  if (closes) return Ask();
  FinishTask(Outcome::no_reply, why);
}

}  // namespace baudgate
