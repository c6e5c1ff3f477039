// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/web_output.h"

#include <utility>

#include "gateway/base/log.h"
#include "gateway/outputs/web/token_file.h"

namespace baudgate {

bool WebOutput::HasOtherToken(const config::Web& next) const {
  if (!server_ || !next.on || next.token_file.empty() || next.token_file != web_.token_file) {
    return false;
  }
  const auto token = web::ReadToken(next.token_file);
  return !token || *token != token_;
}

WebOutput::Prepared WebOutput::Prepare(const config::Web& next) const {
  Prepared prepared;
  if (!next.on) return prepared;
  auto opened = web::WebServer::Open(next, server_ ? &web_ : nullptr);
  if (!opened) prepared.trouble = opened.error();
  if (opened) prepared.opened = std::move(*opened);
  return prepared;
}

std::string WebOutput::Apply(const std::shared_ptr<const config::Config>& config,
                             Prepared prepared) {
  std::string trouble = Serve(config, std::move(prepared));
  const MutexLock lock(mutex_);
  summary_ = server_ ? "web page on " + web_.Place() : std::string();
  return trouble;
}

std::string WebOutput::Serve(const std::shared_ptr<const config::Config>& config,
                             Prepared prepared) {
  const bool moved = !server_ || prepared.opened.socket.is_open();
  if (!config->web.on) {
    if (server_) log::Info("web: ended");
    server_.reset();
    return {};
  }
  if (!prepared.trouble.empty()) return prepared.trouble;
  web_ = config->web;
  token_ = prepared.opened.token;
  if (server_) {
    const Status status = server_->Apply(config, std::move(prepared.opened), links_.info.history);
    if (!status) return status.error();
  } else {
    auto server = web::WebServer::Start(config, std::move(prepared.opened), links_, limits_);
    if (!server) return server.error();
    server_ = std::move(*server);
  }
  if (moved) log::Info("web page on http://{}/", config->web.Place());
  return {};
}

void WebOutput::ApplyHistory(const std::shared_ptr<const config::Config>& config,
                             const std::shared_ptr<const history::HistorySource>& history) {
  links_.info.history = history;
  if (server_) server_->ApplyHistory(config, history);
}

void WebOutput::Stop() {
  if (server_) server_->Stop();
}

std::string WebOutput::Summary() const {
  const MutexLock lock(mutex_);
  return summary_;
}

}  // namespace baudgate
