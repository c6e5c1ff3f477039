// The way of a write from an output to its line, as far as the audit takes part: made and ended by
// daemon.cpp.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "config/model/config.h"
#include "gateway/audit/audit_log.h"
#include "gateway/audit/audited_writes.h"
#include "gateway/daemon/events_place.h"
#include "gateway/requests/commands.h"
#include "gateway/store/point_store.h"

namespace baudgate {

class WritePath {
 public:
  /// All but `place` outlive it.
  WritePath(const config::Config& config, const PointStore& store, CommandSink& lines,
            const EventsPlace& place);

  /// What outputs submit to.
  CommandSink& entrance() { return audited_; }
  audit::AuditLog& log() { return log_; }

  void Start() { audited_.Start(); }
  /// Nobody submits any more: what waits is handed to the lines, or denied.
  void Stop() { audited_.Stop(); }

 private:
  audit::AuditLog log_;
  audit::AuditedWrites audited_;
};

}  // namespace baudgate
