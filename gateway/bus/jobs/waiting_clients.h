// `WaitingClients` takes writes, reads and routed requests of clients for one line, and answers
// clients whose request has ended or is not sent. The poller calls it before and after all work of
// the line.
//
//   a command                          the answer to its client
//   its deadline passes                not sent
//   its device is offline or disabled  not sent
//   confirmed, and read back           the value that the point now has
//   confirmed, its deadline passes     the values read back so far; if none: ok, not read back
//   a routed request                   the answer to its client
//   its deadline passes                no reply
//   a read of a slave that is offline  no reply; one read can be sent as the probe of the slave
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

  /// Answers commands that are not to be sent any more: see AnswerCommands. Returns true if the
  /// queue has space for a command.
  bool MakeRoom(Instant now);
  /// Puts a write command into the queue. A command that only reads is answered as soon as all its
  /// points have been read, or at once if they cannot be read.
  void Take(WriteCommand command, Instant now);
  /// Puts the request of a route into the queue. Returns false if the protocol of the line cannot
  /// carry such requests.
  bool Take(RoutedRequest& request);
  void Abandon(std::uint64_t client) { line_.agenda.route_queue.Abandon(client); }
  std::optional<Instant> Deadline() const;

  /// Answers commands whose deadline has passed, whose client has left, or whose device cannot be
  /// asked now.
  void AnswerCommands(Instant now);
  /// Answers confirmed commands whose device has no read-backs left. `under_way`: the present job,
  /// or null.
  void AnswerConfirmed(const Job* under_way);
  /// Answers routed requests whose deadline has passed, and reads from offline slaves.
  /// `line_is_free`: no job is under way, so one read may stay in the queue, to be sent as the
  /// probe of its slave.
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
