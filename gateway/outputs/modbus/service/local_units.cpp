// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/service/local_units.h"

namespace baudgate::modbus {

LocalUnits::LocalUnits(const config::Config& config, const PointStore& store, CommandSink& sink,
                       std::function<GatewayBlock()> block, const ModbusLinks& links)
    : map_(config),
      events_(links.events),
      reader_(store, map_, events_, std::move(block)),
      writer_(store, WriteGate(store, sink), map_, events_,
              AckRegister(store, links.alarms, links.writes)) {}

void LocalUnits::Apply(const config::Config& config) {
  map_ = RegisterMap(config);
  reader_.Renew();
}

ExceptionCode LocalUnits::Check(View frame, ModbusRequest& request) const {
  if (map_.unit(UnitOf(frame)).kind == UnitMap::Kind::unmapped) return kNoPath;
  return ParseRequest(frame, request);
}

void LocalUnits::Deny(View frame, const Writer& writer, const WriteResult& refused,
                      const Now& now) {
  ModbusRequest request;
  if (!IsPlainWrite(FunctionOf(frame)) || Check(frame, request) != kNoException) return;
  writer_.Deny(request, writer, refused, now);
}

void LocalUnits::Forget(const Writer& writer) {
  writer_.Forget(writer);
  events_.Forget(writer.number);
}

}  // namespace baudgate::modbus
