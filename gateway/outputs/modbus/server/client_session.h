// One connected client of Modbus TCP, or of RTU over TCP: takes its requests in their order and
// sends the answers. Bytes come from and go to its socket; what they mean is decided by
// gateway/outputs/modbus/service/client_requests.h.
// All on the server's thread, which says what time it is. A client can delay no other: a turn
// answers a few frames, answers that it does not read stop its own requests, and memory is bounded.
// ClientPoll is the epoll set of all clients, and ClientSocket the socket of one.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>
#include <sys/epoll.h>

#include <array>
#include <asio/io_context.hpp>
#include <asio/posix/stream_descriptor.hpp>
#include <asio/post.hpp>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "config/model/outputs.h"
#include "gateway/base/bytes.h"
#include "gateway/base/log.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/outputs/modbus/service/client_requests.h"
#include "gateway/outputs/modbus/wire/request.h"

namespace baudgate::modbus {

// Tells clients that their sockets can be read or written, many at a time: one epoll set of their
// own inside the server's io_context. asio alone would cost one more system call a request.
// Sockets come from listener.cpp; ClientSocket reads and writes them.

/// All but Open on the thread that runs the io_context.
class ClientPoll : public std::enable_shared_from_this<ClientPoll> {
 public:
  class Client {
   public:
    /// Some of EPOLLIN, EPOLLOUT, EPOLLERR and EPOLLHUP; the last two come unasked. Comes again
    /// for as long as it holds. `now` is read once for all that are ready together. The client may
    /// remove itself and others.
    virtual void OnEvents(std::uint32_t events, const Now& now) = 0;

   protected:
    ~Client() = default;
  };

  explicit ClientPoll(asio::io_context& io) : set_(io) {}

  /// Takes what it needs of the system.
  Status Open();
  /// Clients are served from now on, until Close.
  void Start() { Wait(); }
  void Close();

  /// False when the kernel has no memory for it. The client is removed before it or its socket
  /// goes.
  bool Add(int socket, Client& client, std::uint32_t events);
  bool Change(int socket, Client& client, std::uint32_t events);
  void Remove(int socket, Client& client);

  /// Runs `task`, which takes a `const Now&`, after whatever else is due.
  template <typename Task>
  void Post(Task task) {
    asio::post(set_.get_executor(), [task = std::move(task)] { task(ReadClocks()); });
  }

 private:
  void Wait();
  void Serve();
  /// Serves the clients that are ready now; returns how many.
  std::size_t ServeBatch();

  asio::posix::stream_descriptor set_;
  std::array<epoll_event, 128> events_{};
  std::span<epoll_event> unserved_;  ///< the rest of the batch in hand
  std::size_t count_ = 0;            ///< clients
  Client* only_ = nullptr;           ///< the one client that there is, when it waits to be read
};

// The socket of one client: what the poll watches it for, and the answers that are not sent yet.
// The socket is closed with this.
class ClientSocket {
 public:
  /// `socket` is connected and non-blocking. The poll and the client, which it tells, outlive this.
  ClientSocket(int socket, ClientPoll& poll, ClientPoll::Client& client, Instant now)
      : socket_(socket), poll_(poll), client_(client), blocked_since_(now) {}
  ~ClientSocket() { Close(); }
  ClientSocket(const ClientSocket&) = delete;
  ClientSocket& operator=(const ClientSocket&) = delete;

  int number() const { return socket_; }
  /// False when the kernel has no memory for it.
  bool Start();
  bool Watch(std::uint32_t events);
  bool is_read() const { return (watched_ & EPOLLIN) != 0; }
  void Close();

  /// How many bytes came to `space`; 0: the connection has ended. Empty: none are there now.
  std::optional<std::size_t> Receive(std::span<std::uint8_t> space);

  /// Answers that are not sent yet.
  Bytes& unsent() { return unsent_; }
  /// Sends as much of them as the client takes. False: the connection has ended.
  bool Flush(Instant now);
  /// The client's buffers are full: nothing is to be read or answered.
  bool is_blocked() const { return blocked_; }
  bool IsBlockedLonger(Duration time, Instant now) const {
    return blocked_ && now - blocked_since_ > time;
  }

