// Writes to the units that the gateway answers itself. By the register a write is for points, the
// selection of a point, the acknowledgement of alarms, or the first event that is shown. On the
// server's thread.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <utility>

#include "gateway/bus/points/point_store.h"
#include "gateway/bus/writes/write_command.h"
#include "gateway/bus/writes/write_gate.h"
#include "gateway/outputs/modbus/registers/register_map.h"
#include "gateway/outputs/modbus/service/ack_register.h"
#include "gateway/outputs/modbus/service/event_window.h"
#include "gateway/outputs/modbus/wire/request.h"

namespace baudgate::modbus {

/// A client that waits for its write.
struct Asker {
  Writer writer{};
  Instant deadline{};                                  ///< nothing of it is sent later
  std::shared_ptr<const std::atomic<bool>> abandoned;  ///< once true, the write is not begun
};

class UnitWriter {
 public:
  using Done = std::function<void(const WriteResult&)>;

  /// All references outlive it.
  UnitWriter(const PointStore& store, WriteGate gate, const RegisterMap& map, EventWindow& events,
             const AckRegister& acks)
      : store_(store), gate_(std::move(gate)), map_(map), events_(events), acks_(acks) {}

  /// `done` is called once, on any thread, unless there is an exception.
  ExceptionCode Submit(const ModbusRequest& request, const Asker& asker, Instant now, Done done);
  /// Another part has denied this write: its points are recorded with that end.
  void Deny(const ModbusRequest& request, const Writer& writer, const WriteResult& refused,
            const Now& now);
  /// The client has left.
  void Forget(const Writer& writer) { gate_.Forget(writer); }

 private:
  const PointStore& store_;
  WriteGate gate_;
  const RegisterMap& map_;
  EventWindow& events_;
  AckRegister acks_;
};

}  // namespace baudgate::modbus
