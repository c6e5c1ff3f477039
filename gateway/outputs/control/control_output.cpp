// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/control/control_output.h"

#include "gateway/base/log.h"

namespace baudgate {

ControlOutput::ControlOutput(const config::Config& config, const Links& links)
    : server_(config, links.store, links.lines, links.commands, links.info, loop_.io()) {
  if (links.reload != nullptr) server_.SetReload(*links.reload);
}

Status ControlOutput::Begin(const Configuration& /*config*/) {
  if (const Status status = server_.Listen(); !status) {
    log::Warn(
        "no control socket, so 'baudgate status' and the like will not work: {}; choose a "
        "place with gateway.socket",
        status.error());
    return {};
  }
  log::Info("control socket {}", server_.path());
  listens_ = true;
  loop_.Start();
  return {};
}

void ControlOutput::SetHistory(const Configuration& config,
                               const std::shared_ptr<const history::HistorySource>& history) {
  if (listens_) RunOn(loop_.io(), [&] { server_.Apply(config, history); });
}

void ControlOutput::StopRequests() {
  loop_.Stop([this] { server_.Stop(); });
}

}  // namespace baudgate
