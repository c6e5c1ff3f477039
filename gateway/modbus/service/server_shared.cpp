// SPDX-License-Identifier: Apache-2.0
#include "gateway/modbus/service/server_shared.h"

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
          links),
      routes_(config.modbus.routes),
      table_(config, routes_),
      targets_(routes_, links.lines),
      frames_(links.frames),
      audit_(links.writes),
      routed_(links.routed),
      book_(std::make_shared<TrafficBook>()) {
  book_->Show(routes_);
}

void ServerShared::Apply(const config::Config& config, std::span<RouteTarget* const> lines,
                         const Origins& routes) {
  units_.Apply(config);
  routes_.Renew(config.modbus.routes, routes);
  table_ = RouteTable(config, routes_);
  book_->Show(routes_);
  targets_.Relink(lines);
}

}  // namespace baudgate::modbus
