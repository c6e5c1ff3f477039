// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/service/unit_writer.h"

#include <utility>

#include "gateway/outputs/modbus/registers/write_request.h"
#include "gateway/outputs/modbus/service/write_exception.h"

namespace baudgate::modbus {

ExceptionCode UnitWriter::Submit(const ModbusRequest& request, const Asker& asker, Instant now,
                                 Done done) {
  const Writer& writer = asker.writer;
  const UnitMap& unit = map_.unit(request.unit);
  if (IsFirstEvent(request)) {
    const auto first = FirstEvent(request);
    if (!first) return kIllegalValue;
    events_.SetFirst(writer.number, request.unit, *first);
    done({});
    return kNoException;
  }
  if (AckRegister::IsFor(request)) return acks_.Submit(request, unit, writer, now, std::move(done));
  if (unit.kind != UnitMap::Kind::device) return kIllegalAddress;
  if (const auto point = SelectedPoint(unit, request)) {
    if (!IsSelectKey(request)) return kIllegalValue;
    if (const auto denial = gate_.Select(writer, unit.device, *point, now)) {
      return ExceptionOf(*denial);
    }
    done({});
    return kNoException;
  }
  ConvertedWrite converted = ConvertWrites(unit, store_.device(unit.device), request);
  if (converted.exception != kNoException) return converted.exception;
  const auto denial = gate_.Submit(writer,
                                   {.device = unit.device,
                                    .parts = std::move(converted.parts),
                                    .deadline = asker.deadline,
                                    .abandoned = asker.abandoned,
                                    .done = std::move(done)},
                                   now);
  return denial ? ExceptionOf(*denial) : kNoException;
}

void UnitWriter::Deny(const ModbusRequest& request, const Writer& writer,
                      const WriteResult& refused, const Now& now) {
  const UnitMap& unit = map_.unit(request.unit);
  if (AckRegister::IsFor(request)) return acks_.Deny(request, unit, writer, refused, now);
  if (unit.kind != UnitMap::Kind::device) return;
  ConvertedWrite converted = ConvertWrites(unit, store_.device(unit.device), request);
  gate_.Deny(writer, {.device = unit.device, .parts = std::move(converted.parts)}, refused.reason,
             refused.end);
}

}  // namespace baudgate::modbus
