// `baudgate scan`: which devices are on this bus, at which settings and addresses, and with which
// profiles. Reads only; what may be sent is listed by each protocol (protocols/scanning.h).
// ScanView is what the user sees.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <ostream>
#include <string>

#include "config/catalog/catalog.h"
#include "gateway/tools/scan/plan.h"
#include "gateway/tools/scan/scanner.h"
#include "gateway/tools/terminal/command_end.h"

namespace baudgate::tools {

struct ScanOptions {
  std::string target;    ///< a port, or a line of the running gateway
  std::string protocol;  ///< empty: all that can be looked for
  std::optional<scan::Addresses> addresses;
  bool quick = false;
  bool json = false;
  bool over_traffic = false;
  bool rs485 = false;  ///< the port's driver switches the direction
  std::string config;  ///< a file to write; empty: none
  bool force = false;  ///< it may be there
  std::string socket;  ///< of the gateway; empty: the default places
  std::size_t width = 0;
};

/// Exit code 0, devices or none; 2 for a wrong word; 4 where the port cannot be opened, is lost,
/// or others speak on it.
int RunScan(const ScanOptions& options, const config::Catalog& catalog, std::ostream& out,
            std::ostream& err);

// What the user of `baudgate scan` sees: one line that is drawn again while it runs, the question
// whether to talk where others do, a table or JSON lines of what was found.
class ScanView final : public scan::Watcher {
 public:
  /// All outlive it. `alive` is called again and again while the scan runs.
  ScanView(const ScanOptions& options, bool network, const StopSignals& stop,
           std::function<void()> alive, std::ostream& out, std::ostream& err);

  void OnProgress(const scan::Progress& progress) override;
  void OnFound(const scan::Found& found) override;
  bool MayTalk(const std::string& who) override;
  /// The table, and what else is worth knowing.
  void Conclude(const scan::Report& report);

  /// Others speak on the line, and the user has not allowed the scan to send.
  bool was_refused() const { return refused_; }

 private:
  void Clear();

  const ScanOptions& options_;
  const bool network_;
  const StopSignals& stop_;
  const std::function<void()> alive_;
  std::ostream& out_;
  std::ostream& err_;
  const bool terminal_;  ///< standard error is one
  bool drawn_ = false;
  bool refused_ = false;
  Instant drawn_at_{};
};

}  // namespace baudgate::tools
