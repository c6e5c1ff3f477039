// The control socket on a thread of its own: long answers must not delay registers.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "gateway/outputs/control/control_server.h"
#include "transports/loop_thread.h"

namespace baudgate {

class ControlOutput {
 public:
  struct Links {
    const PointStore& store;
    LineControl& lines;
    CommandSink& commands;
    control::GatewayInfo info;
    control::ReloadService* reload = nullptr;  ///< null: nothing is reloaded
  };
  /// All of it outlives this. Null if there is no socket: the gateway polls without one.
  static std::unique_ptr<ControlOutput> Start(const config::Config& config, const Links& links);
  ~ControlOutput();  ///< Stop

  /// A reload, done when it returns; see ControlServer.
  void Apply(const std::shared_ptr<const config::Config>& config,
             const std::shared_ptr<const history::HistorySource>& history);
  /// Idempotent.
  void Stop();

  asio::io_context& io() { return loop_.io(); }

 private:
  ControlOutput(const config::Config& config, const Links& links);

  LoopThread loop_{"control"};
  control::ControlServer server_;
};

}  // namespace baudgate
