// `OwnUnits` answers requests for the units that the Modbus server serves itself: devices of the
// gateway, from the point store, and the gateway itself (units 0 and 255).
// gateway/outputs/modbus/service/client_requests.cpp passes the requests on the server's thread.
// `EventWindow` and `AckRegister` implement the registers for events and alarms, and `ExceptionOf`
// returns the exception for a failed write.
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

// `EventWindow` contains, for each client and unit, the number of the first event to show. The
// client writes the number and then reads the event block
// (gateway/outputs/modbus/registers/register_contents.h). It is used only on the server's thread.
class EventWindow {
 public:
  /// `events` null: no events are recorded.
  explicit EventWindow(std::shared_ptr<const events::EventFeed> events)
      : events_(std::move(events)) {}

  /// `first`: the number of an event; 0: the newest events are shown.
  void SetFirst(std::uint64_t client, std::uint8_t unit, std::uint32_t first) {
    firsts_[{client, unit}] = first;
  }
  /// Returns the event block. `source`: the device whose events are shown; nothing: events of all
  /// devices.
  EventBlock Show(std::uint64_t client, std::uint8_t unit,
                  std::optional<events::Source> source) const;
  void Forget(std::uint64_t client);

 private:
  const std::shared_ptr<const events::EventFeed> events_;
  /// The number of the first event by client and unit. No entry: the newest events are shown.
  std::map<std::pair<std::uint64_t, std::uint8_t>, std::uint32_t> firsts_;
};

// `AckRegister` implements the registers that acknowledge alarms, 9096 and 9097 of every unit. A
// client writes the number of the event that raised the alarm (its low 32 bits), or all bits set
// for all alarms. The unit of a device acknowledges the device's alarms; the units of the gateway
// acknowledge alarms of all devices.
class AckRegister {
 public:
  static constexpr std::uint32_t kAll = 0xFFFFFFFF;

  /// References and pointers must outlive this object. `alarms` null: there are no alarms. `log`
  /// null: acknowledgements are not recorded.
  AckRegister(const bus::PointStore& store, events::EventSource* alarms, audit::WriteLog* log)
      : store_(store), alarms_(alarms), log_(log) {}

  /// True if the request writes to no registers but 9096 and 9097.
  static bool IsFor(const ModbusRequest& request);
  /// Acknowledges alarms. Unless an exception is returned, `done` is called once, on any thread,
  /// when the acknowledgement is on the disk or could not be stored. kIllegalValue: only half of
  /// the number was written, or no alarm with this number waits to be acknowledged.
  ExceptionCode Submit(const ModbusRequest& request, const UnitMap& unit, const bus::Writer& writer,
                       Instant now, std::function<void(const WriteResult&)> done);
  /// Records an acknowledgement that was refused.
  void Deny(const ModbusRequest& request, const UnitMap& unit, const bus::Writer& writer,
            const WriteResult& refused, Now now);

 private:
  audit::WriteRecord RecordOf(const ModbusRequest& request, const UnitMap& unit,
                              const bus::Writer& writer) const;

  const bus::PointStore& store_;
  events::EventSource* const alarms_;
  audit::WriteLog* const log_;
};

ExceptionCode ExceptionOf(const WriteResult& result);
ExceptionCode ExceptionOf(const bus::WriteDenial& denial);

struct Asker {
  bus::Writer writer{};
  Instant deadline{};  ///< the line sends no request of the write after this time
  /// Once true, the write is not started. A write that has already been sent continues.
  std::shared_ptr<const std::atomic<bool>> abandoned;
};

class OwnUnits {
 public:
  /// References must outlive this object. `block` returns the gateway's status block. `events`
  /// null: no events are recorded.
  OwnUnits(const config::Config& config, const bus::PointStore& store, bus::CommandSink& sink,
           std::function<GatewayBlock()> block, std::shared_ptr<const events::EventFeed> events,
           const AckRegister& acks);

  void Apply(const config::Config& config);

  /// Checks unit, function, counts and lengths; fills `request` if the result is kNoException.
  ExceptionCode Check(View frame, ModbusRequest& request) const;
  /// Writes the contents of the reply to responder(). Does not wait for a line or the disk.
  /// `client`: the client's number, by which EventWindow finds its first event to show.
  ExceptionCode Read(const ModbusRequest& request, Holes holes, Instant now,
                     std::uint64_t client = 0);
  /// Starts a write. The address decides what is written: values of points, the selection of a
  /// point, the acknowledgement of alarms, or the first event to show. Unless an exception is
  /// returned, `done` is called once, on any thread.
  ExceptionCode Write(const ModbusRequest& request, const Asker& asker, Instant now,
                      std::function<void(const WriteResult&)> done);
  /// Records a write that the caller has denied, with the result `refused`. Does nothing for reads.
  void Deny(View frame, const bus::Writer& writer, const WriteResult& refused, const Now& now);
  /// Must be called when the client has left: removes its selections and its first events to show.
  void Forget(const bus::Writer& writer);

  Responder& responder() { return responder_; }

 private:
  void MakeImages();
  /// Answers from the unit's image. Returns nothing if the image does not contain the whole
  /// request, or is outdated (RegisterImage::Refresh).
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
  /// The image of each unit; null: the unit is not a device.
  std::array<std::unique_ptr<RegisterImage>, 256> images_;
  Responder responder_;
  /// The pieces of the current request; a member, so that its memory is used again.
  std::vector<Piece> pieces_;
  bus::WriteGate gate_;
  AckRegister acks_;
};

}  // namespace baudgate::modbus
