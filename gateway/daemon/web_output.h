// The web server as the configuration wants it: at this address, at another one, or not at all.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "config/model/config.h"
#include "gateway/base/guarded.h"
#include "gateway/base/result.h"
#include "gateway/outputs/web/web_server.h"

namespace baudgate {

class WebOutput {
 public:
  /// All of `links` outlives it.
  WebOutput(web::LiveApi::Links links, const web::Limits& limits)
      : links_(std::move(links)), limits_(limits) {}

  /// Whether the token file has another token than the one in use, or none.
  bool HasOtherToken(const config::Web& next) const;
  /// The port that a reload opens before it changes anything. If it is dropped, the port closes.
  struct Prepared {
    web::WebServer::Opened opened{};
    std::string trouble{};  ///< why it cannot be opened; empty: it can
  };
  Prepared Prepare(const config::Web& next) const;
  /// Returns what could not be applied; empty: all was.
  std::string Apply(const std::shared_ptr<const config::Config>& config, Prepared prepared);
  /// The history that may be read from now on; null: none.
  void ApplyHistory(const std::shared_ptr<const config::Config>& config,
                    const std::shared_ptr<const history::HistorySource>& history);
  void Stop();

  /// "web page on 127.0.0.1:8502"; empty: there is none. From any thread.
  std::string Summary() const;

 private:
  std::string Serve(const std::shared_ptr<const config::Config>& config, Prepared prepared);

  web::LiveApi::Links links_;
  const web::Limits limits_;
  config::Web web_;  // as it is served
  std::optional<std::string> token_;
  std::unique_ptr<web::WebServer> server_;
  mutable Mutex mutex_;
  std::string summary_ BAUDGATE_GUARDED_BY(mutex_);
};

}  // namespace baudgate
