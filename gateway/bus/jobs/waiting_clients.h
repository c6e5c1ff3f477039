// `WaitingClients` takes writes, reads and requests of routes for a line, and answers clients whose
// request is not sent, or has ended. gateway/bus/poller/poller.cpp calls it before and after all
// work of the line.
//
//   a command                          the answer to its client
//   its deadline passes                not sent
//   its device is offline or disabled  not sent
//   confirmed, and read back           the value that the point shows
//   confirmed, its deadline passes     the values read back so far; none: ok, not read back
//   a routed request                   the answer to its client
//   its deadline passes                no reply
//   a read of a slave that is offline  no reply; one read may go out as the probe of the slave
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "gateway/bus/jobs/line_context.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/writes/route_queue.h"
#include "gateway/bus/writes/write_command.h"
#include "gateway/bus/writes/write_queue.h"

namespace baudgate::bus {

class WaitingClients {
 public:
  /// Both references must stay valid for the lifetime of this object.
  WaitingClients(const PointStore& store, LineContext& line) : store_(store), line_(line) {}

  /// Answers commands that need not wait any more. Returns true if one more command may wait.
  bool MakeRoom(Instant now);
  /// A command that only reads points is answered like a confirmed write, as soon as all its points
  /// have been read.
  void Take(WriteCommand command, Instant now);
  /// Returns false if no route leads to this line.
  bool Take(RoutedRequest& request);
  void Abandon(std::uint64_t client) { line_.agenda.route_queue.Abandon(client); }
  /// Returns the earliest deadline of all waiting requests.
  std::optional<Instant> Deadline() const;

  /// Answers commands whose deadline has passed, or whose device may not be asked any more.
  void AnswerCommands(Instant now);
  /// Answers confirmed commands whose device has no read-backs left. `under_way`: the present job;
  /// null: there is none.
  void AnswerConfirmed(const Job* under_way);
  /// Answers routed requests whose deadline has passed, or whose slave is offline. `line_is_free`:
  /// no job is under way.
  void AnswerRouted(const Idle& idle, bool line_is_free);
  /// Answers all requests, because the port is closed.
  void AnswerAll(const std::string& reason);

  void NotSent(WriteCommand& command, const std::string& reason);

 private:
  void ReadNow(WriteCommand command, Instant now);
  const char* WhyNotAsked(const WriteCommand& command) const;
  void Answer(WriteQueue::Confirmed& one);

  const PointStore& store_;
  LineContext& line_;
};

}  // namespace baudgate::bus
