// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/service/server_shared.h"

#include <utility>

namespace baudgate::modbus {

ServerShared::ServerShared(const config::Config& config, const PointStore& store, CommandSink& sink,
                           std::function<GatewayFigures()> info, ModbusLimits limits,
                           const ModbusLinks& links)
    : limits_(limits),
      units_(
          config, store, sink,
          [this, info = std::move(info)] {
            return GatewayBlockOf(info ? info() : GatewayFigures{}, counters_.Snapshot());
          },
          links.events, AckRegister(store, links.alarms, links.writes)),
      router_(config, links.lines, links.writes, links.routed, book_),
      frames_(links.frames) {}

void ServerShared::Open(asio::io_context& io, Inbox::Clocks clocks) {
  inbox_->Open(io, std::move(clocks));
  router_.Open(io);
}

void ServerShared::Apply(const config::Config& config, std::span<RouteTarget* const> lines,
                         const Origins& routes) {
  units_.Apply(config);
  router_.Apply(config, lines, routes);
}

}  // namespace baudgate::modbus
