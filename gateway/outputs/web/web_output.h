// `WebOutput` is the web server as an output of the gateway. A reload can start it, stop it, or
// move it to another address.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/guarded.h"
#include "gateway/base/result.h"
#include "gateway/outputs/output.h"
#include "gateway/outputs/web/web_server.h"

namespace baudgate::web {

class WebOutput final : public outputs::Output {
 public:
  /// The file descriptors that the web server needs if it is on: web::Limits::at_all and a reserve.
  static constexpr std::size_t kDescriptors = 352;
  static outputs::DescriptorNeeds Descriptors(const config::Config& config) {
    return {.viewers = config.web.on ? kDescriptors : 0};
  }
  /// The objects to which `links` refers must outlive this object.
  WebOutput(web::LiveApi::Links links, const web::Limits& limits)
      : links_(std::move(links)), limits_(limits) {}

  std::string_view name() const override { return "web"; }
  Status Open(const Configuration& config) override;
  Status Begin(const Configuration& config) override;
  /// Adds the token to `settings` if the token file contains another token than the running server
  /// has, or no valid token.
  void Examine(const config::Config& next, std::vector<std::string>& settings,
               std::vector<std::string>& restart) const override;
  std::unique_ptr<Prepared> Prepare(const config::Config& next) override;
  std::vector<std::string> Apply(const Configuration& config,
                                 std::unique_ptr<Prepared> prepared) override;
  void SetHistory(const Configuration& config,
                  const std::shared_ptr<const history::HistorySource>& history) override;
  void StopRequests() override;
  /// Returns e.g. "web page on 127.0.0.1:8502"; empty: the web server is off. Any thread may call
  /// it.
  std::string Summary() override;

 private:
  struct Port final : Prepared {
    web::WebServer::Opened opened{};
  };
  bool HasOtherToken(const config::Web& next) const;
  bool HasOtherCertificate(const config::Web& next) const;
  std::unique_ptr<Port> OpenFor(const config::Web& next) const;
  std::string Serve(const Configuration& config, Port& port);

  web::LiveApi::Links links_;
  const web::Limits limits_;
  config::Web web_;             // the settings that are in use
  std::unique_ptr<Port> port_;  // exists from Open to Begin
  std::optional<std::string> token_;
  tls::TlsTexts tls_;
  std::unique_ptr<web::WebServer> server_;
  mutable Mutex mutex_;
  std::string summary_ BAUDGATE_GUARDED_BY(mutex_);
};

}  // namespace baudgate::web
