// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/service/ack_register.h"

#include <utility>

namespace baudgate::modbus {
namespace {

std::optional<std::uint32_t> NumberOf(const ModbusRequest& request) {
  if (request.count != 2) return std::nullopt;
  return ByteReader(request.data).U32Be(0);
}

}  // namespace

bool AckRegister::IsFor(const ModbusRequest& request) {
  return request.table() == config::Table::registers && request.start >= kAckRegister &&
         request.start + request.count <= kAckRegister + 2;
}

/// As a write to a point of this name would be.
audit::WriteRecord AckRegister::RecordOf(const ModbusRequest& request, const UnitMap& unit,
                                         const Writer& writer) const {
  audit::WriteRecord record;
  record.client = writer.name;
  record.point = "alarms";
  const auto number = NumberOf(request);
  if (number == kAll) {
    record.value = std::string("all");
  } else if (number) {
    record.value = std::int64_t{*number};
  }
  if (unit.kind != UnitMap::Kind::device) return record;
  store_.Read(unit.device, [&](const DeviceRecord& of) {
    record.line = of.line->name;
    record.device = of.device->name;
  });
  return record;
}

ExceptionCode AckRegister::Submit(const ModbusRequest& request, const UnitMap& unit,
                                  const Writer& writer, Instant now,
                                  std::function<void(const WriteResult&)> done) {
  if (alarms_ == nullptr) return kIllegalAddress;
  const auto number = NumberOf(request);
  if (!number) return kIllegalValue;
  audit::WriteRecord record = RecordOf(request, unit, writer);
  events::AckQuery query;
  query.line = record.line;
  query.device = record.device;
  query.all = unit.kind != UnitMap::Kind::device;
  if (*number != kAll) query.number = *number;
  query.by = "modbus " + writer.name;
  const bool wants_one = *number != kAll;
  const auto told = [=, log = log_,
                     done = std::move(done)](const events::Acknowledged& ack) mutable {
    if (ack.alarms == 0 && wants_one) return;
    const bool kept = ack.trouble.empty();
    record.time = record.last = ack.at;
    record.end = kept ? WriteEnd::ok : WriteEnd::unknown;
    record.reason = ack.trouble;
    if (log != nullptr) log->Note(record, now);
    done({.end = *record.end, .reason = record.reason});
  };
  const std::size_t alarms = alarms_->Acknowledge(query, told);
  return alarms == 0 && wants_one ? kIllegalValue : kNoException;
}

void AckRegister::Deny(const ModbusRequest& request, const UnitMap& unit, const Writer& writer,
                       const WriteResult& refused, Now now) {
  if (alarms_ == nullptr || log_ == nullptr) return;
  audit::WriteRecord record = RecordOf(request, unit, writer);
  record.kind = audit::Kind::denied;
  record.time = record.last = now.wall;
  record.end = refused.end;
  record.reason = refused.reason;
  log_->Note(std::move(record), now.instant);
}

}  // namespace baudgate::modbus
