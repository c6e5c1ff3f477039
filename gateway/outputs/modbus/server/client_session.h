// `ClientSession` is one connected client of Modbus TCP, or of RTU or ASCII over TCP: it takes the
// client's requests in order and sends the replies.
// gateway/outputs/modbus/service/client_requests.h handles the requests. Everything runs on the
// server's thread. A client cannot delay other clients: at most eight of its frames are answered in
// a row (a turn), a client that does not read its replies stops only itself, and memory is bounded.
// `ClientPoll` is the epoll set of all clients of a port, and `ClientSocket` is the socket of one
// client.
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
#include "gateway/base/fair_places.h"
#include "gateway/base/log.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/outputs/modbus/service/client_requests.h"
#include "gateway/outputs/modbus/wire/request.h"
#include "transports/tls_context.h"

namespace baudgate::modbus {

// `ClientPoll` tells clients that their sockets can be read or written. It is an epoll set inside
// the server's io_context, because asio alone would cost one more system call per request.
// gateway/outputs/modbus/server/listener.cpp accepts the sockets; ClientSocket reads and writes
// them.

/// All functions except Open must be called on the thread that runs the io_context.
class ClientPoll : public std::enable_shared_from_this<ClientPoll> {
 public:
  class Client {
   public:
    /// `events` contains EPOLLIN, EPOLLOUT, EPOLLERR and EPOLLHUP; EPOLLERR and EPOLLHUP are
    /// reported even if not requested. The call is repeated as long as an event lasts. `now` is
    /// read once for all clients that are ready at the same time. The client can remove itself and
    /// other clients.
    virtual void OnEvents(std::uint32_t events, const Now& now) = 0;

   protected:
    ~Client() = default;
  };

  explicit ClientPoll(asio::io_context& io) : set_(io) {}

  Status Open();
  void Start() { Wait(); }
  void Close();

  /// Adds a client. False: the kernel has no memory for it. Remove must be called before the client
  /// or its socket is destroyed.
  bool Add(int socket, Client& client, std::uint32_t events);
  bool Change(int socket, Client& client, std::uint32_t events);
  void Remove(int socket, Client& client);

  /// Runs `task`, which takes a `const Now&`, after all work that is posted already.
  template <typename Task>
  void Post(Task task) {
    asio::post(set_.get_executor(), [task = std::move(task)] { task(ReadClocks()); });
  }

 private:
  void Wait();
  void Serve();
  std::size_t ServeBatch();

  asio::posix::stream_descriptor set_;
  std::array<epoll_event, 128> events_{};
  std::span<epoll_event> unserved_;  ///< the events of the current batch that were not served yet
  std::size_t count_ = 0;
  /// The client, if it is the only client and waits only for input; else null.
  Client* only_ = nullptr;
};

/// The connection of a client that was accepted.
struct Accepted {
  int socket = -1;                          ///< connected and non-blocking; belongs to the session
  std::unique_ptr<tls::Channel> channel{};  ///< null: the connection is not encrypted
  std::string peer{};  ///< address of the client, and what its certificate names
  config::Priority priority = config::Priority::normal;
  const config::RoleRights* rights = nullptr;  ///< see ClientRequests
};

// `ClientSocket` is the socket of one client, with the events for which the poll watches it and the
// replies that were not sent yet. The destructor closes the socket.
class ClientSocket {
 public:
  /// `socket` must be connected and non-blocking. Without a channel, the bytes are not encrypted.
  /// `poll` and `client`, which receives the events, must outlive this object.
  ClientSocket(int socket, std::unique_ptr<tls::Channel> channel, ClientPoll& poll,
               ClientPoll::Client& client, Instant now)
      : socket_(socket),
        channel_(std::move(channel)),
        poll_(poll),
        client_(client),
        blocked_since_(now) {}
  ~ClientSocket() { Close(); }
  ClientSocket(const ClientSocket&) = delete;
  ClientSocket& operator=(const ClientSocket&) = delete;

  /// True if replies must be sent through Flush, which encrypts them.
  bool is_encrypted() const { return channel_ != nullptr; }
  /// True if Receive has bytes for which the poll reports no event.
  bool HasPending() const { return channel_ && channel_->HasPending(); }
  int number() const { return socket_; }
  /// Adds the socket to the poll. False: the kernel has no memory for it.
  bool Start();
  bool Watch(std::uint32_t events);
  bool is_read() const { return (watched_ & EPOLLIN) != 0; }
  void Close();

