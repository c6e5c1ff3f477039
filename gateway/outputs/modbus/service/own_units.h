// `OwnUnits` answers requests for the units that a Modbus server serves itself: devices of the
// gateway, from the point store, and the gateway. Requests come from client_requests.cpp. All on
// the server's thread. `EventWindow` and `AckRegister` are the registers for events and alarms, and
// `ExceptionOf` returns the exception for a failed write.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "config/model/config.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/writes/write_command.h"
#include "gateway/bus/writes/write_gate.h"
#include "gateway/outputs/modbus/registers/register_contents.h"
#include "gateway/outputs/modbus/registers/register_image.h"
#include "gateway/outputs/modbus/registers/register_map.h"
#include "gateway/outputs/modbus/registers/responder.h"
#include "gateway/outputs/modbus/wire/request.h"
#include "gateway/records/audit/audited_writes.h"
#include "gateway/records/events/event_feed.h"
#include "gateway/records/events/event_source.h"

namespace baudgate::modbus {

// `EventWindow` contains, per client and unit, the number of the first event to show. The client
// writes that number, and then reads the event block of
// gateway/outputs/modbus/registers/register_contents.h. On the server's thread.
class EventWindow {
 public:
  /// Null: no events are recorded.
  explicit EventWindow(std::shared_ptr<const events::EventFeed> events)
      : events_(std::move(events)) {}

  /// `first`: the number of an event; 0: the newest events are shown.
  void SetFirst(std::uint64_t client, std::uint8_t unit, std::uint32_t first) {
    firsts_[{client, unit}] = first;
  }
  /// `source`: the device whose events are shown; empty: the events of all devices.
  EventBlock Show(std::uint64_t client, std::uint8_t unit,
                  std::optional<events::Source> source) const;
  /// To be called when the client has left.
  void Forget(std::uint64_t client);

 private:
  const std::shared_ptr<const events::EventFeed> events_;
  /// By client and unit; an absent entry means the newest events.
  std::map<std::pair<std::uint64_t, std::uint8_t>, std::uint32_t> firsts_;
};

// `AckRegister` is the register that acknowledges alarms, 9096 of every unit. A client writes the
// number of the event that raised the alarm (its low 32 bits), or all ones for all alarms. The unit
// of a device acknowledges that device's alarms; the gateway's units acknowledge those of all
// devices.
class AckRegister {
 public:
  static constexpr std::uint32_t kAll = 0xFFFFFFFF;

  /// References and pointers must outlive this object. `alarms` null: there are no alarms. `log`
  /// null: acknowledgements are not recorded.
  AckRegister(const bus::PointStore& store, events::EventSource* alarms, audit::WriteLog* log)
      : store_(store), alarms_(alarms), log_(log) {}

  /// True if the request writes to this register, and to no other.
  static bool IsFor(const ModbusRequest& request);
  /// Acknowledges alarms. Unless an exception is returned, `done` is called once, on any thread,
  /// when the acknowledgement is on the disk. kIllegalValue: half of the number, or no alarm of
  /// that number waits to be acknowledged.
  ExceptionCode Submit(const ModbusRequest& request, const UnitMap& unit, const bus::Writer& writer,
                       Instant now, std::function<void(const WriteResult&)> done);
  /// Records an acknowledgement that was not permitted or not accepted.
  void Deny(const ModbusRequest& request, const UnitMap& unit, const bus::Writer& writer,
            const WriteResult& refused, Now now);

 private:
  audit::WriteRecord RecordOf(const ModbusRequest& request, const UnitMap& unit,
                              const bus::Writer& writer) const;

  const bus::PointStore& store_;
  events::EventSource* const alarms_;
  audit::WriteLog* const log_;
};

/// The exception for a write that has ended; kNoException if it ended well.
ExceptionCode ExceptionOf(const WriteResult& result);
/// The exception for a write that was not begun.
ExceptionCode ExceptionOf(const bus::WriteDenial& denial);

struct Asker {
  bus::Writer writer{};
  Instant deadline{};                                  ///< no request of the write is sent later
  std::shared_ptr<const std::atomic<bool>> abandoned;  ///< once true, the write is not begun
};

class OwnUnits {
 public:
  /// References must outlive this object. `block` returns the gateway's status block. `events`: see
  /// EventWindow.
  OwnUnits(const config::Config& config, const bus::PointStore& store, bus::CommandSink& sink,
           std::function<GatewayBlock()> block, std::shared_ptr<const events::EventFeed> events,
           const AckRegister& acks);

  void Apply(const config::Config& config);

  /// Checks unit, function, counts and lengths; fills `request` if the result is kNoException.
  ExceptionCode Check(View frame, ModbusRequest& request) const;
  /// Fills responder() for the reply, from the point store or the gateway's status block. Never
  /// waits for a line or the disk. `client`: the number of the client, which selects the first
  /// event that it is shown.
  ExceptionCode Read(const ModbusRequest& request, Holes holes, Instant now,
                     std::uint64_t client = 0);
  /// Begins a write. Its first register decides what is written: values of points, the selection of
  /// a point, the acknowledgement of alarms, or the first event to show. Unless an exception is
  /// returned, `done` is called once, on any thread.
  ExceptionCode Write(const ModbusRequest& request, const Asker& asker, Instant now,
                      std::function<void(const WriteResult&)> done);
  /// Records a write that another part has denied with the end `refused`; does nothing for reads.
  void Deny(View frame, const bus::Writer& writer, const WriteResult& refused, const Now& now);
  /// To be called when the client has left: forgets its selections and its first events.
  void Forget(const bus::Writer& writer);

  Responder& responder() { return responder_; }

 private:
  void MakeImages();
  /// Answers from the unit's image if that contains the whole request and is fresh or may be
  /// renewed; else empty.
  std::optional<ExceptionCode> ReadImage(const ModbusRequest& request, Instant now);
  ExceptionCode ReadRecord(const ModbusRequest& request, const UnitMap& unit, Instant now);
  ExceptionCode ReadGateway(const ModbusRequest& request);
  void FillEvents(const ModbusRequest& request, const UnitMap& unit, std::uint64_t client);
  ExceptionCode Select(const UnitMap& unit, std::uint32_t point, const ModbusRequest& request,
                       const bus::Writer& writer, Instant now);
  ExceptionCode WritePoints(const UnitMap& unit, const ModbusRequest& request, const Asker& asker,
                            Instant now, std::function<void(const WriteResult&)> done);

  const bus::PointStore& store_;
  RegisterMap map_;
  EventWindow events_;
  const std::function<GatewayBlock()> block_;
  /// By unit; null if the unit is no device.
  std::array<std::unique_ptr<RegisterImage>, 256> images_;
  Responder responder_;
  std::vector<Piece> pieces_;  ///< of the current request; a member, so that its memory is reused
  bus::WriteGate gate_;
  AckRegister acks_;
};

}  // namespace baudgate::modbus
