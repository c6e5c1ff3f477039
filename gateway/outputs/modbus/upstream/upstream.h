// A Modbus TCP server elsewhere as the target of routes: requests come from
// gateway/outputs/modbus/service/router.cpp, go out over one connection, several at a time, and
// replies go back as they come.
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

/// The connection is made when the first request comes, and kept. A write goes out only after the
/// one before it to the same unit has ended, and nothing goes out after its deadline. Again goes
/// only a read that met the end of a connection: once, or as often as others were the reason.
/// Broadcasts are not waited for: answered ok once they are sent; the server's own answer to one,
/// if it has any, is dropped.
class Upstream final : public bus::RouteTarget {
 public:
  using OnLate = std::function<void(std::uint8_t unit)>;
  using Clock = std::function<Instant()>;

  /// `host` is a name or an address. `on_late`: a reply of this unit came after its request's
  /// deadline and was dropped. The io_context outlives the upstream.
  Upstream(
      asio::io_context& io, std::string host, std::uint16_t port, OnLate on_late,
      Clock clock = [] { return ReadClocks().instant; });
  ~Upstream() override;
  Upstream(const Upstream&) = delete;
  Upstream& operator=(const Upstream&) = delete;

  // On the thread that runs the io_context, or while it does not run.
  /// Lets requests in, also after Rest.
  void Start();
  /// No route leads here any more: the connection is closed once nothing is under way.
  void Rest();
  /// Answers what is under way, and lets nothing in from then on.
  void Stop();

  bool Submit(bus::RoutedRequest request) override;
  void Abandon(std::uint64_t client) override;

 private:
  class Link;
  std::shared_ptr<Link> link_;
};

}  // namespace baudgate::modbus
