// Reads and writes of points by clients of a Modbus server: from registers to the point store, and
// to the command sink. Requests come from request_service.cpp. Used by the server's own thread
// only.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "config/model/config.h"
#include "gateway/modbus/registers/register_contents.h"
#include "gateway/modbus/registers/register_image.h"
#include "gateway/modbus/registers/register_map.h"
#include "gateway/modbus/registers/responder.h"
#include "gateway/modbus/service/ack_register.h"
#include "gateway/modbus/service/links.h"
#include "gateway/modbus/wire/request.h"
#include "gateway/requests/write_command.h"
#include "gateway/store/point_store.h"
#include "gateway/writes/write_gate.h"

namespace baudgate::modbus {

class PointService {
 public:
  using Done = std::function<void(const WriteResult&)>;

  /// All references outlive it. `block`: what the gateway's own registers show.
  PointService(const config::Config& config, const PointStore& store, CommandSink& sink,
               std::function<GatewayBlock()> block, const ModbusLinks& links);

  /// A reload.
  void Apply(const config::Config& config);

  /// Unit, function, counts and lengths; fills `request` when there is no
  /// exception.
  ExceptionCode Check(View frame, ModbusRequest& request) const;
  /// Fills responder() for the answer. Never waits for a line or the disk. `client`: the number of
  /// its Writer, whose place among the events is its own.
  ExceptionCode Read(const ModbusRequest& request, Holes holes, Instant now,
                     std::uint64_t client = 0);
  /// A client that waits for its write.
  struct Asker {
    Writer writer{};
    Instant deadline{};                                  ///< nothing of it is sent later
    std::shared_ptr<const std::atomic<bool>> abandoned;  ///< once true, the write is not begun
  };
  /// By the register: queues a write to points, selects a point, acknowledges alarms, or sets which
  /// events are shown first. `done` is called once, on any thread, unless there is an exception.
  ExceptionCode Submit(const ModbusRequest& request, const Asker& asker, Instant now, Done done);
  /// Another part has denied this write: its points are recorded with that end.
  void Deny(View frame, const Writer& writer, const WriteResult& refused, const Now& now);
  /// The client has left.
  void Forget(const Writer& writer);
  /// How a write ended, as Modbus says it.
  static ExceptionCode ExceptionOf(const WriteResult& result);
  /// Why it was not begun.
  static ExceptionCode ExceptionOf(const WriteDenial& denial);

  Responder& responder() { return responder_; }

 private:
  void MakeImages();
  /// From the unit's image, if that has the whole request and is fresh or may be made again.
  std::optional<ExceptionCode> ReadImage(const ModbusRequest& request, Instant now);
  ExceptionCode ReadRecord(const ModbusRequest& request, const UnitMap& unit, Instant now);
  ExceptionCode ReadGateway(const ModbusRequest& request);
  void FillEvents(const ModbusRequest& request, const UnitMap& unit, std::uint64_t client);

  const PointStore& store_;
  WriteGate gate_;
  const std::function<GatewayBlock()> block_;
  RegisterMap map_;
  std::shared_ptr<const events::EventFeed> events_;  ///< null: none are kept
  AckRegister acks_;
  /// The first event that a client wants to see of a unit; none: the newest.
  std::map<std::pair<std::uint64_t, std::uint8_t>, std::uint32_t> first_events_;
  std::array<std::unique_ptr<RegisterImage>, 256> images_;  ///< by unit; none where no device is
  Responder responder_;
  std::vector<Piece> pieces_;  ///< of the request in hand; kept for its memory
};

}  // namespace baudgate::modbus
