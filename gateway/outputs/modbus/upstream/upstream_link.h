// `Upstream::Link` is the implementation of Upstream: the connection to one remote server.
// `UpstreamQueue` contains requests that wait to be sent; RequestsOnWire contains the requests that
// were sent. `Reconnect` decides when a connection may be attempted, `UnitPauses` decides which
// units get no requests for a while, and `UpstreamConnection` is one TCP connection.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <asio/io_context.hpp>
#include <asio/ip/tcp.hpp>
#include <asio/steady_timer.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/guarded.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/bus/writes/route_queue.h"
#include "gateway/outputs/modbus/upstream/requests_on_wire.h"
#include "gateway/outputs/modbus/upstream/upstream.h"
#include "gateway/outputs/modbus/wire/request.h"
#include "transports/net_stream.h"
#include "transports/port_keeper.h"
#include "transports/tcp_client.h"
#include "transports/tls_handshakes.h"

namespace baudgate::modbus {

// `Reconnect` decides when the next request may open a connection to a remote server, and stores
// the reason of the last failure. The time is an argument.
class Reconnect {
 public:
  /// The longest pause after a failure. It is short, because only a request makes the gateway
  /// connect again: a server that returns is found at the first request after the pause.
  static constexpr Duration kLongestPause = std::chrono::seconds(5);

  explicit Reconnect(std::uint32_t seed) : ladder_(seed) {}

  void OnConnected() {
    trouble_.clear();
    ladder_.Reset();
  }
  /// Must be called when the connection has ended or could not be opened. The next request opens a
  /// new connection: at once if the server had `accepted` this connection, else after a pause.
  /// Returns true if `why` differs from the last reason.
  bool OnBroken(bool accepted, const std::string& why, Instant now) {
    may_at_ = accepted ? Instant::min() : now + std::min(ladder_.Next(), kLongestPause);
    return std::exchange(trouble_, why) != why;
  }

  bool MayConnect(Instant now) const { return now >= may_at_; }
  /// Returns why the last connection failed or ended; empty: the server is connected, or no
  /// connection was attempted yet.
  const std::string& trouble() const { return trouble_; }

 private:
  transports::ReopenLadder ladder_;
  Instant may_at_ = Instant::min();
  std::string trouble_;
};

// `UnitPauses` lists the units of a server that get no requests for a while, because the server
// closes the connection, which all units share, when it gets a request to such a unit. The time is
// an argument.
class UnitPauses {
 public:
  /// The first pause is 0.5 s; each further pause is twice as long, up to kLongest.
  static constexpr Duration kFirst = std::chrono::milliseconds(500);
  static constexpr Duration kLongest = std::chrono::seconds(5);

  void OnAnswer(std::uint8_t unit) { units_[unit] = {.answers = true}; }
  /// Must be called when a repeated request to the unit has ended the connection. A unit that has
  /// answered since the previous call gets no pause, because other clients use it successfully.
  void OnClosed(std::uint8_t unit, Instant now) {
    State& state = units_[unit];
    if (state.answers) {
      state.answers = false;
      return;
    }
    state.until = now + state.next;
    state.next = std::min(2 * state.next, kLongest);
  }
  bool IsPaused(std::uint8_t unit, Instant now) const { return now < units_[unit].until; }

 private:
  struct State {
    bool answers = false;
    Duration next = kFirst;
    Instant until = Instant::min();
  };
  std::array<State, 256> units_{};
};

/// `UpstreamQueue` contains the requests that wait for one remote server. Any thread may call
/// Submit; all other functions must be called on the server's thread.
class UpstreamQueue final : public bus::RouteQueue {
 public:
  /// The number of requests that can wait for their replies (RouteQueue::TakePlace).
  static constexpr std::size_t kMostWaiting = 512;

  enum class Entry : std::uint8_t {
    refused,
    first,  ///< the request is accepted; the caller must request a call of Gather
    more,   ///< the request is accepted; a call of Gather has been requested already
  };
  Entry Submit(bus::RoutedRequest request);

  /// Accepts requests from now on, also after Close.
  void Open();
  /// Queues the requests that other threads have submitted. False: the queue is closed.
  bool Gather();
  /// Queues the submitted requests a last time, and accepts no more requests. False: the queue was
  /// closed already.
  bool Close();

 private:
  void QueueIncoming() BAUDGATE_REQUIRES(mutex_);

