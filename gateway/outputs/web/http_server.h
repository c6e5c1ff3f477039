// HTTP on one port: libmicrohttpd with one thread and epoll. What is asked goes to a handler, which
// may answer later and from any thread; the connection waits without cost meanwhile. A client
// that reads slowly or not at all does not hold up others: the kernel keeps little for each
// connection, and a client that takes nothing for five seconds is dropped. No lock is held while
// something is sent.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "gateway/base/result.h"
#include "gateway/outputs/web/connections.h"
#include "gateway/outputs/web/request.h"
#include "transports/listen_socket.h"

namespace baudgate::web {

class HttpHandler {
 public:
  virtual ~HttpHandler() = default;
  /// On the server's thread, once the header is there, before any content. An answer: it ends so.
  virtual std::optional<Response> Refuse(const Request& request) = 0;
  /// The same thread, with the content. Must not wait; `answered` may be called within.
  virtual void Handle(const Request& request, Answered answered) = 0;
};

class HttpServer {
 public:
  /// `handler` outlives it.
  static Result<std::unique_ptr<HttpServer>> Start(ListenSocket socket, HttpHandler& handler,
                                                   const Limits& limits = {});
  ~HttpServer();  ///< Stop

  /// Ends all answers and closes the port. What is answered later is dropped. Idempotent.
  void Stop();
  /// To be called about once a second: ends those whose request does not come.
  void EndOverdue(Instant now);
  /// Open connections.
  std::size_t connections() const;

  class Impl;

 private:
  explicit HttpServer(std::shared_ptr<Impl> impl) : impl_(std::move(impl)) {}
  std::shared_ptr<Impl> impl_;
};

}  // namespace baudgate::web
