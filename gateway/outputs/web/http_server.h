// `HttpServer` serves HTTP on one port: libmicrohttpd with one thread and epoll. Requests go to a
// handler, which may answer later and on any thread; the connection is suspended meanwhile. A slow
// reader cannot delay others: the kernel's buffer for each connection is small, and a client that
// takes no byte for five seconds is dropped. No lock is held while bytes are sent. `Connections`
// decides which connections may stay.
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

namespace baudgate::web {

// The limits of the web server's connections. A connection without a request is closed if a new one
// needs its place.
struct Limits {
  std::size_t connections = 256;  ///< answered at the same time; beyond, 503
  /// Connections of one client address that are answered at the same time; 127.0.0.1, where proxies
  /// run, may use all.
  std::size_t of_address = 64;
  /// Connections that are open at the same time; beyond, one without a request is closed.
  std::size_t at_all = 320;
  Duration request = 10s;  ///< for a whole request to arrive
  Duration idle = 5s;      ///< without a byte while bytes are to be sent or received
  Duration answer = 1min;  ///< for an answer to be taken by the client; streams have no limit
  /// Bytes of all answers that are being sent; beyond, 503.
  std::size_t answers = 64 * 1024 * 1024;
  std::size_t body = 4096;      ///< bytes of a request's content
  std::size_t header = 8192;    ///< bytes of memory per connection, which limits the header
  int send_buffer = 32 * 1024;  ///< bytes of the kernel's send buffer per connection

  /// Returns limits with as many connections as `descriptors` file descriptors allow.
  static Limits Of(std::size_t descriptors);
};

class Connections {
 public:
  using Id = std::uint64_t;

  explicit Connections(const Limits& limits) : limits_(limits) {}

  /// Adds a connection. If at_all is reached, returns the connection without a request to close in
  /// its place.
  std::optional<Id> Open(Id id, const std::string& peer, Instant now);
  void Close(Id id) { all_.erase(id); }
  /// To be called when a request has arrived. False: too many requests are being answered, or too
  /// many of this address; answer 503.
  bool Begin(Id id, Instant now);
  /// Marks the answer as a stream, which has no time limit.
  void Stream(Id id);
  /// To be called when the answer has ended: the time for the next request begins.
  void End(Id id, Instant now);
  /// The connections that send their request or take their answer too slowly.
  std::vector<Id> Overdue(Instant now) const;

  std::size_t size() const { return all_.size(); }

 private:
  struct Connection {
    std::string peer;
    Instant since{};  ///< when the current state began
    enum class State : std::uint8_t { waits, answered, streams } state = State::waits;

    bool busy() const { return state != State::waits; }
  };

  const Limits limits_;
  std::map<Id, Connection> all_;
};

class HttpHandler {
 public:
  virtual ~HttpHandler() = default;
  /// Called on the server's thread when the header has arrived, before any content. Returns an
  /// answer to refuse the request.
  virtual std::optional<Response> Refuse(const Request& request) = 0;
  /// Called on the server's thread when the content has arrived. Must not wait; `answered` may be
  /// called from within.
  virtual void Handle(const Request& request, Answered answered) = 0;
};

class HttpServer {
 public:
  /// `handler` must outlive the server.
  static Result<std::unique_ptr<HttpServer>> Start(transports::ListenSocket socket,
                                                   HttpHandler& handler, const Limits& limits = {});
  ~HttpServer();  ///< calls Stop

  /// Ends all answers and closes the port. Later answers are dropped. Further calls do nothing.
  void Stop();
  /// To be called about once a second: closes connections that are too slow.
  void EndOverdue(Instant now);
  std::size_t connections() const;

  class Impl;

 private:
  explicit HttpServer(std::shared_ptr<Impl> impl) : impl_(std::move(impl)) {}
  std::shared_ptr<Impl> impl_;
};

}  // namespace baudgate::web
