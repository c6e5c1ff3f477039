// HTTP on one port: libmicrohttpd with one thread and epoll. What is asked goes to a handler, which
// may answer later and from any thread; the connection waits without cost meanwhile. A client
// that reads slowly or not at all does not hold up others: the kernel keeps little for each
// connection, and a client that takes nothing for five seconds is dropped. No lock is held while
// something is sent. Connections decides which connections may stay.
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

// Which connections of the web server may stay. A place is for a client that asks something:
// one that only holds a connection open gives way to the next. Pure; time is an argument.
struct Limits {
  std::size_t connections = 256;  ///< that are answered; beyond, 503
  std::size_t of_address = 64;    ///< of them; 127.0.0.1, where proxies are, has them all
  std::size_t at_all = 320;       ///< beyond, those without a request end
  Duration request = 10s;         ///< for a request to come whole
  Duration idle = 5s;             ///< without a byte, while something is to be sent or received
  Duration answer = 1min;         ///< for an answer to be taken, streams apart
  std::size_t answers = 64 * 1024 * 1024;  ///< bytes of all that are under way; beyond, 503
  std::size_t body = 4096;                 ///< of a request
  std::size_t header = 8192;               ///< memory of a connection
  int send_buffer = 32 * 1024;             ///< of the kernel, for each connection

  /// With as many connections as so many file descriptors allow.
  static Limits Of(std::size_t descriptors);
};

class Connections {
 public:
  using Id = std::uint64_t;

  explicit Connections(const Limits& limits) : limits_(limits) {}

  /// A new one; and which other has to end for it, if any.
  std::optional<Id> Open(Id id, const std::string& peer, Instant now);
  void Close(Id id) { all_.erase(id); }
  /// Its request begins to be answered. False: too many are, or of this address; answer 503.
  bool Begin(Id id, Instant now);
  /// The answer has no end of its own.
  void Stream(Id id);
  /// Its answer has ended; the next request may take its time again.
  void End(Id id, Instant now);
  /// Connections that send their request or take their answer too slowly.
  std::vector<Id> Overdue(Instant now) const;

  std::size_t size() const { return all_.size(); }

 private:
  struct Connection {
    std::string peer;
    Instant since{};  ///< of the state
    enum class State : std::uint8_t { waits, answered, streams } state = State::waits;

    bool busy() const { return state != State::waits; }
  };

  const Limits limits_;
  std::map<Id, Connection> all_;
};

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
  static Result<std::unique_ptr<HttpServer>> Start(transports::ListenSocket socket,
                                                   HttpHandler& handler, const Limits& limits = {});
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
