// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/control_output.h"

#include <pthread.h>

#include <asio/executor_work_guard.hpp>
#include <asio/post.hpp>
#include <utility>

#include "gateway/base/log.h"
#include "gateway/daemon/run_on.h"

namespace baudgate {

ControlOutput::ControlOutput(const config::Config& config, const Links& links)
    : server_(config, links.store, links.lines, links.commands, links.info, io_) {}

std::unique_ptr<ControlOutput> ControlOutput::Start(const config::Config& config,
                                                    const Links& links) {
  std::unique_ptr<ControlOutput> output(new ControlOutput(config, links));
  if (links.reload != nullptr) output->server_.SetReload(*links.reload);
  if (const Status status = output->server_.Listen(); !status) {
    log::Warn(
        "no control socket, so 'baudgate status' and the like will not work: {}; choose a "
        "place with gateway.socket",
        status.error());
    return nullptr;
  }
  log::Info("control socket {}", output->server_.path());
  output->thread_ = std::thread([raw = output.get()] {
    pthread_setname_np(pthread_self(), "control");
    const auto work = asio::make_work_guard(raw->io_);
    raw->io_.run();
  });
  return output;
}

void ControlOutput::Apply(const config::Config& config, const history::HistorySource* history) {
  RunOn(io_, [&] { server_.Apply(config, history); });
}

ControlOutput::~ControlOutput() { Stop(); }

void ControlOutput::Stop() {
  if (!thread_.joinable()) return;
  asio::post(io_, [this] {
    server_.Stop();
    io_.stop();
  });
  thread_.join();
}

}  // namespace baudgate
