// SPDX-License-Identifier: Apache-2.0
#include "gateway/lines/line_servers.h"

#include <utility>

#include "gateway/base/log.h"

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

void LineServers::Stop(const std::string& why) {
  server_.reset();
  Close(why);
}

void LineServers::Offer(config::PortServer server, Duration time, Now now) {
  Withdraw("another one takes its place", now);
  offer_ = std::move(server);
  loan_.Offer(offer_, time, now);
  offered_ = Make(offer_, Server::Use::by_hand);
}

void LineServers::Withdraw(const std::string& why, Now now) {
  if (!offered_) return;
  loan_.TakeBackFrom(*offered_, why, now);
  Close(why);
  loan_.Withdraw(offer_);
}

void LineServers::Close(const std::string& why) {
  if (!offered_) return;
  offered_.reset();
  log::Info({.line = line_.name}, "clients can come in at {} no more: {}", offer_.Place(), why);
}

}  // namespace baudgate
