// `HttpServer` serves HTTP on one port: libmicrohttpd with one thread and epoll. Requests are
// passed to a handler, which can answer later and on any thread; the connection is suspended until
// then. A slow reader cannot delay other clients: the kernel's buffer for each connection is small,
// and a client that accepts no byte for five seconds is disconnected. No lock is held while bytes
// are sent. `Connections` decides which connections may stay open.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/outputs/web/request.h"
#include "transports/listen_socket.h"
#include "transports/tls_files.h"

namespace baudgate::web {

// The limits of the web server's connections. If too many are open, a connection that waits for its
// next request is closed to accept a new one.
struct Limits {
  /// Connections that are answered at the same time; further connections get 503.
  std::size_t connections = 256;
  /// Connections of one host that are answered at the same time. 127.0.0.1 has only the limit
  /// `connections`, because proxies run there.
  std::size_t of_host = 64;
  /// Connections that are open at the same time. Beyond this number, one that waits for its next
  /// request or receives it is closed: the oldest of the host with the most connections.
  std::size_t at_all = 320;
  Duration request = 10s;  ///< time in which a header must arrive, and again for its body
  Duration idle = 5s;      ///< time without a byte while bytes are to be sent or received
  Duration answer = 1min;  ///< time in which the client must read an answer; streams have no limit
  /// Bytes of all answers that are being sent; beyond this number, requests get 503.
  std::size_t answers = 64 * 1024 * 1024;
  std::size_t body = 4096;  ///< longest body of a request in bytes
  /// Memory per connection in bytes; it limits the length of the header.
  std::size_t header = 8192;
  int send_buffer = 32 * 1024;  ///< size of the kernel's send buffer per connection in bytes

  static Limits Of(std::size_t descriptors);
};

class Connections {
 public:
  using Id = std::uint64_t;

  explicit Connections(const Limits& limits) : limits_(limits) {}

  /// Adds a connection. If at_all is reached, returns the connection to close (Limits::at_all).
  std::optional<Id> Open(Id id, const std::string& peer, Instant now);
  void Close(Id id) { all_.erase(id); }
  /// To be called when the header of a request with a body has arrived.
  void Receive(Id id, Instant now);
  /// To be called when a whole request of `client` has arrived. False: too many requests of all
  /// clients or of this host are being answered, so the caller must answer 503.
  bool Begin(Id id, const std::string& client, Instant now);
  void Stream(Id id);
  /// Must be called when the answer has ended. The time for the next request begins.
  void End(Id id, Instant now);
  /// Returns the connections that send their request or read their answer too slowly (Limits).
  std::vector<Id> Overdue(Instant now) const;

  std::size_t size() const { return all_.size(); }

 private:
  struct Connection {
    std::string client;
    std::uint64_t host = 0;  ///< HostNumberOf
    Instant since{};         ///< time when the current state began
    enum class State : std::uint8_t { waits, receives, answered, streams } state = State::waits;

    bool busy() const { return state == State::answered || state == State::streams; }
  };

  const Limits limits_;
  std::map<Id, Connection> all_;
};

class HttpHandler {
 public:
  virtual ~HttpHandler() = default;
  /// Returns Request::forwarded_for. Called on the server's thread.
  virtual std::string ClientBehind(const Request& request) = 0;
  /// True if the login of a request whose stream is still being sent is still valid. Any thread may
  /// call it.
  virtual bool MayGoOn(const Request& request) = 0;
  /// Called on the server's thread when the header has arrived, before the body. Returns an answer
  /// to refuse the request; nothing: the request is accepted.
  virtual std::optional<Response> Refuse(const Request& request) = 0;
  /// Is called on the server's thread when the body has arrived. Must not wait. `answered` can be
  /// called before Handle returns.
  virtual void Handle(const Request& request, Answered answered) = 0;
};

class HttpServer {
 public:
  /// `handler` must outlive the server. `tls` off: the server speaks HTTP without TLS.
  static Result<std::unique_ptr<HttpServer>> Start(transports::ListenSocket socket,
                                                   HttpHandler& handler, const Limits& limits = {},
                                                   const tls::TlsTexts& tls = {});
  ~HttpServer();

  /// Stops listening, and returns the listening socket for another server at the same port. Open
  /// connections go on until Stop.
  transports::ListenSocket TakeSocket();

  /// Ends all answers and closes the port. Answers that come later are dropped. Further calls do
  /// nothing.
  void Stop();
  /// Closes connections that are too slow. Must be called about once a second.
  void EndOverdue(Instant now);
  /// Closes the connections of streams whose login is not valid any more (HttpHandler::MayGoOn).
  void EndLoggedOut();
  std::size_t connections() const;

  class Impl;

 private:
  explicit HttpServer(std::shared_ptr<Impl> impl) : impl_(std::move(impl)) {}
  std::shared_ptr<Impl> impl_;
};

}  // namespace baudgate::web
