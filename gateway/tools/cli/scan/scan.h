// `baudgate scan`: finds the devices on a bus, with their serial settings, addresses and profiles.
// It sends only the reads that each protocol lists (protocols/scanning.h).
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
  std::string target;    ///< path of a port, tcp://HOST:PORT, or a line of the running gateway
  std::string protocol;  ///< empty: all protocols that support a scan
  std::optional<scan::Addresses> addresses;
  bool quick = false;
  bool json = false;
  bool over_traffic = false;
  bool rs485 = false;
  std::string config;  ///< configuration file to write; empty: no file is written
  bool force = false;
  /// Path of the control socket; empty: the only running gateway is used.
  std::string socket;
  std::size_t width = 0;
};

/// Exit codes: 0 the scan has ended, with or without devices; 2 invalid target or protocol; 3 the
/// written configuration has errors; 4 the port fails, another master sends, or no `config` is
/// written.
int RunScan(const ScanOptions& options, const config::Catalog& catalog, std::ostream& out,
            std::ostream& err);

// `ScanView` is the user interface of `baudgate scan`: a progress line, the question whether to
// send on a line with traffic, and the found devices as a table or JSON lines.
class ScanView final : public scan::Watcher {
 public:
  /// All references must outlive this object. `alive` is called repeatedly, to renew the loan of a
  /// line.
  ScanView(const ScanOptions& options, bool network, const StopSignals& stop,
           std::function<void()> alive, std::ostream& out, std::ostream& err);

  void OnProgress(const scan::Progress& progress) override;
  void OnFound(const scan::Found& found) override;
  bool MayTalk(const std::string& who) override;
  void Conclude(const scan::Report& report);

  /// True if the line has traffic and the user has not allowed the scan to send.
  bool was_refused() const { return refused_; }

 private:
  void Clear();

  const ScanOptions& options_;
  const bool network_;
  const StopSignals& stop_;
  const std::function<void()> alive_;
  std::ostream& out_;
  std::ostream& err_;
  const bool terminal_;
  bool drawn_ = false;
  bool refused_ = false;
  Instant drawn_at_{};
};

}  // namespace baudgate::tools
