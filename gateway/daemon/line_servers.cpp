// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/line_servers.h"

#include <utility>

namespace baudgate {

using serial_server::Server;

std::unique_ptr<Server> LineServers::Make(const config::PortServer& server, Server::Use use) {
  auto made = std::make_unique<Server>(io_, server, use, line_.name, owner_);
  made->Start();
  return made;
}

void LineServers::Start() {
  const config::PortServer* const server = line_.server();
  if (server == nullptr) return;
  loan_.Serve(*server);
  server_ = Make(*server, line_.serial_server ? Server::Use::served : Server::Use::lent);
}

void LineServers::Stop() {
  server_.reset();
  offered_.reset();
}

void LineServers::Offer(config::PortServer server, Duration time, Now now) {
  Withdraw(now);
  offer_ = std::move(server);
  loan_.Offer(offer_, time, now);
  offered_ = Make(offer_, Server::Use::lent);
}

void LineServers::Withdraw(Now now) {
  if (!offered_) return;
  loan_.Dismiss(*offered_, "the time of the loan is over", now);
  offered_.reset();
  loan_.Withdraw(offer_);
}

}  // namespace baudgate
