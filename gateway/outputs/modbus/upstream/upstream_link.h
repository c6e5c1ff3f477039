// The connection to one server elsewhere; upstream.h hides it. Requests that wait for it are in
// upstream_queue.h, those on the wire in requests_on_wire.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/steady_timer.hpp>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "gateway/outputs/modbus/upstream/reconnect.h"
#include "gateway/outputs/modbus/upstream/requests_on_wire.h"
#include "gateway/outputs/modbus/upstream/unit_pauses.h"
#include "gateway/outputs/modbus/upstream/upstream.h"
#include "gateway/outputs/modbus/upstream/upstream_connection.h"
#include "gateway/outputs/modbus/upstream/upstream_queue.h"

namespace baudgate::modbus {

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
  bool Submit(RoutedRequest request);
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
  void AnswerUnsent(const std::vector<RoutedRequest>& requests, Outcome outcome,
                    const std::string& reason);

  // upstream_wire.cpp: what is sent, and what comes back
  void Pump(Instant now);
  RouteQueue::Batch Choose(Instant now);
  void Send(RouteQueue::Batch batch, Instant now);

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
