// Clients that wait for a line: takes their writes, reads and requests of routes, and answers those
// whose request is not sent, or has ended. Called by gateway/bus/poller/poller.cpp before and after
// everything that the line does.
//
//   a command                          its client hears
//   its deadline passes                not sent
//   its device is offline or disabled  not sent
//   confirmed, and read back           what the point shows
//   confirmed, its deadline passes     what was read back by then; nothing: ok, not read back
//   a routed request                   its client hears
//   its deadline passes                no reply
//   a read of a slave that is offline  no reply, but for one that may be the slave's probe now
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

  /// Answers commands that need not wait any more. True: one more may wait.
  bool MakeRoom(Instant now);
  /// A command with points to be read and none to be written is answered like a confirmed write, as
  /// soon as all of them have been read.
  void Take(WriteCommand command, Instant now);
  /// False: no routes lead to this line.
  bool Take(RoutedRequest& request);
  /// The client has left: its routed requests are answered.
  void Abandon(std::uint64_t client) { line_.agenda.route_queue.Abandon(client); }
  /// When the next one has waited for long enough.
  std::optional<Instant> Deadline() const;

  /// Commands whose deadline has passed, or whose device may not be asked any more.
  void AnswerCommands(Instant now);
  /// Commands that were confirmed, and whose device is not read back. `under_way`: a job; null:
  /// there is none.
  void AnswerConfirmed(const Job* under_way);
  /// Routed requests whose deadline has passed, or whose slave is offline. `line_is_free`: no job
  /// is under way.
  void AnswerRouted(const Idle& idle, bool line_is_free);
  /// All: the port is closed.
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
