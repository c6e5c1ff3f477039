// The control socket on a thread of its own: long answers must not delay registers.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <memory>
#include <string>
#include <thread>

#include "gateway/control/control_server.h"

namespace baudgate {

class ControlOutput {
 public:
  struct Links {
    const PointStore& store;
    LineControl& lines;
    CommandSink& commands;
    control::GatewayInfo info;
    control::ReloadDesk* reload = nullptr;  ///< null: nothing is reloaded
  };
  /// All of it outlives this. Null where there is no socket: a gateway that can not be asked still
  /// polls.
  static std::unique_ptr<ControlOutput> Start(const config::Config& config, const Links& links);
  ~ControlOutput();  ///< Stop

  /// A reload, done when it returns; see ControlServer.
  void Apply(const config::Config& config, const history::HistorySource* history);
  /// Idempotent.
  void Stop();

  asio::io_context& io() { return io_; }

 private:
  ControlOutput(const config::Config& config, const Links& links);

  asio::io_context io_{1};
  control::ControlServer server_;
  std::thread thread_;
};

}  // namespace baudgate
