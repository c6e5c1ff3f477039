// `WebServer` serves the page, the JSON and the metrics of a gateway. Clients are checked on the
// HTTP server's thread. Two other threads create the answers: one from current data and one from
// data on the disk. `AssetResponse` returns the files of the page.
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

// AssetResponse returns the files of the page (gateway/outputs/web/page) and the chart library,
// which are built into the program in gzip form.

struct PackedFile {
  std::string_view path;  ///< path in the URL, e.g. "/index.html"
  const char* begin;
  const char* end;
};
std::span<const PackedFile> PackedFiles();

std::optional<Response> AssetResponse(const Request& request);

std::string_view TypeOf(std::string_view path);

class WebServer final : public HttpHandler {
 public:
  struct Opened {
    /// Not open: the server keeps its port.
    transports::ListenSocket socket{};
    std::optional<std::string> token{};  ///< empty: there is no token of web.token
    tls::TlsTexts tls{};
  };
  /// Opens a listening socket. `at` must contain an address of this machine, not a name.
  static Result<transports::ListenSocket> ListenAt(const config::HostPort& at);
  /// Reads the token and opens the port for `next`. These steps can fail, so a reload does them
  /// before it changes anything. `now`: the settings of the running server; null: no server runs.
  static Result<Opened> Open(const config::Web& next, const config::Web* now);

  /// Starts to serve. References in `links` must remain valid while the server exists.
  static Result<std::unique_ptr<WebServer>> Start(
      const std::shared_ptr<const config::Config>& config, Opened opened, LiveApi::Links links,
      const Limits& limits = {});
  ~WebServer() override;

  /// Applies a reload; when Apply returns, the new settings are in use. If `opened` contains a
  /// socket, the server moves to its port. If the move fails, the server still uses the old port.
  /// Other certificates end the connections, but not the sessions of users.
  Status Apply(const std::shared_ptr<const config::Config>& config, Opened opened,
               const std::shared_ptr<const history::HistorySource>& history);
  void ApplyHistory(const std::shared_ptr<const config::Config>& config,
                    const std::shared_ptr<const history::HistorySource>& history);
  /// Ends all streams and closes the port. Further calls do nothing.
  void Stop();

  std::string ClientBehind(const Request& request) override;
  bool MayGoOn(const Request& request) override;
  std::optional<Response> Refuse(const Request& request) override;
  void Handle(const Request& request, Answered answered) override;

 private:
  WebServer(const config::Config& config, LiveApi::Links links, const Limits& limits);

  void LogIn(Request request, Answered answered);
  void Ask(const Request& request, Answered answered);
  void Tick();
  void Look();

  const Limits limits_;
  Access access_;
  transports::LoopThread live_loop_{"web"};
  transports::LoopThread past_loop_{"web-past"};
  transports::LoopThread login_loop_{"web-login"};
  LiveApi live_;
  PastApi past_;
  asio::steady_timer tick_{live_loop_.io()};
  asio::steady_timer look_{live_loop_.io()};
  bool ticking_ = false;  // true: a call of Tick is scheduled; used on live_loop_ only
  std::atomic<std::size_t> waiting_ = 0;
  std::atomic<std::size_t> logins_ = 0;
  std::unique_ptr<HttpServer> http_;
  tls::TlsTexts tls_;  // the certificates that http_ uses
};

}  // namespace baudgate::web
