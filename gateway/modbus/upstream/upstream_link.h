// What is behind upstream.h: the queue, the wire and the connection of one server elsewhere.
// upstream.cpp has its coming and going, upstream_wire.cpp what is sent and what comes back.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <asio/steady_timer.hpp>
#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "gateway/base/guarded.h"
#include "gateway/base/modbus_pdu.h"
#include "gateway/modbus/upstream/unit_pauses.h"
#include "gateway/modbus/upstream/upstream.h"
#include "gateway/modbus/upstream/upstream_connection.h"
#include "gateway/requests/route_queue.h"
#include "transports/reopen_ladder.h"

namespace baudgate::modbus {

class Upstream::Link final : public std::enable_shared_from_this<Link>,
                             public UpstreamConnection::Owner {
 public:
  Link(asio::io_context& io, std::string host, std::uint16_t port,
       std::function<void(std::uint8_t)> on_late)
      : io_(io),
        timer_(io),
        host_(std::move(host)),
        port_(port),
        on_late_(std::move(on_late)),
        name_("server " + host_ + ":" + std::to_string(port)),
        ladder_(static_cast<std::uint32_t>(std::hash<std::string>{}(name_))) {}

  void Start();
  void Rest();
  void Stop();
  bool Submit(RoutedRequest request);
  void Forget(std::uint64_t client);

 private:
  /// A request on the wire, with the identical reads that its reply answers as well.
  struct Sent {
    std::uint16_t id = 0;
    std::uint8_t unit = 0;
    Bytes pdu;
    Instant at;
    Instant deadline;  ///< the last of its requests'
    RouteQueue::Batch requests;

    std::uint8_t function() const { return pdu[0]; }
    /// Functions that only read, whoever the server is.
    bool only_reads() const { return IsRead(function()); }
    /// It was on the wire when a connection ended, and may have been the reason.
    bool repeated() const {
      return std::ranges::any_of(requests,
                                 [](const RoutedRequest& request) { return request.tries > 0; });
    }
  };

  /// A request whose deadline has passed on the wire: its reply may still come.
  struct Expired {
    std::uint16_t id = 0;
    std::uint8_t unit = 0;
    bool operator==(const Expired&) const = default;
  };

  void OnConnected() override;
  void OnFrame(View frame) override;
  void OnFramesRead() override { Work(); }
  std::size_t LengthOf(View head, std::size_t told) const override;
  void OnBroken(const std::string& reason) override;

  void TakeIncoming();
  bool Gather();
  void Drop(std::uint64_t client);
  void Work();
  void CloseAtRest();
  void Arm();

  void ExpireWaiting(Instant now);
  void RefusePaused(Instant now);
  void ExpireSent(Instant now);
  bool HasHalfOfExpired() const;
  void AnswerUnsent(const std::vector<RoutedRequest>& requests, Outcome outcome,
                    const std::string& reason);
  static void AnswerSent(const Sent& sent, Outcome outcome, View pdu, const std::string& reason);

  void Connect(Instant now);
  void OnClosed(Instant now);
  void TakeBackReads(const Sent* reason);
  void Break(const std::string& reason);
  void Pump(Instant now);
  bool HasRoom(std::uint8_t unit) const;
  bool IsTryingOut(Instant now) const;
  RouteQueue::Batch Choose(Instant now);
  std::uint16_t FreeId();
  void Send(Instant now, RouteQueue::Batch batch);

  asio::io_context& io_;
  asio::steady_timer timer_;  // the next deadline, whatever it is for
  const std::string host_;
  const std::uint16_t port_;
  const std::function<void(std::uint8_t)> on_late_;
  const std::string name_;

  Mutex mutex_;
  bool accepting_ BAUDGATE_GUARDED_BY(mutex_) = false;
  std::vector<RoutedRequest> incoming_ BAUDGATE_GUARDED_BY(mutex_);

  std::atomic<std::size_t> waiting_ = 0;  // in incoming_ and queue_

  RouteQueue queue_;
  std::vector<Sent> on_wire_;
  std::vector<Expired> expired_;  // the latest of this connection
  std::uint16_t next_id_ = 0;
  UnitPauses pauses_;
  std::array<int, 256> ignored_{};  // by unit: deadlines that passed since it answered

  bool resting_ = false;  // nobody asks, and the connection goes with its last request
  std::shared_ptr<UpstreamConnection> connection_;  // null: there is none, nor an attempt
  Instant connect_by_;
  int silent_ = 0;       // deadlines that passed since then
  Instant silent_from_;  // what was sent later counts as the next of them
  ReopenLadder ladder_;
  Instant retry_at_ = Instant::min();
  std::string trouble_;  // why there was no connection last time
};

}  // namespace baudgate::modbus
