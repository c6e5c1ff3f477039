// `Daemon` is the whole gateway: it makes the store, lines and outputs of a configuration, starts
// and stops them in the right order, and passes writes from outputs to lines.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "config/catalog/catalog.h"
#include "config/model/config.h"
#include "gateway/base/result.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/daemon/output_list.h"
#include "gateway/lines/line_control.h"

namespace baudgate::daemon {

struct ReloadOptions;

class Daemon {
 public:
  /// `catalog` must outlive the daemon.
  Daemon(config::Config config, const config::Catalog& catalog);
  ~Daemon();

  /// Adds an output at the end of the list. Must be called before Start.
  void Add(OutputRow output);
  /// Returns the names of the outputs, in the order in which they stop. Must be called after Start.
  std::vector<std::string_view> outputs() const;

  /// Makes `baudgate reload` and Reload read the file again. Must be called before Start.
  void SetReload(ReloadOptions options);
  /// Requests a reload and returns at once; the result is in the log. Thread-safe.
  void Reload(const std::string& by);

  /// Opens the outputs, then starts the lines. Fails if a network port is in use; a missing serial
  /// port is not an error.
  Status Start();
  /// Closes the lines, reports the end to subscribers and releases every port, within two seconds.
  /// Returns false if a line hangs in a call of its driver. All other parts have then ended
  /// properly, and the process can end with _Exit; the destructor would wait for the driver.
  bool Stop();

  /// Must be called once a second between Start and Stop. Returns false if a thread hangs that the
  /// whole gateway needs. A line that hangs is only reported in log and status.
  bool Look();

  const config::Config& config_at_start() const;
  const bus::PointStore& store() const;
  /// Must be called only between Start and Stop.
  lines::LineControl& control();
  /// Returns e.g. "Modbus TCP on 127.0.0.1:1502, DDS domain 0, 3 lines, 5 devices", for the log and
  /// READY=1.
  std::string Summary() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace baudgate::daemon
