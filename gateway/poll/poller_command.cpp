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
  if (commands_.size() >= kQueueLimit) return false;
  command.sequence = ++sequence_;
  commands_.push_back(std::move(command));
  if (open_) {
    Settle();
  } else {
    WriteCommand refused = std::move(commands_.back());
    commands_.pop_back();
    refused.done(Outcome::line_down, WhyClosed());
  }
  return true;
}

/// A client that reads what it has just written must not get the value from before.
void Poller::AnswerConfirmed() {
  // A device that does not answer the read-back at once does not hold up the answer to the write.
  const bool first_try = work_ && work_->refresh && work_->attempts == 0;
  const bool reading_back = !refresh_.empty() || first_try;
  if (reading_back && open_) return;
  for (const WriteCommand& command : std::exchange(confirmed_, {})) command.done(Outcome::ok, {});
}

void Poller::ExpireCommands() {
  const auto expired = std::stable_partition(
      commands_.begin(), commands_.end(),
      [this](const WriteCommand& command) { return command.deadline > now_.instant; });
  std::vector<WriteCommand> late(std::make_move_iterator(expired),
                                 std::make_move_iterator(commands_.end()));
  commands_.erase(expired, commands_.end());
  for (std::size_t i = 0; i < confirmed_.size();) {
    if (confirmed_[i].deadline > now_.instant) {
      ++i;
      continue;
    }
    confirmed_[i].done(Outcome::ok, {});  // the write itself was in time
    confirmed_.erase(confirmed_.begin() + static_cast<std::ptrdiff_t>(i));
  }
  for (const WriteCommand& command : late) {
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
  const auto next = std::ranges::find_if(commands_, [this](const WriteCommand& command) {
    const Device& device = DeviceOf(command);
    if (!MayCommand(command)) return false;
    return device.late_until <= now_.instant || !device.in_use || device.health.absent();
  });
  if (next == commands_.end()) return false;
  WriteCommand command = std::move(*next);
  commands_.erase(next);
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
  const auto next = std::ranges::find_if(
      refresh_, [this](const auto& wanted) { return wanted.first->late_until <= now_.instant; });
  if (next == refresh_.end()) return false;
  const auto [device, query] = *next;
  refresh_.erase(next);
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
    const std::pair wanted(&device, query);
    const bool known = std::find(refresh_.begin(), refresh_.end(), wanted) != refresh_.end();
    if (!known && refresh_.size() < kQueueLimit) refresh_.push_back(wanted);
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
