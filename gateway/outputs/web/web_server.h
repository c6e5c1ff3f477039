// The page, the JSON and the metrics of a gateway: clients are checked on the server's thread,
// what is asked is made on two others, one for the present and one for what lies on the disk.
// AssetResponse has the files of the page.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/steady_timer.hpp>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "gateway/outputs/web/access.h"
#include "gateway/outputs/web/api.h"
#include "gateway/outputs/web/http_server.h"
#include "gateway/outputs/web/request.h"
#include "transports/loop_thread.h"

namespace baudgate::web {

// The files of the page, as they are built into the program: those of gateway/outputs/web/page, and
// the chart library. Each is packed already.

/// What the build has made of a file.
struct PackedFile {
  std::string_view path;  ///< "/index.html"
  const char* begin;      ///< gzip
  const char* end;
};
std::span<const PackedFile> PackedFiles();

/// Empty: there is no such file.
std::optional<Response> AssetResponse(const Request& request);

/// "text/css; charset=utf-8" of "/style.css".
std::string_view TypeOf(std::string_view path);

class WebServer final : public HttpHandler {
 public:
  struct Opened {
    transports::ListenSocket socket{};   ///< not open: the port stays
    std::optional<std::string> token{};  ///< empty: no login
  };
  /// `at` is an address of this machine, not a name.
  static Result<transports::ListenSocket> ListenAt(const config::HostPort& at);
  /// What may fail, before anything is changed. `now`: where a server listens already.
  static Result<Opened> Open(const config::Web& next, const config::Web* now);

  /// Serves. All of `links` that it does not share outlives it.
  static Result<std::unique_ptr<WebServer>> Start(
      const std::shared_ptr<const config::Config>& config, Opened opened, LiveApi::Links links,
      const Limits& limits = {});
  ~WebServer() override;  ///< Stop

  /// A reload, done when it returns. With an open socket it listens there from then on; an error:
  /// it does not listen at all.
  Status Apply(const std::shared_ptr<const config::Config>& config, Opened opened,
               const std::shared_ptr<const history::HistorySource>& history);
  /// The same, only the history.
  void ApplyHistory(const std::shared_ptr<const config::Config>& config,
                    const std::shared_ptr<const history::HistorySource>& history);
  /// Ends all streams and closes the port. Idempotent.
  void Stop();

  std::optional<Response> Refuse(const Request& request) override;
  void Handle(const Request& request, Answered answered) override;

 private:
  WebServer(const config::Config& config, LiveApi::Links links, const Limits& limits);

  void Ask(const Request& request, Answered answered);
  void Tick();
  void Look();

  const Limits limits_;
  Access access_;
  transports::LoopThread live_loop_{"web"};
  transports::LoopThread past_loop_{"web-past"};
  LiveApi live_;
  PastApi past_;
  asio::steady_timer tick_{live_loop_.io()};
  asio::steady_timer look_{live_loop_.io()};
  bool ticking_ = false;  // of the live loop
  std::atomic<std::size_t> waiting_ = 0;
  std::unique_ptr<HttpServer> http_;
};

}  // namespace baudgate::web
