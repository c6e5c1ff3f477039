// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/waiting_clients.h"

#include <algorithm>
#include <utility>

#include "gateway/base/time.h"
#include "gateway/bus/jobs/write.h"

namespace baudgate::bus {
namespace {

bool IsAsked(const protocols::Conversation& conversation,
             const std::vector<std::uint32_t>& points) {
  return std::ranges::any_of(conversation.Queries(), [&](const protocols::Query& query) {
    return std::ranges::find_first_of(query.points, points) != query.points.end();
  });
}

std::string DoesNotAnswer(std::uint8_t slave) {
  return "slave " + std::to_string(slave) + " does not answer (it is retried from time to time)";
}

}  // namespace

bool WaitingClients::MakeRoom(Instant now) {
  AnswerCommands(now);  // removes commands whose client has left
  return !line_.agenda.write_queue.full();
}

void WaitingClients::Take(WriteCommand command, Instant now) {
  if (command.writes().empty()) return ReadNow(std::move(command), now);
  line_.agenda.write_queue.Push(std::move(command));
}

bool WaitingClients::Take(RoutedRequest& request) {
  if (line_.roster.carrier() == nullptr) return false;
  request.sequence = line_.agenda.write_queue.NextSequence();
  line_.agenda.route_queue.Push(std::move(request));
  return true;
}

std::optional<Instant> WaitingClients::Deadline() const {
  return Soonest({line_.agenda.write_queue.Deadline(), line_.agenda.route_queue.Deadline()});
}

void WaitingClients::ReadNow(WriteCommand command, Instant now) {
  const Device& device = line_.roster.DeviceAt(command.device);
  if (const char* why = WhyNotAsked(command)) return NotSent(command, why);
  if (device.conversation->Listens() != nullptr &&
      !IsAsked(*device.conversation, command.reads())) {
    return NotSent(
        command,
        "this device cannot be polled, because it sends by itself; its last message is shown");
  }
  const std::vector<std::size_t> points(command.reads().begin(), command.reads().end());
  line_.agenda.write_queue.AddReadBacks(device.place, device.conversation->Queries(), points);
  command.MoveTo(WriteState::reading_back);
  line_.agenda.write_queue.Confirm(std::move(command), device.place, now);
}

void WaitingClients::AnswerCommands(Instant now) {
  WriteQueue::Expired expired = line_.agenda.write_queue.TakeExpired(now);
  for (WriteQueue::Confirmed& one : expired.confirmed) Answer(one);
  for (WriteCommand& command : expired.unsent) {
    const Device& device = line_.roster.DeviceAt(command.device);
    const bool in_vain =
        !Answers(device.health.state()) || line_.agenda.schedule.failing(device.place);
    NotSent(command,
            in_vain
                ? "the command was not sent before its deadline, because the device does not answer"
                : kTooLate);
  }
  while (auto refused = line_.agenda.write_queue.Take(
             [&](const WriteCommand& command) { return WhyNotAsked(command) != nullptr; })) {
    NotSent(*refused, WhyNotAsked(*refused));
  }
}

const char* WaitingClients::WhyNotAsked(const WriteCommand& command) const {
  const Device& device = line_.roster.DeviceAt(command.device);
  if (command.client_left()) return kClientLeft;
  if (!device.in_use) return "the device is disabled; 'baudgate enable' takes it into use";
  // A write is sent to an offline device if only a write can show that the device is back.
  const bool is_its_probe =
      !command.writes().empty() &&
      (line_.agenda.probes.CannotProbe(device) || line_.owed.whose.IsProbedByWrites(device));
  return device.health.absent() && !is_its_probe ? "the device is offline" : nullptr;
}

void WaitingClients::NotSent(WriteCommand& command, const std::string& reason) {
  if (!command.writes().empty()) {
    line_.accounts.devices.OnWrite(line_.roster.DeviceAt(command.device), WriteEnd::not_sent,
                                   false);
  }
  command.End({.end = WriteEnd::not_sent, .reason = reason});
}

void WaitingClients::AnswerConfirmed(const Job* under_way) {
  const auto is_reading_back = [&](std::size_t device) {
    const Member& member = line_.roster.device(device);
    return line_.agenda.parked.HasReadBack(member) ||
           (under_way != nullptr && under_way->ReadsBack(member));
  };
  for (auto& one : line_.agenda.write_queue.TakeConfirmed(is_reading_back)) Answer(one);
}

void WaitingClients::Answer(WriteQueue::Confirmed& one) {
  ReadBackVerdict verdict;
  store_.Read(one.command.device,
              [&](const DeviceRecord& record) { verdict = VerdictOn(one, record); });
  if (one.written > 0) {
    line_.accounts.devices.OnWrite(line_.roster.DeviceAt(one.command.device), verdict.result.end,
                                   !verdict.lost);
  }
  one.command.End(verdict.result);
}

/// An offline slave is asked only as often as its probes allow. Until it answers, reads are
/// answered at once as failed; writes wait until their deadline.
void WaitingClients::AnswerRouted(const Idle& idle, bool line_is_free) {
  RouteQueue& queue = line_.agenda.route_queue;
  if (queue.empty()) return;
  for (RoutedRequest& request : queue.TakeExpired(idle.now)) {
    const Member* member = line_.roster.FindSlave(request.slave);
    const bool offline = member != nullptr && member->health.absent();
    RoutedReply reply;
    reply.outcome = Outcome::no_reply;
    reply.sent = request.tries > 0;
    if (reply.sent) {
      reply.reason =
          "the reply was damaged, and the deadline passed before the request was sent again";
    } else {
      reply.reason = offline ? DoesNotAnswer(request.slave) : kTooLate;
    }
    request.done(std::move(reply));
  }
  for (const std::uint8_t slave : queue.Slaves()) {
    const Member* member = line_.roster.FindSlave(slave);
    if (member == nullptr || !member->health.absent()) continue;
    const std::size_t keep = line_is_free && line_.chooser.MayProbe(*member, idle) ? 1 : 0;
    for (RoutedRequest& read : line_.agenda.routes.TakeHopeless(
             *member, keep, *line_.roster.carrier()->carrier, idle.now)) {
      read.done({Outcome::no_reply, {}, DoesNotAnswer(slave)});
    }
  }
}

void WaitingClients::AnswerAll(const std::string& reason) {
  std::vector<WriteCommand> unsent = line_.agenda.write_queue.TakeAll();
  AnswerConfirmed(nullptr);
  for (WriteCommand& command : unsent) NotSent(command, reason);
  for (RoutedRequest& request : line_.agenda.route_queue.TakeAll()) {
    request.done({Outcome::line_down, {}, reason});
  }
}

}  // namespace baudgate::bus