  /// Runs `turn`, which takes a `const Now&` and keeps this alive, after whatever else is due. Does
  /// nothing if one is to be run already.
  template <typename Turn>
  void PostTurn(Turn turn) {
    if (std::exchange(turn_posted_, true)) return;
    poll_.Post([this, turn = std::move(turn)](const Now& now) {
      turn_posted_ = false;
      turn(now);
    });
  }

 private:
  int socket_;
  ClientPoll& poll_;
  ClientPoll::Client& client_;
  std::uint32_t watched_ = 0;  ///< events that the poll knows of
  Bytes unsent_;
  bool blocked_ = false;
  Instant blocked_since_;
  bool turn_posted_ = false;
};

// The log line about a client that was turned away or closed; called by Listener and ClientSession.

/// "10.0.0.7:40112", "refused", and why. Clients at one address are repeats of each other: their
/// ports differ every time.
inline void WarnOfClient(std::string_view peer, std::string_view what, std::string_view why) {
  const std::string_view address = peer.substr(0, peer.rfind(':'));
  log::WarnFolded(fmt::format("modbus: client {} {}", address, what), "modbus: client {} {}: {}",
                  peer, what, why);
}

class ClientSession final : public ClientPoll::Client,
                            public ClientWire,
                            public std::enable_shared_from_this<ClientSession> {
 public:
  class Owner {
   public:
    /// Once, at the end.
    virtual void OnClosed(ClientSession& session) = 0;
    /// Sweep is to be called at this time, if not before.
    virtual void SweepAt(Instant at) = 0;

   protected:
    ~Owner() = default;
  };

  /// Owns `socket`, which is connected and non-blocking. Clients, listener, `shared` and owner
  /// outlive every session that is not closed.
  ClientSession(int socket, ClientPoll& clients, const config::Listener& listener,
                ServerShared& shared, std::string peer, config::Priority priority, const Now& now,
                Owner& owner);

  void Start();
  void Close();
  /// Closes an idle or stalled client and decides what an RTU client has left unfinished. Answers
  /// requests whose deadline has passed, if the line has not done so.
  void Sweep(const Now& now);
  /// When Sweep has a request to answer. Empty: no request waits.
  std::optional<Instant> Deadline() const { return requests_.Deadline(); }

 private:
  void OnEvents(std::uint32_t events, const Now& now) override;
  void Watch(std::uint32_t events);
  void Receive(const Now& now);
  /// Takes bytes from the socket; false when there are none.
  bool Fill(Instant now);
  /// Answers the frames at hand, at most a few.
  void Turn(const Now& now);
  /// RTU: what the client has asked before this frame is not answered any more. False when it has
  /// given up this one as well.
  bool Supersede(View frame);
  /// Waits for what comes next: room for answers, more frames at hand, or bytes from the client.
  void Continue();
  void Answer(const ModbusRequest& request, Responder& responder, Instant now) override;
  void Answer(View frame, Instant now) override;
  void AnswerNothing(Instant now) override;
  void SweepAt(Instant at) override { owner_.SweepAt(at); }
  /// False when the answer could not go out like this.
  bool SendAtOnce(const ModbusRequest& request, Responder& responder);
  /// One more request is answered.
  void Answered(Instant now);
  /// Sends what is to be sent. An RTU answer waits here until it is certain that what has come
  /// behind its request is no new one.
  void Flush(Instant now);
  /// Keeps the session alive through an answer that may close it; in a turn its caller does.
  std::shared_ptr<ClientSession> Hold() { return in_turn_ ? nullptr : shared_from_this(); }
  bool CloseOther(const Now& now);
  void CloseMalformed(Instant now);
  void CloseStalled(std::string_view why);

  ClientSocket socket_;
  const config::Listener& listener_;
  ServerShared& shared_;
  std::string peer_;
  Owner& owner_;
  std::unique_ptr<ClientFraming> framing_;
  ClientRequests requests_;
  /// Sent before its first request, as much as is looked at; empty: a request has come.
  std::optional<Bytes> first_ = Bytes();
  bool in_turn_ = false;  ///< answers are flushed at its end
  Instant last_bytes_;
  Instant last_frame_;
  bool closed_ = false;
};

}  // namespace baudgate::modbus
