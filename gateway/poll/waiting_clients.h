// Answers clients that wait for a line: of writes, of reads and of routes whose request is not
// sent, or has ended. Called by gateway/poll/poller.cpp before and after everything that the line
// does.
//
//   a command                          its client hears
//   its deadline passes                not sent
//   its device is offline or disabled  not sent
//   confirmed, and read back           what the point shows
//   confirmed, its deadline passes     ok, not read back
//   a routed request                   its client hears
//   its deadline passes                no reply
//   a read of a slave that is offline  no reply, but for one that may be the slave's probe now
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "gateway/poll/chooser.h"
#include "gateway/poll/device_accounts.h"
#include "gateway/poll/roster.h"
#include "gateway/poll/write_queue.h"
#include "gateway/requests/routed.h"
#include "gateway/requests/write_command.h"
#include "gateway/store/point_store.h"

namespace baudgate {

class WaitingClients {
 public:
  /// All references outlive it.
  WaitingClients(const PointStore& store, const Roster& roster, const Chooser& chooser,
                 Agenda& agenda, DeviceAccounts& accounts)
      : store_(store), roster_(roster), chooser_(chooser), agenda_(agenda), accounts_(accounts) {}

  /// A command with points to be read and none to be written: answered like a confirmed write, as
  /// soon as all of them have been read. `unasked`: the device that sends unasked; null: there is
  /// none.
  void ReadNow(WriteCommand command, const Device* unasked, Instant now);
  /// Commands whose deadline has passed, or whose device may not be asked any more.
  void AnswerCommands(Instant now);
  /// Commands that were confirmed.
  void AnswerConfirmed(const WriteQueue::IsReadingBack& is_reading_back);
  /// Routed requests whose deadline has passed, or whose slave is offline. `line_is_free`: no job
  /// is under way.
  void AnswerRouted(const Idle& idle, bool line_is_free);
  /// All: the port is closed.
  void AnswerAll(const std::string& reason);

  void NotSent(WriteCommand& command, const std::string& reason);

 private:
  const char* WhyNotAsked(const WriteCommand& command) const;
  void Answer(WriteQueue::Confirmed& one);

  const PointStore& store_;
  const Roster& roster_;
  const Chooser& chooser_;
  Agenda& agenda_;
  DeviceAccounts& accounts_;
};

}  // namespace baudgate
