// `Upstream` is a remote Modbus TCP server as the target of routes. Requests come from
// gateway/outputs/modbus/service/router.cpp and are sent over one connection, several at a time;
// replies are passed back in the order in which they arrive.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "config/model/network.h"
#include "gateway/base/time.h"
#include "gateway/bus/writes/route_queue.h"

namespace baudgate::modbus {

/// The connection is opened for the first request, and stays open. A write is sent only after the
/// previous write to the same unit has ended, and nothing is sent after its deadline. A read that
/// was on the wire when the connection ended is sent again: once, and once more each time that
/// another request has ended the connection. A broadcast is answered "ok" when it is sent; a reply
/// of the server to a broadcast is dropped.
class Upstream final : public bus::RouteTarget {
 public:
  using OnLate = std::function<void(std::uint8_t unit)>;
  using Clock = std::function<Instant()>;

  /// `host` is a name or an address. With `tls.on()`, the server is called over TLS (Modbus/TCP
  /// Security). `on_late` is called when a reply of a unit came after its
  /// request's deadline and was dropped. `io` must outlive this object.
  Upstream(
      asio::io_context& io, std::string host, std::uint16_t port, const config::TlsFiles& tls,
      OnLate on_late, Clock clock = [] { return ReadClocks().instant; });
  ~Upstream() override;
  Upstream(const Upstream&) = delete;
  Upstream& operator=(const Upstream&) = delete;

  // Start, Rest and Stop must be called on the thread that runs the io_context, or while no thread
  // runs it.
  /// Accepts requests from now on, also after Rest.
  void Start();
  /// Must be called when no route leads to this server any more: closes the connection when no
  /// request is pending.
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
