// `Daemon::Impl` holds the parts of the gateway. daemon.cpp starts and stops them; apply.cpp gives
// them another configuration while they run.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "gateway/daemon/certificates.h"
#include "gateway/daemon/clocks/clock_corrector.h"
#include "gateway/daemon/daemon.h"
#include "gateway/daemon/descriptors.h"
#include "gateway/daemon/output_list.h"
#include "gateway/daemon/reload/difference.h"
#include "gateway/daemon/reloader.h"
#include "gateway/daemon/ticker.h"
#include "gateway/lines/lines.h"
#include "gateway/outputs/status/status_json.h"
#include "gateway/records/audit/security_journal.h"
#include "gateway/records/records.h"
#include "gateway/records/trace/line_recorder.h"

namespace baudgate::daemon {

struct Daemon::Impl {
  Impl(config::Config its_config, const config::Catalog& its_catalog)
      : config(std::move(its_config)),
        catalog(its_catalog),
        store(config),
        lines(store, catalog,
              lines::SharedLoops(config.lines, std::thread::hardware_concurrency())) {}

  /// Returns the sink that takes the writes of all outputs: the audit, or the lines if writes are
  /// not recorded.
  bus::CommandSink& Commands() {
    bus::CommandSink* const recorded = records.entrance();
    return recorded != nullptr ? *recorded : dispatcher;
  }

  // Reloader calls Examine and Prepare (Reloader::Links).
  void Examine(const config::Config& next, reload::Difference& difference) const;
  Reloader::Prepared Prepare(config::Config next, const reload::Difference& difference);
  /// The threads of the lines that start. Key: the name of the line.
  using Threads = std::map<std::string, std::shared_ptr<transports::LoopThread>>;
  /// The prepared outputs, in the order of `outputs`.
  using PreparedOutputs = std::vector<std::unique_ptr<outputs::Output::Prepared>>;
  /// Applies a prepared configuration. Returns a sentence for each part that could not be applied.
  std::vector<std::string> Apply(config::Config next, const reload::Difference& difference,
                                 PreparedOutputs prepared, const Threads& threads);
  /// If `own` is null, the line gets a new thread if it needs a thread and the system has resources
  /// for it; else it shares a thread.
  void AddLine(std::shared_ptr<const config::Line> line,
               std::shared_ptr<transports::LoopThread> own);
  reload::Healths Healths() const;
  void SetHistory(const std::shared_ptr<const history::HistorySource>& history);
  void SetReload(ReloadOptions options);

  Status OpenRecords();
  void TellUnsettled(const std::set<audit::Target>& devices);
  /// Gives the journal its folder, if the gateway stores anything or has users.
  void PlaceJournal(const config::Config& its);
  void MakeLines();
  void MakeClocks();
  void MakeOutputs();
  Status OpenOutputs();
  Status BeginOutputs();
  void StopOutputs();
  status::GatewayInfo GatewayForStatus();
  void EndLines();

  // The configuration of the start. Settings that only a restart can change are read from it.
  const config::Config config;
  /// The current configuration; its lines have the numbers of the store. It points to `config`
  /// without owning it until the first reload. Later only the reloader's thread uses it.
  std::shared_ptr<const config::Config> running{std::shared_ptr<void>(), &config};
  const config::Catalog& catalog;
  bus::PointStore store;
  OpenFiles open_files;
  records::FileTroubles troubles;
  std::unique_ptr<records::Recordings> recordings;  // null: there is no folder for recordings
  records::Records records;
  audit::SecurityJournal journal;
  lines::Lines lines;
  lines::LineDispatcher dispatcher{store, catalog, lines};
  Certificates certificates;
  std::unique_ptr<ClockCorrector> clocks;
  std::unique_ptr<Ticker> ticker;
  std::unique_ptr<HostClock> host_clock;
  Instant started = ReadClocks().instant;
  OutputRows output_rows = AllOutputs();
  outputs::OutputList outputs;
  std::unique_ptr<Reloader> reloader;  // null: the gateway cannot be reloaded
};

}  // namespace baudgate::daemon
