// Reads of the units that the gateway answers itself: from the point store, or from the block of
// the gateway, to registers. On the server's thread.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "gateway/bus/points/point_store.h"
#include "gateway/outputs/modbus/registers/register_contents.h"
#include "gateway/outputs/modbus/registers/register_image.h"
#include "gateway/outputs/modbus/registers/register_map.h"
#include "gateway/outputs/modbus/registers/responder.h"
#include "gateway/outputs/modbus/service/event_window.h"
#include "gateway/outputs/modbus/wire/request.h"

namespace baudgate::modbus {

class UnitReader {
 public:
  /// All references outlive it. `block`: what the gateway's own registers show.
  UnitReader(const PointStore& store, const RegisterMap& map, const EventWindow& events,
             std::function<GatewayBlock()> block);

  /// The map is another one now.
  void Renew();
  /// Fills responder() for the answer. Never waits for a line or the disk. `client`: whose place
  /// among the events is its own.
  ExceptionCode Read(const ModbusRequest& request, Holes holes, Instant now, std::uint64_t client);

  Responder& responder() { return responder_; }

 private:
  /// From the unit's image, if that has the whole request and is fresh or may be made again.
  std::optional<ExceptionCode> ReadImage(const ModbusRequest& request, Instant now);
  ExceptionCode ReadRecord(const ModbusRequest& request, const UnitMap& unit, Instant now);
  ExceptionCode ReadGateway(const ModbusRequest& request);
  void FillEvents(const ModbusRequest& request, const UnitMap& unit, std::uint64_t client);

  const PointStore& store_;
  const RegisterMap& map_;
  const EventWindow& events_;
  const std::function<GatewayBlock()> block_;
  std::array<std::unique_ptr<RegisterImage>, 256> images_;  ///< by unit; none where no device is
  Responder responder_;
  std::vector<Piece> pieces_;  ///< of the request in hand; kept for its memory
};

}  // namespace baudgate::modbus