  Mutex mutex_;
  bool open_ BAUDGATE_GUARDED_BY(mutex_) = false;
  std::vector<bus::RoutedRequest> incoming_ BAUDGATE_GUARDED_BY(mutex_);
  FairPlaces places_{kMostWaiting};
};

// `UpstreamConnection` is one connection to a Modbus TCP server: it looks up the name, connects,
// and sends and receives whole frames. gateway/outputs/modbus/upstream/upstream.cpp creates it and
// interprets the frames.

/// All functions must be called on the thread that runs the io_context. Pending operations keep the
/// object alive.
class UpstreamConnection : public std::enable_shared_from_this<UpstreamConnection> {
 public:
  /// Receives the callbacks. No function of the connection makes a callback before it returns. The
  /// owner can close the connection from within a callback.
  class Owner {
   public:
    virtual void OnConnected() = 0;
    /// Called for each frame. OnFramesRead is called after all frames that arrived together.
    virtual void OnFrame(View frame) = 0;
    virtual void OnFramesRead() = 0;
    /// Returns the length of the PDU of the frame that begins with `head` (see
    /// MbapAssembler::Length).
    virtual std::size_t LengthOf(View head, std::size_t told) const = 0;
    /// Called when the connection has failed; it must not be used any more. `reason` completes a
    /// sentence that begins with the server's name.
    virtual void OnBroken(const std::string& reason) = 0;

   protected:
    ~Owner() = default;
  };

  /// The owner must remain valid until Close.
  UpstreamConnection(asio::io_context& io, Owner& owner)
      : io_(io),
        stream_(asio::ip::tcp::socket(io)),
        owner_(&owner),
        input_([this](View head, std::size_t told) {
          return owner_ == nullptr ? told : owner_->LengthOf(head, told);
        }) {}

  /// Looks up the name and connects; with `tls`, the server must have a certificate for `host`.
  /// Must be called only once. There is no timeout; Close ends the attempt.
  void Open(const std::string& host, std::uint16_t port,
            std::shared_ptr<tls::ContextFiles> tls = {});
  /// Passes the whole frame to the kernel. Returns an error if the kernel does not accept all of it
  /// now.
  Status Send(View frame);
  /// Closes the connection; no callback is called any more.
  void Close();

  bool connected() const { return connected_; }
  bool in_frame() const { return !input_.empty(); }
  /// Returns the transaction id of the next frame, if two bytes of the frame have been received.
  std::optional<std::uint16_t> frame_id() const { return input_.transaction(); }

 private:
  void Connect(const std::vector<asio::ip::tcp::endpoint>& endpoints);
  void BeginTls();
  void Begin();
  void Read();
  void TakeFrames();

  asio::io_context& io_;
  transports::HostNames::Ticket look_up_;
  std::string host_;
  std::shared_ptr<tls::ContextFiles> tls_;  // null: without TLS
  tls::Handshakes::Ticket handshake_;
  std::unique_ptr<asio::ip::tcp::socket> connecting_;
  tls::NetStream stream_;
  Owner* owner_;  // null: the connection is closed
  bool connected_ = false;
  MbapAssembler input_;
};

class Upstream::Link final : public std::enable_shared_from_this<Link>,
                             public UpstreamConnection::Owner {
 public:
  Link(asio::io_context& io, std::string host, std::uint16_t port, const config::TlsFiles& tls,
       OnLate on_late, Clock clock)
      : io_(io),
        timer_(io),
        host_(std::move(host)),
        port_(port),
        tls_(tls.on() ? std::make_shared<tls::ContextFiles>(tls::End::client, tls) : nullptr),
        on_late_(std::move(on_late)),
        clock_(std::move(clock)),
        name_("server " + host_ + ":" + std::to_string(port)),
        reconnect_(static_cast<std::uint32_t>(std::hash<std::string>{}(name_))) {}

  void Start();
  void Rest();
  void Stop();
  bool Submit(bus::RoutedRequest request);
  void Abandon(std::uint64_t client);

 private:
  using Sent = RequestsOnWire::Sent;

  void OnConnected() override;
  void OnFrame(View frame) override;
  void OnFramesRead() override { Work(); }
  std::size_t LengthOf(View head, std::size_t told) const override;
  void OnBroken(const std::string& reason) override;

  void TakeIncoming();
  void Drop(std::uint64_t client);
  void Work();
  void CloseAtRest();
  void Arm(Instant now);
  void Connect(Instant now);
  void TakeBackReads(const Sent* reason);
  void Break(const std::string& reason, Instant now);
  void ExpireWaiting(Instant now);
  void ExpireSent(Instant now);
  void RefusePaused(Instant now);
  void AnswerUnsent(const std::vector<bus::RoutedRequest>& requests, Outcome outcome,
                    const std::string& reason);

  void Pump(Instant now);
  bus::RouteQueue::Batch Choose(Instant now);
  void Send(bus::RouteQueue::Batch batch, Instant now);

  asio::io_context& io_;
  // Expires when Work has something to do.
  asio::steady_timer timer_;
  const std::string host_;
  const std::uint16_t port_;
  const std::shared_ptr<tls::ContextFiles> tls_;  // null: without TLS
  const OnLate on_late_;
  const Clock clock_;
  const std::string name_;

  UpstreamQueue queue_;
  RequestsOnWire on_wire_;
  UnitPauses pauses_;
  Reconnect reconnect_;
  // True: no route leads to this server, so the connection is closed after the last request.
  bool resting_ = false;
  std::shared_ptr<UpstreamConnection> connection_;
  Instant connect_by_;
};

}  // namespace baudgate::modbus
