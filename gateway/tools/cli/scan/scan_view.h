// What the user of `baudgate scan` sees: one line that is drawn again while it runs, the question
// whether to talk where others do, a table or JSON lines of what was found.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <ostream>
#include <string>

#include "gateway/tools/cli/scan/scan.h"
#include "gateway/tools/scan/scanner.h"
#include "gateway/tools/terminal/stop_signals.h"

namespace baudgate {

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

/// Asks on the terminal; no where there is none, or at Ctrl-C.
bool AskUser(const std::string& question, const StopSignals& stop, std::ostream& err);
/// Standard input and standard error are terminals.
bool HasUser();

}  // namespace baudgate
