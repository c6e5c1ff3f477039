// `Upstream` is a remote Modbus TCP server as the target of routes. Requests are sent over one
// connection, several at a time; replies are passed back as they arrive.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "gateway/base/time.h"
#include "gateway/bus/writes/route_queue.h"

namespace baudgate::modbus {

/// The connection is opened for the first request, and stays open. A write waits for the previous
/// write to its unit, and nothing is sent after its deadline. A read that was on the wire when the
/// connection ended is sent again: once, and each time that another request was the cause. A
/// broadcast is answered "ok" when it is sent.
class Upstream final : public bus::RouteTarget {
 public:
  using OnLate = std::function<void(std::uint8_t unit)>;
  using Clock = std::function<Instant()>;

  /// `on_late` is called for replies that came too late. `io` must outlive this object.
  Upstream(
      asio::io_context& io, std::string host, std::uint16_t port, OnLate on_late,
      Clock clock = [] { return ReadClocks().instant; });
  ~Upstream() override;
  Upstream(const Upstream&) = delete;
  Upstream& operator=(const Upstream&) = delete;

  // Start, Rest and Stop run on the io_context's thread, or while none runs it.
  /// Accepts requests from now on, also after Rest.
  void Start();
  /// No route leads to this server any more: closes when no request is pending.
  void Rest();
  /// Answers all pending requests, and accepts no more requests.
  void Stop();

  bool Submit(bus::RoutedRequest request) override;
  void Abandon(std::uint64_t client) override;

 private:
  class Link;
  std::shared_ptr<Link> link_;
};

}  // namespace baudgate::modbus