  /// Reads into `space` and returns the number of bytes; 0: the connection has ended; nothing: no
  /// bytes have arrived.
  std::optional<std::size_t> Receive(std::span<std::uint8_t> space);

  Bytes& unsent() { return unsent_; }
  /// Sends as many bytes of the unsent replies as the socket accepts. False: the connection has
  /// ended.
  bool Flush(Instant now);
  /// True if the socket's send buffer is full. The caller should then read and answer nothing more.
  bool is_blocked() const { return blocked_; }
  bool IsBlockedLonger(Duration time, Instant now) const {
    return blocked_ && now - blocked_since_ > time;
  }

  /// Runs `turn`, which takes a `const Now&` and must keep this object alive, after all work that
  /// is posted already. Does nothing if a turn is posted already.
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
  std::unique_ptr<tls::Channel> channel_;
  ClientPoll& poll_;
  ClientPoll::Client& client_;
  std::uint32_t watched_ = 0;
  Bytes unsent_;
  bool blocked_ = false;
  Instant blocked_since_;
  bool turn_posted_ = false;
};

/// Logs that a client was refused or closed: WarnOfClient("10.0.0.7:40112", "refused", why).
/// Repeated messages are folded by host, because the port differs every time.
inline void WarnOfClient(std::string_view peer, std::string_view what, std::string_view why) {
  log::WarnFolded(fmt::format("modbus: client {} {}", HostOf(peer), what),
                  "modbus: client {} {}: {}", peer, what, why);
}

class ClientSession final : public ClientPoll::Client,
                            public ClientWire,
                            public std::enable_shared_from_this<ClientSession> {
 public:
  class Owner {
   public:
    /// Called once, when the session has closed itself.
    virtual void OnClosed(ClientSession& session) = 0;
    /// Requests that Sweep is called at the time `at` or earlier.
    virtual void SweepAt(Instant at) = 0;

   protected:
    ~Owner() = default;
  };

  /// `clients`, `listener`, `shared` and `owner` must remain valid until the session is closed.
  ClientSession(Accepted accepted, ClientPoll& clients, const config::Listener& listener,
                ServerShared& shared, const Now& now, Owner& owner);

  void Start();
  void Close();
  /// Closes the client because the limit of clients is reached and it must make room for a client
  /// of another host, or for a new client of its own host.
  void CloseForRoom();
  std::uint64_t host() const { return requests_.host(); }
  /// The time of the latest request, or of the connection if there was none.
  Instant idle_since() const { return last_frame_; }
  bool has_pending() const { return requests_.outstanding() > 0; }
  /// Closes an idle or stalled client, and drops incomplete frames of a client of RTU or ASCII.
  /// Answers requests whose deadline has passed, if the line has not answered them.
  void Sweep(const Now& now);
  /// Returns the next time at which Sweep has a request to answer; nothing: no request waits.
  std::optional<Instant> Deadline() const { return requests_.Deadline(); }

 private:
  void OnEvents(std::uint32_t events, const Now& now) override;
  void Watch(std::uint32_t events);
  void Receive(const Now& now);
  bool Fill(Instant now);
  void Turn(const Now& now);
  bool Supersede(View frame);
  /// Waits for the next event: space for replies, a turn for more frames, or bytes from the client.
  void Continue();
  void Answer(const ModbusRequest& request, Responder& responder, Instant now) override;
  void Answer(View frame, Instant now) override;
  void AnswerNothing(Instant now) override;
  void SweepAt(Instant at) override { owner_.SweepAt(at); }
  /// Sends the reply directly to the socket. Returns false if the reply must be appended to the
  /// unsent replies instead, or the session was closed.
  bool SendAtOnce(const ModbusRequest& request, Responder& responder);
  /// Sends the reply outside a turn, and waits for the next event. Must be called after each reply.
  void Answered(Instant now);
  /// Sends unsent replies. A reply of RTU or ASCII waits while bytes of a newer request are held.
  void Flush(Instant now);
  /// Returns a pointer that keeps the session alive while a reply may close it. Returns null during
  /// a turn (Turn), because the caller of Turn keeps the session alive.
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
  /// The first bytes of the client, at most kMostLookedAt, to detect another framing. Nothing after
  /// the first frame.
  std::optional<Bytes> first_ = Bytes();
  bool in_turn_ = false;  ///< true while Turn runs; it sends the replies at its end
  Instant last_bytes_;
  Instant last_frame_;
  bool closed_ = false;
};

}  // namespace baudgate::modbus
