// The register that acknowledges alarms, 9096 of every unit: the number of the event that has
// raised one (its low 32 bits), or all ones for all. At the unit of a device its own, at the
// gateway's all.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

#include "gateway/bus/points/point_store.h"
#include "gateway/bus/writes/write_gate.h"
#include "gateway/outputs/modbus/registers/register_map.h"
#include "gateway/outputs/modbus/wire/request.h"
#include "gateway/records/audit/write_log.h"
#include "gateway/records/events/event_source.h"

namespace baudgate::modbus {

class AckRegister {
 public:
  static constexpr std::uint32_t kAll = 0xFFFFFFFF;

  /// All outlive it. Null: there are no alarms; it is not recorded.
  AckRegister(const PointStore& store, events::EventSource* alarms, audit::WriteLog* log)
      : store_(store), alarms_(alarms), log_(log) {}

  /// The request writes to this register, and to nothing else.
  static bool IsFor(const ModbusRequest& request);
  /// `done` comes once, on any thread, when it is on the disk, unless there is an exception.
  /// illegal_value: half a number, or no alarm of that number waits for it.
  ExceptionCode Submit(const ModbusRequest& request, const UnitMap& unit, const Writer& writer,
                       Instant now, std::function<void(const WriteResult&)> done);
  void Deny(const ModbusRequest& request, const UnitMap& unit, const Writer& writer,
            const WriteResult& refused, Now now);

 private:
  audit::WriteRecord RecordOf(const ModbusRequest& request, const UnitMap& unit,
                              const Writer& writer) const;

  const PointStore& store_;
  events::EventSource* const alarms_;
  audit::WriteLog* const log_;
};

}  // namespace baudgate::modbus
