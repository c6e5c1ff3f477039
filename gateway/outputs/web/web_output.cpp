// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/web/web_output.h"

#include "gateway/base/log.h"

namespace baudgate::web {

Status WebOutput::Open(const Configuration& config) {
  port_ = OpenFor(config->web);
  return port_->troubles.empty() ? Status() : Error{port_->troubles.front()};
}

Status WebOutput::Begin(const Configuration& config) {
  const std::vector<std::string> missing = Apply(config, std::move(port_));
  return missing.empty() ? Status() : Error{missing.front()};
}

bool WebOutput::HasOtherToken(const config::Web& next) const {
  if (!server_ || !next.on || next.token_file.empty() || next.token_file != web_.token_file) {
    return false;
  }
  const auto token = web::ReadToken(next.token_file);
  return !token || *token != token_;
}

bool WebOutput::HasOtherCertificate(const config::Web& next) const {
  if (!server_ || next.tls.certificate.empty() || next.tls != web_.tls) return false;
  const auto tls = tls::ReadTls(next.tls);
  return !tls || *tls != tls_;
}

void WebOutput::Examine(const config::Config& next, std::vector<std::string>& settings,
                        std::vector<std::string>& /*restart*/) const {
  if (HasOtherToken(next.web)) settings.emplace_back("the token in " + next.web.token_file);
  if (HasOtherCertificate(next.web)) {
    settings.emplace_back("the certificate in " + next.web.tls.certificate);
  }
}

std::unique_ptr<WebOutput::Port> WebOutput::OpenFor(const config::Web& next) const {
  auto port = std::make_unique<Port>();
  if (!next.on) return port;
  auto opened = web::WebServer::Open(next, server_ ? &web_ : nullptr);
  if (!opened) port->troubles.push_back(opened.error());
  if (opened) port->opened = std::move(*opened);
  return port;
}

std::unique_ptr<outputs::Output::Prepared> WebOutput::Prepare(const config::Config& next) {
  return OpenFor(next.web);
}

std::vector<std::string> WebOutput::Apply(const Configuration& config,
                                          std::unique_ptr<Prepared> prepared) {
  std::string trouble = Serve(config, static_cast<Port&>(*prepared));
  const MutexLock lock(mutex_);
  summary_ = server_ ? "web page on " + web_.Address() : std::string();
  if (trouble.empty()) return {};
  return {std::move(trouble)};
}

std::string WebOutput::Serve(const Configuration& config, Port& port) {
  const bool moved = !server_ || port.opened.socket.is_open();
  if (!config->web.on) {
    if (server_) log::Info("web: ended");
    server_.reset();
    return {};
  }
  if (!port.troubles.empty()) return port.troubles.front();
  const std::optional<std::string> token = port.opened.token;
  const tls::TlsTexts tls = port.opened.tls;
  if (server_) {
    const Status status = server_->Apply(config, std::move(port.opened), links_.info.history);
    if (!status) return status.error();
  } else {
    auto server = web::WebServer::Start(config, std::move(port.opened), links_, limits_);
    if (!server) return server.error();
    server_ = std::move(*server);
  }
  // web_ and token_ change only after a success, because the next reload compares with the settings
  // that are in use.
  web_ = config->web;
  token_ = token;
  tls_ = tls;
  if (moved) {
    log::Info("web page on {}://{}/", config->web.tls.certificate.empty() ? "http" : "https",
              config->web.Address());
  }
  return {};
}

void WebOutput::SetHistory(const Configuration& config,
                           const std::shared_ptr<const history::HistorySource>& history) {
  links_.info.history = history;
  if (server_) server_->ApplyHistory(config, history);
}

void WebOutput::StopRequests() {
  if (server_) server_->Stop();
}

std::string WebOutput::Summary() {
  const MutexLock lock(mutex_);
  return summary_;
}

}  // namespace baudgate::web
