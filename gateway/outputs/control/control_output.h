// The control socket as an output of the gateway, on a thread of its own: long answers must not
// delay registers.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string_view>

#include "gateway/outputs/control/control_server.h"
#include "gateway/outputs/output.h"
#include "transports/loop_thread.h"

namespace baudgate {

class ControlOutput final : public Output {
 public:
  struct Links {
    const PointStore& store;
    LineControl& lines;
    CommandSink& commands;
    control::GatewayInfo info;
    control::ReloadService* reload = nullptr;  ///< null: nothing is reloaded
  };
  /// All of `links` and `config`, that of the start, outlive it.
  ControlOutput(const config::Config& config, const Links& links);
  ~ControlOutput() override { StopRequests(); }

  std::string_view name() const override { return "control"; }
  /// Without a socket the gateway polls all the same: the log says why there is none.
  Status Begin(const Configuration& config) override;
  void SetHistory(const Configuration& config,
                  const std::shared_ptr<const history::HistorySource>& history) override;
  void StopRequests() override;
  asio::io_context* loop() override { return listens_ ? &loop_.io() : nullptr; }

 private:
  LoopThread loop_{"control"};
  control::ControlServer server_;
  bool listens_ = false;
};

}  // namespace baudgate
