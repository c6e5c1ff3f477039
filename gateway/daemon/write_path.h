// The way of a recorded write from an output to its line: the audit log and the sink in front of
// the lines. Made and ended by daemon.cpp.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <set>
#include <string>

#include "config/model/config.h"
#include "gateway/base/guarded.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/writes/write_command.h"
#include "gateway/daemon/events_place.h"
#include "gateway/records/audit/audit_log.h"
#include "gateway/records/audit/audited_writes.h"

namespace baudgate {

class WritePath {
 public:
  /// Called once, from any thread: see AuditLog::Options.
  using Unsettled = std::function<void(const std::set<audit::Target>& devices)>;
  /// All but `place` outlive it.
  WritePath(const config::Config& config, const PointStore& store, CommandSink& lines,
            const EventsPlace& place, Unsettled unsettled);

  /// What outputs submit to.
  CommandSink& entrance() { return audited_; }
  audit::AuditLog& log() { return log_; }

  /// The lines are there: `unsettled` is called from now on.
  void Start();
  /// Nothing is submitted any more: waiting writes are handed to the lines, or denied.
  void Stop() { audited_.Stop(); }

 private:
  void OnUnsettled(const std::set<audit::Target>& devices);

  const Unsettled unsettled_;
  Mutex mutex_;
  bool started_ BAUDGATE_GUARDED_BY(mutex_) = false;
  std::set<audit::Target> early_ BAUDGATE_GUARDED_BY(mutex_);  // before Start
  audit::AuditLog log_;
  audit::AuditedWrites audited_;
};

}  // namespace baudgate
