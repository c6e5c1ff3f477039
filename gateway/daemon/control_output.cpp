// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/control_output.h"

#include <utility>

#include "gateway/base/log.h"
#include "transports/run_on.h"

namespace baudgate {

ControlOutput::ControlOutput(const config::Config& config, const Links& links)
    : server_(config, links.store, links.lines, links.commands, links.info, loop_.io()) {}

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
  output->loop_.Start();
  return output;
}

void ControlOutput::Apply(const std::shared_ptr<const config::Config>& config,
                          const std::shared_ptr<const history::HistorySource>& history) {
  RunOn(loop_.io(), [&] { server_.Apply(config, history); });
}

ControlOutput::~ControlOutput() { Stop(); }

void ControlOutput::Stop() {
  loop_.Stop([this] { server_.Stop(); });
}

}  // namespace baudgate
