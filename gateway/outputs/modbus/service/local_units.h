// The units that a Modbus server answers itself: devices of the gateway, out of the point store,
// and the gateway's own. Requests come from local_requests.cpp. Used by the server's own thread
// only.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <utility>

#include "config/model/config.h"
#include "gateway/outputs/modbus/registers/register_map.h"
#include "gateway/outputs/modbus/service/event_window.h"
#include "gateway/outputs/modbus/service/links.h"
#include "gateway/outputs/modbus/service/unit_reader.h"
#include "gateway/outputs/modbus/service/unit_writer.h"
#include "gateway/outputs/modbus/wire/request.h"

namespace baudgate::modbus {

class LocalUnits {
 public:
  /// All references outlive it. `block`: what the gateway's own registers show.
  LocalUnits(const config::Config& config, const PointStore& store, CommandSink& sink,
             std::function<GatewayBlock()> block, const ModbusLinks& links);

  /// A reload.
  void Apply(const config::Config& config);

  /// Unit, function, counts and lengths; fills `request` when there is no
  /// exception.
  ExceptionCode Check(View frame, ModbusRequest& request) const;
  /// See UnitReader.
  ExceptionCode Read(const ModbusRequest& request, Holes holes, Instant now,
                     std::uint64_t client = 0) {
    return reader_.Read(request, holes, now, client);
  }
  /// See UnitWriter.
  ExceptionCode Submit(const ModbusRequest& request, const Asker& asker, Instant now,
                       UnitWriter::Done done) {
    return writer_.Submit(request, asker, now, std::move(done));
  }
  /// Another part has denied this request: if it is a write, its points are recorded with that end.
  void Deny(View frame, const Writer& writer, const WriteResult& refused, const Now& now);
  /// The client has left.
  void Forget(const Writer& writer);

  Responder& responder() { return reader_.responder(); }

 private:
  RegisterMap map_;
  EventWindow events_;
  UnitReader reader_;
  UnitWriter writer_;
};

}  // namespace baudgate::modbus
