// The connection to one server elsewhere; upstream.h hides it. Requests that wait for it are in
// UpstreamQueue, those on the wire in requests_on_wire.h. Reconnect and UnitPauses decide when the
// server is asked, and UpstreamConnection is one connection.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <asio/io_context.hpp>
#include <asio/ip/tcp.hpp>
#include <asio/steady_timer.hpp>
#include <atomic>
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
#include "transports/port_keeper.h"
#include "transports/tcp_client.h"

namespace baudgate::modbus {

// When the next request may make a connection to a server elsewhere, and why there is none. Time is
// an argument; for upstream.cpp.
class Reconnect {
 public:
  /// A server that returns is not kept waiting longer: only a request makes us look for it.
  static constexpr Duration kLongestPause = std::chrono::seconds(5);

  explicit Reconnect(std::uint32_t seed) : ladder_(seed) {}

  void OnConnected() {
    trouble_.clear();
    ladder_.Reset();
  }
  /// The next request makes a new connection: at once when the server has `accepted` this one, else
  /// after a pause. True: `why` is news.
  bool OnBroken(bool accepted, const std::string& why, Instant now) {
    may_at_ = accepted ? Instant::min() : now + std::min(ladder_.Next(), kLongestPause);
    return std::exchange(trouble_, why) != why;
  }

  bool MayConnect(Instant now) const { return now >= may_at_; }
  /// Why there was no connection last time; empty: there was one.
  const std::string& trouble() const { return trouble_; }

 private:
  transports::ReopenLadder ladder_;
  Instant may_at_ = Instant::min();
  std::string trouble_;
};

// Which units of a server are not asked for a while, because the server closes the connection when
// they are: all share it. Told and asked by upstream.cpp; time is an argument.
class UnitPauses {
 public:
  /// 0.5 s, then twice as long each time.
  static constexpr Duration kFirst = std::chrono::milliseconds(500);
  static constexpr Duration kLongest = std::chrono::seconds(5);

  void OnAnswer(std::uint8_t unit) { units_[unit] = {.answers = true}; }
  /// A request of it has ended the connection twice. A unit that has answered others since the last
  /// such request does not pause for it: other clients are served by it.
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

// Requests that wait for one server elsewhere, with the way in for other threads.

/// All but Submit on one thread.
class UpstreamQueue final : public bus::RouteQueue {
 public:
  /// Requests that wait to be sent; more are not let in, but for some short writes.
  static constexpr std::size_t kMostWaiting = 512;

  enum class Entry : std::uint8_t {
    refused,
    first,  ///< Gather is to be called
    more,
  };
  /// From any thread.
  Entry Submit(bus::RoutedRequest request);

  /// Lets requests in, also after Close.
  void Open();
  /// Queues what other threads have submitted. False: it is closed.
  bool Gather();
  /// Queues it once more, and lets nothing in from then on. False: it was closed already.
  bool Close();
  /// After requests were taken, before they are answered: whoever is answered may ask again at
  /// once.
  void Count() { queued_ = size(); }

 private:
  void QueueIncoming() BAUDGATE_REQUIRES(mutex_);

  Mutex mutex_;
  bool open_ BAUDGATE_GUARDED_BY(mutex_) = false;
  std::vector<bus::RoutedRequest> incoming_ BAUDGATE_GUARDED_BY(mutex_);
  std::atomic<std::size_t> queued_ = 0;  // without those that come in
};

// One connection to a Modbus TCP server: look-up, connecting, whole frames in and out. Made and
// heard by upstream.cpp, which knows what the frames mean.

/// All on the thread that runs the io_context. Kept alive by its own pending operations.
class UpstreamConnection : public std::enable_shared_from_this<UpstreamConnection> {
 public:
  /// The listener, never called from within a call. May close the connection from within a
  /// callback.
  class Owner {
   public:
    virtual void OnConnected() = 0;
    /// Everything that has come together; called for each frame, then OnFramesRead.
    virtual void OnFrame(View frame) = 0;
    virtual void OnFramesRead() = 0;
    /// The length of a frame that begins with `head`: see MbapAssembler::Length.
    virtual std::size_t LengthOf(View head, std::size_t told) const = 0;
    /// Not to be used any more. `reason` goes on where the server's name ends.
    virtual void OnBroken(const std::string& reason) = 0;

   protected:
    ~Owner() = default;
  };

  /// The owner outlives the connection until Close.
  UpstreamConnection(asio::io_context& io, Owner& owner)
      : io_(io), socket_(io), owner_(&owner), input_([this](View head, std::size_t told) {
          return owner_ == nullptr ? told : owner_->LengthOf(head, told);
        }) {}

  /// Once. Takes as long as it takes; Close ends it.
  void Open(const std::string& host, std::uint16_t port);
  /// Hands the whole frame to the kernel; an error when that is not possible now.
  Status Send(View frame);
  /// No callback from now on. What neither side has read is dropped, not delivered late.
  void Close();

  bool connected() const { return connected_; }
  /// A frame has begun to come.
  bool in_frame() const { return !input_.empty(); }
  /// Its transaction id, if that much of it has come.
  std::optional<std::uint16_t> frame_id() const { return input_.transaction(); }

 private:
  void Connect(const std::vector<asio::ip::tcp::endpoint>& endpoints);
  void Begin();
  void Read();
  void TakeFrames();

  asio::io_context& io_;
  transports::HostNames::Ticket look_up_;
  asio::ip::tcp::socket socket_;
  Owner* owner_;  // null: closed
  bool connected_ = false;
  MbapAssembler input_;
};

class Upstream::Link final : public std::enable_shared_from_this<Link>,
                             public UpstreamConnection::Owner {
 public:
  Link(asio::io_context& io, std::string host, std::uint16_t port, OnLate on_late, Clock clock)
      : io_(io),
        timer_(io),
        host_(std::move(host)),
        port_(port),
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

  // upstream.cpp: its coming and going
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

  // upstream.cpp: what is sent, and what comes back
  void Pump(Instant now);
  bus::RouteQueue::Batch Choose(Instant now);
  void Send(bus::RouteQueue::Batch batch, Instant now);

  asio::io_context& io_;
  asio::steady_timer timer_;  // the next deadline, whatever it is for
  const std::string host_;
  const std::uint16_t port_;
  const OnLate on_late_;
  const Clock clock_;
  const std::string name_;

  UpstreamQueue queue_;
  RequestsOnWire on_wire_;
  UnitPauses pauses_;
  Reconnect reconnect_;
  bool resting_ = false;  // no request is left, and the connection is closed after the last
  std::shared_ptr<UpstreamConnection> connection_;  // null: there is none, nor an attempt
  Instant connect_by_;
};

}  // namespace baudgate::modbus
