// `Upstream` is a remote Modbus TCP server as the target of routes. Requests come from
// gateway/outputs/modbus/service/router.cpp and go out over one connection, several at a time;
// replies go back in the order in which they come.
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

/// The connection is made for the first request, and stays open. A write is sent only after the
/// write before it to the same unit has ended, and nothing is sent after its deadline. A read that
/// was on the wire when the connection ended is sent again: once, and once more each time that
/// another request was the cause. A broadcast is answered ok once it is sent; a reply of the server
/// to it is dropped.
class Upstream final : public bus::RouteTarget {
 public:
  using OnLate = std::function<void(std::uint8_t unit)>;
  using Clock = std::function<Instant()>;

  /// `host` is a name or an address. `on_late` is called when a reply of a unit came after its
  /// request's deadline and was dropped. The io_context must outlive this object.
  Upstream(
      asio::io_context& io, std::string host, std::uint16_t port, OnLate on_late,
      Clock clock = [] { return ReadClocks().instant; });
  ~Upstream() override;
  Upstream(const Upstream&) = delete;
  Upstream& operator=(const Upstream&) = delete;

  // Start, Rest and Stop: on the thread that runs the io_context, or while none does.
  /// Accepts requests from now on, also after Rest.
  void Start();
  /// To be called when no route leads here any more: closes the connection once no request is under
  /// way.
  void Rest();
  /// Answers all requests that are under way, and accepts none from then on.
  void Stop();

  bool Submit(bus::RoutedRequest request) override;
  void Abandon(std::uint64_t client) override;

 private:
  class Link;
  std::shared_ptr<Link> link_;
};

}  // namespace baudgate::modbus
