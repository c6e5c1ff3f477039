// The composition root: makes store, lines and outputs out of a configuration, starts and stops
// them in the right order, and carries writes from outputs to lines.
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
  /// `catalog` outlives the daemon.
  Daemon(config::Config config, const config::Catalog& catalog);
  ~Daemon();

  /// Adds an output behind the others in the list. To be called before Start.
  void Add(OutputRow output);
  /// The names of the outputs, in the order in which they are stopped. After Start.
  std::vector<std::string_view> outputs() const;

  /// Before Start. Then `baudgate reload` and Reload read the file again.
  void SetReload(ReloadOptions options);
  /// From any thread, done soon after; the result is in the log.
  void Reload(const std::string& by);

  /// Opens the outputs, then starts the lines. A network port that is in use is an error; a missing
  /// serial port is not.
  Status Start();
  /// Closes the lines, tells subscribers the end and releases every port; within two seconds.
  /// False: a line hangs in a call of its driver. All others have ended properly, and the process
  /// may end with _Exit; the destructor would wait for the driver.
  bool Stop();

  /// Call it once a second between Start and Stop. False: something that the whole gateway needs
  /// hangs. A line that hangs is reported in log and status, and the rest goes on.
  bool Look();

  const config::Config& config_at_start() const;
  const bus::PointStore& store() const;
  /// Between Start and Stop.
  lines::LineControl& control();
  /// "Modbus TCP on 127.0.0.1:1502, DDS domain 0, 3 lines, 5 devices": for the log and READY=1.
  std::string Summary() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace baudgate::daemon
