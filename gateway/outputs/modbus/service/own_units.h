// The units that a Modbus server answers itself: devices of the gateway, out of the point store,
// and the gateway's own. Requests come from client_requests.cpp. Used by the server's own thread
// only. EventWindow and AckRegister are the registers for events and alarms, and ExceptionOf gives
// the exception for a failed write.
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

// Which events each client is shown of each unit: it writes the number of the first one, and reads
// the block of gateway/outputs/modbus/registers/register_contents.h. On the server's thread.
class EventWindow {
 public:
  /// Null: no events are kept.
  explicit EventWindow(std::shared_ptr<const events::EventFeed> events)
      : events_(std::move(events)) {}

  /// `first`: the number of an event; 0: the newest are shown.
  void SetFirst(std::uint64_t client, std::uint8_t unit, std::uint32_t first) {
    firsts_[{client, unit}] = first;
  }
  /// `source`: the device whose events are shown; empty: the events of all.
  EventBlock Show(std::uint64_t client, std::uint8_t unit,
                  std::optional<events::Source> source) const;
  /// The client has left.
  void Forget(std::uint64_t client);

 private:
  const std::shared_ptr<const events::EventFeed> events_;
  /// By client and unit; none: the newest.
  std::map<std::pair<std::uint64_t, std::uint8_t>, std::uint32_t> firsts_;
};

// The register that acknowledges alarms, 9096 of every unit: the number of the event that has
// raised one (its low 32 bits), or all ones for all. At the unit of a device its own, at the
// gateway's all.
class AckRegister {
 public:
  static constexpr std::uint32_t kAll = 0xFFFFFFFF;

  /// All outlive it. Null: there are no alarms; it is not recorded.
  AckRegister(const bus::PointStore& store, events::EventSource* alarms, audit::WriteLog* log)
      : store_(store), alarms_(alarms), log_(log) {}

  /// The request writes to this register, and to nothing else.
  static bool IsFor(const ModbusRequest& request);
  /// `done` comes once, on any thread, when it is on the disk, unless there is an exception.
  /// illegal_value: half a number, or no alarm of that number waits for it.
  ExceptionCode Submit(const ModbusRequest& request, const UnitMap& unit, const bus::Writer& writer,
                       Instant now, std::function<void(const WriteResult&)> done);
  void Deny(const ModbusRequest& request, const UnitMap& unit, const bus::Writer& writer,
            const WriteResult& refused, Now now);

 private:
  audit::WriteRecord RecordOf(const ModbusRequest& request, const UnitMap& unit,
                              const bus::Writer& writer) const;

  const bus::PointStore& store_;
  events::EventSource* const alarms_;
  audit::WriteLog* const log_;
};

// The exception that a client of a Modbus server is answered when its write has failed. Pure.

/// kNoException: it ended well.
ExceptionCode ExceptionOf(const WriteResult& result);
/// Why it was not begun.
ExceptionCode ExceptionOf(const bus::WriteDenial& denial);

/// A client that waits for its write.
struct Asker {
  bus::Writer writer{};
  Instant deadline{};                                  ///< nothing of it is sent later
  std::shared_ptr<const std::atomic<bool>> abandoned;  ///< once true, the write is not begun
};

class OwnUnits {
 public:
  /// All references outlive it. `block`: what the gateway's own registers show. `events`: see
  /// EventWindow.
  OwnUnits(const config::Config& config, const bus::PointStore& store, bus::CommandSink& sink,
           std::function<GatewayBlock()> block, std::shared_ptr<const events::EventFeed> events,
           const AckRegister& acks);

  /// A reload.
  void Apply(const config::Config& config);

  /// Unit, function, counts and lengths; fills `request` when there is no exception.
  ExceptionCode Check(View frame, ModbusRequest& request) const;
  /// Fills responder() for the answer: from the point store, or from the block of the gateway.
  /// Never waits for a line or the disk. `client`: whose place among the events is its own.
  ExceptionCode Read(const ModbusRequest& request, Holes holes, Instant now,
                     std::uint64_t client = 0);
  /// By the register a write is for points, the selection of a point, the acknowledgement of
  /// alarms, or the first event that is shown. `done` is called once, on any thread, unless there
  /// is an exception.
  ExceptionCode Write(const ModbusRequest& request, const Asker& asker, Instant now,
                      std::function<void(const WriteResult&)> done);
  /// Another part has denied this request: if it is a write, its points are recorded with that end.
  void Deny(View frame, const bus::Writer& writer, const WriteResult& refused, const Now& now);
  /// The client has left.
  void Forget(const bus::Writer& writer);

  Responder& responder() { return responder_; }

 private:
  /// One image for each unit of a device.
  void MakeImages();
  /// From the unit's image, if that has the whole request and is fresh or may be made again.
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
  std::array<std::unique_ptr<RegisterImage>, 256> images_;  ///< by unit; none where no device is
  Responder responder_;
  std::vector<Piece> pieces_;  ///< of the request in hand; kept for its memory
  bus::WriteGate gate_;
  AckRegister acks_;
};

}  // namespace baudgate::modbus
